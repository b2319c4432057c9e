//! A damaged BVH file is an error that names the line, the column and the problem.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_import::bvh::{BvhError, BvhFile, BvhProblem};

const GOOD: &str = "HIERARCHY
ROOT Hips
{
  OFFSET 0 1 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Head
  {
    OFFSET 0 2 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 3 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.04
1 2 3 4 5 6 7 8 9
1 2 3 4 5 6 7 8 9
";

fn parse(text: &str) -> Result<BvhFile, BvhError> {
    BvhFile::parse(text.as_bytes())
}

/// `GOOD` with one thing replaced must give exactly this error.
#[track_caller]
fn fails(from: &str, to: &str, expected: &str) {
    assert!(GOOD.contains(from), "{from}");
    let text = GOOD.replacen(from, to, 1);
    assert_eq!(parse(&text).unwrap_err().to_string(), expected);
}

#[test]
fn what_is_no_text() {
    let error = |bytes: &[u8]| BvhFile::parse(bytes).unwrap_err().to_string();
    assert_eq!(error(b""), "line 1, column 1: the file is empty");
    assert_eq!(
        error(b"\xEF\xBB\xBF \n"),
        "line 1, column 1: the file is empty"
    );
    let not_text = "not text: a BVH file is ASCII or UTF-8, and this byte is neither";
    assert_eq!(
        error(b"HIER\n\nA\xFF"),
        format!("line 3, column 2: {not_text}")
    );
    assert_eq!(
        error(b"HIERARCHY\0"),
        format!("line 1, column 10: {not_text}")
    );
    assert_eq!(
        error(b"\x89PNG\r\n"),
        format!("line 1, column 1: {not_text}")
    );
}

#[test]
fn a_hierarchy_that_is_none() {
    fails(
        "HIERARCHY",
        "RIFF",
        "line 1, column 1: expected HIERARCHY, found \"RIFF\"",
    );
    fails(
        "ROOT Hips",
        "JOINT Hips",
        "line 2, column 1: expected ROOT, found \"JOINT\"",
    );
    fails(
        "ROOT Hips",
        "ROOT",
        "line 3, column 1: expected a joint's name, found \"{\"",
    );
    fails(
        "Hips\n{",
        "Hips\n",
        "line 4, column 3: expected `{`, found \"OFFSET\"",
    );
    fails(
        "End Site",
        "End Sight",
        "line 10, column 9: expected Site, found \"Sight\"",
    );
    assert_eq!(
        parse("HIERARCHY\nMOTION\nFrames: 1")
            .unwrap_err()
            .to_string(),
        "line 2, column 1: the hierarchy has no joints"
    );
    fails(
        "    CHANNELS 3",
        "    CHANELS 3",
        "line 9, column 5: expected OFFSET, CHANNELS, JOINT, End Site or `}` in \"Head\", found \"CHANELS\"",
    );
    fails(
        "MOTION",
        "ROOT The other one\n{\n}\nMOTION",
        "line 16, column 1: a second ROOT, \"The other one\": only files of one skeleton can be read",
    );
}

#[test]
fn braces_that_do_not_balance() {
    fails(
        "}\nMOTION",
        "MOTION",
        "line 15, column 1: the block of \"Hips\" is not closed: expected `}`, found \"MOTION\"",
    );
    fails(
        "}\nMOTION",
        "}\n}\nMOTION",
        "line 16, column 1: expected MOTION, found \"}\"",
    );
    let cut = &GOOD[..GOOD.find("    End Site").unwrap()];
    assert_eq!(
        parse(cut).unwrap_err().to_string(),
        "line 10, column 1: the block of \"Head\" is not closed: expected `}`, found the end of the file"
    );
}

#[test]
fn offsets_and_channels_that_are_wrong() {
    fails(
        "    OFFSET 0 2 0\n",
        "",
        "line 13, column 3: \"Head\" has no OFFSET",
    );
    fails(
        "OFFSET 0 2 0",
        "OFFSET 0 2",
        "line 9, column 5: expected a number of OFFSET, found \"CHANNELS\"",
    );
    fails(
        "OFFSET 0 2 0",
        "OFFSET 0 2 0 OFFSET 1 1 1",
        "line 8, column 18: OFFSET of \"Head\" must stand once, before its children",
    );
    fails(
        "CHANNELS 3",
        "CHANNELS 65",
        "line 9, column 14: \"Head\": expected a number of channels from 0 to 64, found \"65\"",
    );
    fails(
        "CHANNELS 3",
        "CHANNELS -1",
        "line 9, column 14: \"Head\": expected a number of channels from 0 to 64, found \"-1\"",
    );
    fails(
        "CHANNELS 3 Zrotation Xrotation Yrotation",
        "CHANNELS 3 Zrotation Wrotation Yrotation",
        "line 9, column 26: \"Head\": expected a channel (Xposition … Zscale) as number 2 of 3, found \"Wrotation\"",
    );
    fails(
        "CHANNELS 6 Xposition Yposition",
        "CHANNELS 6 Xposition Xposition",
        "line 5, column 24: \"Hips\" has the channel Xposition twice",
    );
    fails(
        "      OFFSET 0 3 0",
        "      OFFSET 0 3 0\n      CHANNELS 3",
        "line 13, column 7: an End Site has only an OFFSET, found \"CHANNELS\" in \"Head_End\"",
    );
}

#[test]
fn a_motion_header_that_is_wrong() {
    fails(
        "Frames: 2",
        "Frames: 0",
        "line 17, column 9: the motion has no frames",
    );
    fails(
        "Frames: 2",
        "Frames: -2",
        "line 17, column 9: expected a whole number of frames, found \"-2\"",
    );
    fails(
        "Frames: 2",
        "Frame: 2",
        "line 17, column 1: expected Frames:, found \"Frame:\"",
    );
    fails(
        "Frame Time:",
        "FrameRate:",
        "line 18, column 1: expected Frame Time:, found \"FrameRate:\"",
    );
    let frame_time = "expected a frame time between 0.000001 and 3600 seconds, found";
    fails(
        "0.04",
        "0",
        &format!("line 18, column 13: {frame_time} \"0\""),
    );
    fails(
        "0.04",
        "-0.04",
        &format!("line 18, column 13: {frame_time} \"-0.04\""),
    );
    fails(
        "0.04",
        "NaN",
        "line 18, column 13: expected a finite number, found \"NaN\"",
    );
    fails(
        "0.04",
        "0,04",
        "line 18, column 13: \"0,04\" has a decimal comma; BVH numbers have a point",
    );
    fails(
        "0.04",
        "fast",
        "line 18, column 13: expected a frame time, found \"fast\"",
    );
    let rest = "HIERARCHY ROOT A { OFFSET 0 0 0 } MOTION Frames: 9 Frame Time: 1";
    assert_eq!(parse(rest).unwrap_err().problem, BvhProblem::NoChannels);
}

#[test]
fn values_that_are_wrong() {
    fails(
        "8 9\n1",
        "8 inf\n1",
        "line 19, column 17: expected a finite number, found \"inf\"",
    );
    fails(
        "8 9\n1",
        "8 1e400\n1",
        "line 19, column 17: expected a finite number, found \"1e400\"",
    );
    fails(
        "8 9\n1",
        "8 1e30\n1",
        "line 19, column 17: \"1e30\" is larger than any motion",
    );
    fails(
        "8 9\n1",
        "8 -1.#IND\n1",
        "line 19, column 17: expected a number of the motion, found \"-1.#IND\"",
    );
    fails(
        "8 9\n1",
        "8 9,5\n1",
        "line 19, column 17: \"9,5\" has a decimal comma; BVH numbers have a point",
    );
    fails(
        "Frames: 2",
        "Frames: 999999999999",
        "line 20, column 18: the motion ends early: 999999999999 frames of 9 values are 8999999999991 values, found 18 (2 whole frames)",
    );
    let most = u64::MAX;
    fails(
        "Frames: 2",
        &format!("Frames: {most}"),
        &format!(
            "line 20, column 18: the motion ends early: {most} frames of 9 values are {most} values, found 18 (2 whole frames)"
        ),
    );
    fails(
        "8 9\n1",
        "8 9 10\n1",
        "line 20, column 18: after frame 2, 1 of 9 values: the last frame is not whole",
    );
    let trailing = format!("{GOOD}Frames: 3");
    assert_eq!(
        parse(&trailing).unwrap_err().to_string(),
        "line 21, column 1: \"Frames:\" follows the last frame"
    );
    let cut = &GOOD[..GOOD.len() - 4];
    assert_eq!(
        parse(cut).unwrap_err().to_string(),
        "line 20, column 14: the motion ends early: 2 frames of 9 values are 18 values, found 16 (1 whole frames)"
    );
}

#[test]
fn hostile_depth_and_size() {
    let deep: String = (0..100_000)
        .map(|i| format!("JOINT j{i} {{ OFFSET 0 1 0\n"))
        .collect();
    let text = format!("HIERARCHY ROOT r {{ OFFSET 0 0 0\n{deep}");
    let error = parse(&text).unwrap_err();
    assert_eq!(error.problem, BvhProblem::TooManyJoints);
    assert_eq!(error.line, sabaki::anim::Skeleton::MAX_JOINTS + 1);
    let long_word = "x".repeat(1_000_000);
    let error = parse(&GOOD.replace("0.04", &long_word)).unwrap_err();
    assert!(error.to_string().len() < 200, "{}", error.to_string().len());
    let same = "JOINT a { OFFSET 0 1 0 }\n".repeat(4_000);
    let text = format!(
        "HIERARCHY ROOT a {{ OFFSET 0 0 0 CHANNELS 1 Xrotation\n{same}}} MOTION Frames: 1 Frame Time: 1 5"
    );
    assert_eq!(parse(&text).unwrap().joints()[4_000].name, "a_4001");
}

#[test]
fn the_library_names_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bad.bvh");
    std::fs::write(&path, GOOD.replace("OFFSET 0 2 0", "OFFSET 0 2 z")).unwrap();
    let error =
        sabaki_import::read_clip(&path, &sabaki_import::ReadOptions::default()).unwrap_err();
    assert_eq!(
        error.to_string(),
        format!(
            "{}: line 8, column 16: expected a number of OFFSET, found \"z\"",
            path.display()
        )
    );
    let missing = folder.path().join("none.bvh");
    let error = sabaki_import::read_bvh(&missing).unwrap_err().to_string();
    assert!(error.starts_with(&missing.display().to_string()), "{error}");
    let zero = sabaki_import::ReadOptions {
        scale: Some(0.0),
        ..Default::default()
    };
    let error = sabaki_import::read_clip(&path, &zero)
        .unwrap_err()
        .to_string();
    assert_eq!(
        error,
        "a scale of 0 metres per unit is not possible; it must be 1e-9 to 1e6"
    );
}
