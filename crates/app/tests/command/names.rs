//! Names of files that are not UTF-8, which JSON cannot hold.

use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;

use glam::Vec3;

use super::run::{clips, command, folder};
use sabaki_fixtures::shapes::Shape;

#[test]
fn names_that_are_not_utf8_are_read_and_written() {
    let folder = folder();
    let at = folder.path();
    let named = |name: &'static [u8]| Path::new(OsStr::from_bytes(name));
    fs::create_dir(at.join("clips")).unwrap();
    for name in ["bounce.bvh", "duck.bvh"] {
        fs::copy(Path::new(clips().0).join(name), at.join("clips").join(name)).unwrap();
    }
    let mut staff = Shape::default();
    staff.capsule(Vec3::NEG_Y * 0.5, Vec3::Y, 0.015, 8);
    fs::write(at.join(named(b"s\xff.obj")), staff.obj(1.0)).unwrap();
    let run = |args: &str, paths: &[(&str, &Path)]| {
        let mut command = command(at, args);
        for (option, path) in paths {
            command.arg(option).arg(path);
        }
        let done = command.output().unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (done.status.code(), text(&done.stdout), text(&done.stderr))
    };
    let bake = "bake --clips clips --prop-joint RightHand --json";
    let (out, prop) = (named(b"a\xff.sabaki"), named(b"s\xff.obj"));
    let (code, stdout, stderr) = run(bake, &[("--out", out), ("--prop", prop)]);
    assert_eq!(code, Some(0), "{stderr}");
    let document: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!(document["out"], "a\u{FFFD}.sabaki");
    assert_eq!(document["fits"][0]["file"], "s\u{FFFD}.obj");
    assert!(at.join(out).is_file());
    let first = fs::read_dir(at.join("clips")).unwrap().flatten().next();
    let renamed = at.join("clips").join(named(b"schl\xe4ge.bvh"));
    fs::rename(first.unwrap().path(), renamed).unwrap();
    let plan = "bake plan --clips clips --shards 1";
    let (code, stdout, stderr) = run(plan, &[("--out", Path::new("plan"))]);
    assert_eq!(code, Some(0), "{stdout}{stderr}");
    assert!(at.join("plan").is_dir());
}
