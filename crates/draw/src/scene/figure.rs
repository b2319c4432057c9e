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

impl Look {
    /// The two fighters of a duel: in white, and in blue.
    pub(crate) fn fighters() -> [Self; 2] {
        let clothes = Vec3::new(0.10, 0.19, 0.44);
        [
            Self::default(),
            Self {
                clothes,
                ..Self::default()
            },
        ]
    }
}

/// A capsule that moves with a joint: ends in its frame, and radii, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
struct FigurePart {
    joint: JointId,
    ends: [Vec3; 2],
    radii: [f32; 2],
    /// Linear colour.
    colour: Vec3,
}

/// Capsules of a body, for skeletons that no human body is made for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figure {
    parts: Vec<FigurePart>,
}

impl Figure {
    /// Creates a body's capsules. A part extends beyond the body's spheres only by the gap between
    /// two of them.
    #[must_use]
    pub fn of(skeleton: &Skeleton, body: &Body, look: &Look) -> Self {
        let bones = skeleton.ids().skip(1).filter_map(|id| {
            let bone = skeleton.joint(id);
            let parent = bone.parent.filter(|_| bone.offset.length() > 1e-3)?;
            let is_end = bone.kind == JointKind::EndSite;
            let is_head = is_end && skeleton.mirror(parent).is_none();
            let ([from, to], radii, colour) = match is_end {
                _ if is_head => ([0.28, 0.62], [0.70, 0.80], look.skin),
                true => ([0.0, 1.0], [1.0, 0.95], look.skin),
                false => ([0.0, 1.0], [0.96, 0.84], look.clothes),
            };
            let radius = radius(body, parent, bone.offset);
            Some(FigurePart {
                joint: parent,
                ends: [bone.offset * from, bone.offset * to],
                radii: radii.map(|share| share * radius),
                colour,
            })
        });
        // What goes on beyond the last joint, as a head without a tip.
        let is_last = |joint: JointId| {
            let holds = body.props.iter().any(|prop| prop.joint == joint);
            !holds && skeleton.children(joint).next().is_none()
        };
        let beyond = body.spheres.iter();
        let beyond = beyond.filter(|sphere| sphere.offset != Vec3::ZERO && is_last(sphere.joint));
        let beyond = beyond.map(|sphere| FigurePart {
            joint: sphere.joint,
            ends: [sphere.offset; 2],
            radii: [0.96 * sphere.radius; 2],
            colour: look.skin,
        });
        let held = body.props.iter().flat_map(|prop| prop.body_spheres());
        let held = held.map(|sphere| FigurePart {
            joint: sphere.joint,
            ends: [sphere.offset; 2],
            radii: [sphere.radius; 2],
            colour: look.held,
        });
        let parts = bones.chain(beyond).chain(held).collect();
        Self { parts }
    }

    /// Adds the capsules of a pose to `out`.
    ///
    /// # Panics
    /// If `joints` is shorter than the figure's skeleton.
    pub fn capsules(&self, joints: &[JointTransform], alpha: f32, out: &mut Vec<Capsule>) {
        out.extend(self.parts.iter().map(|part| {
            let end = |side: usize| {
                let joint = &joints[part.joint.index()];
                Sphere::new(joint.point(part.ends[side]), part.radii[side])
            };
            Capsule::new(end(0), end(1), part.colour.extend(alpha).to_array())
        }));
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
            let own = weights.get(part.joint.index()).copied().unwrap_or(1.0);
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
