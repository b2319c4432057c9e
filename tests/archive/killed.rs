//! If a writing process is killed at any time, either the old or the new file remains.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use sabaki::archive::{read, to_bytes, write};

use sabaki_fixtures::random::Random;
use sabaki_fixtures::small::small;

/// Set for the process that is killed: the file that it writes over and over. It says that it does by another file.
const WRITES: &str = "SABAKI_TEST_WRITES";
const BEGUN: &str = "begun";

#[test]
fn a_writer_that_is_killed_leaves_the_old_file_or_the_new_one() {
    if let Some(path) = std::env::var_os(WRITES) {
        write_for_ever(Path::new(&path));
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("graph.sabaki");
    let begun = path.with_extension(BEGUN);
    let both = [to_bytes(small()).unwrap(), spoilt()];
    std::fs::write(&path, &both[0]).unwrap();
    let (mut random, mut seen) = (Random::new(9), [0, 0]);
    for _ in 0..16 {
        let mut writer = Command::new(std::env::current_exe().unwrap())
            .args([
                "--exact",
                "archive::killed::a_writer_that_is_killed_leaves_the_old_file_or_the_new_one",
            ])
            .env(WRITES, &path)
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        while !begun.exists() && writer.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(Duration::from_millis(random.below(60) as u64));
        assert!(writer.try_wait().unwrap().is_none(), "it ends by itself");
        writer.kill().unwrap();
        writer.wait().unwrap();
        std::fs::remove_file(&begun).unwrap();
        let found = std::fs::read(&path).unwrap();
        let which = both.iter().position(|bytes| *bytes == found);
        seen[which.expect("the file is neither the old one nor the new one")] += 1;
    }
    // What was left behind by those that were killed does not keep anybody from writing.
    write(&path, small()).unwrap();
    assert_eq!(&read(&path).unwrap(), small());
    assert!(seen[0] > 0 && seen[1] > 0, "nobody wrote: {seen:?}");
}

/// Another file as long as the graph's.
fn spoilt() -> Vec<u8> {
    let mut bytes = to_bytes(small()).unwrap();
    bytes.iter_mut().for_each(|byte| *byte = !*byte);
    bytes
}

fn write_for_ever(path: &Path) -> ! {
    use std::io::Write;
    let other = spoilt();
    std::fs::write(path.with_extension(BEGUN), "").unwrap();
    loop {
        sabaki::archive::write_atomically(path, |file| file.write_all(&other)).unwrap();
        write(path, small()).unwrap();
    }
}
