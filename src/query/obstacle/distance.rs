//! Signed distances of points from obstacles.
//!
//! Source: Quilez, "Distance functions" and "2D distance functions": box, capsule, convex polygon. Differs: each also gives the
//! direction in which the distance grows.

use glam::{Vec2, Vec3};

use super::{Obstacle, Shape};

/// The surface point nearest to a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Nearest {
    /// Distance from the surface, in metres; negative inside.
    pub metres: f32,
    /// Direction in which the distance grows fastest; of unit length.
    pub normal: Vec3,
}

impl Obstacle {
    /// The nearest surface point `seconds` from now.
    pub(crate) fn nearest(&self, point: Vec3, seconds: f32) -> Nearest {
        let point = self.moved_back(point, seconds);
        let nearest = match &self.shape {
            Shape::HalfSpace { point: on, normal } => Nearest {
                metres: normal.dot(point - *on),
                normal: *normal,
            },
            Shape::Block { center, half, turn } => of_block(point - *center, *half, *turn),
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
                of_polygon(Vec2::new(point.x, point.z), &corners[..*count])
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

    /// Distance of a point from the surface `seconds` from now, in metres; negative inside. The same to the bit as
    /// [`Obstacle::nearest`], without its direction where that costs much.
    pub(super) fn metres(&self, point: Vec3, seconds: f32) -> f32 {
        let metres = match &self.shape {
            Shape::HalfSpace { point: on, normal } => {
                normal.dot(self.moved_back(point, seconds) - *on)
            }
            Shape::Disc { center, radius } => {
                let point = self.moved_back(point, seconds);
                Vec3::new(point.x - center.x, 0.0, point.z - center.y).length() - radius
            }
            Shape::Block { .. } | Shape::Capsule { .. } | Shape::Prism { .. } => {
                return self.nearest(point, seconds).metres;
            }
        };
        metres - self.margin
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
}

/// `apart` leads from the nearest point of an axis to the point.
fn from_axis(apart: Vec3, radius: f32) -> Nearest {
    let far = apart.length();
    Nearest {
        metres: far - radius,
        normal: apart.normalize_or(Vec3::X),
    }
}

/// `turn` is cosine and sine of the heading.
fn of_block(apart: Vec3, half: Vec3, turn: Vec2) -> Nearest {
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
fn of_polygon(point: Vec2, corners: &[Vec2]) -> Nearest {
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

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg32;

    use super::*;

    #[test]
    fn distances_are_those_of_the_nearest_points() {
        let mut random = Pcg32::seed_from_u64(3);
        let mut number = |most: f32| random.random_range(-most..most);
        for _ in 0..200 {
            let mut point = |most: f32| Vec3::new(number(most), number(most), number(most));
            let (at, to, velocity) = (point(3.0), point(3.0), point(2.0));
            let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE].map(|corner| corner + to.truncate());
            for obstacle in [
                Obstacle::half_space(at, to),
                Obstacle::block(at, Vec3::splat(0.4), to.x),
                Obstacle::capsule(at, to, 0.3),
                Obstacle::polygon(&corners),
                Obstacle::disc(at.truncate(), 0.7),
            ] {
                let obstacle = obstacle.unwrap().moving(velocity).unwrap().later(0.2, 0.05);
                for _ in 0..20 {
                    let (point, seconds) = (point(4.0), 0.7);
                    let nearest = obstacle.nearest(point, seconds);
                    assert_eq!(obstacle.distance(point, seconds), nearest.metres);
                    // The surface is that far away in that direction.
                    let surface = point - nearest.normal * nearest.metres;
                    let off = obstacle.distance(surface, seconds);
                    assert!(off.abs() < 1e-4 || nearest.metres < 0.0, "{off} m");
                }
            }
        }
    }
}
