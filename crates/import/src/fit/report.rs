use serde::Serialize;

use super::surface::Surface;

/// How well spheres stand for a mesh.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FitReport {
    /// For each joint that has spheres, in the skeleton's order.
    pub joints: Vec<JointFit>,
    /// All figures are measured on points; no place on the mesh is further than this from all of them, metres.
    pub spacing: f32,
    /// Share of the points at which the mesh is the border between inside and outside: near 1 for a closed skin, less where parts reach
    /// into one another, 0 for sheets, whose spheres stand on them.
    pub border: f32,
}

/// How well a joint's spheres stand for what of the mesh moves with it. Metres.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct JointFit {
    /// Name of the joint.
    pub joint: String,
    /// Of the mesh, that move with it.
    pub vertices: usize,
    /// On vertices and triangles, at which the figures are measured.
    pub points: usize,
    /// How many.
    pub spheres: usize,
    /// The most that the mesh sticks out of the joint's spheres.
    pub mesh_out_max: f32,
    /// The mean of that over the points, 0 where it does not.
    pub mesh_out_mean: f32,
    /// The most that the spheres stick out of the whole mesh, sampled on their surface.
    pub spheres_out_max: f32,
    /// The mean of that over the samples that lie in no other sphere of the joint, 0 where they do not.
    pub spheres_out_mean: f32,
    /// The spheres that are allowed did not do: the mesh sticks out by more than is wished.
    pub limited: bool,
}

/// A maximum and a mean.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Misfit {
    pub(super) max: f32,
    sum: f64,
    count: u32,
}

impl Misfit {
    pub(super) fn add(&mut self, metres: f32) {
        self.max = self.max.max(metres);
        self.sum += f64::from(metres);
        self.count += 1;
    }

    pub(super) fn mean(&self) -> f32 {
        (self.sum / f64::from(self.count.max(1))) as f32
    }
}

impl FitReport {
    pub(super) fn of(surface: &Surface<'_>) -> Self {
        let border = surface.border.order.len() as f32 / surface.places.len().max(1) as f32;
        Self {
            joints: Vec::new(),
            spacing: surface.spacing,
            border,
        }
    }

    /// Sums of all joints' counts, largest of their maxima, means by points and spheres.
    #[must_use]
    pub fn worst(&self) -> JointFit {
        let mut all = JointFit {
            joint: "all".to_owned(),
            ..JointFit::default()
        };
        for fit in &self.joints {
            all.vertices += fit.vertices;
            all.points += fit.points;
            all.spheres += fit.spheres;
            all.mesh_out_max = all.mesh_out_max.max(fit.mesh_out_max);
            all.spheres_out_max = all.spheres_out_max.max(fit.spheres_out_max);
            all.mesh_out_mean += fit.mesh_out_mean * fit.points as f32;
            all.spheres_out_mean += fit.spheres_out_mean * fit.spheres as f32;
            all.limited |= fit.limited;
        }
        all.mesh_out_mean /= all.points.max(1) as f32;
        all.spheres_out_mean /= all.spheres.max(1) as f32;
        all
    }
}
