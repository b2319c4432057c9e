//! BVH variants of common programs are read: white space, case, line ends, names and counts do not
//! matter.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki::anim::JointKind;
use sabaki_import::bvh::{BvhError, BvhFile};

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

/// `GOOD` with one thing replaced must be read as `GOOD` is.
#[track_caller]
fn reads_the_same(from: &str, to: &str) {
    assert!(GOOD.contains(from), "{from}");
    assert_eq!(
        parse(&GOOD.replace(from, to)).unwrap(),
        parse(GOOD).unwrap()
    );
}

#[test]
fn white_space_line_ends_and_case_do_not_matter() {
    reads_the_same("\n", "\r\n");
    reads_the_same("\n", "\r");
    reads_the_same("\n", "  \n\n\t");
    reads_the_same(" ", "\t");
    reads_the_same("HIERARCHY", "\u{FEFF}hierarchy");
    reads_the_same("ROOT", "Root");
    reads_the_same("OFFSET", "offset");
    reads_the_same("Xposition", "XPOSITION");
    reads_the_same("End Site", "END SITE");
    reads_the_same("End Site", "EndSite");
    reads_the_same("End Site", "End Site Crown");
    reads_the_same("Hips\n{", "Hips {");
    reads_the_same("OFFSET 0 3 0\n    }", "OFFSET 0 3 0}");
    reads_the_same("Frames: 2", "FRAMES :2");
    reads_the_same("Frame Time: 0.04", "FrameTime:.04");
    reads_the_same("Frame Time: 0.04", "frame time\t:\t+4e-2");
    reads_the_same("5 6 7 8 9\n1 2", "5\n6 7\n\n8 9 1 2");
    reads_the_same("9\n1 2", "9 1 2");
}

#[test]
fn joints_without_channels_or_ends_and_odd_names() {
    let text = GOOD
        .replace("ROOT Hips", "ROOT  mixamorig:Hips 1.L ")
        .replace("    CHANNELS 3 Zrotation Xrotation Yrotation\n", "")
        .replace("    End Site\n    {\n      OFFSET 0 3 0\n    }\n", "")
        .replace("6 7 8 9", "6");
    let file = parse(&text).unwrap();
    let joints: Vec<_> = file
        .joints()
        .iter()
        .map(|j| (j.name.as_str(), j.kind))
        .collect();
    let moving = JointKind::Moving;
    assert_eq!(joints, [("mixamorig:Hips 1.L", moving), ("Head", moving)]);
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
    let names: Vec<_> = file
        .joints()
        .iter()
        .map(|joint| joint.name.as_str())
        .collect();
    assert_eq!(
        names,
        ["a", "a_2", "a_2_End2", "a_2_End3", "a_2_2", "a_2_End"]
    );
}

#[test]
fn frames_beyond_the_announced_are_kept() {
    let file = parse(&GOOD.replace("Frames: 2", "Frames: 1")).unwrap();
    assert_eq!((file.declared_frames(), file.frames()), (1, 2));
}
