//! Changes of a motion that is being played: its past is dropped, it is turned on the ground, and it is joined to another motion.

use crate::anim::Pose;
use crate::graph::motion_graph::MotionGraph;
use crate::graph::play::inertia::{EntryScratch, Inertia};
use crate::graph::play::motion::Motion;
use crate::math::Rigid2;

/// A motion that was played until another motion replaces it.
#[derive(Clone, Copy, Debug)]
pub struct Played<'a> {
    /// The motion.
    pub motion: &'a Motion,
    /// Time since the start of the motion, in seconds.
    pub seconds: f32,
    /// Playback rate of the motion.
    pub rate: f32,
}

impl Motion {
    /// Replaces the motion by [`Motion::rest`]. The rest of a warp stays.
    pub fn drop_past(&mut self, graph: &MotionGraph, seconds: f32) {
        *self = self.rest(graph, seconds);
    }

    /// Transforms the whole motion, including the part that has been played.
    pub fn transform(&mut self, by: Rigid2) {
        for piece in &mut self.pieces {
            piece.playhead.clip_to_world = by * piece.playhead.clip_to_world;
        }
        let entered = self.entered;
        for inertia in &mut self.inertias[..entered] {
            inertia.turn(by);
        }
        if let Some(warp) = &mut self.warp {
            let bend = &mut warp.bend;
            for vector in [&mut bend.spine, &mut bend.pelvis] {
                *vector = by.vector(*vector);
            }
            for end in &mut bend.ends {
                *end = by.vector(*end);
            }
        }
    }

    /// Starts in the pose of `played`, with its velocity. The offset from it fades out within `blend` seconds. An earlier blend at the start is
    /// replaced.
    pub fn blend_from(&mut self, graph: &MotionGraph, played: Played<'_>, blend: f32) {
        let mut scratch = std::mem::take(&mut self.scratch);
        let step = (1.0 / graph.frame_rate()) as f32;
        scratch.step = step;
        let later = [played.seconds, played.seconds + step * played.rate];
        played.motion.sample_both(graph, later, &mut scratch.from);
        self.blend_from_scratch(graph, scratch, blend);
    }

    /// Starts in the second of two poses that are `seconds` apart, with their velocity. The offset from it fades out within `blend` seconds.
    pub(crate) fn blend_from_poses(
        &mut self,
        graph: &MotionGraph,
        poses: [&Pose; 2],
        [seconds, blend]: [f32; 2],
    ) {
        let mut scratch = std::mem::take(&mut self.scratch);
        let [before, now] = poses;
        let [from, later] = &mut scratch.from;
        from.copy_from(now);
        later.copy_from(now);
        // Extrapolates the motion of the joints from the previous interval.
        later.root = now.root + (now.root - before.root);
        for (rotation, before) in later.rotations.iter_mut().zip(&before.rotations) {
            *rotation = (*rotation * before.conjugate() * *rotation).normalize();
        }
        scratch.step = seconds;
        self.blend_from_scratch(graph, scratch, blend);
    }

    fn blend_from_scratch(&mut self, graph: &MotionGraph, mut scratch: EntryScratch, blend: f32) {
        let step = scratch.step;
        self.extend(graph, step);
        let begun = self.inertias().partition_point(|one| one.start <= 0.0);
        self.inertias[..self.entered].rotate_left(begun);
        self.entered -= begun;
        self.sample_both(graph, [0.0, step], &mut scratch.to);
        if self.inertias.len() == self.entered {
            self.inertias.push(Inertia::default());
        }
        let entered = self.entered;
        self.inertias[..=entered].rotate_right(1);
        let inertia = &mut self.inertias[0];
        inertia.set_times(0.0, blend.max(step));
        inertia.measure(graph, &mut scratch);
        self.entered += 1;
        self.scratch = scratch;
        self.measure_later(graph);
    }

    /// Number of pieces and blends of the motion.
    #[must_use]
    pub fn len(&self) -> usize {
        self.pieces.len() + self.entered
    }

    /// Whether the motion was never started.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Whether the graph has everything that the motion plays. It checks motions that come from a file.
    #[must_use]
    pub fn is_sound(&self, graph: &MotionGraph) -> bool {
        let joints = graph.skeleton().len();
        let pieces_fit = self.pieces.iter().all(|piece| {
            let times = [piece.start, piece.end, piece.rate];
            piece.playhead.is_sound(graph)
                && times.iter().all(|time| time.is_finite())
                && piece.rate > 0.0
        });
        let ordered = self.pieces.is_sorted_by(|a, b| a.end <= b.end);
        let connected = self
            .pieces
            .windows(2)
            .all(|pair| pair[0].start <= pair[1].start);
        let blends_fit = self.inertias.len() >= self.entered
            && self
                .inertias()
                .iter()
                .all(|one| one.is_sound(joints, graph.feet().legs().len()));
        let warp_fits = self.warp.is_none_or(|warp| warp.bend.is_finite());
        pieces_fit && ordered && connected && blends_fit && warp_fits && self.is_layer_sound(graph)
    }
}
