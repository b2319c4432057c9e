//! Spheres that move along straight lines between keys: the objects of attacks.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::math::{Rigid2, Sphere};

/// Position and radius of a moving sphere at one time. Both are interpolated linearly between keys. The space is that of the object that the
/// key belongs to; for an attack it is the world.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SphereKey {
    /// Time, in seconds.
    pub t: f32,
    /// Position of the centre, in metres.
    pub center: Vec3,
    /// Radius, in metres.
    pub radius: f32,
}

impl SphereKey {
    /// The key in another frame. `placement` transforms points to that frame.
    pub(crate) fn placed(&self, placement: Rigid2) -> Self {
        Self {
            center: placement.point(self.center),
            ..*self
        }
    }
}

/// A sphere that moves along straight lines between keys. It does not exist before its first and
/// after its last key.
#[derive(Debug, PartialEq, Serialize)]
#[serde(transparent)]
pub struct MovingSphere {
    keys: Vec<SphereKey>,
}

impl Clone for MovingSphere {
    fn clone(&self) -> Self {
        Self {
            keys: self.keys.clone(),
        }
    }

    /// Copies into existing memory.
    fn clone_from(&mut self, source: &Self) {
        self.keys.clone_from(&source.keys);
    }
}

impl MovingSphere {
    /// Creates a sphere from keys, or returns `None` if there are no keys or their times do not
    /// increase.
    #[must_use]
    pub fn new(keys: Vec<SphereKey>) -> Option<Self> {
        let ordered = keys.windows(2).all(|pair| pair[0].t < pair[1].t);
        (ordered && !keys.is_empty()).then_some(Self { keys })
    }

    /// Replaces the keys, in existing memory. They are checked by whoever makes a sphere public.
    pub(crate) fn refill(&mut self, keys: impl IntoIterator<Item = SphereKey>) {
        self.keys.clear();
        self.keys.extend(keys);
    }

    /// A sphere without keys, as memory.
    pub(crate) fn empty() -> Self {
        Self { keys: Vec::new() }
    }

    /// Copies `other`, transformed by `placement`, into this sphere.
    pub fn place_from(&mut self, other: &Self, placement: Rigid2) {
        self.refill(other.keys.iter().map(|key| key.placed(placement)));
    }

    /// Returns the sphere in another frame. `placement` transforms points to that frame.
    pub fn placed(&self, placement: Rigid2) -> Self {
        let mut placed = Self::empty();
        placed.place_from(self, placement);
        placed
    }

    /// Time of the first key, in seconds.
    pub fn start(&self) -> f32 {
        self.keys[0].t
    }

    /// Time of the last key, in seconds.
    pub fn end(&self) -> f32 {
        self.keys[self.keys.len() - 1].t
    }

    /// Keys in the order of time, at least one.
    pub fn keys(&self) -> &[SphereKey] {
        &self.keys
    }

    /// Position and radius at time `t`, which must lie between the first and the last key.
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

    /// Interpolates between two keys. Times before the first or after the second key are clamped.
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

    /// Calls `visit` with the sphere at times so close together that it moves at most half its
    /// radius between them. The first and the last key are included.
    pub fn for_each_step(&self, mut visit: impl FnMut(Sphere)) {
        visit(Sphere::new(self.keys[0].center, self.keys[0].radius));
        let steps = |from: &SphereKey, to: &SphereKey| {
            from.center.distance(to.center) / (0.5 * from.radius.min(to.radius))
        };
        self.for_each_span(steps, |[_, to]| visit(Sphere::new(to.center, to.radius)));
    }

    /// Calls `visit` with the ends of each step. `steps` returns the number of steps between two keys, which is rounded up.
    pub(crate) fn for_each_span(
        &self,
        steps: impl Fn(&SphereKey, &SphereKey) -> f32,
        mut visit: impl FnMut([SphereKey; 2]),
    ) {
        /// Maximum number of steps between two keys. The steps of a sphere that moves very far relative to its radius are longer, and leave gaps.
        const MOST_STEPS: f32 = 1024.0;
        for pair in self.keys.windows(2) {
            let steps = steps(&pair[0], &pair[1]).ceil().clamp(1.0, MOST_STEPS);
            let mut from = pair[0];
            for step in 1..=steps as usize {
                let share = step as f32 / steps;
                let between = |a: f32, b: f32| a + (b - a) * share;
                let to = SphereKey {
                    t: between(pair[0].t, pair[1].t),
                    center: pair[0].center.lerp(pair[1].center, share),
                    radius: between(pair[0].radius, pair[1].radius),
                };
                visit([from, to]);
                from = to;
            }
        }
    }
}
