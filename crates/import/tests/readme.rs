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
fn the_attack_file_has_an_attack_of_two_spheres() {
    let [example] = examples("Attacks")[..] else {
        panic!("one example is expected")
    };
    let file = AttackFile::parse(example.as_bytes()).unwrap();
    let spheres: Vec<usize> = file
        .attacks
        .iter()
        .map(|attack| attack.spheres.len())
        .collect();
    assert_eq!(spheres, [1, 2]);
}

#[test]
fn the_events_file_can_be_read() {
    for example in examples("Events") {
        assert!(
            !EventsFile::parse(example.as_bytes())
                .unwrap()
                .clips
                .is_empty()
        );
    }
}
