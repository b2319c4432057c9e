//! Small files that ask for more memory than there may be are refused with the file and the limit.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::fmt::Write;
use std::path::Path;

use sabaki_import::asf::{AmcClipDesc, AmcFile, AsfFile};
use sabaki_import::bvh::{BvhFile, MotionError};
use sabaki_import::{MOST_ENTRIES, ReadError, ReadOptions, read_clips, read_motions};

/// A BVH file of joints without channels below a root with one.
fn bvh(joints: usize, frames: usize) -> String {
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
    let frames = MOST_ENTRIES as usize / 4096 + 1;
    let file = BvhFile::parse(bvh(4096, frames).as_bytes()).unwrap();
    let error = file.motion("many", 1.0).unwrap_err();
    assert_eq!(
        error,
        MotionError::TooManyEntries {
            frames,
            joints: 4096
        }
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("many.bvh");
    std::fs::write(&path, bvh(4096, frames)).unwrap();
    let error = read_motions(&path, &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, ReadError::Motion { .. }), "{error}");
    let error = error.to_string();
    assert!(
        error.ends_with(
            "many.bvh: 16385 frames of 4096 joints; 67108864 rotations in all are the most"
        ),
        "{error}"
    );
}

#[test]
fn bones_without_freedom_count_in_every_frame_of_an_amc_file() {
    let bones = 2000;
    let most = MOST_ENTRIES as usize / bones;
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).unwrap();
        folder.path().join(name)
    };
    write("many.asf", &asf(bones));
    let path = write("many.amc", &amc(most + 1));
    let error = read_clips(&[path], None, &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, ReadError::Asf { .. }), "{error}");
    let error = error.to_string();
    assert!(
        error.contains("many.amc: line 67110: more frames of 2000 bones than 67108864 rotations"),
        "{error}"
    );
}

#[test]
fn end_sites_count_too() {
    // Each bone but the root has an end site.
    let bones = 2000;
    let skeleton = AsfFile::parse(asf(bones).as_bytes()).unwrap();
    let frames = MOST_ENTRIES as usize / (2 * bones - 1) + 1;
    let motion = AmcFile::parse(&skeleton, amc(frames).as_bytes()).unwrap();
    let desc = AmcClipDesc {
        name: "many",
        metres_per_unit: 1.0,
        frame_rate: 120.0,
    };
    let joints = 2 * bones - 1;
    let error = motion.motion(&skeleton, &desc).unwrap_err();
    assert_eq!(error, MotionError::TooManyEntries { frames, joints });
}

#[test]
fn files_within_the_limit_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path: &Path = &folder.path().join("few.bvh");
    std::fs::write(path, bvh(64, 100)).unwrap();
    let read = read_motions(path, &ReadOptions::default()).unwrap();
    assert_eq!((read[0].skeleton.len(), read[0].clip.frames()), (64, 100));
}
