use super::GraphEvent;
use super::minima::Minimum;

/// A blend from one clip to another.
///
/// It leaves the source at its node's frame, plays `frames` frames of both, and arrives at the
/// target's node. Frame `i + 1` of the blend weighs the source, for i = 0..k-1, by Kovar's
/// `2((i+1)/k)³ - 3((i+1)/k)² + 1`, so that the frame before the blend is the source alone and its
/// last frame is the target alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transition {
    /// Clip that is left.
    pub source_clip: usize,
    /// Frame of the source where the blend starts, the last one of the source alone.
    pub source_frame: usize,
    /// Clip that is entered.
    pub target_clip: usize,
    /// Frame of the target where the blend ends, the first one of the target alone.
    pub target_frame: usize,
    /// How long the blend is.
    pub frames: usize,
    /// Root of the mean squared point distance of the windows, metres.
    pub distance: f32,
}

/// The source's weight at a share `s` of the blend, 0..=1: 1 at 0, 0 at 1, without slope at both.
#[must_use]
pub fn blend_weight(s: f32) -> f32 {
    let s = s.clamp(0.0, 1.0);
    (2.0 * s - 3.0) * s * s + 1.0
}

impl Transition {
    /// The two transitions that a minimum of the map of clips `a` and `b` allows, there and back,
    /// where the clips have the frame before the window that each starts from.
    pub(super) fn both_ways(
        a: usize,
        b: usize,
        minimum: &Minimum,
        window: usize,
    ) -> impl Iterator<Item = Self> {
        let one_way = move |source_clip, source: usize, target_clip, target: usize| {
            (source > 0 && target > 0).then(|| Self {
                source_clip,
                source_frame: source - 1,
                target_clip,
                target_frame: target + window - 1,
                frames: window,
                distance: minimum.distance,
            })
        };
        let there = one_way(a, minimum.a, b, minimum.b);
        let back = one_way(b, minimum.b, a, minimum.a);
        there.into_iter().chain(back)
    }

    /// Whether the blend would play a part of an event at a weight other than all or nothing.
    pub(super) fn cuts(&self, event: &GraphEvent) -> bool {
        let clip = event.clip.index();
        let (first, last) = (event.first as usize, event.last as usize);
        let blended = |from: usize, to: usize| first < last && first < to && last > from;
        (clip == self.source_clip && blended(self.source_frame, self.source_frame + self.frames))
            || (clip == self.target_clip
                && blended(self.target_frame - self.frames, self.target_frame))
    }
}
