//! Files that bakes write, which no reader of motions knows.

use std::io::Read;
use std::path::Path;

use sabaki::archive;

use super::super::Failure;

/// First bytes of the parts of a shared bake.
pub(super) const PART: &[u8; 8] = b"sabakis\n";

/// Refuses a file that a bake wrote where a motion is read. A file that cannot be opened is left to the reader.
pub(crate) fn check_is_none(path: &Path) -> Result<(), Failure> {
    let mut head = Vec::new();
    let is_read = archive::open_regular(path).and_then(|file| file.take(8).read_to_end(&mut head));
    if is_read.is_err() {
        return Ok(());
    }
    let what = match archive::is_baked(&head) {
        true => "a baked graph",
        false if head == PART => "a part of a shared bake (for bake join)",
        false => return Ok(()),
    };
    Err(Failure::Usage(format!(
        "{}: this is {what}, and not a motion file (BVH, AMC or glTF)",
        path.display()
    )))
}
