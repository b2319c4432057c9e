use glam::Vec3;
use serde::Serialize;
use thiserror::Error;

use crate::math::Rigid2;
use crate::region::SphereKey;

/// A sphere on its way: keys in the order of time, straight lines between them. Before the first and after the last key it is not there.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(transparent)]
pub struct MovingSphere {
    keys: Vec<SphereKey>,
}

/// Where and when an attack passes: one or more moving spheres. Times count from the moment of the query.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Attack {
    spheres: Vec<MovingSphere>,
}

/// Why spheres are no attack.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum AttackError {
    /// There is no sphere.
    #[error("the attack has no spheres")]
    Empty,
    /// A sphere has no keys.
    #[error("sphere {sphere} has no keys")]
    NoKeys {
        /// Zero-based.
        sphere: usize,
    },
    /// A number is not finite or out of its range.
    #[error(
        "sphere {sphere}, key {key}: the time must be 0 to 600 s, the center within 10,000 m and the radius above 0 and at most 100 m"
    )]
    Value {
        /// Zero-based.
        sphere: usize,
        /// Zero-based.
        key: usize,
    },
    /// A key does not come after the one before it.
    #[error("sphere {sphere}, key {key}: its time {t} s is not after the key before it")]
    Order {
        /// Zero-based.
        sphere: usize,
        /// Zero-based.
        key: usize,
        /// Seconds.
        t: f32,
    },
}

impl MovingSphere {
    /// Its keys, in the order of time.
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

    /// Calls `visit` with the sphere at times so close to each other that it moves at most half its radius in between, first and last
    /// key included.
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

impl Attack {
    /// Seconds.
    const LATEST: f32 = 600.0;
    /// Metres from the origin.
    const FURTHEST: f32 = 10_000.0;
    /// Metres.
    const WIDEST: f32 = 100.0;

    /// Checks the spheres' keys. Positions in metres, times in seconds from the moment of the query.
    ///
    /// # Errors
    /// The first key that is not finite or not in order, by its place.
    pub fn new(spheres: Vec<Vec<SphereKey>>) -> Result<Self, AttackError> {
        if spheres.is_empty() {
            return Err(AttackError::Empty);
        }
        for (sphere, keys) in spheres.iter().enumerate() {
            if keys.is_empty() {
                return Err(AttackError::NoKeys { sphere });
            }
            for (key, value) in keys.iter().enumerate() {
                let near = value.center.is_finite() && value.center.length() <= Self::FURTHEST;
                let sized = value.radius > 0.0 && value.radius <= Self::WIDEST;
                if !((0.0..=Self::LATEST).contains(&value.t) && near && sized) {
                    return Err(AttackError::Value { sphere, key });
                }
                if key > 0 && value.t <= keys[key - 1].t {
                    return Err(AttackError::Order {
                        sphere,
                        key,
                        t: value.t,
                    });
                }
            }
        }
        Ok(Self {
            spheres: spheres
                .into_iter()
                .map(|keys| MovingSphere { keys })
                .collect(),
        })
    }

    /// All spheres.
    #[must_use]
    pub fn spheres(&self) -> &[MovingSphere] {
        &self.spheres
    }

    /// When the first sphere appears, seconds.
    #[must_use]
    pub fn start(&self) -> f32 {
        self.spheres
            .iter()
            .map(|sphere| sphere.keys[0].t)
            .fold(f32::INFINITY, f32::min)
    }

    /// When the last sphere disappears, seconds.
    #[must_use]
    pub fn end(&self) -> f32 {
        self.spheres
            .iter()
            .map(|sphere| sphere.keys[sphere.keys.len() - 1].t)
            .fold(0.0, f32::max)
    }

    /// The same attack in another frame: `placement` takes points of this one there.
    #[must_use]
    pub fn placed(&self, placement: Rigid2) -> Self {
        let key = |key: &SphereKey| SphereKey {
            center: placement.point(key.center),
            ..*key
        };
        let sphere = |sphere: &MovingSphere| MovingSphere {
            keys: sphere.keys.iter().map(key).collect(),
        };
        Self {
            spheres: self.spheres.iter().map(sphere).collect(),
        }
    }
}
