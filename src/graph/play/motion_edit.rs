//! Changes of a motion: entries at other positions of the graph, the offsets that fade out after them, and what remains of it at a time.

use crate::anim::{EventKind, Pose, Warp};
use crate::graph::motion_graph::{EdgeId, EdgeMotion, MotionGraph};
use crate::graph::play::inertia::{Entry, EntryScratch, Inertia};
use crate::graph::play::motion::{Motion, Piece};
use crate::graph::play::playhead::MotionStep;
use crate::math::Rigid2;
use glam::{Vec2, Vec3};

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
    /// Jumps to another position of the graph after `seconds`. The offset of the motion from that position, with its velocity, fades out
    /// during the entry's blend. The rest of the previous motion is dropped.
    pub fn enter(&mut self, graph: &MotionGraph, seconds: f32, entry: &Entry) {
        let mut scratch = std::mem::take(&mut self.scratch);
        let step = (1.0 / graph.frame_rate()) as f32;
        scratch.step = step;
        self.extend(graph, seconds + step);
        self.sample_both(graph, [seconds, seconds + step], &mut scratch.from);
        // These poses contain the offset of an earlier entry.
        self.cut(seconds);
        self.push_entry(graph, entry, seconds);
        self.extend(graph, seconds + step);
        if self.inertias.len() == self.entered {
            self.inertias.push(Inertia::default());
        }
        self.inertias[self.entered].set_times(seconds, entry.blend.max(step));
        self.measure_entry(self.entered, graph, &mut scratch);
        self.entered += 1;
        self.scratch = scratch;
    }

    /// Computes the offset of a cut from the poses of the motion that it leaves.
    fn measure_entry(&mut self, index: usize, graph: &MotionGraph, scratch: &mut EntryScratch) {
        let start = self.inertias[index].start;
        for (later, pose) in [0.0, scratch.step].into_iter().zip(&mut scratch.to) {
            self.playhead(graph, start + later).pose(graph, pose);
        }
        self.inertias[index].measure(graph, scratch);
    }

    /// Recomputes the offsets of later cuts after the first one has changed or replaced another one, which may have lasted longer. The pose that a
    /// cut leaves contains the offset before it.
    pub(crate) fn measure_later(&mut self, graph: &MotionGraph) {
        let warp = self.warp.take();
        for index in 1..self.entered {
            let start = self.inertias[index].start;
            if index > 1 && !self.inertias[index - 1].lasts(start) {
                break;
            }
            let mut scratch = std::mem::take(&mut self.scratch);
            scratch.step = (1.0 / graph.frame_rate()) as f32;
            self.sample_left(graph, index, &mut scratch);
            self.measure_entry(index, graph, &mut scratch);
            self.scratch = scratch;
        }
        self.warp = warp;
    }

    /// Samples the motion that a cut leaves, continued as if it were not cut.
    fn sample_left(&mut self, graph: &MotionGraph, index: usize, scratch: &mut EntryScratch) {
        let start = self.inertias[index].start;
        let (layer, entered) = (self.layer, self.entered);
        self.layer = layer.map(|layer| layer.before_cut(start));
        self.entered = index;
        let mut pieces = std::mem::take(&mut self.uncut);
        pieces.clone_from(&self.pieces);
        std::mem::swap(&mut self.pieces, &mut pieces);
        let played = self.pieces.partition_point(|piece| piece.start < start);
        self.pieces.truncate(played);
        if let Some(last) = self.pieces.last_mut() {
            last.end = last.start + last.playhead.seconds_to_next_node(graph) / last.rate;
        }
        let moments = [start, start + scratch.step];
        self.extend(graph, moments[1]);
        self.sample_both(graph, moments, &mut scratch.from);
        self.uncut = std::mem::replace(&mut self.pieces, pieces);
        (self.layer, self.entered) = (layer, entered);
    }

    /// Ends the motion just before `seconds`, so that the next piece starts at that time.
    pub(crate) fn cut(&mut self, seconds: f32) {
        let played = self.pieces.partition_point(|piece| piece.start < seconds);
        self.pieces.truncate(played);
        if let Some(last) = self.pieces.last_mut() {
            last.end = last.end.min(seconds.next_down());
        }
        if let Some(layer) = &mut self.layer {
            layer.cut = Some(layer.cut.map_or(seconds, |cut| cut.min(seconds)));
        }
        let begun = |inertia: &Inertia| inertia.start < seconds;
        self.entered = self.inertias[..self.entered].partition_point(begun);
    }

    /// Appends the entry's edge and the edges of its clip up to the end of the evasion, all at the entry's rate.
    pub(crate) fn push_entry(&mut self, graph: &MotionGraph, entry: &Entry, seconds: f32) {
        let rate = entry.rate;
        let playhead = entry.playhead();
        let left = playhead.seconds_to_next_node(graph) / rate;
        self.pieces.push(Piece {
            playhead,
            rate,
            start: seconds,
            end: seconds + left,
        });
        let mut edge = entry.edge;
        let is_evasion = |edge: EdgeId| {
            let event = graph.edge(edge).event;
            event.is_some_and(|event| graph.event(event).kind == EventKind::Evasion)
        };
        /// Maximum number of edges of a lead-in.
        const MOST: usize = 256;
        let mut pushed = 0;
        while !is_evasion(edge) && pushed < MOST {
            edge = graph.natural_edge(graph.edge(edge).to);
            if graph.edge(edge).motion != EdgeMotion::Clip {
                break;
            }
            self.push(graph, MotionStep { edge, rate });
            pushed += 1;
        }
    }

    pub(crate) fn inertias(&self) -> &[Inertia] {
        &self.inertias[..self.entered]
    }

    /// Offset that still fades out after `seconds`.
    pub(crate) fn inertia(&self, seconds: f32) -> Option<&Inertia> {
        let begun = self
            .inertias()
            .partition_point(|inertia| inertia.start <= seconds);
        let last = self.inertias[..begun].last()?;
        last.lasts(seconds).then_some(last)
    }

    /// Whether the offset of an earlier motion still fades out after `seconds`. The pose then differs from the playhead's.
    pub fn is_blending(&self, seconds: f32) -> bool {
        self.inertia(self.moment(seconds)).is_some()
    }

    /// Whether the offset of an earlier motion still moves more than feet that are held after `seconds`.
    pub(crate) fn is_blending_body(&self, seconds: f32) -> bool {
        let inertia = self.inertia(self.moment(seconds));
        inertia.is_some_and(|inertia| inertia.moves_body(self.moment(seconds)))
    }

    /// The largest distance by which the offset at the start moves the feet from `seconds` on, unless they give way to each other, in metres, and
    /// until when it does, if they are released as in [`Motion::release_feet`]; `None` if it then still moves more than feet that are held.
    pub(crate) fn held_feet_moved(
        &self,
        seconds: f32,
        lifted: &[Option<f32>],
    ) -> Option<(f32, f32)> {
        let Some(held) = self.inertia(0.0).filter(|it| it.lasts(seconds)) else {
            return Some((0.0, 0.0));
        };
        let until = held.held_until(lifted);
        (!held.moves_body(seconds)).then(|| (held.feet_moved(seconds), until))
    }

    /// Turns the motion about its root at `seconds`, and moves it over the ground (x, z), while some feet stay where they stand. `standing` has of
    /// each leg that stands the position of its toe in the world, and the time until it is lifted, in seconds.
    pub(crate) fn move_on_feet(
        &mut self,
        graph: &MotionGraph,
        seconds: f32,
        (turn, way): (f32, Vec2),
        standing: impl Iterator<Item = (usize, Vec3, f32)>,
    ) {
        let root = self.root(graph, seconds);
        let back = Rigid2::new(0.0, -root.x, -root.z);
        let by = Rigid2::new(turn, root.x + way.x, root.z + way.y) * back;
        self.transform(by);
        let last = self.inertias().len().checked_sub(1);
        let lasting = last.filter(|&last| self.inertias[last].lasts(seconds));
        let mut holding = lasting;
        for (leg, toe, lifted) in standing {
            let index = *holding.get_or_insert_with(|| self.push_still(graph, seconds));
            self.inertias[index].keep_foot(leg, seconds, by, toe, lifted);
        }
    }

    /// Appends offsets that are 0, for feet that are held. Returns their index.
    fn push_still(&mut self, graph: &MotionGraph, seconds: f32) -> usize {
        let mut scratch = std::mem::take(&mut self.scratch);
        let pose = &mut scratch.from[0];
        self.sample(graph, seconds, pose);
        // What has faded out gives its memory.
        self.inertias[..self.entered].rotate_left(self.entered.min(1));
        let index = self.entered.saturating_sub(1);
        if self.inertias.is_empty() {
            self.inertias.push(Inertia::default());
        }
        self.inertias[index].restart_still(graph, seconds, pose);
        self.entered = index + 1;
        self.scratch = scratch;
        index
    }

    /// Whether nothing but the blend that the motion has taken over from an earlier one acts at `seconds`.
    pub(crate) fn is_in_continued_blend(&self, seconds: f32) -> bool {
        let continued = self.continued_blend().is_some_and(|it| it.lasts(seconds));
        let is_last = self.inertias().iter().skip(1).all(|it| it.start > seconds);
        continued && is_last && !self.is_bent(seconds)
    }

    /// The blend that the motion has taken over from an earlier one.
    pub(crate) fn continued_blend(&self) -> Option<&Inertia> {
        self.inertias().first().filter(|it| it.start < 0.0)
    }

    /// Takes over the offset that fades out `seconds` after the start of `other`, so that this motion continues that one. Call it before any
    /// [`Motion::enter`].
    pub fn continue_blend(&mut self, other: &Self, seconds: f32) {
        let Some(left) = other.inertia(seconds) else {
            return;
        };
        self.entered = 0;
        if self.inertias.is_empty() {
            self.inertias.push(Inertia::default());
        }
        self.inertias[0].clone_from(left);
        self.inertias[0].start -= seconds;
        self.entered = 1;
    }

    /// Lets go of the feet that are held at the start once they are lifted. They were held for as long as the motion that was left would have
    /// stood on them. `lifted` has for each leg the time when that is, in seconds.
    pub(crate) fn release_feet(&mut self, lifted: &[Option<f32>]) {
        if let Some(held) = self.inertias[..self.entered].first_mut() {
            held.release_feet(lifted);
        }
    }

    /// Time until the offset at the start has faded out, in seconds; 0 without an offset.
    pub fn blends_until(&self) -> f32 {
        self.inertia(0.0).map_or(0.0, Inertia::end)
    }

    /// Returns the motion that remains after `seconds`: the edge that plays then, at its rate, and
    /// everything after it.
    pub fn rest(&self, graph: &MotionGraph, seconds: f32) -> Self {
        let mut rest = self.clone();
        rest.leave_behind(graph, seconds);
        rest.inertias.truncate(rest.entered);
        rest
    }

    /// Becomes what [remains](Self::rest) after `seconds`. The memory is kept.
    pub(crate) fn leave_behind(&mut self, graph: &MotionGraph, seconds: f32) {
        let warp = self.warp.filter(|warp| warp.envelope.end > seconds);
        let moment = warp.map_or(seconds, |warp| warp.moment(seconds).min(seconds));
        let index = self.pieces.partition_point(|piece| piece.end < moment);
        let first = index.min(self.pieces.len().saturating_sub(1));
        let playhead = self.playhead(graph, seconds);
        self.pieces.drain(..first);
        for piece in &mut self.pieces {
            piece.start -= seconds;
            piece.end -= seconds;
        }
        if let Some(begun) = self.pieces.first_mut().filter(|_| warp.is_none()) {
            begun.playhead = playhead;
            begun.start = 0.0;
            begun.end = begun.end.max(0.0);
        }
        self.layer = self.layer_since(seconds);
        self.warp = warp.map(|warp| Warp {
            envelope: warp.envelope.since(seconds),
            ..warp
        });
        let mut left = 0;
        for index in 0..self.entered {
            let inertia = &mut self.inertias[index];
            if !inertia.lasts(seconds) {
                continue;
            }
            inertia.start -= seconds;
            // Rounding may move the end of the piece before the entry past the entry.
            let is_past =
                |piece: &&mut Piece| piece.start < inertia.start && piece.end >= inertia.start;
            if let Some(piece) = self.pieces.iter_mut().rev().find(is_past) {
                piece.end = inertia.start.next_down();
            }
            self.inertias.swap(left, index);
            left += 1;
        }
        self.entered = left;
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

    /// Becomes what it is when it is played at `rate`. Returns `false`, and changes nothing, if it has a layer or a warp.
    pub(crate) fn retime(&mut self, rate: f32) -> bool {
        if rate == 1.0 {
            return true;
        }
        if self.warp.is_some() || self.layer.is_some() {
            return false;
        }
        for piece in &mut self.pieces {
            piece.rate *= rate;
            piece.start /= rate;
            piece.end /= rate;
        }
        let entered = self.entered;
        let inertias = self.inertias[..entered].iter_mut();
        inertias.for_each(|inertia| inertia.retime(rate));
        true
    }

    /// Drops what follows the pieces that are played at the rate of the first one.
    pub(crate) fn truncate_at_other_rate(&mut self) {
        let rate = self.pieces.first().map_or(1.0, |first| first.rate);
        let same = self.pieces.iter().take_while(|piece| piece.rate == rate);
        self.pieces.truncate(same.count());
    }

    /// Starts in the pose of `played`, with its velocity. The offset from it fades out within `blend` seconds. An earlier blend at the start is
    /// replaced.
    pub fn blend_from(&mut self, graph: &MotionGraph, played: Played<'_>, blend: f32) {
        self.blend_on_feet(graph, played, [blend; 2], Vec2::ZERO, &[]);
    }

    /// Like [`Motion::blend_from`], but the offset of the root's position fades out within `blends[1]` seconds. `standing` has for each leg whose
    /// foot stands at the start the time when it is lifted, in seconds: until then it stays where it was. `drift` is a velocity over the ground
    /// (x, z) that the played motion had besides its own, in metres per second.
    pub(crate) fn blend_on_feet(
        &mut self,
        graph: &MotionGraph,
        played: Played<'_>,
        blends: [f32; 2],
        drift: Vec2,
        standing: &[Option<f32>],
    ) {
        let mut scratch = std::mem::take(&mut self.scratch);
        let step = (1.0 / graph.frame_rate()) as f32;
        scratch.step = step;
        let later = [played.seconds, played.seconds + step * played.rate];
        played.motion.sample_both(graph, later, &mut scratch.from);
        scratch.from[1].root += step * Vec3::new(drift.x, 0.0, drift.y);
        self.blend_from_scratch(graph, scratch, blends[0], |inertia| {
            inertia.slow_root(blends[1]);
            if !standing.is_empty() {
                inertia.bend_knees();
            }
            inertia.hold_feet(standing);
        });
    }

    /// Moves all that follows by a distance over the ground, within `seconds` from the start. `stances` has for each leg the times when its foot
    /// is put down next, or 0 if it stands, and lifted again, in seconds; `None` if that is far. A foot that stands stays where it was until it is
    /// lifted, unless the other one would cross it. One that is put down is put where the body will be while it stands.
    pub(crate) fn shift_on_feet(
        &mut self,
        graph: &MotionGraph,
        by: Vec3,
        seconds: f32,
        stances: &[Option<[f32; 2]>],
    ) {
        /// Duration of a step aside, in seconds.
        const STEP: f32 = 0.3;
        let mut scratch = std::mem::take(&mut self.scratch);
        scratch.step = (1.0 / graph.frame_rate()) as f32;
        self.extend(graph, scratch.step);
        self.sample_both(graph, [0.0, scratch.step], &mut scratch.from);
        self.transform(Rigid2::new(0.0, by.x, by.z));
        self.blend_from_scratch(graph, scratch, STEP.min(seconds), |inertia| {
            inertia.slow_root(seconds);
            inertia.place_feet(stances);
            inertia.bend_knees();
        });
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
        self.blend_from_scratch(graph, scratch, blend, |_| ());
    }

    fn blend_from_scratch(
        &mut self,
        graph: &MotionGraph,
        mut scratch: EntryScratch,
        blend: f32,
        shape: impl FnOnce(&mut Inertia),
    ) {
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
        shape(inertia);
        self.entered += 1;
        self.scratch = scratch;
        self.measure_later(graph);
    }

    /// Number of pieces and blends of the motion.
    pub fn len(&self) -> usize {
        self.pieces.len() + self.entered
    }

    /// Whether the motion was never started.
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Whether the graph has everything that the motion plays. It checks motions that come from a file.
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
        let layer_fits = self.layer.is_none_or(|layer| layer.is_sound(graph));
        let warp_fits = self.warp.is_none_or(|warp| warp.bend.is_finite());
        pieces_fit && ordered && connected && blends_fit && warp_fits && layer_fits
    }
}
