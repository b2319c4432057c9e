//! The body's spheres as rows of numbers, for the inner loop of the exact test.

use glam::Vec3;

use super::body::{Body, BodySphere};
use crate::anim::{JointTransform, Leg, Skeleton};
use crate::math::Isa;

/// Number of spheres that are transformed together.
const LANES: usize = 8;

/// The spheres of a body, sorted by bone, with one row for each axis. Rows are padded with copies
/// of the last sphere to a multiple of [`BodyTrack::LANES`](super::track::BodyTrack::LANES).
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct BodyRows {
    spheres: usize,
    bones: Vec<Bone>,
    /// Centres of the spheres in their joints' frames: x, y, z.
    offsets: [Vec<f32>; 3],
    radii: Vec<f32>,
    /// Share of each sphere in the body's mass, without padding.
    masses: Vec<f32>,
    /// [`BodyRows::knee_shares`].
    knee_shares: Vec<f32>,
}

/// Consecutive spheres of one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bone {
    joint: usize,
    first: usize,
    end: usize,
}

impl BodyRows {
    /// Row lengths are multiples of this number.
    pub(super) const ROW_LANES: usize = 16;

    /// Creates the rows of a body.
    #[must_use]
    pub(crate) fn new(body: &Body) -> Self {
        let spheres = body.spheres.len();
        let row = spheres.next_multiple_of(Self::ROW_LANES);
        let padded = |value: &dyn Fn(&BodySphere) -> f32| {
            let mut values: Vec<f32> = body.spheres.iter().map(value).collect();
            values.resize(row, values.last().copied().unwrap_or(0.0));
            values
        };
        let mut bones: Vec<Bone> = Vec::new();
        for (index, sphere) in body.spheres.iter().enumerate() {
            match bones.last_mut() {
                Some(last) if last.joint == sphere.joint.index() => last.end = index + 1,
                _ => bones.push(Bone {
                    joint: sphere.joint.index(),
                    first: index,
                    end: index + 1,
                }),
            }
        }
        // Padding moves with the last sphere's joint.
        if let Some(last) = bones.last_mut() {
            last.end = row;
        }
        Self {
            spheres,
            bones,
            offsets: [
                padded(&|sphere| sphere.offset.x),
                padded(&|sphere| sphere.offset.y),
                padded(&|sphere| sphere.offset.z),
            ],
            radii: padded(&|sphere| sphere.radius),
            masses: body.masses(),
            knee_shares: vec![0.0; row],
        }
    }

    /// Finds the spheres of the legs.
    #[must_use]
    pub(crate) fn with_legs(mut self, body: &Body, skeleton: &Skeleton, legs: &[Leg]) -> Self {
        let share = |sphere: &BodySphere| {
            let carries = |leg: &&Leg| skeleton.ancestry(sphere.joint).any(|id| id == leg.hip);
            let Some(leg) = legs.iter().find(carries) else {
                return 0.0;
            };
            let below_hip = skeleton.ancestry(leg.knee).take_while(|&id| id != leg.hip);
            let thigh = below_hip.map(|id| skeleton.joints()[id.index()].offset);
            match sphere.joint == leg.hip {
                true => sphere.offset.length() / thigh.map(Vec3::length).sum::<f32>(),
                false => 1.0,
            }
        };
        let shares = body.spheres.iter().map(share);
        for (at, share) in self.knee_shares.iter_mut().zip(shares) {
            *at = share.min(1.0);
        }
        let last = self.spheres.checked_sub(1).map(|at| self.knee_shares[at]);
        self.knee_shares[self.spheres..].fill(last.unwrap_or(0.0));
        self
    }

    /// How far each sphere moves if a leg is bent, as a share of the most that knee or foot move, padded: 0 above the legs.
    #[must_use]
    pub(crate) fn knee_shares(&self) -> &[f32] {
        &self.knee_shares
    }

    /// Share of each sphere in the body's mass, without padding.
    #[must_use]
    pub(crate) fn masses(&self) -> &[f32] {
        &self.masses
    }

    /// Radii of the spheres, with padding, in metres.
    #[must_use]
    pub(crate) fn radii(&self) -> &[f32] {
        &self.radii
    }

    /// Centre of mass of a body whose centres [`BodyRows::push`] wrote to `rows`.
    #[must_use]
    pub(crate) fn centre_of_mass(&self, rows: &[f32]) -> Vec3 {
        let mut axes = rows.chunks_exact(self.radii.len());
        let mut along = || {
            let places = axes.next().unwrap_or_default().iter();
            let moments = places.zip(&self.masses).map(|(place, mass)| place * mass);
            moments.sum()
        };
        Vec3::new(along(), along(), along())
    }

    /// Appends the x, then the y, then the z coordinates of all centres, in the space of `joints`.
    pub(crate) fn push(&self, joints: &[JointTransform], rows: &mut Vec<f32>) {
        let (start, row) = (rows.len(), self.radii.len());
        rows.resize(start + 3 * row, 0.0);
        let (x, rest) = rows[start..].split_at_mut(row);
        let (y, z) = rest.split_at_mut(row);
        Isa::best().run(
            #[inline(always)]
            || {
                for bone in &self.bones {
                    self.place(bone, &joints[bone.joint], [&mut *x, &mut *y, &mut *z]);
                }
            },
        );
    }

    /// Transforms a bone's spheres, a whole vector at a time. The last vector may also write
    /// spheres of later bones, which those bones overwrite afterwards.
    #[inline(always)]
    fn place(&self, bone: &Bone, joint: &JointTransform, mut out: [&mut [f32]; 3]) {
        let [a, b, c] = glam::Mat3::from_quat(joint.rotation).to_cols_array_2d();
        let columns = [a, b, c, joint.translation.to_array()];
        let row = self.radii.len();
        for first in (bone.first..bone.end).step_by(LANES) {
            let end = (first + LANES).min(row);
            if end - first < LANES {
                self.place_one_by_one(first..end, columns, out);
                return;
            }
            let [x, y, z] = &self.offsets;
            let (x, y, z) = (lanes(x, first), lanes(y, first), lanes(z, first));
            for (axis, row) in out.iter_mut().enumerate() {
                let factors = columns.map(|column| column[axis]);
                let mut placed = [0.0; LANES];
                for lane in 0..LANES {
                    let along = factors[0] * x[lane] + factors[1] * y[lane];
                    placed[lane] = along + factors[2] * z[lane] + factors[3];
                }
                row[first..end].copy_from_slice(&placed);
            }
        }
    }

    /// Transforms some spheres by the columns of a joint's matrix.
    #[inline(always)]
    fn place_one_by_one(
        &self,
        spheres: std::ops::Range<usize>,
        columns: [[f32; 3]; 4],
        out: [&mut [f32]; 3],
    ) {
        let [x, y, z] = &self.offsets;
        for index in spheres {
            for axis in 0..3 {
                let along = columns[0][axis] * x[index] + columns[1][axis] * y[index];
                out[axis][index] = along + columns[2][axis] * z[index] + columns[3][axis];
            }
        }
    }
}

#[inline(always)]
fn lanes(values: &[f32], first: usize) -> [f32; LANES] {
    let mut lanes = [0.0; LANES];
    lanes.copy_from_slice(&values[first..first + LANES]);
    lanes
}
