//! Promise: the examples of the README are files that can be read.

use sabaki_import::{AttackFile, EventsFile};

/// The JSON examples under a heading.
fn examples(heading: &str) -> Vec<&'static str> {
    let readme = include_str!("../README.md");
    let section = readme.split("\n## ").find(|part| part.starts_with(heading));
    let blocks = section.unwrap().split("```json\n").skip(1);
    blocks
        .map(|block| block.split("```").next().unwrap())
        .collect()
}

#[test]
fn attacks_and_events_can_be_read() {
    let [example] = examples("Attacks")[..] else {
        panic!("one example is expected")
    };
    let file = AttackFile::parse(example.as_bytes()).unwrap();
    let spheres = file.attacks.iter().map(|attack| attack.spheres().len());
    assert_eq!(spheres.collect::<Vec<_>>(), [1, 2]);
    for example in examples("Events") {
        let file = EventsFile::parse(example.as_bytes()).unwrap();
        assert!(!file.clips.is_empty());
    }
}
