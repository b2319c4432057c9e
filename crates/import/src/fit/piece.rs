//! The part of a mesh that moves with one joint, and the balls that represent it.

use std::f32::consts::PI;

use glam::Vec3;

use super::cover::Cover;
use super::medial::{self, Ball, Limits};
use super::mesh::Mesh;
use super::report::{JointFit, Misfit};
use super::settings::FitSettings;
use super::surface::Surface;
use sabaki::anim::JointId;

/// Maximum number of candidate balls for each joint.
const CANDIDATES: usize = 384;
/// Number of points on a sphere at which its distance outside the mesh is measured.
const PROBES: usize = 96;

/// Points of a surface that belong to one joint.
pub(super) struct Piece {
    joint: JointId,
    /// Indices of the points in the surface.
    pub points: Vec<u32>,
    places: Vec<Vec3>,
}

impl Piece {
    pub(super) fn of(surface: &Surface, joint: JointId) -> Self {
        let own = |point: &u32| surface.joints[*point as usize] == joint;
        let points: Vec<u32> = surface.tree.order.iter().copied().filter(own).collect();
        let places = points
            .iter()
            .map(|&point| surface.places[point as usize])
            .collect();
        Self {
            joint,
            points,
            places,
        }
    }

    /// Number of the mesh's vertices that belong to the piece.
    pub(super) fn vertices(&self, mesh: &Mesh, joints: &[JointId]) -> usize {
        let mut own = vec![false; joints.len()];
        for &vertex in mesh.triangles().iter().flatten() {
            own[vertex as usize] = joints[vertex as usize] == self.joint;
        }
        own.into_iter().filter(|&own| own).count()
    }

    /// Finds few balls that cover the piece, in the space of the mesh.
    pub(super) fn fit(&self, surface: &Surface, settings: &FitSettings) -> Vec<Ball> {
        let (low, high) = self.places.iter().fold(
            (Vec3::INFINITY, Vec3::NEG_INFINITY),
            |(low, high), &place| (low.min(place), high.max(place)),
        );
        // Limit the radius, because a ball could grow without bound where the mesh is open.
        let limits = Limits {
            largest: low.distance(high).max(settings.cover),
            inside: 0.5 * settings.bulge,
        };
        let grown = |point: u32| {
            let ball = medial::ball(surface, point as usize, limits);
            Ball {
                radius: ball.radius + settings.bulge - limits.inside,
                ..ball
            }
        };
        let on_border = |&point: &u32| surface.normals[point as usize] != Vec3::ZERO;
        let mut seeds: Vec<u32> = self.points.iter().copied().filter(on_border).collect();
        if seeds.is_empty() {
            seeds.clone_from(&self.points);
        }
        let cover = Cover {
            points: &self.places,
            // The points are in the order of the tree, so each range of it is local.
            balls: seeds
                .iter()
                .step_by(seeds.len().div_ceil(CANDIDATES))
                .map(|&p| grown(p))
                .collect(),
            allowed: settings.cover,
            most: settings.most_spheres,
        };
        cover.choose(|point| grown(self.points[point]))
    }

    /// Measures how far the mesh and the balls stick out of each other.
    pub(super) fn measure(
        &self,
        surface: &Surface,
        balls: &[Ball],
        settings: &FitSettings,
    ) -> JointFit {
        let (mut mesh_out, mut spheres_out) = (Misfit::default(), Misfit::default());
        for &place in &self.places {
            let out = balls
                .iter()
                .map(|ball| ball.distance(place))
                .fold(f32::INFINITY, f32::min);
            mesh_out.add(out.max(0.0));
        }
        for (index, ball) in balls.iter().enumerate() {
            for probe in 0..PROBES {
                let place = ball.centre + ball.radius * direction(probe);
                let others = balls
                    .iter()
                    .enumerate()
                    .filter(|&(other, _)| other != index);
                if others
                    .into_iter()
                    .all(|(_, other)| other.distance(place) >= 0.0)
                {
                    spheres_out.add(surface.outside(place));
                }
            }
        }
        JointFit {
            joint: String::new(),
            vertices: 0,
            points: self.places.len(),
            spheres: balls.len(),
            mesh_out_max: mesh_out.max,
            mesh_out_mean: mesh_out.mean(),
            spheres_out_max: spheres_out.max,
            spheres_out_mean: spheres_out.mean(),
            limited: mesh_out.max > settings.cover + 1e-5,
        }
    }
}

/// Points distributed evenly on the unit sphere by the golden angle.
fn direction(index: usize) -> Vec3 {
    let y = 1.0 - (2 * index + 1) as f32 / PROBES as f32;
    let turn = index as f32 * PI * (3.0 - 5.0_f32.sqrt());
    let around = (1.0 - y * y).sqrt();
    Vec3::new(around * turn.cos(), y, around * turn.sin())
}
