//! Which edges may be played faster or slower.
//!
//! Source: Masaoka & Oshita, section 4.2. Differs: edges of a dense graph can be shorter than the
//! window in which travel is measured; the window then reaches over the edge's ends into what is
//! played before and after it in the clip, and an edge counts as still only when that whole window
//! is.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::anim::{JointId, Limbs, Pose, forward_kinematics};
use crate::graph::{EdgeId, EdgeMotion, MotionGraph};

/// When is motion slow, fast or still?
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RetimeSettings {
    /// Travel is measured over this long, seconds. Default 1/3.
    pub window: f64,
    /// Slow: all hands and feet travel less than this, metres. Default 0.08.
    pub slow: f32,
    /// Fast: one of them travels this or more, metres. Default 0.20.
    pub fast: f32,
    /// Still: none of them travels this in the whole edge, metres. Default 0.05.
    pub still: f32,
    /// Travel relative to the root instead of in the world. Default no.
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

/// How the rate of an edge may change without looking unnatural.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Retimable {
    /// It may be played faster than it was captured.
    pub faster: bool,
    /// It may be played slower.
    pub slower: bool,
}

/// Judges every edge of a graph, by [`EdgeId`]. Events and transitions between clips are judged
/// like all others.
#[must_use]
pub fn retimable_edges(graph: &MotionGraph, settings: &RetimeSettings) -> Vec<Retimable> {
    let limbs: Vec<JointId> = Limbs::of(graph.skeleton()).all().collect();
    let tracks: Vec<Vec<Vec<Vec3>>> = (0..graph.clips().len())
        .map(|clip| limb_track(graph, clip, &limbs, settings.relative_to_root))
        .collect();
    graph
        .edge_ids()
        .map(|edge| judge(&travel(graph, edge, &tracks, settings), settings))
        .collect()
}

/// What hands and feet do in an edge, metres: the largest and, over the whole edge, the total.
struct Travel {
    /// Largest travel of any limb in any window that meets the edge.
    window: f32,
    /// Largest travel of any limb from the edge's start to its end, or over one window where that
    /// is longer.
    whole: f32,
}

fn judge(travel: &Travel, settings: &RetimeSettings) -> Retimable {
    if travel.whole < settings.still {
        return Retimable {
            faster: true,
            slower: true,
        };
    }
    Retimable {
        faster: travel.window < settings.slow,
        slower: travel.window >= settings.fast,
    }
}

/// Places of each limb in each frame: `[limb][frame]`.
fn limb_track(
    graph: &MotionGraph,
    clip: usize,
    limbs: &[JointId],
    relative: bool,
) -> Vec<Vec<Vec3>> {
    let clip = &graph.clips()[clip];
    let (mut pose, mut joints) = (Pose::default(), Vec::new());
    let mut tracks = vec![Vec::with_capacity(clip.frames()); limbs.len()];
    for frame in 0..clip.frames() {
        clip.pose(frame, &mut pose);
        forward_kinematics(graph.skeleton(), &pose, &mut joints);
        let origin = if relative {
            joints[0].translation
        } else {
            Vec3::ZERO
        };
        for (track, limb) in tracks.iter_mut().zip(limbs) {
            track.push(joints[limb.index()].translation - origin);
        }
    }
    tracks
}

fn travel(
    graph: &MotionGraph,
    edge: EdgeId,
    tracks: &[Vec<Vec<Vec3>>],
    settings: &RetimeSettings,
) -> Travel {
    let edge = graph.edge(edge);
    let (from, to) = (graph.node(edge.from), graph.node(edge.to));
    // A transition plays the end of its source's stretch and the start of its target's: the worse
    // of the two counts.
    let stretches = match edge.motion {
        EdgeMotion::Clip => vec![(from.clip, from.frame, to.frame)],
        EdgeMotion::Transition { .. } => {
            vec![
                (from.clip, from.frame, from.frame + edge.frames),
                (to.clip, to.frame - edge.frames, to.frame),
            ]
        }
    };
    let window = ((settings.window * graph.frame_rate()).round() as usize).max(1);
    let mut worst = Travel {
        window: 0.0,
        whole: 0.0,
    };
    for (clip, first, last) in stretches {
        for track in &tracks[clip.index()] {
            let (first, last) = widen(first as usize, last as usize, window, track.len() - 1);
            let steps: Vec<f32> = track[first..=last]
                .windows(2)
                .map(|pair| pair[0].distance(pair[1]))
                .collect();
            let in_window = steps
                .windows(window.min(steps.len()).max(1))
                .map(|w| w.iter().sum());
            worst.window = in_window.fold(worst.window, f32::max);
            worst.whole = worst.whole.max(steps.iter().sum());
        }
    }
    worst
}

/// Grows a stretch about its middle to at least `window` frames, within the clip.
fn widen(first: usize, last: usize, window: usize, end: usize) -> (usize, usize) {
    let missing = window.saturating_sub(last - first);
    let first = first.saturating_sub(missing.div_ceil(2));
    let last = (first + window).max(last).min(end);
    (first.min(last.saturating_sub(window)), last)
}
