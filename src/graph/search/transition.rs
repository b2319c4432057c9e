use crate::graph::motion_graph::{ClipId, GraphEvent, Node};
use crate::graph::search::bands::Minimum;
use crate::graph::search::distance::WindowPair;
use crate::graph::search::windows::PointCloud;

/// A blend from one clip to another.
///
/// It starts at the source node's frame, plays `frames` frames of both clips, and ends at the
/// target's node. Frame `i + 1` of the blend weights the source, for i = 0..k-1, by Kovar's
/// `2((i+1)/k)³ - 3((i+1)/k)² + 1`. The frame before the blend is the source alone, and its last
/// frame is the target alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Transition {
    pub source_clip: usize,
    /// Frame of the source where the blend starts. It is the last frame of the source alone.
    pub source_frame: usize,
    pub target_clip: usize,
    /// Frame of the target where the blend ends. It is the first frame of the target alone.
    pub target_frame: usize,
    pub frames: usize,
    /// Root of the mean squared point distance of the windows, in metres.
    pub distance: f32,
}

/// Weight of the source at a share `s` of the blend, 0..=1. It falls from 1 at 0 to 0 at 1, with
/// zero slope at both ends.
#[must_use]
pub fn blend_weight(s: f32) -> f32 {
    let s = s.clamp(0.0, 1.0);
    (2.0 * s - 3.0) * s * s + 1.0
}

impl Minimum {
    /// The transitions in both directions at this minimum of the distance map of clips `a` and `b`. A direction is left out if its source
    /// clip has no frame before the window.
    pub(crate) fn transitions(
        &self,
        a: usize,
        b: usize,
        window: usize,
    ) -> impl Iterator<Item = Transition> {
        let one_way = move |source_clip, source: usize, target_clip, target: usize| {
            (source > 0 && target > 0).then(|| Transition {
                source_clip,
                source_frame: source - 1,
                target_clip,
                target_frame: target + window - 1,
                frames: window,
                distance: self.distance,
            })
        };
        let (at_a, at_b) = (self.a as usize, self.b as usize);
        let there = one_way(a, at_a, b, at_b);
        let back = one_way(b, at_b, a, at_a);
        there.into_iter().chain(back)
    }
}

impl Transition {
    /// The places where the blend starts and ends.
    pub(crate) fn ends(&self) -> [Node; 2] {
        let ends = [
            (self.source_clip, self.source_frame),
            (self.target_clip, self.target_frame),
        ];
        ends.map(|(clip, frame)| Node {
            clip: ClipId(clip as u32),
            frame: frame as u32,
        })
    }

    /// The frames of both clips that the blend plays, without the frame before it.
    pub(crate) fn windows<'a>(&self, clouds: &'a [PointCloud]) -> WindowPair<'a> {
        WindowPair {
            a: &clouds[self.source_clip],
            start_a: self.source_frame + 1,
            b: &clouds[self.target_clip],
            start_b: self.target_frame + 1 - self.frames,
            frames: self.frames,
        }
    }

    /// Whether the blend would play a part of an event with a weight between 0 and 1.
    pub(crate) fn cuts(&self, event: &GraphEvent) -> bool {
        let clip = event.clip.index();
        let (first, last) = (event.first as usize, event.last as usize);
        let blended = |from: usize, to: usize| first < last && first < to && last > from;
        (clip == self.source_clip && blended(self.source_frame, self.source_frame + self.frames))
            || (clip == self.target_clip
                && blended(self.target_frame - self.frames, self.target_frame))
    }
}
