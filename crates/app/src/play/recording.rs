//! Records what characters play, as BVH at 60 Hz, so that any reader of BVH can measure it.

use std::f32::consts::TAU;
use std::path::Path;
use std::sync::Arc;

use glam::Vec3;
use rand::{Rng, RngExt};
use sabaki::anim::{Clip, ClipDesc, Pose};
use sabaki::archive::write_atomically;
use sabaki::character::{CharacterId, CharacterSettings, Characters, Goal, Threat};
use sabaki::graph::MotionGraph;
use sabaki::math::{Rigid2, in_parallel};
use sabaki_fixtures::throw::generator;
use sabaki_import::bvh;
use serde_json::{Value, json};

use super::steering::{random_velocity, speeds};
use super::{FRAME, PlayError, Scenarios};

/// What a recorded character does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// A new goal every 3 s: a walk or run of random speed and direction, or a stop.
    Steering,
    /// As [`Kind::Steering`], with a ball every 3 s that is seen 0.3 to 1.5 s before it arrives.
    Threats,
    /// Stands idle.
    Idle,
}

/// Kinds, their names, and their numbers of recordings of a minute.
const KINDS: [(Kind, &str, usize); 3] = [
    (Kind::Steering, "steering", 10),
    (Kind::Threats, "threats", 10),
    (Kind::Idle, "idle", 4),
];

/// Time between two goals and between two balls, in seconds.
const HELD: f32 = 3.0;

impl Scenarios {
    /// Writes ten minutes of steering, ten under threats and four of standing, a file a minute, to `steering`, `threats` and `idle` below a folder,
    /// and the goals and balls to `goals.json` beside them. Returns what `measure` finds in the poses of each minute, with the name of its folder.
    ///
    /// # Errors
    /// A graph in which nothing can be played; those of the file system.
    pub fn record<T: Send>(
        &self,
        folder: &Path,
        threads: usize,
        measure: impl Fn(&[Pose]) -> T + Sync,
    ) -> Result<Vec<(&'static str, Vec<T>)>, PlayError> {
        let mut found = Vec::new();
        for (kind, name, count) in KINDS {
            let folder = folder.join(name);
            let failed = |error| PlayError::File {
                place: folder.clone(),
                error,
            };
            std::fs::create_dir_all(&folder).map_err(failed)?;
            let minutes = in_parallel(threads, count, |index| {
                let (poses, goals) = self.recorded(kind, index as u64)?;
                let file = format!("{name}_{index:02}.bvh");
                write_played(&folder.join(&file), self.baked.graph(), &poses).map_err(failed)?;
                Ok((json!({ "file": file, "goals": goals }), measure(&poses)))
            });
            let minutes: Result<Vec<(Value, T)>, PlayError> = minutes.into_iter().collect();
            let (goals, measured): (Vec<Value>, Vec<T>) = minutes?.into_iter().unzip();
            found.push((name, measured));
            let goals = format!("{:#}", json!(goals));
            write_atomically(&folder.join("goals.json"), |out| {
                std::io::Write::write_all(out, goals.as_bytes())
            })
            .map_err(failed)?;
        }
        Ok(found)
    }

    /// A minute of one character, and its goals and balls.
    fn recorded(&self, kind: Kind, index: u64) -> Result<(Vec<Pose>, Vec<Value>), PlayError> {
        const FRAMES: usize = 3600;
        let mut random = generator(self.seed ^ 0x5ec0, index);
        let speeds = speeds(&self.baked);
        let mut characters =
            Characters::new(Arc::clone(&self.baked), CharacterSettings::default())?;
        let id = characters.spawn(Rigid2::IDENTITY)?;
        let mut poses = Vec::with_capacity(FRAMES);
        let mut goals = Vec::new();
        let held = (HELD / FRAME).round() as usize;
        for frame in 0..FRAMES {
            let seconds = frame as f32 * FRAME;
            if kind != Kind::Idle && frame % held == 0 {
                let goal = random_goal(&speeds, &mut random);
                characters.steer(id, goal)?;
                goals.push(json!({ "seconds": seconds, "goal": goal }));
            }
            if kind == Kind::Threats && frame % held == held / 2 {
                let ball = ball(&characters, id, &mut random)?;
                goals.push(json!({ "seconds": seconds, "ball": ball }));
                characters.threaten(ball)?;
            }
            let mut pose = Pose::default();
            characters.local_pose(id, &mut pose)?;
            poses.push(pose);
            characters.step(FRAME, &[], &mut Vec::new());
        }
        Ok((poses, goals))
    }
}

/// Writes poses that were played, one a frame, as BVH in centimetres.
pub(super) fn write_played<'a>(
    path: &Path,
    graph: &MotionGraph,
    poses: impl IntoIterator<Item = &'a Pose>,
) -> std::io::Result<()> {
    let moves_joints = graph.clips().iter().any(|clip| clip.moves_joints());
    let poses: Vec<&Pose> = poses.into_iter().collect();
    let pose = |frame: usize, pose: &mut Pose| {
        pose.clone_from(poses[frame]);
        match moves_joints {
            true => pose.fill_translations(graph.skeleton()),
            false => pose.translations.clear(),
        }
    };
    let desc = ClipDesc::of_poses("played", f64::from(1.0 / FRAME), poses.len(), pose);
    let clip = Clip::new(graph.skeleton(), desc).map_err(std::io::Error::other)?;
    write_atomically(path, |out| bvh::write(out, graph.skeleton(), &clip, 0.01))
}

/// A stop, one time in five, else a speed of the clips in a random direction.
fn random_goal(speeds: &[f32], random: &mut impl Rng) -> Goal {
    if random.random::<f32>() < 0.2 {
        return Goal::Stop;
    }
    Goal::Walk {
        velocity: random_velocity(speeds, random),
        facing: None,
    }
}

/// A ball from a random side at the place where the trunk or head will be if the velocity stays.
fn ball(
    characters: &Characters,
    id: CharacterId,
    random: &mut impl Rng,
) -> Result<Threat, PlayError> {
    let mut between = |low: f32, high: f32| low + (high - low) * random.random::<f32>();
    let (seen, speed, radius) = (between(0.3, 1.5), between(6.0, 14.0), between(0.08, 0.15));
    let (around, height) = (between(0.0, TAU), between(0.8, 1.7));
    let place = characters.place(id)?.point(Vec3::Y * height);
    let target = place + characters.velocity(id)?.with_y(0.0) * seen;
    let velocity = Vec3::new(around.sin(), 0.0, around.cos()) * speed;
    let ball = Threat::ball(characters.now(), target - velocity * seen, velocity, radius);
    let seconds = seen + 0.3;
    Ok(Threat { seconds, ..ball })
}
