//! `sabaki inspect`.

use std::fmt::Write;
use std::io::Read;
use std::path::{Path, PathBuf};

use sabaki::anim::{Joint, JointKind};
use sabaki::archive;
use sabaki_import::{self, AttackFile, EventsFile, LoadedClip, without_mark};
use serde_json::{Value, json};

use super::bake::{self, ReadArgs};
use super::{Done, Failure};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// A BVH, AMC, glTF or FBX file, a baked graph, an events file or an attack file.
    file: PathBuf,
    #[command(flatten)]
    read: ReadArgs,
}

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    let path = &args.file;
    let head = head(path).map_err(Failure::file(path))?;
    let (document, text) = if archive::is_baked(&head) {
        let baked = archive::read(path)?;
        let mut document = bake::statistics(&baked);
        document["kind"] = json!("baked");
        (document, bake::describe(&baked))
    } else if sabaki_import::is_gltf(path)
        || path
            .extension()
            .is_some_and(|ending| ending.eq_ignore_ascii_case("amc"))
    {
        motion(path, &args.read)?
    } else if head.iter().find(|byte| !byte.is_ascii_whitespace()) == Some(&b'{') {
        json_file(path)?
    } else {
        motion(path, &args.read)?
    };
    Ok(Done::ok(if as_json { Done::json(&document) } else { text }))
}

/// The first bytes of a file, which identify its kind.
fn head(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    archive::open_regular(path)?
        .take(1024)
        .read_to_end(&mut bytes)?;
    Ok(without_mark(&bytes).to_vec())
}

/// A motion file: its first motion stands for what all of them share.
struct MotionFile {
    motions: Vec<LoadedClip>,
    notes: Vec<String>,
    /// Height of the figure in its first pose, in metres.
    stature: f64,
}

fn motion(path: &Path, read: &ReadArgs) -> Result<(Value, String), Failure> {
    bake::check_is_motion(path)?;
    let motions = sabaki_import::read_motions(path, &read.options())?;
    let Some(first) = motions.first() else {
        return Err(Failure::Usage(format!("{}: no motion", path.display())));
    };
    let mut notes = first.notes.clone();
    let clips = std::slice::from_ref(&first.clip);
    notes.extend(sabaki_import::clip_warnings(&first.skeleton, clips));
    let stature = sabaki_import::stature(&first.skeleton, &first_pose(&first.clip));
    let file = MotionFile {
        motions,
        notes,
        stature,
    };
    Ok((file.document(), file.text()))
}

impl MotionFile {
    fn first(&self) -> &LoadedClip {
        &self.motions[0]
    }

    /// Numbers of joints that move and of end sites.
    fn joints(&self) -> (usize, usize) {
        let joints = self.first().skeleton.joints();
        let is_end = |joint: &&Joint| joint.kind == JointKind::EndSite;
        let ends = joints.iter().filter(is_end).count();
        (joints.len() - ends, ends)
    }

    fn document(&self) -> Value {
        let LoadedClip {
            skeleton,
            clip,
            scale,
            ..
        } = self.first();
        let of_clip = |motion: &LoadedClip| {
            let clip = &motion.clip;
            json!({
                "name": clip.name(),
                "frames": clip.frames(),
                "frame_rate": clip.frame_rate(),
                "seconds": clip.duration(),
                "events": motion.events,
            })
        };
        let clips: Vec<Value> = self.motions.iter().map(of_clip).collect();
        let of_joint = |joint: &Joint| {
            let parent = joint.parent.map(|parent| &skeleton.joint(parent).name);
            json!({ "name": joint.name, "parent": parent, "offset": joint.offset })
        };
        let joints: Vec<Value> = skeleton.joints().iter().map(of_joint).collect();
        let (moving, ends) = self.joints();
        json!({
            "kind": "motion",
            "joints": moving,
            "end_sites": ends,
            "frames": clip.frames(),
            "frame_rate": clip.frame_rate(),
            "seconds": clip.duration(),
            "metres_per_unit": scale.metres_per_unit,
            "unit_found": reason(scale.found),
            "above": self.above(),
            "notes": self.notes,
            "stature": self.stature,
            "moves_joints": clip.moves_joints(),
            "skeleton": joints,
            "clips": clips,
        })
    }

    /// Names of the joints above the body.
    fn above(&self) -> Vec<&str> {
        let file = self.first().skeleton.file_joints();
        file.into_iter().flat_map(|file| file.above()).collect()
    }

    fn text(&self) -> String {
        let (moving, ends) = self.joints();
        let mut text = format!(
            "motion: {moving} joints and {ends} end sites, {:.2} m high\n",
            self.stature
        );
        for motion in &self.motions {
            let clip = &motion.clip;
            let name = match self.motions.len() {
                1 => String::new(),
                _ => format!("{}: ", clip.name()),
            };
            let (frames, rate, seconds) = (clip.frames(), clip.frame_rate(), clip.duration());
            let _ = writeln!(
                text,
                "{name}{frames} frames at {rate:.2} frames per second: {seconds:.2} s"
            );
        }
        let scale = self.first().scale;
        let (unit, found) = (scale.metres_per_unit as f32, reason(scale.found));
        let _ = writeln!(text, "1 unit is {unit} m: {found}");
        if !self.above().is_empty() {
            let above = self.above().join(", ");
            let root = &self.first().skeleton.joints()[0].name;
            let _ = writeln!(text, "root {root}, with the motion of {above}");
        }
        for motion in &self.motions {
            for event in &motion.events {
                let kind = format!("{:?}", event.kind).to_lowercase();
                let (start, end, clip) = (event.start, event.end, motion.clip.name());
                let _ = writeln!(text, "{kind} {start:.2} s to {end:.2} s in {clip}");
            }
        }
        for note in &self.notes {
            let _ = writeln!(text, "note: {note}");
        }
        let skeleton = &self.first().skeleton;
        for joint in skeleton.joints() {
            let depth = |parent| skeleton.ancestry(parent).count();
            let indent = 2 * joint.parent.map_or(0, depth);
            let _ = writeln!(text, "{:indent$}{}", "", joint.name);
        }
        text
    }
}

/// How the unit was found.
fn reason(found: sabaki_import::ScaleSource) -> String {
    use sabaki_import::ScaleSource;
    match found {
        ScaleSource::Given => "given by --scale".to_owned(),
        ScaleSource::Format => "defined by the format".to_owned(),
        ScaleSource::Unit(unit) => {
            let name = format!("{unit:?}").to_lowercase();
            format!("{name}, which brings the figure nearest to a person's height")
        }
        ScaleSource::Stature => {
            format!(
                "no common unit fits; the figure is scaled to {} m",
                sabaki_import::USUAL_STATURE
            )
        }
        ScaleSource::Assumed => "centimetres, because the figure has no height".to_owned(),
    }
}

fn first_pose(clip: &sabaki::anim::Clip) -> sabaki::anim::Pose {
    let mut pose = sabaki::anim::Pose::default();
    clip.pose(0, &mut pose);
    pose
}

/// Inspects an events file or an attack file, by the key that it has.
fn json_file(path: &Path) -> Result<(Value, String), Failure> {
    let bytes = std::fs::read(path).map_err(Failure::file(path))?;
    let has_attacks = serde_json::from_slice::<Value>(without_mark(&bytes))
        .is_ok_and(|value| value.get("attacks").is_some());
    if has_attacks {
        let file = AttackFile::read(path)?;
        let mut text = format!("attacks: {}\n", file.attacks.len());
        for (index, attack) in file.attacks.iter().enumerate() {
            let spheres = attack.spheres();
            let times = spheres.iter().flat_map(|sphere| sphere.keys());
            let times = times.map(|key| key.t);
            let (start, end) = times.fold((f32::INFINITY, 0f32), |(low, high), t| {
                (low.min(t), high.max(t))
            });
            let _ = writeln!(
                text,
                "attack {index}: {} spheres, {start:.2} s to {end:.2} s",
                spheres.len()
            );
        }
        let attacks = file.attacks.iter();
        let attacks = attacks.map(|attack| json!({ "spheres": attack }));
        let attacks: Vec<Value> = attacks.collect();
        return Ok((json!({ "kind": "attacks", "attacks": attacks }), text));
    }
    let file = EventsFile::read(path)?;
    let count = file
        .clips
        .iter()
        .map(|clip| clip.events.len())
        .sum::<usize>();
    let mut text = format!("events: {count} in {} clips\n", file.clips.len());
    for clip in &file.clips {
        for event in &clip.events {
            let kind = format!("{:?}", event.kind).to_lowercase();
            let _ = writeln!(
                text,
                "{:<8} {:.2} s to {:.2} s in {}",
                kind, event.start, event.end, clip.file
            );
        }
    }
    Ok((json!({ "kind": "events", "clips": file.clips }), text))
}
