//! BVH variants of common programs are read: white space, case, line ends, names and counts do not matter. A damaged file is an error that
//! names the line, the column and the problem.

use sabaki::anim::JointKind;
use sabaki_import::{Channel, ChannelFile, TextError, bvh};

use super::refused::cases;

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

fn parse(text: &str) -> Result<ChannelFile, TextError> {
    bvh::parse(text.as_bytes())
}

#[test]
fn white_space_line_ends_and_case_do_not_matter() {
    for [from, to] in cases(include_str!("refused/bvh_same.txt")) {
        assert!(GOOD.contains(&from), "{from}");
        let text = GOOD.replace(&from, &to);
        assert_eq!(parse(&text), parse(GOOD), "{from:?} {to:?}");
    }
}

#[test]
fn joints_without_channels_or_ends_and_odd_names() {
    let text = GOOD
        .replace("ROOT Hips", "ROOT  mixamorig:Hips 1.L ")
        .replace("    CHANNELS 3 Zrotation Xrotation Yrotation\n", "")
        .replace("    End Site\n    {\n      OFFSET 0 3 0\n    }\n", "")
        .replace("6 7 8 9", "6");
    let file = parse(&text).unwrap();
    let joints = file.joints.iter();
    let joints = joints.map(|joint| (&joint.name[..], joint.kind));
    let names = ["mixamorig:Hips 1.L", "Head"];
    assert!(joints.eq(names.map(|name| (name, JointKind::Moving))));
    assert_eq!(file.frames(), 2);
}

#[test]
fn names_are_made_unique() {
    let end = "End Site { OFFSET 0 1 0 }";
    let text = format!(
        "HIERARCHY ROOT a\n{{ OFFSET 0 0 0 CHANNELS 1 Xrotation
        JOINT a\n{{ OFFSET 0 1 0 {end}\n{end}\n}}
        JOINT a_2\n{{ OFFSET 0 1 0 JOINT a_2_End\n{{ OFFSET 0 1 0 }} }} }}
        MOTION Frames: 1 Frame Time: 1 5"
    );
    let file = parse(&text).unwrap();
    let names = file.joints.iter().map(|joint| &joint.name[..]);
    let expected = ["a", "a_2", "a_2_End2", "a_2_End3", "a_2_2", "a_2_End"];
    assert_eq!(names.collect::<Vec<_>>(), expected);
}

#[test]
fn frames_beyond_the_announced_are_kept() {
    let file = parse(&GOOD.replace("Frames: 2", "Frames: 1")).unwrap();
    assert_eq!(file.frames(), 2);
    assert!(file.notes[0].contains("says that it has 1 frames, but has 2"));
}

#[test]
fn scales_are_ignored_and_noted() {
    let scaled = GOOD
        .replace("CHANNELS 6 ", "CHANNELS 9 Xscale ")
        .replace(
            "Zrotation Xrotation Yrotation\n  JOINT",
            "Zrotation Xrotation Yrotation Yscale ZSCALE\n  JOINT",
        )
        .replace("CHANNELS 3 Zrotation", "CHANNELS 4 xscale Zrotation")
        .replace("1 2 3 4 5 6 7 8 9", "2 1 2 3 4 5 6 0.5 1 3 7 8 9");
    let (plain, scaled) = (parse(GOOD).unwrap(), parse(&scaled).unwrap());
    assert_eq!(scaled.joints[0].channels[8], Channel::Scale(2));
    assert_eq!(Channel::Scale(2).name(), "Zscale");
    let motions = [&scaled, &plain].map(|file| file.motion("a", 1.0).unwrap());
    assert_eq!(motions[0], motions[1]);
    assert_eq!(plain.notes, [""; 0]);
    let note = "joints have channels of scale, which are ignored: \"Hips\" and 1 more";
    assert_eq!(scaled.notes, [note]);
}

#[test]
fn a_joint_may_turn_more_than_three_times() {
    let more = GOOD
        .replace(
            "CHANNELS 3 Zrotation",
            "CHANNELS 7 Xrotation Yrotation Xrotation Yrotation Zrotation",
        )
        .replace("7 8 9", "10 0 -10 0 7 8 9");
    let (plain, more) = (parse(GOOD).unwrap(), parse(&more).unwrap());
    assert_eq!(more.joints[1].channels.len(), 7);
    let turn = |file: &ChannelFile| file.motion("a", 1.0).unwrap().1.desc().rotations[1];
    assert!(turn(&more).dot(turn(&plain)).abs() > 1.0 - 1e-6);
}

#[test]
fn damaged_files_are_refused_with_line_and_column() {
    for [from, to, expected] in cases(include_str!("refused/bvh.txt")) {
        assert!(GOOD.contains(&from), "{from}");
        let error = parse(&GOOD.replacen(&from, &to, 1)).unwrap_err();
        assert_eq!(error.to_string(), expected);
    }
    let not_text = "not text: a BVH file is ASCII or UTF-8, and this byte is neither";
    let trailing = format!("{GOOD}Frames: 3");
    let in_head = &GOOD[..GOOD.find("    End Site").unwrap()];
    let channels = "HIERARCHY ROOT A { OFFSET 0 0 0 } MOTION Frames: 9 Frame Time: 1";
    let not_closed = "the block of \"Head\" is not closed: expected `}`, found the end of the file";
    let too_few =
        "the motion ends early: 2 frames of 9 values are 18 values, found 16 (1 whole frames)";
    let no_joints = "the hierarchy has no joints";
    let no_channels = "no joint has a channel: there is no motion to read";
    let cut_off = &GOOD.as_bytes()[..GOOD.len() - 4];
    for (bytes, [line, column], problem) in [
        (&b""[..], [1, 1], "the file is empty"),
        (b"\xEF\xBB\xBF \n", [1, 1], "the file is empty"),
        (b"HIER\n\nA\xFF", [3, 2], not_text),
        (b"HIERARCHY\0", [1, 10], not_text),
        (b"\x89PNG\r\n", [1, 1], not_text),
        (b"HIERARCHY\nMOTION\nFrames: 1", [2, 1], no_joints),
        (
            trailing.as_bytes(),
            [21, 1],
            "\"Frames:\" follows the last frame",
        ),
        (in_head.as_bytes(), [10, 1], not_closed),
        (cut_off, [20, 14], too_few),
        (channels.as_bytes(), [1, 41], no_channels),
    ] {
        let (column, message) = (Some(column), problem.to_owned());
        let expected = TextError {
            line,
            column,
            message,
        };
        assert_eq!(bvh::parse(bytes), Err(expected));
    }
}

#[test]
fn hostile_depth_and_size() {
    let deep: String = (0..100_000)
        .map(|i| format!("JOINT j{i} {{ OFFSET 0 1 0\n"))
        .collect();
    let text = format!("HIERARCHY ROOT r {{ OFFSET 0 0 0\n{deep}");
    let error = parse(&text).unwrap_err();
    assert_eq!(error.message, "more than 4096 joints");
    assert_eq!(error.line, sabaki::anim::Skeleton::MAX_JOINTS + 1);
    let long_word = "x".repeat(1_000_000);
    let error = parse(&GOOD.replace("0.04", &long_word)).unwrap_err();
    assert!(error.to_string().len() < 200, "{}", error.to_string().len());
    let same = "JOINT a { OFFSET 0 1 0 }\n".repeat(4_000);
    let text = format!(
        "HIERARCHY ROOT a {{ OFFSET 0 0 0 CHANNELS 1 Xrotation\n{same}}} MOTION Frames: 1 Frame Time: 1 5"
    );
    assert_eq!(parse(&text).unwrap().joints[4_000].name, "a_4001");
}
