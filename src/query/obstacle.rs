//! Obstacles: walls, furniture, ledges and other bodies that no motion may enter. Not in the paper, whose characters stand in an empty plane.
//!
//! Source of the signed distances: Quilez, "Distance functions" and "2D distance functions": box, capsule, convex polygon. Differs: each also
//! gives the direction in which the distance grows.

use glam::{Vec2, Vec3};
use thiserror::Error;

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
    /// See [`Obstacle::weighing`].
    pub(crate) weight: f32,
    /// Time until the moment that counts as now, in seconds.
    later: f32,
    /// Distance by which the obstacle is larger than its shape, in metres.
    margin: f32,
}

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
        check(half.min_element() > 0.0, "the size")?;
        check(heading.is_finite(), "the heading")?;
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
            let (from, to) = (b - a, c - b);
            (from.perp_dot(to), from.angle_to(to).abs())
        };
        let turns = (0..count).map(turn);
        let left = turns.clone().all(|(turn, _)| turn > 0.0);
        let right = turns.clone().all(|(turn, _)| turn < 0.0);
        let around: f32 = turns.map(|(_, angle)| angle).sum();
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
        let is_valid = velocity.is_finite() && velocity.length() <= FASTEST;
        check(is_valid, "the velocity")?;
        Ok(Self { velocity, ..self })
    }

    /// Returns the obstacle with another weight: how much worse it is to enter the obstacle than to be hit equally deep by a threat. It matters if
    /// no motion avoids both. Default 4.
    ///
    /// # Errors
    /// A weight that is not positive or above 10⁶.
    pub fn weighing(self, weight: f32) -> Result<Self, ObstacleError> {
        check(weight > 0.0 && weight <= 1e6, "the weight")?;
        Ok(Self { weight, ..self })
    }

    /// The obstacle `seconds` later, and larger by `margin` metres.
    pub(crate) fn later(self, seconds: f32, margin: f32) -> Self {
        Self {
            later: self.later + seconds,
            margin: self.margin + margin,
            ..self
        }
    }

    pub(crate) fn lowered(mut self, metres: f32) -> Self {
        match &mut self.shape {
            Shape::HalfSpace { point, .. } => point.y -= metres,
            Shape::Block { center, .. } => center.y -= metres,
            Shape::Capsule { from, to, .. } => {
                from.y -= metres;
                to.y -= metres;
            }
            Shape::Prism { .. } | Shape::Disc { .. } => {}
        }
        self
    }

    pub(crate) fn velocity(&self) -> Vec3 {
        self.velocity
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
    let is_valid = point.abs().max_element() <= FURTHEST && point.is_finite();
    check(is_valid, what)
}

fn is_radius(radius: f32) -> Result<(), ObstacleError> {
    check(radius > 0.0 && radius <= FURTHEST, "the radius")
}

fn check(is_valid: bool, what: &'static str) -> Result<(), ObstacleError> {
    is_valid.then_some(()).ok_or(ObstacleError::Value(what))
}

/// The surface point nearest to a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Nearest {
    /// Distance from the surface, in metres; negative inside.
    pub metres: f32,
    /// Direction in which the distance grows fastest; of unit length.
    pub normal: Vec3,
}

impl Obstacle {
    /// Distance of a point from the surface `seconds` from now, in metres; negative inside.
    pub fn distance(&self, point: Vec3, seconds: f32) -> f32 {
        self.nearest(point, seconds).metres
    }

    /// The nearest surface point `seconds` from now. Inlined so that the normal costs nothing where it is not used.
    #[inline(always)]
    pub(crate) fn nearest(&self, point: Vec3, seconds: f32) -> Nearest {
        let point = self.moved_back(point, seconds);
        let nearest = match &self.shape {
            Shape::HalfSpace { point: on, normal } => Nearest {
                metres: normal.dot(point - *on),
                normal: *normal,
            },
            Shape::Block { center, half, turn } => block_nearest(point - *center, *half, *turn),
            Shape::Capsule { from, to, radius } => {
                let along = *to - *from;
                let square = along.length_squared();
                let share = match square > 0.0 {
                    true => ((point - *from).dot(along) / square).clamp(0.0, 1.0),
                    false => 0.0,
                };
                from_axis(point - (*from + along * share), *radius)
            }
            Shape::Prism { corners, count } => {
                polygon_nearest(Vec2::new(point.x, point.z), &corners[..*count])
            }
            Shape::Disc { center, radius } => from_axis(
                Vec3::new(point.x - center.x, 0.0, point.z - center.y),
                *radius,
            ),
        };
        Nearest {
            metres: nearest.metres - self.margin,
            ..nearest
        }
    }

    /// The point where it would be if the obstacle had not moved.
    fn moved_back(&self, point: Vec3, seconds: f32) -> Vec3 {
        point - self.velocity * (self.later + seconds)
    }

    /// Direction on the ground from its middle to a point, where the normal is vertical.
    pub(crate) fn outwards(&self, point: Vec3, seconds: f32) -> Vec2 {
        let point = self.moved_back(point, seconds);
        let middle = match &self.shape {
            Shape::HalfSpace { .. } => Vec3::ZERO,
            Shape::Block { center, .. } => *center,
            Shape::Capsule { from, to, .. } => 0.5 * (*from + *to),
            Shape::Prism { corners, count } => {
                let sum: Vec2 = corners[..*count].iter().sum();
                Vec3::new(sum.x, 0.0, sum.y) / *count as f32
            }
            Shape::Disc { center, .. } => Vec3::new(center.x, 0.0, center.y),
        };
        Vec2::new(point.x - middle.x, point.z - middle.z).normalize_or(Vec2::Y)
    }

    /// Lower bound of the distance from the surface of all points of a vertical line between two heights `seconds` from now, in metres.
    pub(super) fn metres_from_line(&self, axis: Vec2, [low, high]: [f32; 2], seconds: f32) -> f32 {
        let at = |y: f32| Vec3::new(axis.x, y, axis.y);
        match &self.shape {
            Shape::HalfSpace { .. } => {
                let [low, high] = [low, high].map(|y| self.distance(at(y), seconds));
                low.min(high)
            }
            Shape::Block { center, .. } => {
                let middle = center.y + self.velocity.y * (self.later + seconds);
                self.distance(at(middle.clamp(low, high)), seconds)
            }
            Shape::Capsule { from, to, radius } => {
                let (from, to) = (Vec2::new(from.x, from.z), Vec2::new(to.x, to.z));
                let velocity = Vec2::new(self.velocity.x, self.velocity.z);
                let point = axis - velocity * (self.later + seconds) - from;
                let along = to - from;
                let square = along.length_squared();
                let share = match square > 0.0 {
                    true => (point.dot(along) / square).clamp(0.0, 1.0),
                    false => 0.0,
                };
                point.distance(along * share) - radius - self.margin
            }
            Shape::Prism { .. } | Shape::Disc { .. } => self.distance(at(low), seconds),
        }
    }

    /// Lowest and highest x and z coordinates from now until `seconds` from now.
    pub(super) fn ground_bounds(&self, seconds: f32) -> [Vec2; 2] {
        let ground = |point: Vec3| Vec2::new(point.x, point.z);
        let around = |middle: Vec2, half: Vec2| [middle - half, middle + half];
        let [low, high] = match &self.shape {
            Shape::HalfSpace { .. } => [Vec2::NEG_INFINITY, Vec2::INFINITY],
            Shape::Block { center, half, .. } => {
                around(ground(*center), Vec2::splat(ground(*half).length()))
            }
            Shape::Capsule { from, to, radius } => {
                let [from, to] = [from, to].map(|end| ground(*end));
                [from.min(to) - *radius, from.max(to) + *radius]
            }
            Shape::Prism { corners, count } => {
                let corners = &corners[..*count];
                [
                    corners.iter().copied().fold(Vec2::INFINITY, Vec2::min),
                    corners.iter().copied().fold(Vec2::NEG_INFINITY, Vec2::max),
                ]
            }
            Shape::Disc { center, radius } => around(*center, Vec2::splat(*radius)),
        };
        let ways = [self.later, self.later + seconds].map(|time| ground(self.velocity) * time);
        [
            low + ways[0].min(ways[1]) - self.margin,
            high + ways[0].max(ways[1]) + self.margin,
        ]
    }
}

/// `apart` leads from the nearest point of an axis to the point.
#[inline(always)]
fn from_axis(apart: Vec3, radius: f32) -> Nearest {
    let far = apart.length();
    Nearest {
        metres: far - radius,
        normal: apart.normalize_or(Vec3::X),
    }
}

/// `turn` is cosine and sine of the heading.
#[inline(always)]
fn block_nearest(apart: Vec3, half: Vec3, turn: Vec2) -> Nearest {
    let (cos, sin) = (turn.x, turn.y);
    let turned = Vec3::new(
        cos * apart.x - sin * apart.z,
        apart.y,
        sin * apart.x + cos * apart.z,
    );
    let beyond = turned.abs() - half;
    let outside = beyond.max(Vec3::ZERO);
    let far = outside.length();
    let local = match far > 0.0 {
        true => outside / far,
        false if beyond.x >= beyond.y && beyond.x >= beyond.z => Vec3::X,
        false if beyond.z >= beyond.y => Vec3::Z,
        false => Vec3::Y,
    } * turned.signum();
    Nearest {
        metres: far + beyond.max_element().min(0.0),
        normal: Vec3::new(
            cos * local.x + sin * local.z,
            local.y,
            cos * local.z - sin * local.x,
        ),
    }
}

/// The corners turn from +X to +Z.
#[inline(always)]
fn polygon_nearest(point: Vec2, corners: &[Vec2]) -> Nearest {
    let mut inside = (f32::NEG_INFINITY, Vec2::X);
    let mut outside = (f32::INFINITY, Vec2::X);
    for (at, &from) in corners.iter().enumerate() {
        let along = corners[(at + 1) % corners.len()] - from;
        let apart = point - from;
        let normal = Vec2::new(along.y, -along.x).normalize_or(Vec2::X);
        let depth = normal.dot(apart);
        if depth > inside.0 {
            inside = (depth, normal);
        }
        let share = (apart.dot(along) / along.length_squared()).clamp(0.0, 1.0);
        let off = apart - along * share;
        if off.length_squared() < outside.0 {
            outside = (off.length_squared(), off);
        }
    }
    let (metres, normal) = match inside.0 > 0.0 {
        true => (outside.0.sqrt(), outside.1.normalize_or(inside.1)),
        false => inside,
    };
    Nearest {
        metres,
        normal: Vec3::new(normal.x, 0.0, normal.y),
    }
}
