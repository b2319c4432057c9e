use glam::Vec2;

use super::segment::CylinderRow;
use crate::maps::SphereKey;

/// An upright cylinder around all places of the body during some time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Envelope {
    axis: Vec2,
    radius: f32,
    /// Lowest and highest y.
    low: f32,
    high: f32,
}

impl Envelope {
    /// A cylinder around cylinders. Those of a negative radius are empty.
    pub(super) fn around(cylinders: impl Iterator<Item = CylinderRow> + Clone) -> Self {
        let cylinders = cylinders.filter(|cylinder| cylinder[2] >= 0.0);
        let (mut least, mut most) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for [x, z, _, lowest, highest] in cylinders.clone() {
            let axis = Vec2::new(x, z);
            (least, most) = (least.min(axis), most.max(axis));
            (low, high) = (low.min(lowest), high.max(highest));
        }
        let axis = 0.5 * (least + most);
        let reach = |[x, z, radius, ..]: CylinderRow| Vec2::new(x, z).distance(axis) + radius;
        Self {
            axis,
            radius: cylinders.map(reach).fold(0.0, f32::max),
            low,
            high,
        }
    }

    /// A lower bound of the distance of the body from a sphere that moves between two keys, metres.
    pub(super) fn distance(self, keys: [SphereKey; 2]) -> f32 {
        let radius = keys[0].radius.max(keys[1].radius);
        let [start, end] = keys.map(|key| Vec2::new(key.center.x, key.center.z) - self.axis);
        let motion = end - start;
        // The added number only prevents a division by 0: where nothing moves, the share is not used.
        let squared = motion.length_squared() + f32::MIN_POSITIVE;
        let share = (-start.dot(motion) / squared).clamp(0.0, 1.0);
        let beside = (start + motion * share).length() - self.radius;
        let [from, to] = keys.map(|key| key.center.y);
        let above = from.min(to) - self.high;
        let below = self.low - from.max(to);
        beside.max(above).max(below) - radius
    }
}
