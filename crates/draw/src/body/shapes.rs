//! Rounded shapes as distances, joined smoothly.
//!
//! Source: Quilez, "Distance functions" and "Smooth minimum" (iquilezles.org), with the polynomial minimum of the second degree.

use glam::{Quat, Vec3};

use sabaki::anim::JointId;

/// Form of a shape.
#[derive(Clone, Copy, Debug)]
pub(super) enum Form {
    /// The hull of two spheres.
    Cone { ends: [Vec3; 2], radii: [f32; 2] },
    /// An ellipsoid. The distance is exact on its surface and near along its axes.
    Ellipsoid {
        centre: Vec3,
        radii: Vec3,
        rotation: Quat,
    },
    /// A flat ring around the vertical: half axes along X and Z, and half its height.
    Belt { centre: Vec3, radii: Vec3 },
}

/// The joint that moves a shape.
#[derive(Clone, Copy, Debug)]
pub(super) enum Carrier {
    Joint(JointId),
    /// The joint of the trunk at the height of the place.
    Trunk,
}

/// A shape of a body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub(super) form: Form,
    pub(super) carrier: Carrier,
    /// Linear colour.
    pub(super) colour: Vec3,
    /// Width over which the shape blends with those before it, in metres.
    pub(super) blend: f32,
    /// Factor of a cone's depth along Z, at most 1.
    pub(super) depth: f32,
}

impl Shape {
    pub(super) fn distance(&self, place: Vec3) -> f32 {
        self.form.distance(place, self.depth) * self.depth
    }
}

impl Form {
    fn distance(&self, place: Vec3, depth: f32) -> f32 {
        match *self {
            Self::Cone { ends, radii } => {
                let along = ends[1] - ends[0];
                let share = (place - ends[0]).dot(along) / along.length_squared().max(1e-12);
                let share = share.clamp(0.0, 1.0);
                let radius = radii[0] + (radii[1] - radii[0]) * share;
                let own = place - (ends[0] + along * share);
                Vec3::new(own.x, own.y, own.z / depth).length() - radius
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
            Self::Belt { centre, radii } => {
                let own = place - centre;
                let share = Vec3::new(own.x / radii.x, 0.0, own.z / radii.z).length();
                let aside = (share - 1.0) * radii.x.min(radii.z);
                aside.max(own.y.abs() - radii.y)
            }
        }
    }

    /// Lowest and highest coordinates.
    pub(super) fn bounds(&self) -> (Vec3, Vec3) {
        match *self {
            Self::Cone { ends, radii } => {
                let low = (ends[0] - radii[0]).min(ends[1] - radii[1]);
                (low, (ends[0] + radii[0]).max(ends[1] + radii[1]))
            }
            Self::Ellipsoid { centre, radii, .. } => {
                let most = Vec3::splat(radii.max_element());
                (centre - most, centre + most)
            }
            Self::Belt { centre, radii } => (centre - radii, centre + radii),
        }
    }
}

/// A body of shapes on flat soles.
pub(super) struct Shapes {
    pub(super) all: Vec<Shape>,
    /// Height of the soles, in metres. The body ends there.
    pub(super) sole: f32,
}

impl Shapes {
    pub(super) fn distance(&self, place: Vec3) -> f32 {
        joined(&self.all, place).max(self.sole - place.y)
    }

    /// Outward unit normal of the surface near a place.
    pub(super) fn normal(&self, place: Vec3, step: f32) -> Vec3 {
        let slope =
            |axis: Vec3| self.distance(place + axis * step) - self.distance(place - axis * step);
        Vec3::new(slope(Vec3::X), slope(Vec3::Y), slope(Vec3::Z)).normalize_or(Vec3::Y)
    }

    /// The shape that is nearest to a place.
    pub(super) fn nearest(&self, place: Vec3) -> &Shape {
        let mut best = (f32::MAX, 0);
        for (index, shape) in self.all.iter().enumerate() {
            let distance = shape.distance(place);
            if distance < best.0 {
                best = (distance, index);
            }
        }
        &self.all[best.1]
    }

    pub(super) fn colour(&self, place: Vec3) -> Vec3 {
        self.nearest(place).colour
    }

    pub(super) fn bounds(&self) -> (Vec3, Vec3) {
        let bounds = self.all.iter().map(|shape| shape.form.bounds());
        let whole = bounds.fold((Vec3::MAX, Vec3::MIN), |(low, high), (a, b)| {
            (low.min(a), high.max(b))
        });
        (whole.0 - 0.05, whole.1 + 0.05)
    }
}

/// Distance of a place to shapes that are joined smoothly, one after the other.
pub(super) fn joined(shapes: &[Shape], place: Vec3) -> f32 {
    shapes.iter().fold(f32::MAX, |before, shape| {
        smooth_min(before, shape.distance(place), shape.blend)
    })
}

fn smooth_min(a: f32, b: f32, width: f32) -> f32 {
    let near = (width - (a - b).abs()).max(0.0) / width;
    a.min(b) - 0.25 * near * near * width
}
