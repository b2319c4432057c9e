//! Decides which edges may be played faster or slower.
//!
//! Source: Masaoka & Oshita, section 4.2. Differs: edges of a dense graph can be shorter than the
//! window in which travel is measured. The window then extends beyond the edge's ends into the
//! frames before and after it in the clip. An edge is still only if the whole window is still.

use std::ops::RangeInclusive;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::anim::{Clip, JointId, Limbs, Pose, Skeleton, forward_kinematics};
use crate::graph::{EdgeId, EdgeMotion, MotionGraph};
use crate::math::in_parallel;

/// Thresholds for slow, fast and still motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RetimeSettings {
    /// Duration of the window in which travel is measured, in seconds. Default 1/3.
    pub window: f64,
    /// Motion is slow if all hands and feet travel less than this, in metres. Default 0.08.
    pub slow: f32,
    /// Motion is fast if a hand or foot travels at least this far, in metres. Default 0.20.
    pub fast: f32,
    /// An edge is still if no hand or foot travels this far in the whole edge, in metres. Default
    /// 0.05.
    pub still: f32,
    /// Whether travel is measured relative to the root instead of in world space. Default false.
    pub relative_to_root: bool,
}

impl Default for RetimeSettings {
    fn default() -> Self {
        Self {
            window: 1.0 / 3.0,
            slow: 0.08,
            fast: 0.20,
            still: 0.05,
            relative_to_root: false,
        }
    }
}

/// Rate changes of an edge that look natural.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Retimable {
    /// Whether the edge may be played faster than it was captured.
    pub faster: bool,
    /// Whether the edge may be played slower than it was captured.
    pub slower: bool,
}

/// Classifies every edge of a graph, by [`EdgeId`]. Events and transitions are classified like all
/// other edges.
pub(in crate::maps) fn retimable_edges(
    graph: &MotionGraph,
    settings: &RetimeSettings,
    threads: usize,
) -> Vec<Retimable> {
    let limbs: Vec<JointId> = Limbs::of(graph.skeleton()).all().collect();
    let clips = graph.clips();
    let tracks = in_parallel(threads, clips.len(), |clip| {
        limb_tracks(
            graph.skeleton(),
            &clips[clip],
            &limbs,
            settings.relative_to_root,
        )
    });
    in_parallel(threads, graph.edges().len(), |edge| {
        let (in_window, total) = travel(graph, &tracks, EdgeId(edge as u32), settings.window);
        let is_still = total < settings.still;
        Retimable {
            faster: is_still || in_window < settings.slow,
            slower: is_still || in_window >= settings.fast,
        }
    })
}

/// Positions of each limb in each frame of a clip, `[limb][frame]`, in metres.
fn limb_tracks(
    skeleton: &Skeleton,
    clip: &Clip,
    limbs: &[JointId],
    relative_to_root: bool,
) -> Vec<Vec<Vec3>> {
    let (mut pose, mut joints) = (Pose::default(), Vec::new());
    let mut tracks = vec![Vec::with_capacity(clip.frames()); limbs.len()];
    for frame in 0..clip.frames() {
        clip.pose(frame, &mut pose);
        forward_kinematics(skeleton, &pose, &mut joints);
        let origin = match relative_to_root {
            true => joints[0].translation,
            false => Vec3::ZERO,
        };
        for (track, limb) in tracks.iter_mut().zip(limbs) {
            track.push(joints[limb.index()].translation - origin);
        }
    }
    tracks
}

/// Maximum travel of any limb in any window of `seconds` that overlaps an edge, and maximum travel of any limb over the whole edge, or over
/// one window if that is longer, in metres. `tracks` holds the limbs of each clip.
fn travel(
    graph: &MotionGraph,
    tracks: &[Vec<Vec<Vec3>>],
    edge: EdgeId,
    seconds: f64,
) -> (f32, f32) {
    let edge = graph.edge(edge);
    let (from, to) = (graph.node(edge.from), graph.node(edge.to));
    // A transition plays the end of its source's frames and the start of its target's. The larger
    // travel counts.
    let stretches = match edge.motion {
        EdgeMotion::Clip => vec![(from.clip, from.frame, to.frame)],
        EdgeMotion::Transition { .. } => vec![
            (from.clip, from.frame, from.frame + edge.frames),
            (to.clip, to.frame - edge.frames, to.frame),
        ],
    };
    let window = ((seconds * graph.frame_rate()).round() as usize).max(1);
    let (mut worst, mut total) = (0.0, 0.0f32);
    for (clip, first, last) in stretches {
        for track in &tracks[clip.index()] {
            let frames = widen(first as usize..=last as usize, window, track.len() - 1);
            let pairs = track[frames].windows(2);
            let steps: Vec<f32> = pairs.map(|pair| pair[0].distance(pair[1])).collect();
            let windows = steps.windows(window.min(steps.len()).max(1));
            worst = windows.map(|w| w.iter().sum()).fold(worst, f32::max);
            total = total.max(steps.iter().sum());
        }
    }
    (worst, total)
}

/// Extends a range of frames evenly to at least `window` frames, within the clip.
fn widen(frames: RangeInclusive<usize>, window: usize, end: usize) -> RangeInclusive<usize> {
    let (first, last) = frames.into_inner();
    let missing = window.saturating_sub(last - first);
    let first = first.saturating_sub(missing.div_ceil(2));
    let last = (first + window).max(last).min(end);
    first.min(last.saturating_sub(window))..=last
}
