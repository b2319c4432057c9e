//! The embedded motions in the user's cache folder.

use std::fs;
use std::path::Path;

use sabaki::archive;
use sabaki_fixtures::baked::embedded_file;
use serde_json::Value;

use super::run::{baked, command, folder};
use super::without_times;

#[test]
fn they_are_baked_by_the_first_command_and_read_by_later_ones() {
    let program = fs::read(env!("CARGO_BIN_EXE_sabaki")).unwrap();
    let (checksum, length) = (crc32fast::hash(&program), program.len());
    let name = "sabaki/embedded.sabaki";
    let build = format!("{checksum:08x}-{length:x}");
    let folder = folder();
    let dodge = |cache: &Path, graph: &str| -> Value {
        let mut command = command(&folder, &format!("dodge {graph} --attacks 4 --json"));
        let output = command.env("XDG_CACHE_HOME", cache).output().unwrap();
        assert!(output.status.success() && output.stderr.is_empty());
        without_times(serde_json::from_slice(&output.stdout).unwrap())
    };
    // One that the tests share: this command or another one bakes.
    let shared = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let first = dodge(shared, "");
    let kept = archive::to_bytes(&archive::read(&shared.join(name)).unwrap()).unwrap();
    assert_eq!(kept, fs::read(embedded_file(folder.path())).unwrap());

    // What is read is the file, and it is not written again.
    let own = folder.path().join("cache");
    fs::create_dir_all(own.join("sabaki")).unwrap();
    let graph = archive::read(Path::new(baked())).unwrap();
    archive::write_with(&own.join(name), &graph, build.as_bytes()).unwrap();
    let bytes = fs::read(own.join(name)).unwrap();
    let other = dodge(&own, "");
    assert_ne!(other, first);
    assert_eq!(other, dodge(&own, "BAKED"));
    let files: Vec<_> = fs::read_dir(own.join("sabaki")).unwrap().collect();
    assert_eq!(files.len(), 1);
    assert_eq!(bytes, fs::read(own.join(name)).unwrap());
    assert_eq!(dodge(shared, ""), first);
}
