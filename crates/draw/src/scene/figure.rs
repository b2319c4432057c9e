//! What a body looks like: capsules on its bones, a little inside of the spheres that attacks are held against.

use glam::Vec3;

use super::Capsule;
use sabaki::anim::{JointId, JointKind, JointTransform, Skeleton};
use sabaki::maps::Body;

/// Colours of a body, linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Trunk, and the upper parts of arms and legs.
    pub clothes: Vec3,
    /// Head, hands and feet.
    pub skin: Vec3,
    /// On the head, and around the hips.
    pub dark: Vec3,
    /// What is held.
    pub held: Vec3,
}

impl Default for Look {
    fn default() -> Self {
        Self {
            clothes: Vec3::new(0.84, 0.83, 0.80),
            skin: Vec3::new(0.72, 0.47, 0.34),
            dark: Vec3::new(0.045, 0.05, 0.075),
            held: Vec3::new(0.35, 0.22, 0.12),
        }
    }
}

/// A capsule between two joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FigurePart {
    /// The joints of its ends.
    pub joints: [JointId; 2],
    /// The ends in their joints' frames, metres.
    pub ends: [Vec3; 2],
    /// Radii of the ends, metres.
    pub radii: [f32; 2],
    /// Linear.
    pub colour: Vec3,
}

/// A body as it is drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figure {
    /// In the order of their bones.
    pub parts: Vec<FigurePart>,
}

/// Which part of a body a bone is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Head,
    Neck,
    Trunk,
    Girdle,
    Limb,
    /// The last bone but one of a limb: forearm or shin.
    Lower,
    /// Hand or foot.
    End,
}

impl Figure {
    /// A body's capsules. No part sticks out of the body's own spheres by more than what lies between two of them.
    #[must_use]
    pub fn of(skeleton: &Skeleton, body: &Body, look: &Look) -> Self {
        let mut parts = Vec::new();
        for id in skeleton.ids().skip(1) {
            let joint = skeleton.joint(id);
            let Some(parent) = joint.parent.filter(|_| joint.offset.length() > 1e-3) else {
                continue;
            };
            let radius = radius(body, parent, joint.offset);
            bone(
                &mut parts,
                look,
                Bone {
                    skeleton,
                    parent,
                    id,
                    radius,
                },
            );
        }
        for prop in &body.props {
            for sphere in prop.body_spheres() {
                parts.push(FigurePart {
                    joints: [sphere.joint; 2],
                    ends: [sphere.offset; 2],
                    radii: [sphere.radius; 2],
                    colour: look.held,
                });
            }
        }
        Self { parts }
    }

    /// The capsules of a posture.
    pub fn capsules(&self, joints: &[JointTransform], alpha: f32, out: &mut Vec<Capsule>) {
        out.extend(self.parts.iter().map(|part| {
            let end = |side: usize| {
                let joint = &joints[part.joints[side].index()];
                (joint.point(part.ends[side]), part.radii[side])
            };
            Capsule::new(end(0), end(1), part.colour.extend(alpha).to_array())
        }));
    }

    /// The same in one colour.
    #[must_use]
    pub fn coloured(mut self, colour: Vec3) -> Self {
        self.parts.iter_mut().for_each(|part| part.colour = colour);
        self
    }
}

struct Bone<'a> {
    skeleton: &'a Skeleton,
    parent: JointId,
    id: JointId,
    radius: f32,
}

/// The radius of the body around a bone: that of the sphere nearest to its middle.
fn radius(body: &Body, joint: JointId, bone: Vec3) -> f32 {
    let of_joint = body.spheres.iter().filter(|sphere| sphere.joint == joint);
    let nearest = of_joint.min_by(|a, b| {
        let away = |offset: Vec3| offset.distance_squared(0.5 * bone);
        away(a.offset).total_cmp(&away(b.offset))
    });
    nearest.map_or(0.05, |sphere| sphere.radius)
}

fn kind(skeleton: &Skeleton, parent: JointId, id: JointId) -> Kind {
    let sided = |id| skeleton.mirror(id).is_some();
    let ends = |id: JointId| skeleton.joint(id).kind == JointKind::EndSite;
    let leads = |id: JointId| {
        let mut limbs = skeleton.ids().filter(|&limb| sided(limb));
        limbs.any(|limb| skeleton.ancestry(limb).any(|joint| joint == id))
    };
    let next_ends = || skeleton.children(id).any(ends);
    match (sided(parent), sided(id)) {
        (false, false) if ends(id) => Kind::Head,
        (false, false) if leads(id) => Kind::Trunk,
        (false, false) => Kind::Neck,
        (false, true) => Kind::Girdle,
        _ if ends(id) => Kind::End,
        _ if next_ends() => Kind::Lower,
        _ => Kind::Limb,
    }
}

fn bone(parts: &mut Vec<FigurePart>, look: &Look, bone: Bone<'_>) {
    let Bone {
        skeleton,
        parent,
        id,
        radius,
    } = bone;
    let offset = skeleton.joint(id).offset;
    let mut part = |from: f32, to: f32, radii: [f32; 2], colour| {
        parts.push(FigurePart {
            joints: [parent; 2],
            ends: [offset * from, offset * to],
            radii: radii.map(|share| share * radius),
            colour,
        });
    };
    match kind(skeleton, parent, id) {
        Kind::Head => {
            part(0.28, 0.62, [0.70, 0.80], look.skin);
            let back = Vec3::new(0.0, 0.04, -0.14) * radius;
            parts.push(FigurePart {
                joints: [parent; 2],
                ends: [offset * 0.58 + back, offset * 0.66 + back],
                radii: [0.76 * radius, 0.80 * radius],
                colour: look.dark,
            });
        }
        Kind::Neck => part(0.0, 1.0, [0.8, 0.75], look.skin),
        Kind::Trunk => {
            let belt = parent == JointId::ROOT;
            part(0.0, 1.0, [0.96, 0.92], look.clothes);
            if belt {
                part(0.12, 0.30, [0.99, 0.99], look.dark);
            }
        }
        Kind::Girdle => part(0.0, 1.0, [0.9, 0.85], look.clothes),
        Kind::Limb => part(0.0, 1.0, [1.0, 0.82], look.clothes),
        Kind::Lower => part(0.0, 1.0, [0.84, 0.62], look.clothes),
        Kind::End => part(0.0, 1.0, [1.0, 0.95], look.skin),
    }
}
