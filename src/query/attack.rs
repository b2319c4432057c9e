use std::f32::consts::PI;

use serde::Serialize;
use thiserror::Error;

use crate::maps::{MovingSphere, SphereKey};
use crate::math::Rigid2;

/// An attack: one or more moving spheres. Times count from the moment of the query.
#[derive(Clone, Debug, Serialize)]
#[serde(transparent)]
pub struct Attack {
    spheres: Vec<MovingSphere>,
    /// Memory of spheres that the attack had before.
    #[serde(skip)]
    spare: Vec<MovingSphere>,
}

impl PartialEq for Attack {
    fn eq(&self, other: &Self) -> bool {
        self.spheres == other.spheres
    }
}

/// An invalid attack.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum AttackError {
    /// The attack has no spheres.
    #[error("the attack has no spheres")]
    Empty,
    /// A sphere has no keys.
    #[error("sphere {sphere} has no keys")]
    NoKeys {
        /// Index of the sphere.
        sphere: usize,
    },
    /// The attack has more than [`Attack::MOST_KEYS`] keys.
    #[error("the attack has {0} keys; {max} is the most", max = Attack::MOST_KEYS)]
    TooMany(usize),
    /// A number is not finite or out of range.
    #[error(
        "sphere {sphere}, key {key}: the time must be 0 to {latest} s, the center within {furthest} m and the radius above 0 and at most {widest} m",
        latest = Attack::LATEST, furthest = Attack::FURTHEST, widest = Attack::WIDEST
    )]
    Value {
        /// Index of the sphere.
        sphere: usize,
        /// Index of the key.
        key: usize,
    },
    /// A key is not later than the key before it.
    #[error("sphere {sphere}, key {key}: its time {t} s is not after the key before it")]
    Order {
        /// Index of the sphere.
        sphere: usize,
        /// Index of the key.
        key: usize,
        /// Time of the key, in seconds.
        t: f32,
    },
}

impl Attack {
    /// Maximum time of a key, in seconds. The minimum is 0, the moment of the query.
    pub const LATEST: f32 = 600.0;
    /// Maximum distance of a centre from the origin, in metres.
    pub const FURTHEST: f32 = 10_000.0;
    /// Maximum radius, in metres. Every radius is above 0.
    pub const WIDEST: f32 = 100.0;
    /// Maximum number of keys of all spheres together. A query with so many keys takes up to a minute and about 200 MB.
    pub const MOST_KEYS: usize = 1 << 18;

    /// An attack without spheres, as memory for copies.
    pub(crate) fn empty() -> Self {
        Self {
            spheres: Vec::new(),
            spare: Vec::new(),
        }
    }

    /// Creates an attack from the keys of each sphere. Positions are in metres, times in seconds from the moment of the query.
    ///
    /// # Errors
    /// A key is not finite, out of range or out of order, a sphere has no keys, or there are no spheres or too many keys.
    pub fn new(spheres: Vec<Vec<SphereKey>>) -> Result<Self, AttackError> {
        let mut attack = Self::empty();
        for keys in spheres {
            attack.push(keys);
        }
        attack.check()?;
        Ok(attack)
    }

    /// Removes all spheres. Their memory is kept. What [pushes](Self::push) new ones [checks](Self::check) them.
    pub(crate) fn clear(&mut self) {
        self.spare.append(&mut self.spheres);
    }

    /// Appends a sphere, in the memory of an earlier one.
    pub(crate) fn push(&mut self, keys: impl IntoIterator<Item = SphereKey>) {
        let mut sphere = self.spare.pop().unwrap_or_else(MovingSphere::empty);
        sphere.refill(keys);
        self.spheres.push(sphere);
    }

    /// Refuses what [`Attack::new`] refuses.
    pub(crate) fn check(&self) -> Result<(), AttackError> {
        if self.spheres.is_empty() {
            return Err(AttackError::Empty);
        }
        let keys = self.spheres.iter().map(|sphere| sphere.keys().len()).sum();
        if keys > Self::MOST_KEYS {
            return Err(AttackError::TooMany(keys));
        }
        let mut numbered = self.spheres.iter().enumerate();
        numbered.try_for_each(|(sphere, one)| Self::check_keys(sphere, one.keys()))
    }

    fn check_keys(sphere: usize, keys: &[SphereKey]) -> Result<(), AttackError> {
        let sound = |key: &SphereKey| {
            let near = key.center.is_finite() && key.center.length() <= Self::FURTHEST;
            let sized = key.radius > 0.0 && key.radius <= Self::WIDEST;
            (0.0..=Self::LATEST).contains(&key.t) && near && sized
        };
        if let Some(key) = keys.iter().position(|key| !sound(key)) {
            return Err(AttackError::Value { sphere, key });
        }
        if let Some(before) = keys.windows(2).position(|pair| pair[1].t <= pair[0].t) {
            let key = before + 1;
            return Err(AttackError::Order {
                sphere,
                key,
                t: keys[key].t,
            });
        }
        match keys {
            [] => Err(AttackError::NoKeys { sphere }),
            _ => Ok(()),
        }
    }

    /// Area of the sections through the middles of all spheres, in square metres.
    pub(crate) fn section(&self) -> f32 {
        let radius = |sphere: &MovingSphere| {
            let radii = sphere.keys().iter().map(|key| key.radius);
            radii.fold(0.0, f32::max)
        };
        let each = self.spheres.iter();
        each.map(|sphere| PI * radius(sphere).powi(2)).sum()
    }

    /// The spheres.
    pub fn spheres(&self) -> &[MovingSphere] {
        &self.spheres
    }

    /// Time of the first key, in seconds.
    pub fn start(&self) -> f32 {
        self.spheres
            .iter()
            .map(MovingSphere::start)
            .fold(f32::INFINITY, f32::min)
    }

    /// Time of the last key, in seconds.
    pub fn end(&self) -> f32 {
        self.spheres
            .iter()
            .map(MovingSphere::end)
            .fold(0.0, f32::max)
    }

    /// Copies another attack into existing memory.
    pub(super) fn copy_from(&mut self, other: &Self) {
        self.clear();
        for sphere in &other.spheres {
            self.push(sphere.keys().iter().copied());
        }
    }

    /// Copies another attack into existing memory, transformed by `placement`.
    pub(super) fn place_from(&mut self, other: &Self, placement: Rigid2) {
        self.clear();
        for sphere in &other.spheres {
            self.push(sphere.keys().iter().map(|key| key.placed(placement)));
        }
    }

    /// The attack in another frame. `placement` transforms points to that frame.
    pub fn placed(&self, placement: Rigid2) -> Self {
        let mut placed = Self::empty();
        placed.place_from(self, placement);
        placed
    }
}
