//! Small files that ask for more memory than there may be are refused with the file and the limit.

use std::fmt::Write;

use sabaki_import::asf::AsfFile;
use sabaki_import::bvh;
use sabaki_import::gltf::GltfFile;
use sabaki_import::{FileError, MOST_ENTRIES, ReadOptions, read_clips, read_motions};
use serde_json::{Value, json};

use super::common::written;
use super::corpora::MOST;
use super::gltf::Builder;
use sabaki_fixtures::memory::{alone, held_at_most};

/// The error of a read that holds little memory.
fn refused<T, E>(read: impl FnOnce() -> Result<T, E>) -> E {
    let (read, held) = held_at_most(read);
    assert!(held < MOST, "{} MB", held >> 20);
    read.err().unwrap()
}

/// Frames and joints of a motion that is refused for them.
fn entries(error: &FileError) -> Option<(usize, usize)> {
    match *error {
        FileError::TooManyEntries { frames, joints } => Some((frames, joints)),
        _ => None,
    }
}

/// A BVH file of joints without channels below a root with one.
fn bvh_text(joints: usize, frames: usize) -> String {
    let mut text = "HIERARCHY\nROOT r\n{\nOFFSET 0 0 0\nCHANNELS 1 Yposition\n".to_owned();
    for joint in 1..joints {
        write!(text, "JOINT j{joint}\n{{\nOFFSET 0 1 0\n}}\n").unwrap();
    }
    write!(
        text,
        "}}\nMOTION\nFrames: {frames}\nFrame Time: 0.01\n{}",
        "0\n".repeat(frames)
    )
    .unwrap();
    text
}

/// An ASF file of bones without degrees of freedom below a root with one.
fn asf(bones: usize) -> String {
    let mut text = ":version 1.10\n:units\n length 1\n angle deg\n:root\n order TY\n axis XYZ\n \
                    position 0 0 0\n orientation 0 0 0\n:bonedata\n"
        .to_owned();
    for bone in 1..bones {
        write!(
            text,
            "begin\n name b{bone}\n direction 0 0 1\n length 1\n axis 0 0 0 XYZ\nend\n"
        )
        .unwrap();
    }
    text.push_str(":hierarchy\nbegin\nroot");
    for bone in 1..bones {
        write!(text, " b{bone}").unwrap();
    }
    text.push_str("\nend\n");
    text
}

fn amc(frames: usize) -> String {
    let frames = (1..=frames).map(|frame| format!("{frame}\nroot 1\n"));
    ":DEGREES\n".to_owned() + &frames.collect::<String>()
}

#[test]
fn joints_without_channels_count_in_every_frame_of_a_bvh_file() {
    alone(|| {
        let frames = MOST_ENTRIES as usize / 4096 + 1;
        let text = bvh_text(4096, frames);
        let error = refused(|| {
            let file = bvh::parse(text.as_bytes()).unwrap();
            file.motion("many", 1.0).map(|_| ())
        });
        assert_eq!(entries(&error), Some((frames, 4096)), "{error}");
        let folder = tempfile::tempdir().unwrap();
        let path = written(folder.path(), "many.bvh", text);
        let error = refused(|| read_motions(&path, &ReadOptions::default())).to_string();
        let said = "many.bvh: 16385 frames of 4096 joints; 67108864 rotations in all are the most";
        assert!(error.ends_with(said), "{error}");
    });
}

#[test]
fn bones_without_freedom_count_in_every_frame_of_an_amc_file() {
    alone(|| {
        let bones = 2000;
        let most = MOST_ENTRIES as usize / bones;
        let folder = tempfile::tempdir().unwrap();
        written(folder.path(), "many.asf", asf(bones));
        let path = written(folder.path(), "many.amc", amc(most + 1));
        let error = refused(|| read_clips(&[path], None, &ReadOptions::default())).to_string();
        let said = "many.amc: line 67110: more frames of 2000 bones than 67108864 rotations";
        assert!(error.contains(said), "{error}");
    });
}

#[test]
fn end_sites_count_too() {
    alone(|| {
        // Each bone but the root has an end site.
        let bones = 2000;
        let skeleton = AsfFile::parse(asf(bones).as_bytes()).unwrap();
        let frames = MOST_ENTRIES as usize / (2 * bones - 1) + 1;
        let motion = skeleton.motion(amc(frames).as_bytes()).unwrap();
        let error = refused(|| motion.motion("many", 1.0));
        assert_eq!(entries(&error), Some((frames, 2 * bones - 1)), "{error}");
    });
}

/// A glTF file of a chain of nodes. Each animation moves the first `moved` nodes, by the keys of an accessor of its own.
fn gltf(nodes: usize, moved: usize, animations: &[&[f32]]) -> Value {
    let mut builder = Builder::default();
    let animations = animations.iter().enumerate().map(|(index, times)| {
        let input = builder.floats("SCALAR", times);
        let output = builder.floats("VEC3", &vec![0.0; 3 * times.len()]);
        let channel = |node: usize| {
            json!({ "sampler": 0, "target": { "node": node, "path": "translation" } })
        };
        json!({
            "name": format!("a{index}"),
            "samplers": [{ "input": input, "output": output }],
            "channels": (0..moved).map(channel).collect::<Vec<_>>(),
        })
    });
    let animations = animations.collect();
    let node = |index: usize| match index + 1 < nodes {
        true => json!({ "name": format!("n{index}"), "children": [index + 1] }),
        false => json!({ "name": format!("n{index}") }),
    };
    builder.animated((0..nodes).map(node).collect(), animations)
}

#[test]
fn what_the_animations_of_a_gltf_file_need_is_counted_before_they_are_sampled() {
    let refused = |document: &Value, said: &str| {
        let text = document.to_string();
        let read = || GltfFile::parse(text.as_bytes(), |_| Err("there is none".to_owned()));
        assert_eq!(refused(read).to_string(), said);
    };
    let many = |animation: &str, frames: u64, joints: u64| {
        format!(
            "animation \"{animation}\": {frames} frames of {joints} joints; {MOST_ENTRIES} rotations in all are the most"
        )
    };
    alone(|| {
        // Keys that lie on no grid are sampled 60 times a second: the second animation alone is within the limit.
        let frames = MOST_ENTRIES / 4096;
        let long = [0.0, 0.31, 0.4567, (frames - 1) as f32 / 60.0];
        let document = gltf(4096, 1, &[&[0.0, 1.0], &long]);
        refused(&document, &many("a1", frames, 4096));
        // Nodes above the root count in every frame.
        let mut document = gltf(4000, 1, &[&[0.0, 0.31, 0.4567, 30_000.0]]);
        document["skins"] = json!([{ "joints": [3999] }]);
        refused(&document, &many("a0", 1_800_001, 4000));
        // Each key is read once for each node that it moves.
        let times: Vec<f32> = (0..8500).map(|key| key as f32 / 30.0).collect();
        let said = "the animations have 68000000 keys together; 67108864 are the most";
        refused(&gltf(4000, 4000, &[&times, &times]), said);
        let said = "animation \"a0\": it lasts 1000000 s; 36000 s is the most";
        refused(&gltf(1, 1, &[&[0.0, 0.31, 1e6]]), said);
    });
}
