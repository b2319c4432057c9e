//! `sabaki inspect`.

use std::fmt::Write;
use std::io::Read;
use std::path::{Path, PathBuf};

use sabaki::anim::JointKind;
use sabaki::archive;
use sabaki_import::{self, AttackFile, EventsFile};
use serde_json::{Value, json};

use super::source::{self, ReadArgs};
use super::{Done, Failure};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// A BVH, AMC or glTF file, a baked graph, an events file or an attack file.
    file: PathBuf,
    #[command(flatten)]
    read: ReadArgs,
}

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    let path = &args.file;
    let head = head(path).map_err(|source| Failure::Open {
        path: path.clone(),
        source,
    })?;
    let (document, text) = if archive::is_baked(&head) {
        let baked = source::from_file(path)?;
        let mut document = source::statistics(&baked);
        document["kind"] = json!("baked");
        (document, source::describe(&baked))
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
    Ok(bytes)
}

fn motion(path: &Path, read: &ReadArgs) -> Result<(Value, String), Failure> {
    let motions = sabaki_import::read_motions(path, &read.options())?;
    // A file without a motion was refused above.
    let Some(sabaki_import::LoadedClip {
        skeleton,
        clip,
        scale,
        notes,
        ..
    }) = motions.first()
    else {
        return Err(Failure::Usage(format!("{}: no motion", path.display())));
    };
    let clips: Vec<Value> = motions
        .iter()
        .map(|motion| {
            let clip = &motion.clip;
            json!({
                "name": clip.name(),
                "frames": clip.frames(),
                "seconds": clip.duration(),
                "events": motion.events,
            })
        })
        .collect();
    let ends = skeleton
        .joints()
        .iter()
        .filter(|joint| joint.kind == JointKind::EndSite)
        .count();
    let (moving, frames) = (skeleton.len() - ends, clip.frames());
    let stature = sabaki_import::stature(skeleton, &first_pose(clip));
    let joints: Vec<Value> = skeleton
        .joints()
        .iter()
        .map(|joint| {
            let parent = joint.parent.map(|parent| &skeleton.joint(parent).name);
            json!({ "name": joint.name, "parent": parent, "offset": joint.offset })
        })
        .collect();
    let mut notes = notes.clone();
    notes.extend(sabaki_import::clip_warnings(
        skeleton,
        std::slice::from_ref(clip),
    ));
    let document = json!({
        "kind": "motion",
        "joints": moving,
        "end_sites": ends,
        "frames": frames,
        "frame_rate": clip.frame_rate(),
        "seconds": clip.duration(),
        "metres_per_unit": scale.metres_per_unit,
        "unit_found": reason(scale.found),
        "notes": notes,
        "stature": stature,
        "moves_joints": !clip.desc().translations.is_empty(),
        "skeleton": joints,
        "clips": clips,
    });
    let mut text = format!("motion: {moving} joints and {ends} end sites, {stature:.2} m high\n");
    for motion in &motions {
        let clip = &motion.clip;
        let name = match motions.len() {
            1 => String::new(),
            _ => format!("{}: ", clip.name()),
        };
        let _ = writeln!(
            text,
            "{name}{} frames at {:.2} a second: {:.2} s",
            clip.frames(),
            clip.frame_rate(),
            clip.duration()
        );
    }
    let _ = writeln!(
        text,
        "1 unit is {} m: {}",
        scale.metres_per_unit,
        reason(scale.found)
    );
    for (clip, event) in motions
        .iter()
        .flat_map(|m| m.events.iter().map(|event| (&m.clip, event)))
    {
        let kind = format!("{:?}", event.kind).to_lowercase();
        let _ = writeln!(
            text,
            "{kind} {:.2} s to {:.2} s in {}",
            event.start,
            event.end,
            clip.name()
        );
    }
    for note in notes {
        let _ = writeln!(text, "note: {note}");
    }
    for joint in skeleton.joints() {
        let depth = joint
            .parent
            .map_or(0, |parent| skeleton.ancestry(parent).count());
        let _ = writeln!(text, "{:indent$}{}", "", joint.name, indent = 2 * depth);
    }
    Ok((document, text))
}

/// How the unit was found.
fn reason(found: sabaki_import::ScaleSource) -> String {
    use sabaki_import::ScaleSource;
    match found {
        ScaleSource::Given => "as --scale says".to_owned(),
        ScaleSource::Format => "the format says so".to_owned(),
        ScaleSource::Unit(unit) => {
            let name = format!("{unit:?}").to_lowercase();
            format!("{name}, in which the figure comes nearest to a person's height")
        }
        ScaleSource::Stature => {
            format!(
                "no unit fits, so the figure is made {} m high",
                sabaki_import::USUAL_STATURE
            )
        }
        ScaleSource::Assumed => {
            "centimetres, since the figure has no height to judge by".to_owned()
        }
    }
}

fn first_pose(clip: &sabaki::anim::Clip) -> sabaki::anim::Pose {
    let mut pose = sabaki::anim::Pose::default();
    clip.pose(0, &mut pose);
    pose
}

/// Inspects an events file or an attack file, by the key that it has.
fn json_file(path: &Path) -> Result<(Value, String), Failure> {
    let bytes = std::fs::read(path).map_err(|source| Failure::Open {
        path: path.to_owned(),
        source,
    })?;
    let has_attacks =
        serde_json::from_slice::<Value>(&bytes).is_ok_and(|value| value.get("attacks").is_some());
    if has_attacks {
        let file = AttackFile::read(path)?;
        let mut text = format!("attacks: {}\n", file.attacks.len());
        for (index, attack) in file.attacks.iter().enumerate() {
            let times = attack.spheres.iter().flatten().map(|key| key.t);
            let (start, end) = times.fold((f32::INFINITY, 0f32), |(low, high), t| {
                (low.min(t), high.max(t))
            });
            let _ = writeln!(
                text,
                "attack {index}: {} spheres, {start:.2} s to {end:.2} s",
                attack.spheres.len()
            );
        }
        return Ok((json!({ "kind": "attacks", "attacks": file.attacks }), text));
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
