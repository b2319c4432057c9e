//! How well characters obey: random changes of speed and direction, and a figure of eight.

use std::f32::consts::TAU;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use rand::{Rng, RngExt};
use sabaki::character::{CharacterError, CharacterId, CharacterSettings, Characters, Goal};
use sabaki::maps::BakedGraph;
use sabaki::math::{Rigid2, in_parallel};

use super::{FRAME, Scenarios, joints_of, percentile};
use sabaki_fixtures::throw::generator;

/// Measurements of steering.
#[derive(Clone, Copy, Debug, Default)]
pub struct SteerReport {
    /// Mean share by which the speed is off, from 1.2 s after a change on.
    pub speed_error: f32,
    /// Median time after a change until the direction stays within 10°, in seconds.
    pub settle_median: f32,
    /// 95th percentile of that time, in seconds.
    pub settle_p95: f32,
    /// Share of the changes after which the velocity did not settle before the next change.
    pub unsettled: f32,
    /// 95th percentile of the distance from the figure of eight, in metres.
    pub path_error: f32,
    /// Largest distance from it, in metres.
    pub path_error_max: f32,
}

/// Time between two changes, in seconds.
const HELD: f32 = 3.0;
/// Changes of one character.
const CHANGES: usize = 10;
/// Half of the time over which velocity is averaged: half a stride, in frames.
const HALF: usize = 15;

impl Scenarios {
    /// Steers `count` characters through random changes, and one along a figure of eight.
    ///
    /// # Errors
    /// A graph in which nothing can be played.
    pub fn steer(&self, count: usize, threads: usize) -> Result<SteerReport, CharacterError> {
        let speeds = speeds(&self.baked);
        let runs = in_parallel(threads, count, |index| {
            changes(&self.baked, &speeds, generator(self.seed, index as u64))
        });
        let (mut errors, mut settled) = (Vec::new(), Vec::new());
        for run in runs {
            let run = run?;
            errors.extend(run.0);
            settled.extend(run.1);
        }
        let path = figure_of_eight(&self.baked)?;
        let never = settled.iter().filter(|&&seconds| seconds >= HELD).count();
        Ok(SteerReport {
            speed_error: errors.iter().sum::<f32>() / errors.len().max(1) as f32,
            unsettled: never as f32 / settled.len().max(1) as f32,
            settle_median: percentile(settled.clone(), 0.5),
            settle_p95: percentile(settled, 0.95),
            path_error: percentile(path.clone(), 0.95),
            path_error_max: percentile(path, 1.0),
        })
    }
}

/// Speeds of the walks and runs of the clips: means over half a second without events, above 0.6 m/s.
pub(super) fn speeds(baked: &BakedGraph) -> Vec<f32> {
    let graph = baked.graph();
    let half = (0.25 * graph.frame_rate()).round() as usize;
    let mut speeds = Vec::new();
    for edge in graph.natural_edges().map(|id| graph.edge(id)) {
        let node = graph.node(edge.from);
        let (clip, frame) = (graph.clip(node.clip), node.frame as usize);
        if frame >= half && frame + half < clip.frames() {
            let moved = (clip.root(frame + half) - clip.root(frame - half)).with_y(0.0);
            let speed = moved.length() * graph.frame_rate() as f32 / (2 * half) as f32;
            if speed > 0.6 {
                speeds.push(speed);
            }
        }
    }
    if speeds.is_empty() {
        speeds.push(1.0);
    }
    speeds
}

/// One of some speeds in a random direction.
pub(super) fn random_velocity(speeds: &[f32], random: &mut impl Rng) -> Vec3 {
    let heading = random.random::<f32>() * TAU;
    let speed = speeds[random.random_range(0..speeds.len())];
    Vec3::new(heading.sin(), 0.0, heading.cos()) * speed
}

/// Errors of speed and times until the direction is reached, of one character.
fn changes(
    baked: &Arc<BakedGraph>,
    speeds: &[f32],
    mut random: impl Rng,
) -> Result<(Vec<f32>, Vec<f32>), CharacterError> {
    let mut characters = Characters::new(Arc::clone(baked), CharacterSettings::default())?;
    let id = characters.spawn(Rigid2::IDENTITY)?;
    let (mut roots, mut wanted) = (Vec::new(), Vec::new());
    let frames = (HELD / FRAME).round() as usize;
    for _ in 0..CHANGES {
        let velocity = random_velocity(speeds, &mut random);
        let goal = Goal::Walk {
            velocity,
            facing: None,
        };
        characters.steer(id, goal)?;
        wanted.push(Vec2::new(velocity.x, velocity.z));
        for _ in 0..frames {
            record(&mut characters, id, &mut roots)?;
        }
    }
    let velocity = |at: usize| {
        let (from, to) = (at.saturating_sub(HALF), (at + HALF).min(roots.len() - 1));
        (roots[to] - roots[from]) / ((to - from) as f32 * FRAME)
    };
    let (mut errors, mut settled) = (Vec::new(), Vec::new());
    for (change, wanted) in wanted.into_iter().enumerate() {
        let (start, end) = (change * frames, (change + 1) * frames - HALF);
        let is_off = |&at: &usize| velocity(at).angle_to(wanted).abs() > 10f32.to_radians();
        let last = (start..end).rev().find(is_off);
        let since = last.map_or(0, |last| last + 1 - start);
        settled.push(if since == end - start {
            HELD
        } else {
            since as f32 * FRAME
        });
        let from = start + (1.2 / FRAME) as usize;
        let speed = (from..end).map(|at| velocity(at).length()).sum::<f32>() / (end - from) as f32;
        errors.push((speed / wanted.length() - 1.0).abs());
    }
    Ok((errors, settled))
}

/// Records the root on the ground and plays a frame.
fn record(
    characters: &mut Characters,
    id: CharacterId,
    roots: &mut Vec<Vec2>,
) -> Result<(), CharacterError> {
    let mut joints = Vec::new();
    joints_of(characters, id, &mut joints)?;
    let root = joints[0].translation;
    roots.push(Vec2::new(root.x, root.z));
    characters.step(FRAME, &[], &mut Vec::new());
    Ok(())
}

/// Distances from a figure of eight of 8 m by 4 m that is walked at 1.2 m/s, each frame of a minute, without the first 3 s.
fn figure_of_eight(baked: &Arc<BakedGraph>) -> Result<Vec<f32>, CharacterError> {
    const SPEED: f32 = 1.2;
    const POINTS: usize = 2000;
    /// The point that is walked to lies this far ahead, in metres.
    const AHEAD: f32 = 0.55;
    let point = |index: usize| {
        let t = index as f32 / POINTS as f32 * TAU;
        Vec2::new(4.0 * t.sin(), 4.0 * t.sin() * t.cos())
    };
    let path: Vec<Vec2> = (0..POINTS).map(point).collect();
    let mut characters = Characters::new(Arc::clone(baked), CharacterSettings::default())?;
    let id = characters.spawn(Rigid2::new(0.785, 0.0, 0.0))?;
    let (mut roots, mut at) = (Vec::new(), 0);
    for _ in 0..(60.0 / FRAME) as usize {
        record(&mut characters, id, &mut roots)?;
        let root = roots[roots.len() - 1];
        // The path crosses itself: only what lies ahead is looked at.
        let apart = |index: &usize| path[index % POINTS].distance(root);
        let near = (at..at + POINTS / 12).min_by(|a, b| apart(a).total_cmp(&apart(b)));
        at = near.unwrap_or(at);
        let far = |index: &usize| path[index % POINTS].distance(path[at % POINTS]) > AHEAD;
        let goal = (at..at + POINTS / 4).find(far).unwrap_or(at);
        let way = (path[goal % POINTS] - root).normalize_or_zero() * SPEED;
        let goal = Goal::Walk {
            velocity: Vec3::new(way.x, 0.0, way.y),
            facing: None,
        };
        characters.steer(id, goal)?;
    }
    // The sway of a stride is none of the path's.
    let mean = |at: usize| roots[at - HALF..at + HALF].iter().sum::<Vec2>() / (2 * HALF) as f32;
    let off = |at: usize| {
        let place = mean(at);
        let apart = path.iter().map(|point| point.distance(place));
        apart.fold(f32::INFINITY, f32::min)
    };
    let first = (3.0 / FRAME) as usize;
    Ok((first..roots.len() - HALF).step_by(6).map(off).collect())
}
