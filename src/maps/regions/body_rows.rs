//! The body's spheres as rows of numbers, for the inner loop of the exact test.

use glam::{Mat3, Vec2, Vec3, Vec3Swizzles};

use super::body::{Body, BodySphere};
use crate::anim::{JointTransform, Leg, Pose, Skeleton, forward_kinematics};
use crate::graph::MotionGraph;
use crate::graph::push;
use crate::math::in_parallel;

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
    pub(crate) fn with_legs(mut self, body: &Body, skeleton: &Skeleton, legs: &[Leg]) -> Self {
        let share = |sphere: &BodySphere| {
            let carries = |leg: &&Leg| skeleton.carries(leg.hip, sphere.joint);
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
    pub(crate) fn knee_shares(&self) -> &[f32] {
        &self.knee_shares
    }

    /// Share of each sphere in the body's mass, without padding.
    pub(crate) fn masses(&self) -> &[f32] {
        &self.masses
    }

    /// Radii of the spheres, with padding, in metres.
    pub(crate) fn radii(&self) -> &[f32] {
        &self.radii
    }

    /// Centre of mass of a body whose centres [`BodyRows::push`] wrote to `rows`.
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
        let (rows, [x, y, z]) = (&mut rows[start..], &self.offsets);
        for bone in &self.bones {
            let joint = &joints[bone.joint];
            let [a, b, c] = Mat3::from_quat(joint.rotation).to_cols_array_2d();
            for at in bone.first..bone.end {
                for axis in 0..3 {
                    let along = a[axis] * x[at] + b[axis] * y[at];
                    rows[axis * row + at] = along + c[axis] * z[at] + joint.translation[axis];
                }
            }
        }
    }
}

/// Horizontal accelerations of a body's centre of mass in all clips of a graph, in metres per second squared.
pub(crate) fn pushes(graph: &MotionGraph, body: &Body, threads: usize) -> Vec<f32> {
    let rows = BodyRows::new(body);
    let of_clips = in_parallel(threads, graph.clips().len(), |index| {
        let clip = &graph.clips()[index];
        let (mut pose, mut joints, mut axes) = (Pose::default(), Vec::new(), Vec::new());
        let centre = |frame| {
            clip.pose(frame, &mut pose);
            forward_kinematics(graph.skeleton(), &pose, &mut joints);
            axes.clear();
            rows.push(&joints, &mut axes);
            rows.centre_of_mass(&axes).xz()
        };
        let centres: Vec<Vec2> = graph.own_frames(index).map(centre).collect();
        push::pushes(&centres, graph.frame_rate())
    });
    of_clips.concat()
}
