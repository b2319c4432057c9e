use serde::Serialize;

use super::FitSettings;
use super::surface::Surface;

/// Quality of a fit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FitReport {
    /// Quality for each joint with spheres, in the skeleton's order.
    pub joints: Vec<JointFit>,
    /// Maximum distance of any place on the mesh from the nearest measured point, in metres.
    pub spacing: f32,
    /// Share of the points at which the mesh separates inside from outside. It is near 1 for a
    /// closed skin, smaller if parts intersect, and 0 for sheets, whose spheres lie on them.
    pub border: f32,
}

/// Quality of a joint's spheres, in metres.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct JointFit {
    /// Name of the joint.
    pub joint: String,
    /// Number of vertices that move with the joint.
    pub vertices: usize,
    /// Number of points at which the errors are measured.
    pub points: usize,
    /// Number of spheres.
    pub spheres: usize,
    /// Maximum distance by which the mesh sticks out of the joint's spheres.
    pub mesh_out_max: f32,
    /// Mean of that distance over the points. Points inside the spheres count as 0.
    pub mesh_out_mean: f32,
    /// Maximum distance by which the spheres stick out of the whole mesh, sampled on their
    /// surfaces.
    pub spheres_out_max: f32,
    /// Mean of that distance over the samples outside the joint's other spheres. Samples inside the
    /// mesh count as 0.
    pub spheres_out_mean: f32,
    /// Whether the number of spheres was too small to reach the wanted error.
    pub limited: bool,
}

/// Maximum and mean of a distance.
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

impl JointFit {
    /// Describes the fit if it misses the settings by far: the spheres stick out by more than twice the bulge and `spacing`,
    /// or the mesh by more than twice the cover and `spacing`.
    #[must_use]
    pub fn misfit(&self, settings: &FitSettings, spacing: f32) -> Option<String> {
        let sides = [
            (
                "the spheres stick out of the mesh",
                self.spheres_out_max,
                settings.bulge,
            ),
            (
                "the mesh sticks out of the spheres",
                self.mesh_out_max,
                settings.cover,
            ),
        ];
        let wide = sides
            .into_iter()
            .filter(|&(_, found, wanted)| found > 2.0 * wanted + spacing);
        let words: Vec<String> = wide
            .map(|(what, found, wanted)| {
                format!(
                    "{what} by {:.0} mm, {:.0} mm is wanted",
                    found * 1e3,
                    wanted * 1e3
                )
            })
            .collect();
        (!words.is_empty()).then(|| format!("joint \"{}\": {}", self.joint, words.join("; ")))
    }
}

impl FitReport {
    /// The joints whose fit misses the settings by far, one line each.
    #[must_use]
    pub fn misfits(&self, settings: &FitSettings) -> Vec<String> {
        let joints = self.joints.iter();
        joints
            .filter_map(|joint| joint.misfit(settings, self.spacing))
            .collect()
    }

    pub(super) fn of(surface: &Surface) -> Self {
        let border = surface.border.order.len() as f32 / surface.places.len().max(1) as f32;
        Self {
            joints: Vec::new(),
            spacing: surface.spacing,
            border,
        }
    }

    /// Summary of all joints: sums of counts, maxima of maxima, and means weighted by points and
    /// spheres.
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
