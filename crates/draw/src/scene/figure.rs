//! Appearance of a body: capsules on its bones, slightly inside the spheres that attacks are tested
//! against.

use std::sync::Arc;

use glam::Vec3;

use super::{Capsule, Shot, Skin, SkinnedBody};
use sabaki::anim::{JointId, JointKind, JointTransform, Skeleton};
use sabaki::maps::{BakedGraph, Body};
use sabaki::math::Sphere;

/// Linear colours of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Colour of the trunk and of the upper arms and legs.
    pub clothes: Vec3,
    /// Colour of head, hands and feet.
    pub skin: Vec3,
    /// Colour of the hair and the belt.
    pub dark: Vec3,
    /// Colour of props.
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
    /// Joints at the ends.
    pub joints: [JointId; 2],
    /// Positions of the ends in their joints' frames, in metres.
    pub ends: [Vec3; 2],
    /// Radii of the ends, in metres.
    pub radii: [f32; 2],
    /// Linear colour.
    pub colour: Vec3,
}

/// Parts of a body that are drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figure {
    /// Parts, in the order of their bones.
    pub parts: Vec<FigurePart>,
}

/// Part of the body that a bone belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Head,
    Neck,
    Trunk,
    Girdle,
    Limb,
    /// Second-to-last bone of a limb: forearm or shin.
    Lower,
    /// Hand or foot.
    End,
}

impl Figure {
    /// Creates a body's capsules. A part extends beyond the body's spheres only by the gap between
    /// two of them.
    #[must_use]
    pub fn of(skeleton: &Skeleton, body: &Body, look: &Look) -> Self {
        let mut parts = Vec::new();
        for id in skeleton.ids().skip(1) {
            let joint = skeleton.joint(id);
            let Some(parent) = joint.parent.filter(|_| joint.offset.length() > 1e-3) else {
                continue;
            };
            let radius = radius(body, parent, joint.offset);
            bone(&mut parts, look, skeleton, parent, id, radius);
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

    /// Adds the capsules of a pose to `out`.
    ///
    /// # Panics
    /// If `joints` is shorter than the figure's skeleton.
    pub fn capsules(&self, joints: &[JointTransform], alpha: f32, out: &mut Vec<Capsule>) {
        out.extend(self.parts.iter().map(|part| {
            let end = |side: usize| {
                let joint = &joints[part.joints[side].index()];
                Sphere::new(joint.point(part.ends[side]), part.radii[side])
            };
            Capsule::new(end(0), end(1), part.colour.extend(alpha).to_array())
        }));
    }

    /// Returns the figure in one colour.
    #[must_use]
    pub fn coloured(mut self, colour: Vec3) -> Self {
        self.parts.iter_mut().for_each(|part| part.colour = colour);
        self
    }
}

/// A body that is drawn as capsules, or with a mesh in their place.
#[derive(Clone, Debug)]
pub struct Actor {
    /// The capsules.
    pub figure: Figure,
    /// The mesh, bound to the skeleton.
    pub skin: Option<Arc<Skin>>,
}

impl Actor {
    /// The body of a graph's character.
    #[must_use]
    pub fn new(baked: &BakedGraph, look: &Look, skin: Option<Arc<Skin>>) -> Self {
        Self {
            figure: Figure::of(baked.graph().skeleton(), baked.body(), look),
            skin,
        }
    }

    /// Adds the body in a pose, in its own colours or in one. `alpha` below 1 makes it a ghost.
    ///
    /// # Panics
    /// If `joints` is shorter than the skeleton.
    pub fn add(
        &self,
        joints: &[JointTransform],
        colour: Option<Vec3>,
        alpha: f32,
        shot: &mut Shot,
    ) {
        let tint = colour.map_or([0.0; 4], |colour| colour.extend(1.0).to_array());
        self.add_tinted(joints, tint, &[], alpha, shot);
    }

    /// As [`Actor::add`], with a tint colour and its weight. `weights` has a factor of the weight for each joint; it is 1 without them.
    ///
    /// # Panics
    /// As for [`Actor::add`].
    pub fn add_tinted(
        &self,
        joints: &[JointTransform],
        tint: [f32; 4],
        weights: &[f32],
        alpha: f32,
        shot: &mut Shot,
    ) {
        if let Some(skin) = &self.skin {
            shot.skinned.push(SkinnedBody {
                tint,
                tinted: weights.to_vec(),
                alpha,
                ..SkinnedBody::new(skin, joints)
            });
            return;
        }
        let mut figure = self.figure.clone();
        let [red, green, blue, weight] = tint;
        for part in &mut figure.parts {
            let own = weights.get(part.joints[0].index()).copied().unwrap_or(1.0);
            part.colour = part.colour.lerp(Vec3::new(red, green, blue), weight * own);
        }
        let capsules = match alpha < 1.0 {
            true => &mut shot.ghosts,
            false => &mut shot.solids,
        };
        figure.capsules(joints, alpha, capsules);
    }

    /// Darkens the floor beneath a body with a mesh, by its capsules. Other capsules do so by themselves.
    ///
    /// # Panics
    /// As for [`Actor::add`].
    pub fn shade(&self, joints: &[JointTransform], shot: &mut Shot) {
        if self.skin.is_some() {
            self.figure.capsules(joints, 1.0, &mut shot.occluders);
        }
    }
}

/// Radius of the body around a bone: that of the sphere nearest to the bone's middle.
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

/// Adds the capsules of the bone from `parent` to `id`, around which the body has a radius.
fn bone(
    parts: &mut Vec<FigurePart>,
    look: &Look,
    skeleton: &Skeleton,
    parent: JointId,
    id: JointId,
    radius: f32,
) {
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
