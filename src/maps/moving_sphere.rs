use glam::Vec3;
use serde::Serialize;

use super::SphereKey;
use crate::math::Rigid2;

/// A sphere on its way: keys in the order of time, straight lines between them. Before the first
/// and after the last key it is not there.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(transparent)]
pub struct MovingSphere {
    keys: Vec<SphereKey>,
}

impl MovingSphere {
    /// A sphere of these keys; `None` where there is none or one is not after the one before it.
    #[must_use]
    pub fn new(keys: Vec<SphereKey>) -> Option<Self> {
        let ordered = keys.windows(2).all(|pair| pair[0].t < pair[1].t);
        (ordered && !keys.is_empty()).then_some(Self { keys })
    }

    /// Becomes another sphere seen from another frame; `placement` takes its points there.
    pub fn place_from(&mut self, other: &Self, placement: Rigid2) {
        self.keys.clear();
        self.keys.extend(other.keys.iter().map(|key| SphereKey {
            center: placement.point(key.center),
            ..*key
        }));
    }

    /// The same sphere in another frame: `placement` takes points of this one there.
    #[must_use]
    pub fn placed(&self, placement: Rigid2) -> Self {
        let key = |key: &SphereKey| SphereKey {
            center: placement.point(key.center),
            ..*key
        };
        Self {
            keys: self.keys.iter().map(key).collect(),
        }
    }

    /// When it appears, seconds.
    #[must_use]
    pub fn start(&self) -> f32 {
        self.keys[0].t
    }

    /// When it disappears, seconds.
    #[must_use]
    pub fn end(&self) -> f32 {
        self.keys[self.keys.len() - 1].t
    }

    /// Its keys, in the order of time, at least one.
    #[must_use]
    pub fn keys(&self) -> &[SphereKey] {
        &self.keys
    }

    /// Where it is at a time between its first and its last key.
    #[must_use]
    pub fn at(&self, t: f32) -> SphereKey {
        let next = self
            .keys
            .partition_point(|key| key.t <= t)
            .clamp(1, self.keys.len().max(2) - 1);
        let (before, after) = (
            self.keys[next - 1],
            self.keys[next.min(self.keys.len() - 1)],
        );
        Self::between(before, after, t)
    }

    /// Where a sphere is that goes straight from one key to a later one; before the first that,
    /// after the last the other.
    #[must_use]
    pub fn between(before: SphereKey, after: SphereKey, t: f32) -> SphereKey {
        let span = after.t - before.t;
        let share = if span > 0.0 {
            ((t - before.t) / span).clamp(0.0, 1.0)
        } else {
            0.0
        };
        SphereKey {
            t,
            center: before.center.lerp(after.center, share),
            radius: before.radius + (after.radius - before.radius) * share,
        }
    }

    /// Calls `visit` with the sphere at times so close to each other that it moves at most half its
    /// radius in between, first and last key included.
    pub fn for_each_step(&self, mut visit: impl FnMut(Vec3, f32)) {
        /// A sphere that is far faster than wide is drawn with gaps rather than without end.
        const MOST_STEPS: f32 = 1024.0;
        visit(self.keys[0].center, self.keys[0].radius);
        for pair in self.keys.windows(2) {
            let smallest = pair[0].radius.min(pair[1].radius);
            let steps = (pair[0].center.distance(pair[1].center) / (0.5 * smallest))
                .ceil()
                .clamp(1.0, MOST_STEPS);
            for step in 1..=steps as usize {
                let share = step as f32 / steps;
                let radius = pair[0].radius + (pair[1].radius - pair[0].radius) * share;
                visit(pair[0].center.lerp(pair[1].center, share), radius);
            }
        }
    }
}
