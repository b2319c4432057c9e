//! What stands idle stays near the place where it came to stand.
//!
//! No source. Each moment that stands moves the body a little, and over an hour these steps add up to metres. Of moments that are
//! about as near to the body, one is played that leads back.

use glam::{Vec2, Vec3};

use super::table::Moment;
use crate::math::Rigid2;

/// Where a character is that stands idle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Standing {
    /// From the place where it came to stand (x, z), in metres.
    pub off: Vec2,
    /// Heading averaged over a stride, in radians.
    pub heading: f32,
}

impl Standing {
    /// What is added to a moment's distance: 0 if it leads back, up to 1 if it leads further away.
    pub(super) fn cost(&self, moment: &Moment) -> f32 {
        /// From here on the way back counts whole, in metres.
        const FAR: f32 = 0.3;
        /// Of each metre by which a moment leads back.
        const GAIN: f32 = 10.0;
        let turned = Rigid2::new(self.heading - moment.heading, 0.0, 0.0);
        let way = turned.vector(Vec3::new(moment.rest.x, 0.0, moment.rest.y));
        let (before, after) = (self.off, self.off + Vec2::new(way.x, way.z));
        let nearer = before.length() - after.length();
        (before.length() / FAR).min(1.0) * (0.5 - GAIN * nearer).clamp(0.0, 1.0)
    }
}
