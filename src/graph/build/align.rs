//! Aligns a transition on the feet that stand.
//!
//! Source: the closed form is that of Kovar, Gleicher & Pighin (2002), section 3.1, whose weights may differ by point. Differs: the
//! alignment that is played gives a foot that stands in both clips most of the weight, so that it stays where it stands and the body,
//! which is free in the air, moves instead. The distance of the windows, by which transitions are found, is not changed by it.

use crate::anim::{JointId, Leg};
use crate::graph::ClipId;
use crate::graph::motion_graph::Feet;
use crate::graph::search::cloud::PointCloud;
use crate::graph::search::transition::Transition;
use crate::math::Rigid2;

/// Weight of each joint of a foot that stands. All joints of the body together have weight 1.
const STANDING: f64 = 1.0;

/// Aligns transitions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Aligner<'a> {
    /// Points of each clip.
    pub(crate) clouds: &'a [PointCloud],
    /// Plants of the clips; `None` if feet are not kept planted.
    pub(crate) feet: Option<&'a Feet>,
}

impl Aligner<'_> {
    /// Transform from the space of the target clip to that of the source clip.
    pub(crate) fn align(self, transition: &Transition) -> Rigid2 {
        let pair = transition.windows(self.clouds);
        let Some(feet) = self.feet else {
            return pair.alignment();
        };
        let stands = |leg: usize, frame: usize| {
            let sides = [
                (transition.source_clip, pair.start_a),
                (transition.target_clip, pair.start_b),
            ];
            sides
                .iter()
                .all(|&(clip, start)| feet.stands(ClipId(clip as u32), leg, (start + frame) as u32))
        };
        pair.weighted_alignment(|joint, frame| {
            let has = |leg: &Leg| [leg.foot, leg.toe_or_foot()].contains(&JointId(joint as u16));
            let leg = feet.legs.iter().position(has);
            match leg.is_some_and(|leg| stands(leg, frame)) {
                true => STANDING,
                false => 0.0,
            }
        })
    }
}
