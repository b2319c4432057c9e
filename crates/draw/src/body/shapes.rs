//! Rounded shapes as distances, joined smoothly, and what they give a place on their surface: normal, colour and bones.
//!
//! Source: Quilez, "Distance functions" and "Smooth minimum" (iquilezles.org), with the polynomial minimum of the second degree.

use std::collections::BTreeMap;

use glam::{Quat, Vec3};

use sabaki::anim::JointId;
use sabaki::math::smooth_step;

#[derive(Clone, Copy, Debug)]
pub(super) enum Form {
    /// The hull of two spheres. `depth` is a factor of its size along Z, at most 1.
    Cone {
        ends: [Vec3; 2],
        radii: [f32; 2],
        depth: f32,
    },
    /// An ellipsoid. The distance is exact on its surface and near along its axes.
    Ellipsoid {
        centre: Vec3,
        radii: Vec3,
        rotation: Quat,
    },
    /// A flat ring around the vertical: half axes along X and Z, and half its height.
    Ring { centre: Vec3, radii: Vec3 },
}

impl Form {
    pub(super) fn distance(&self, place: Vec3) -> f32 {
        match *self {
            Self::Cone { ends, radii, depth } => {
                let along = ends[1] - ends[0];
                let share = (place - ends[0]).dot(along) / along.length_squared().max(1e-12);
                let share = share.clamp(0.0, 1.0);
                let radius = radii[0] + (radii[1] - radii[0]) * share;
                let own = place - (ends[0] + along * share);
                (own.with_z(own.z / depth).length() - radius) * depth
            }
            Self::Ellipsoid {
                centre,
                radii,
                rotation,
            } => {
                let own = rotation.conjugate() * (place - centre);
                let (near, far) = ((own / radii).length(), (own / (radii * radii)).length());
                if far < 1e-6 {
                    return -radii.min_element();
                }
                near * (near - 1.0) / far
            }
            Self::Ring { centre, radii } => {
                let own = (place - centre) / radii;
                let aside = (own.with_y(0.0).length() - 1.0) * radii.x.min(radii.z);
                aside.max((own.y.abs() - 1.0) * radii.y)
            }
        }
    }
}

/// The joint that moves a shape.
#[derive(Clone, Copy, Debug)]
pub(super) enum Carrier {
    Joint(JointId),
    /// The joints of the trunk at the height of the place.
    Trunk,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub(super) form: Form,
    pub(super) carrier: Carrier,
    /// Number of the limb that the shape belongs to; 0 is the trunk. The joints of one limb do not move the surface of another.
    pub(super) limb: u32,
    /// Linear colour.
    pub(super) colour: Vec3,
    /// Width over which the shape blends with those before it, in metres.
    pub(super) blend: f32,
}

/// A body of shapes on flat soles.
pub(super) struct Shapes {
    pub(super) all: Vec<Shape>,
    /// Height of the soles, in metres. The body ends there.
    pub(super) sole: f32,
    /// Joints of the trunk and their heights, lowest first.
    pub(super) trunk: Vec<(JointId, f32)>,
    /// Joints of the hips and shoulders, which rotate furthest.
    pub(super) wide: [Vec3; 4],
    /// Height of the body, in metres.
    pub(super) height: f32,
}

/// Distance over which joints share a surface, as a share of the height; then the distance at the hips and shoulders, and how far around these
/// it is greater.
const SPREAD: f32 = 0.010;
const WIDE: f32 = 0.015;
const REACH: f32 = 0.12;

impl Shapes {
    pub(super) fn distance(&self, place: Vec3) -> f32 {
        let joined = self.all.iter().fold(f32::MAX, |before, shape| {
            smooth_min(before, shape.form.distance(place), shape.blend)
        });
        joined.max(self.sole - place.y)
    }

    /// Outward unit normal of the surface near a place.
    pub(super) fn normal(&self, place: Vec3, step: f32) -> Vec3 {
        let slope =
            |axis: Vec3| self.distance(place + axis * step) - self.distance(place - axis * step);
        Vec3::new(slope(Vec3::X), slope(Vec3::Y), slope(Vec3::Z)).normalize_or(Vec3::Y)
    }

    /// The shape that is nearest to a place, and its distance.
    pub(super) fn nearest(&self, place: Vec3) -> (&Shape, f32) {
        let mut best = (&self.all[0], f32::MAX);
        for shape in &self.all {
            let distance = shape.form.distance(place);
            if distance < best.1 {
                best = (shape, distance);
            }
        }
        best
    }

    /// Four bones that move a place on the surface, and their weights, which add up to 65,535: the nearer the shapes of a joint are, the more it
    /// weighs.
    pub(super) fn weights(&self, place: Vec3) -> ([u16; 4], [u16; 4]) {
        let (own, least) = self.nearest(place);
        let apart = self.wide.iter().map(|joint| joint.distance(place));
        let apart = apart.fold(f32::MAX, f32::min) / (REACH * self.height);
        let near = smooth_step(2.0 * (1.0 - apart));
        let spread = (SPREAD + (WIDE - SPREAD) * near) * self.height;
        let mut weights: BTreeMap<u16, f32> = BTreeMap::new();
        for shape in &self.all {
            if own.limb != 0 && shape.limb != 0 && own.limb != shape.limb {
                continue;
            }
            let weight = ((least - shape.form.distance(place)) / spread).exp();
            let mut add = |joint: JointId, weight: f32| {
                let known = weights.entry(joint.0).or_default();
                *known = known.max(weight);
            };
            match shape.carrier {
                Carrier::Joint(joint) => add(joint, weight),
                Carrier::Trunk => {
                    let shares = self.trunk_shares(place.y);
                    shares.for_each(|(joint, share)| add(joint, weight * share));
                }
            }
        }
        let mut sorted: Vec<(u16, f32)> = weights.into_iter().collect();
        sorted.sort_by(|a, b| b.1.total_cmp(&a.1));
        sorted.truncate(4);
        let sum: f32 = sorted.iter().map(|(_, weight)| weight).sum();
        let (mut joints, mut whole) = ([0; 4], [0u16; 4]);
        for (slot, (joint, weight)) in sorted.into_iter().enumerate() {
            joints[slot] = joint;
            whole[slot] = (weight / sum * 65_535.0) as u16;
        }
        let rest = u32::from(u16::MAX) - whole.iter().map(|&part| u32::from(part)).sum::<u32>();
        whole[0] += rest as u16;
        (joints, whole)
    }

    /// Shares of the trunk's joints in a height. A joint moves what is between it and the next one.
    fn trunk_shares(&self, height: f32) -> impl Iterator<Item = (JointId, f32)> + '_ {
        let above = move |index: usize| match self.trunk.get(index) {
            _ if index == 0 => 1.0,
            Some((_, bottom)) => smooth_step((height - bottom) / (0.05 * self.height) + 0.5),
            None => 0.0,
        };
        let joints = self.trunk.iter().enumerate();
        joints.map(move |(index, (joint, _))| (*joint, above(index) - above(index + 1)))
    }
}

fn smooth_min(a: f32, b: f32, width: f32) -> f32 {
    let near = (width - (a - b).abs()).max(0.0) / width;
    a.min(b) - 0.25 * near * near * width
}
