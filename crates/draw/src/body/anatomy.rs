//! The parts of a skeleton that a body is built around, in the pose that it is built in.

use glam::Vec3;

use crate::scene::straightened;
use sabaki::anim::{JointId, JointTransform, Leg, Skeleton, carried};

/// Index of the left side, which is at +X.
pub(super) const LEFT: usize = 0;

/// A skeleton in the pose that the body is made in: upright, facing +Z, arms and legs spread.
pub(super) struct Anatomy {
    pub(super) frames: Vec<JointTransform>,
    /// Joints from the pelvis up to the joint that carries both arms.
    pub(super) trunk: Vec<JointId>,
    /// Joint at which the neck starts.
    pub(super) neck: JointId,
    pub(super) head: JointId,
    /// Left and right leg.
    pub(super) legs: [Leg; 2],
    /// Left and right arm: shoulder, elbow, hand and its tip.
    pub(super) arms: [Leg; 2],
    /// Joint that carries the shoulder.
    pub(super) girdles: [JointId; 2],
    /// Ends of the toes, as joints.
    pub(super) toes: [JointId; 2],
    /// Height of the soles, in metres.
    pub(super) sole: f32,
    /// Height of the body, in metres.
    pub(super) height: f32,
}

impl Anatomy {
    pub(super) fn of(skeleton: &Skeleton, standing: &[JointTransform]) -> Option<Self> {
        let x = |id: JointId| standing[id.index()].translation.x;
        let sided = |limbs: Vec<Leg>| -> Option<[Leg; 2]> {
            let mut pair = <[Leg; 2]>::try_from(limbs).ok()?;
            // Left is +X. The first joints do not cross over.
            pair.sort_by(|a, b| x(b.hip).total_cmp(&x(a.hip)));
            Some(pair)
        };
        let legs = sided(Leg::all(skeleton))?;
        let arms = sided(Leg::arms(skeleton))?;
        let pelvis = common(skeleton, legs[0].hip, legs[1].hip)?;
        let chest = common(skeleton, arms[0].hip, arms[1].hip)?;
        let mut trunk: Vec<JointId> = skeleton
            .ancestry(chest)
            .take_while(|&id| id != pelvis)
            .collect();
        trunk.push(pelvis);
        trunk.reverse();
        let head = head(skeleton, chest)?;
        let neck = skeleton
            .ancestry(head)
            .take_while(|&id| id != chest)
            .last()
            .unwrap_or(head);
        let toes = legs.map(|leg| furthest(skeleton, leg.foot));
        let crown = crown(skeleton, standing, head);
        let mut spread = Spread {
            skeleton,
            standing,
            directions: vec![None; skeleton.len()],
        };
        spread.fill(&trunk, [head, crown], legs, arms);
        let wanted = spread.directions;
        let frames = straightened(skeleton, standing, &wanted);
        let at = |id: JointId| frames[id.index()].translation;
        let lowest = toes.iter().map(|&toe| at(toe).y).fold(f32::MAX, f32::min);
        let top = at(crown).y.max(at(head).y + 0.1);
        let height = top - lowest;
        let girdles = arms.map(|arm| skeleton.joint(arm.hip).parent.unwrap_or(chest));
        Some(Self {
            sole: lowest - 0.009 * height,
            height,
            trunk,
            neck,
            head,
            legs,
            arms,
            girdles,
            toes,
            frames,
        })
    }

    pub(super) fn at(&self, id: JointId) -> Vec3 {
        self.frames[id.index()].translation
    }

    /// Lowest and highest coordinates of a body around the joints.
    pub(super) fn bounds(&self) -> (Vec3, Vec3) {
        let limbs = self.legs.iter().chain(&self.arms);
        let joints = limbs.flat_map(|limb| [limb.hip, limb.knee, limb.toe_or_foot()]);
        let places = joints
            .chain(self.toes)
            .chain([self.head])
            .map(|id| self.at(id));
        let (low, high) = places.fold((Vec3::MAX, Vec3::MIN), |(low, high), place| {
            (low.min(place), high.max(place))
        });
        let room = 0.12 * self.height;
        (
            low - room,
            high.with_y(high.y.max(self.sole + self.height)) + room,
        )
    }

    /// Middle between the shoulders.
    pub(super) fn shoulders(&self) -> Vec3 {
        0.5 * (self.at(self.arms[0].hip) + self.at(self.arms[1].hip))
    }

    /// The point at which the neck leaves the trunk: slightly above the shoulders, however high the joint of the neck is.
    pub(super) fn nape(&self) -> Vec3 {
        /// Height of the nape above the shoulders, as a share of the body's height.
        const RISE: f32 = 0.032;
        let (neck, shoulders) = (self.at(self.neck), self.shoulders());
        let height = shoulders.y + RISE * self.height;
        let share = (height - shoulders.y) / (neck.y - shoulders.y).max(1e-3);
        match neck.y > height {
            true => Vec3::new(neck.x, height, shoulders.z + (neck.z - shoulders.z) * share),
            false => neck,
        }
    }
}

/// The nearest joint that is above both or one of them.
fn common(skeleton: &Skeleton, a: JointId, b: JointId) -> Option<JointId> {
    skeleton.ancestry(a).find(|&id| skeleton.carries(id, b))
}

/// The joint above the chest with that name.
fn head(skeleton: &Skeleton, chest: JointId) -> Option<JointId> {
    let named = |id: &JointId| {
        let name = skeleton.joint(*id).name.to_ascii_lowercase();
        name.contains("head") && !name.ends_with("_end")
    };
    let mut below = skeleton.ids().filter(|&id| skeleton.carries(chest, id));
    below.find(named)
}

/// The highest joint of the body that a head carries: the longest chain may be that of a tongue.
fn crown(skeleton: &Skeleton, standing: &[JointTransform], head: JointId) -> JointId {
    let carried = carried(skeleton);
    let is_own = |&id: &JointId| skeleton.carries(head, id) && !carried[id.index()];
    let all = skeleton.ids().filter(is_own);
    let height = |id: &JointId| standing[id.index()].translation.y;
    all.max_by(|a, b| height(a).total_cmp(&height(b)))
        .unwrap_or(head)
}

/// The descendant that the longest chain of bones leads to.
fn furthest(skeleton: &Skeleton, from: JointId) -> JointId {
    let length = |id: JointId| skeleton.chain_length(id);
    let all = skeleton.ids().filter(|&id| skeleton.carries(from, id));
    all.max_by(|&a, &b| length(a).total_cmp(&length(b)))
        .unwrap_or(from)
}

/// Directions of the bones in the pose that the body is made in.
struct Spread<'a> {
    skeleton: &'a Skeleton,
    standing: &'a [JointTransform],
    directions: Vec<Option<Vec3>>,
}

impl Spread<'_> {
    fn fill(
        &mut self,
        trunk: &[JointId],
        [head, crown]: [JointId; 2],
        legs: [Leg; 2],
        arms: [Leg; 2],
    ) {
        let (pelvis, chest) = (trunk[0], trunk[trunk.len() - 1]);
        self.path(pelvis, chest, Vec3::Y);
        self.path(chest, head, Vec3::new(0.0, 1.0, 0.08));
        self.path(head, crown, Vec3::new(0.0, 1.0, 0.05));
        let standing = self.standing;
        let at = |id: JointId| standing[id.index()].translation;
        let upright = |a: JointId, b: JointId| (at(b) - at(a)).normalize_or(Vec3::Y);
        let (low, high) = (upright(pelvis, chest), upright(chest, head));
        self.rigid(pelvis, legs.map(|leg| leg.hip), low);
        self.rigid(chest, arms.map(|arm| arm.hip), high);
        for side in 0..2 {
            let sign = if side == LEFT { 1.0 } else { -1.0 };
            let aside = |x: f32, y: f32, z: f32| Vec3::new(sign * x, y, z);
            let Leg {
                hip, knee, foot, ..
            } = legs[side];
            self.sideways(pelvis, hip, low);
            self.path(hip, knee, aside(0.06, -1.0, 0.02));
            self.path(knee, foot, aside(0.04, -1.0, -0.03));
            let arm = arms[side];
            self.sideways(chest, arm.hip, high);
            self.path(arm.hip, arm.knee, aside(0.82, -0.57, 0.0));
            self.path(arm.knee, arm.foot, aside(0.80, -0.59, 0.08));
            if let Some(tip) = arm.toe {
                self.path(arm.foot, tip, aside(0.80, -0.59, 0.08));
            }
        }
    }

    /// Sets the direction of the bones from one joint down to another.
    fn path(&mut self, from: JointId, to: JointId, direction: Vec3) {
        for bone in self.skeleton.ancestry(to).take_while(|&id| id != from) {
            self.directions[bone.index()] = direction.try_normalize();
        }
    }

    /// The bones of a joint that carries a pair of limbs, as they stand to each other: their sides level, `up` upright.
    fn rigid(&mut self, joint: JointId, limbs: [JointId; 2], up: Vec3) {
        let at = |id: JointId| self.standing[id.index()].translation;
        let left = (at(limbs[0]) - at(limbs[1])).normalize_or(Vec3::X);
        let up = (up - left * up.dot(left)).normalize_or(Vec3::Y);
        let ahead = left.cross(up);
        for child in self.skeleton.children(joint) {
            let away = at(child) - at(joint);
            let own = Vec3::new(away.dot(left), away.dot(up), away.dot(ahead));
            self.directions[child.index()] = own.try_normalize();
        }
    }

    /// Bones that lead to the side as far as they do while standing, and straight up or down.
    fn sideways(&mut self, from: JointId, to: JointId, up: Vec3) {
        for bone in self.skeleton.ancestry(to).take_while(|&id| id != from) {
            let parent = self.skeleton.joint(bone).parent;
            let Some(parent) = parent.filter(|&parent| parent != from) else {
                continue;
            };
            let at = |id: JointId| self.standing[id.index()].translation;
            let away = at(bone) - at(parent);
            let rise = away.dot(up);
            let sign = at(to).x.signum();
            let aside = (away - up * rise).length();
            self.directions[bone.index()] = Vec3::new(sign * aside, rise, 0.0).try_normalize();
        }
    }
}
