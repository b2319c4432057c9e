//! The embedded motions in the user's cache folder.

use std::fs;
use std::path::{Path, PathBuf};

use sabaki_testing::baked::embedded_file;
use serde_json::Value;

use super::run::{baked, command, folder};
use super::without_times;

#[test]
fn they_are_baked_by_the_first_command_and_read_by_later_ones() {
    let folder = folder();
    let cache = folder.path().join("cache");
    let dodge = |more: &[&str]| -> Value {
        let mut command = command(folder.path(), &["dodge", "--attacks", "4", "--json"]);
        let output = command.args(more).env("XDG_CACHE_HOME", &cache).output();
        let output = output.unwrap();
        assert!(output.status.success() && output.stderr.is_empty());
        without_times(serde_json::from_slice(&output.stdout).unwrap())
    };
    let first = dodge(&[]);
    let file = only_file(&cache.join("sabaki"));
    let bytes = fs::read(&file).unwrap();
    assert_eq!(bytes, fs::read(embedded_file(folder.path())).unwrap());
    assert_eq!(dodge(&[]), first);

    // What is read is the file, and it is not written again.
    fs::copy(baked(), &file).unwrap();
    let other = dodge(&[]);
    assert_ne!(other, first);
    assert_eq!(other, dodge(&[baked()]));
    assert_eq!(
        fs::read(only_file(&cache.join("sabaki"))).unwrap(),
        fs::read(baked()).unwrap()
    );
}

fn only_file(folder: &Path) -> PathBuf {
    let mut files = fs::read_dir(folder).unwrap();
    let file = files.next().unwrap().unwrap().path();
    assert!(files.next().is_none());
    file
}
