//! The moments of the clips that a character may be steered to.
//!
//! Source: Clavet, "Motion Matching and The Road to Next-Gen Animation" (GDC 2016): each moment of the clips has a row of features
//! (where the root goes, how the body turns, where the feet are and how they move), and the moment with the nearest row is played.
//! Differs: only moments of the graph without labelled events are in the table, so that a query can start from each of them.

use glam::{Vec2, Vec3};

use crate::anim::{Facing, Pose, forward_kinematics};
use crate::character::goal::wrapped;
use crate::graph::{ClipId, EdgeId, EdgeMotion, MotionGraph, Playhead};
use crate::maps::Stance;

/// Number of features of a moment, padded to whole vectors.
pub(super) const FEATURES: usize = 24;

/// Features of one moment, each multiplied by its weight.
pub(super) type Row = [f32; FEATURES];

/// Times at which the way ahead is looked at, in seconds.
pub(super) const AHEAD: [f32; 2] = [0.2, 0.4];

/// Half of the time over which a stride's sway is averaged, in seconds.
const STRIDE: f32 = 0.5;

/// Inverse of the difference that counts as 1, for: displacement and turn at each of [`AHEAD`], position and velocity of a foot, velocity
/// and height of the root.
const WEIGHTS: ([f32; 2], [f32; 2], f32, f32, f32, f32) =
    ([12.0, 8.0], [4.0, 3.0], 5.0, 0.7, 1.5, 10.0);

/// A moment of a clip that can be played.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    pub edge: EdgeId,
    /// Frames since the edge's start.
    pub edge_frame: u32,
    pub clip: ClipId,
    /// Frame of the clip.
    pub frame: u32,
    /// Frames until the table ends in this clip.
    pub left: u32,
    /// Velocity over the ground, averaged over a stride, in the space of the clip, in metres per second.
    pub velocity: Vec2,
    /// Heading averaged over a stride, in the space of the clip, in radians.
    pub heading: f32,
    /// Position of the root in the space of the clip (x, z).
    pub root: Vec2,
    /// Whether the body stands for a while.
    pub is_calm: bool,
    /// Time for which it stands from here on, in frames.
    pub calm_frames: u32,
}

impl Moment {
    /// Time until the table ends in this clip, in seconds.
    pub(super) fn seconds_left(&self, graph: &MotionGraph) -> f32 {
        self.left as f32 / graph.frame_rate() as f32
    }
}

/// All moments, by clip and frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Table {
    pub moments: Vec<Moment>,
    pub rows: Vec<Row>,
    /// Index of each clip frame's moment, from the clip's first on; `u32::MAX` for none.
    index: Vec<u32>,
    first: Vec<u32>,
}

/// Features of the way ahead and of the body at a moment.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Features {
    /// Displacement of the root at each of [`AHEAD`], in the character's frame (x, z).
    pub ways: [Vec2; 2],
    /// Change of heading at each of [`AHEAD`], in radians.
    pub turns: [f32; 2],
    /// Feet in the character's frame, and their velocities.
    pub feet: [[Vec3; 2]; 2],
    /// Velocity of the root in the character's frame.
    pub velocity: Vec3,
    /// Height of the root.
    pub height: f32,
}

impl Features {
    /// Feet, velocity and height of a body at `now`, without the way ahead. It moves as between two stances that are `seconds` apart.
    pub(super) fn from_body(now: &Stance, [from, to]: [&Stance; 2], seconds: f32) -> Self {
        let inverse = now.placement.inverse();
        let velocity = |from: Vec3, to: Vec3| inverse.vector(to - from) / seconds;
        let foot = |leg: usize| {
            [
                inverse.point(now.ankles[leg]),
                velocity(from.ankles[leg], to.ankles[leg]),
            ]
        };
        Self {
            feet: [foot(0), foot(1)],
            velocity: velocity(from.root, to.root),
            height: now.root.y,
            ..Self::default()
        }
    }

    pub(super) fn row(&self) -> Row {
        let (way, turn, foot, foot_velocity, velocity, height) = WEIGHTS;
        let ahead = (0..AHEAD.len()).flat_map(|step| {
            let moved = self.ways[step] * way[step];
            [moved.x, moved.y, self.turns[step] * turn[step]]
        });
        let feet = self.feet.iter().flat_map(|&[place, speed]| {
            [place * foot, speed * foot_velocity].map(|vector| vector.to_array())
        });
        let root = (self.velocity * velocity).to_array();
        let all = ahead.chain(feet.flatten()).chain(root);
        let mut row = [0.0; FEATURES];
        for (value, feature) in row.iter_mut().zip(all.chain([self.height * height])) {
            *value = feature;
        }
        row
    }
}

/// Squared distance of two rows.
pub(super) fn distance(a: &Row, b: &Row) -> f32 {
    const LANES: usize = 8;
    let mut sums = [0.0f32; LANES];
    for (a, b) in a.chunks_exact(LANES).zip(b.chunks_exact(LANES)) {
        for lane in 0..LANES {
            let apart = a[lane] - b[lane];
            sums[lane] += apart * apart;
        }
    }
    sums.iter().sum()
}

impl Table {
    pub(super) fn new(graph: &MotionGraph) -> Self {
        let mut table = Self::default();
        let edges = edges_by_clip(graph);
        for (clip, edges) in (0..).map(ClipId).zip(&edges) {
            table.add_clip(graph, clip, edges);
        }
        table
    }

    /// The moment at a playhead, or `None` if the table has none there.
    pub(super) fn at(&self, graph: &MotionGraph, playhead: Playhead) -> Option<usize> {
        let edge = graph.edge(playhead.edge);
        if edge.motion != EdgeMotion::Clip {
            return None;
        }
        let node = graph.node(edge.from);
        let frame = node.frame as usize + playhead.frame.round() as usize;
        let first = *self.first.get(node.clip.index())? as usize;
        let index = *self.index.get(first + frame)?;
        (index != u32::MAX).then_some(index as usize)
    }

    /// Adds the moments of a clip, given the edge that plays each frame of it.
    fn add_clip(&mut self, graph: &MotionGraph, clip: ClipId, edges: &PlayedBy) {
        let frames = graph.clip(clip).frames();
        self.first.push(self.index.len() as u32);
        let start = self.index.len();
        self.index.resize(start + frames, u32::MAX);
        let posed = pose_clip(graph, clip);
        let frame_rate = graph.frame_rate() as f32;
        let longest = (AHEAD[1] * frame_rate).round() as usize;
        let mut run = 0..0;
        for frame in 0..frames {
            let Some((edge, edge_frame)) = edges[frame] else {
                continue;
            };
            if frame >= run.end {
                let played = edges[frame..].iter().take_while(|edge| edge.is_some());
                run = frame..frame + played.count();
            }
            let left = (run.end - frame).min(frames - 1 - frame);
            if left < longest + 1 {
                continue;
            }
            let features = features(&posed, frame, frame_rate);
            let half = (STRIDE * frame_rate).round() as usize;
            let from = frame.saturating_sub(half).max(run.start);
            let to = (frame + half).min(frame + left);
            let (velocity, heading) = stride(&posed[from..=to], frame_rate);
            let calm = features.ways[1].length() < 0.08
                && velocity.length() < 0.15
                && features.turns[1].abs() < 0.15;
            self.index[start + frame] = self.moments.len() as u32;
            self.rows.push(features.row());
            self.moments.push(Moment {
                edge,
                edge_frame,
                clip,
                frame: frame as u32,
                left: (left - longest) as u32,
                velocity,
                heading,
                root: Vec2::new(posed[frame].root.x, posed[frame].root.z),
                is_calm: calm,
                calm_frames: u32::from(calm),
            });
        }
        self.add_calm_frames(start);
    }

    /// Adds up for how long the moments of the last clip stand. `start` is the clip's place in the index.
    fn add_calm_frames(&mut self, start: usize) {
        for pair in self.index[start..].windows(2).rev() {
            let [Some(now), Some(next)] =
                [pair[0], pair[1]].map(|at| self.moments.get(at as usize))
            else {
                continue;
            };
            if now.is_calm && next.is_calm {
                let calm_frames = next.calm_frames + 1;
                self.moments[pair[0] as usize].calm_frames = calm_frames;
            }
        }
    }
}

/// The edge that plays each frame of a clip without an event, and its frame.
type PlayedBy = Vec<Option<(EdgeId, u32)>>;

fn edges_by_clip(graph: &MotionGraph) -> Vec<PlayedBy> {
    let clips = graph.clips().iter();
    let mut edges: Vec<PlayedBy> = clips.map(|clip| vec![None; clip.frames()]).collect();
    for id in graph.natural_edges() {
        let edge = graph.edge(id);
        let from = graph.node(edge.from);
        for ahead in 0..edge.frames {
            edges[from.clip.index()][(from.frame + ahead) as usize] = Some((id, ahead));
        }
    }
    edges
}

fn pose_clip(graph: &MotionGraph, clip: ClipId) -> Vec<Stance> {
    let facing = Facing::of(graph.skeleton());
    let (mut pose, mut joints) = (Pose::default(), Vec::new());
    let stance = |frame: usize| {
        graph.clip(clip).pose(frame, &mut pose);
        forward_kinematics(graph.skeleton(), &pose, &mut joints);
        Stance::from_joints(graph, facing, &joints)
    };
    (0..graph.clip(clip).frames()).map(stance).collect()
}

fn features(posed: &[Stance], frame: usize, frame_rate: f32) -> Features {
    let [now, next] = [&posed[frame], &posed[frame + 1]];
    let inverse = now.placement.inverse();
    let at = |seconds: f32| &posed[frame + (seconds * frame_rate).round() as usize];
    let way = |seconds: f32| {
        let moved = inverse.vector(at(seconds).root - now.root);
        Vec2::new(moved.x, moved.z)
    };
    let turn = |seconds: f32| wrapped(at(seconds).placement.heading() - now.placement.heading());
    Features {
        ways: AHEAD.map(way),
        turns: AHEAD.map(turn),
        ..Features::from_body(now, [now, next], 1.0 / frame_rate)
    }
}

/// Mean velocity and heading of some frames that follow each other.
fn stride(posed: &[Stance], frame_rate: f32) -> (Vec2, f32) {
    let moved = match posed {
        [first, .., last] => last.root - first.root,
        _ => Vec3::ZERO,
    };
    let seconds = (posed.len() - 1).max(1) as f32 / frame_rate;
    let facing = posed
        .iter()
        .map(|stance| Vec2::new(stance.placement.sin(), stance.placement.cos()));
    let facing = facing.sum::<Vec2>();
    (
        Vec2::new(moved.x, moved.z) / seconds,
        facing.x.atan2(facing.y),
    )
}
