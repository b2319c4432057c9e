//! Files that bakes write, which no reader of motions knows.

use std::io::Read;
use std::path::Path;

use sabaki::archive;

use super::super::Failure;
use super::sealed::Kind;

/// Refuses a file that a bake wrote where a motion is read. A file that cannot be opened is left to the reader.
pub(crate) fn check_is_none(path: &Path) -> Result<(), Failure> {
    let mut head = Vec::new();
    let is_read = archive::open_regular(path).and_then(|file| file.take(8).read_to_end(&mut head));
    if is_read.is_err() {
        return Ok(());
    }
    let what = match archive::is_baked(&head) {
        true => Some("a baked graph"),
        false => Kind::of(&head).map(Kind::describe),
    };
    match what {
        Some(what) => Err(Failure::Usage(format!(
            "{}: this is {what}, and not a motion file (BVH, AMC or glTF)",
            path.display()
        ))),
        None => Ok(()),
    }
}
