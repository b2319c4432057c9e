use serde::{Deserialize, Serialize};

/// Blend of one foot in a transition. The foot follows the source until it leaves, the target from
/// when it lands, and a blend of both in between.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LegBlend {
    /// Time when the foot leaves the source's motion, in frames since the transition's start.
    pub leave: f32,
    /// Time when the foot reaches the target's motion, in frames since the transition's start. It
    /// is later than `leave`.
    pub land: f32,
    /// Height of the step, in metres. It is above 0 if the foot would otherwise slide along the
    /// ground.
    pub lift: f32,
}

impl LegBlend {
    /// Weight of the target, and height to add to the blend, in metres.
    pub(super) fn at(self, frame: f32) -> (f32, f32) {
        let s = ((frame - self.leave) / (self.land - self.leave)).clamp(0.0, 1.0);
        // A foot that is in the air anyway uses a quintic. A lifted foot uses a higher degree, so
        // that it hardly moves horizontally while it is low. Both start slowly enough that a
        // straight knee, whose angle grows with the square root of the foot's displacement, does
        // not start with a jerk.
        let weight = if self.lift > 0.0 {
            s.powi(4) * (35.0 + s * (-84.0 + s * (70.0 - 20.0 * s)))
        } else {
            s.powi(3) * (10.0 + s * (-15.0 + 6.0 * s))
        };
        let arc = 4.0 * s * (1.0 - s);
        (weight, self.lift * arc * arc * arc)
    }

    pub(super) fn is_sound(self, frames: u32, furthest: f32) -> bool {
        (0.0..=frames as f32).contains(&self.leave)
            && self.land > self.leave
            && self.land <= frames as f32
            && (0.0..=furthest).contains(&self.lift)
    }
}
