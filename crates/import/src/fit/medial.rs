//! Finds the largest ball inside a mesh that touches it at a given point.
//!
//! Source: Ma, Bae & Choi, "3D Medial Axis Point Approximation Using Nearest Neighbors and the
//! Normal Field" (2012). A large ball that touches the point is shrunk until no other surface point
//! is inside. Differs: other points may lie inside by a tolerance. Otherwise the edges between the
//! flat triangles of a round limb would keep nearly all balls small.

use glam::Vec3;

use super::surface::Surface;

/// A ball in the space of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ball {
    pub centre: Vec3,
    pub radius: f32,
}

impl Ball {
    /// Distance from the ball's surface to a place, negative inside.
    pub(super) fn distance(&self, place: Vec3) -> f32 {
        self.centre.distance(place) - self.radius
    }
}

/// Limits of a ball.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Maximum radius, in metres.
    pub largest: f32,
    /// Maximum depth of points inside the ball, in metres.
    pub inside: f32,
}

/// Largest ball that touches the surface at a point. On an inner wall it is the largest ball around
/// the point; on a sheet its radius is 0.
pub(super) fn ball(surface: &Surface, point: usize, limits: Limits) -> Ball {
    /// Maximum number of steps. Each step shrinks the ball to one more point; a few suffice.
    const MOST_STEPS: usize = 64;
    let (place, normal) = (surface.places[point], surface.normals[point]);
    if normal == Vec3::ZERO {
        let border = surface.border.nearest(&surface.places, place);
        let deep = border.filter(|_| surface.is_inner[point]);
        let radius = deep.map_or(0.0, |(_, squared)| squared.sqrt().min(0.5 * limits.largest));
        return Ball {
            centre: place,
            radius,
        };
    }
    let mut radius = limits.largest;
    for _ in 0..MOST_STEPS {
        let centre = place - radius * normal;
        let Some((other, squared)) = surface.border.nearest(&surface.places, centre) else {
            break;
        };
        if squared.sqrt() >= radius - limits.inside {
            break;
        }
        let across = place - surface.places[other as usize];
        let depth = across.dot(normal);
        let smaller = across.length_squared() / (2.0 * depth);
        if !(depth > 0.0 && smaller < radius) {
            break;
        }
        radius = smaller;
    }
    Ball {
        centre: place - radius * normal,
        radius,
    }
}
