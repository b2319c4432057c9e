//! Obstacles: walls, furniture, ledges and other bodies that no motion may enter.

mod cells;
mod column;
mod distance;
mod extents;
mod near;
mod test;

use glam::{Vec2, Vec3};
use thiserror::Error;

pub(in crate::query) use near::{NearObstacles, TrackPart};
pub(in crate::query) use test::ObstacleScratch;
pub use test::{ObstacleHit, ObstacleTest};

/// Largest number of corners of a polygon.
const MOST_CORNERS: usize = 16;
/// Largest coordinate and size, in metres.
const FURTHEST: f32 = 10_000.0;
/// Fastest obstacle, in metres per second.
const FASTEST: f32 = 100.0;

/// A solid that no body may enter. It may move at a constant velocity.
///
/// The ground itself is no obstacle: feet touch it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Obstacle {
    shape: Shape,
    /// Metres per second.
    velocity: Vec3,
    weight: f32,
    /// Time until the moment that counts as now, in seconds.
    later: f32,
    /// Distance by which the obstacle is larger than its shape, in metres.
    margin: f32,
}

/// The geometry of an obstacle.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    /// Everything behind a plane.
    HalfSpace {
        point: Vec3,
        normal: Vec3,
    },
    /// A box that stands upright.
    Block {
        center: Vec3,
        half: Vec3,
        /// Cosine and sine of the heading.
        turn: Vec2,
    },
    Capsule {
        from: Vec3,
        to: Vec3,
        radius: f32,
    },
    /// A convex prism of unlimited height, its corners (x, z) from +X towards +Z.
    Prism {
        corners: [Vec2; MOST_CORNERS],
        count: usize,
    },
    /// A vertical cylinder of unlimited height, its middle (x, z).
    Disc {
        center: Vec2,
        radius: f32,
    },
}

/// Why an obstacle is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ObstacleError {
    /// A number is not finite or out of range.
    #[error("{0} of the obstacle is not finite or out of range")]
    Value(&'static str),
    /// The corners of a polygon do not enclose a convex area.
    #[error("a polygon needs 3 to {MOST_CORNERS} corners, in order, of a convex area")]
    Corners,
}

impl Obstacle {
    /// Everything behind a plane through `point`; `normal` points out of the solid. A vertical plane is a wall or a ledge.
    ///
    /// # Errors
    /// A point that is not finite or beyond 10 km; a normal of no length.
    pub fn half_space(point: Vec3, normal: Vec3) -> Result<Self, ObstacleError> {
        let normal = normal.try_normalize();
        let normal = normal.ok_or(ObstacleError::Value("the normal"))?;
        is_near(point, "the point")?;
        Ok(Self::new(Shape::HalfSpace { point, normal }))
    }

    /// An upright box around `center`, `half` its sizes, turned by `heading` radians about +Y.
    ///
    /// # Errors
    /// A number that is not finite or beyond 10 km; a size of 0 or less.
    pub fn block(center: Vec3, half: Vec3, heading: f32) -> Result<Self, ObstacleError> {
        is_near(center, "the middle")?;
        is_near(half, "the size")?;
        if half.min_element() <= 0.0 {
            return Err(ObstacleError::Value("the size"));
        }
        if !heading.is_finite() {
            return Err(ObstacleError::Value("the heading"));
        }
        let (sin, cos) = heading.sin_cos();
        let turn = Vec2::new(cos, sin);
        Ok(Self::new(Shape::Block { center, half, turn }))
    }

    /// All points within `radius` of a line from `from` to `to`, which may be one point.
    ///
    /// # Errors
    /// A number that is not finite or beyond 10 km; a radius of 0 or less.
    pub fn capsule(from: Vec3, to: Vec3, radius: f32) -> Result<Self, ObstacleError> {
        is_near(from, "an end")?;
        is_near(to, "an end")?;
        is_radius(radius)?;
        Ok(Self::new(Shape::Capsule { from, to, radius }))
    }

    /// A convex area of the ground, of unlimited height: 3 to 16 corners (x, z) in order, either way around.
    ///
    /// # Errors
    /// Corners that are not finite, too few, too many, or not convex.
    pub fn polygon(corners: &[Vec2]) -> Result<Self, ObstacleError> {
        let count = corners.len();
        if !(3..=MOST_CORNERS).contains(&count) {
            return Err(ObstacleError::Corners);
        }
        for corner in corners {
            is_near(corner.extend(0.0), "a corner")?;
        }
        let turn = |at: usize| {
            let [a, b, c] = [0, 1, 2].map(|ahead| corners[(at + ahead) % count]);
            (b - a).perp_dot(c - b)
        };
        let turns = (0..count).map(turn);
        let (left, right) = (
            turns.clone().all(|turn| turn > 0.0),
            turns.clone().all(|turn| turn < 0.0),
        );
        let around: f32 = (0..count)
            .map(|at| {
                let [a, b, c] = [0, 1, 2].map(|ahead| corners[(at + ahead) % count]);
                (b - a).angle_to(c - b).abs()
            })
            .sum();
        // A star also turns one way, but more than once around.
        if left == right || around > 1.5 * std::f32::consts::TAU {
            return Err(ObstacleError::Corners);
        }
        let mut sorted = [Vec2::ZERO; MOST_CORNERS];
        sorted[..count].copy_from_slice(corners);
        if right {
            sorted[..count].reverse();
        }
        Ok(Self::new(Shape::Prism {
            corners: sorted,
            count,
        }))
    }

    /// A disc on the ground around `center` (x, z), of unlimited height, for example another body.
    ///
    /// # Errors
    /// A number that is not finite or beyond 10 km; a radius of 0 or less.
    pub fn disc(center: Vec2, radius: f32) -> Result<Self, ObstacleError> {
        is_near(center.extend(0.0), "the middle")?;
        is_radius(radius)?;
        Ok(Self::new(Shape::Disc { center, radius }))
    }

    /// Returns the obstacle with a velocity, in metres per second.
    ///
    /// # Errors
    /// A velocity that is not finite or above 100 m/s.
    pub fn moving(self, velocity: Vec3) -> Result<Self, ObstacleError> {
        if !velocity.is_finite() || velocity.length() > FASTEST {
            return Err(ObstacleError::Value("the velocity"));
        }
        Ok(Self { velocity, ..self })
    }

    /// Returns the obstacle with another weight: the harm of entering it by a metre, as a multiple of the harm of being hit by a threat a metre
    /// deep. It decides where no motion avoids both. Default 4.
    ///
    /// # Errors
    /// A weight that is not positive or above 10⁶.
    pub fn weighing(self, weight: f32) -> Result<Self, ObstacleError> {
        if !(weight > 0.0 && weight <= 1e6) {
            return Err(ObstacleError::Value("the weight"));
        }
        Ok(Self { weight, ..self })
    }

    /// Distance of a point from its surface `seconds` from now, in metres; negative inside.
    #[must_use]
    pub fn distance(&self, point: Vec3, seconds: f32) -> f32 {
        self.metres(point, seconds)
    }

    /// The obstacle `seconds` later, and larger by `margin` metres.
    pub(crate) fn later(self, seconds: f32, margin: f32) -> Self {
        Self {
            later: self.later + seconds,
            margin: self.margin + margin,
            ..self
        }
    }

    /// Velocity, in metres per second.
    pub(crate) fn velocity(&self) -> Vec3 {
        self.velocity
    }

    /// See [`Obstacle::weighing`].
    pub(crate) fn weight(&self) -> f32 {
        self.weight
    }

    fn new(shape: Shape) -> Self {
        Self {
            shape,
            velocity: Vec3::ZERO,
            weight: 4.0,
            later: 0.0,
            margin: 0.0,
        }
    }
}

fn is_near(point: Vec3, what: &'static str) -> Result<(), ObstacleError> {
    match point.abs().max_element() <= FURTHEST && point.is_finite() {
        true => Ok(()),
        false => Err(ObstacleError::Value(what)),
    }
}

fn is_radius(radius: f32) -> Result<(), ObstacleError> {
    match radius > 0.0 && radius <= FURTHEST {
        true => Ok(()),
        false => Err(ObstacleError::Value("the radius")),
    }
}
