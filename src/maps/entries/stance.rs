//! Position, facing direction and feet of a body, by which entries are aligned.

use crate::anim::{Facing, JointId, JointTransform, Pose, forward_kinematics};
use crate::graph::{MotionGraph, Node};
use crate::math::Rigid2;
use glam::Vec3;

/// Position and facing direction of a body, and positions of its root and feet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stance {
    /// The character's frame (root on the ground, facing +Z).
    pub placement: Rigid2,
    /// Position of the root.
    pub root: Vec3,
    /// Positions of the toes of the first four legs.
    pub toes: [Vec3; Self::LEGS],
    /// Positions of the ankles of the first four legs.
    pub ankles: [Vec3; Self::LEGS],
}

impl Stance {
    /// Maximum number of legs.
    pub(crate) const LEGS: usize = 4;

    /// Stance of a body, in the space of `joints`.
    #[must_use]
    pub(crate) fn from_joints(
        graph: &MotionGraph,
        facing: Facing,
        joints: &[JointTransform],
    ) -> Self {
        let [mut toes, mut ankles] = [[Vec3::ZERO; Self::LEGS]; 2];
        for (index, leg) in graph.feet().legs().iter().take(Self::LEGS).enumerate() {
            let place = |joint: JointId| joints[joint.index()].translation;
            toes[index] = place(leg.toe_or_foot());
            ankles[index] = place(leg.foot);
        }
        Self {
            placement: facing.placement(joints),
            root: joints[0].translation,
            toes,
            ankles,
        }
    }

    /// Stance at a frame of a clip, in the clip's space.
    #[must_use]
    pub(crate) fn at_frame(graph: &MotionGraph, facing: Facing, at: Node) -> Self {
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        graph.clip(at.clip).pose(at.frame as usize, &mut pose);
        forward_kinematics(graph.skeleton(), &pose, &mut joints);
        Self::from_joints(graph, facing, &joints)
    }

    /// Transform from the space of `target` to that of this stance that makes the facing directions equal and the positions of a foot (or,
    /// without one, of the root) equal.
    #[must_use]
    pub(crate) fn align(&self, target: &Self, pin: Option<usize>) -> Rigid2 {
        let place =
            |stance: &Self| pin.map_or(stance.root, |leg| stance.toes[leg.min(Self::LEGS - 1)]);
        let turn = self.placement * target.placement.inverse();
        let off = place(self) - turn.point(place(target));
        Rigid2::new(0.0, off.x, off.z) * turn
    }

    /// Horizontal distance of the roots, and of each leg's feet, after the alignment, in metres.
    pub(crate) fn apart(&self, target: &Self, align: Rigid2) -> (f32, [f32; Self::LEGS]) {
        let apart = |a: Vec3, b: Vec3| (a - align.point(b)).with_y(0.0).length();
        let feet = std::array::from_fn(|leg| apart(self.toes[leg], target.toes[leg]));
        (apart(self.root, target.root), feet)
    }
}

// Finds targets whose root and feet are near those of a body when one foot is at the same position. The test is cheap and excludes no target
// that is near.
//
// For each foot, let `d` be the difference of two stances' vectors from the foot to the root, in the character's frame. With foot `a` in
// place the roots are `|d_a|` apart and the feet `b` are `|d_a - d_b|` apart; with the root in place the feet are `|d_b|` apart.

/// Vectors from each foot to the root of some stances, in the character's frame, as one list for each coordinate of each foot.
#[derive(Clone, Debug, Default)]
pub(crate) struct NearStances {
    feet: Vec<[Vec<f32>; 2]>,
    /// Largest distances of the roots and of the feet, squared, in square metres.
    limits: [f32; 2],
}

/// Tolerance for rounding, in metres.
const ROUNDING: f32 = 1e-3;

impl NearStances {
    /// Prepares the first `legs` feet of stances. `limits` are the maximum distances of the roots and of the feet, in metres.
    pub(crate) fn new(stances: &[Stance], legs: usize, limits: [f32; 2]) -> Self {
        let of_foot = |foot: usize| {
            let vectors = || stances.iter().map(move |stance| vector(stance, foot));
            [0, 1].map(|axis| vectors().map(|vector| vector[axis]).collect())
        };
        Self {
            feet: (0..legs).map(of_foot).collect(),
            limits: limits.map(|limit| (limit + ROUNDING) * (limit + ROUNDING)),
        }
    }

    /// Whether the bodies have no feet.
    pub(crate) fn is_empty(&self) -> bool {
        self.feet.is_empty()
    }

    /// Writes for each stance whether it is near `stance` when one of the standing feet, or the root if none stands, is at the same position.
    pub(crate) fn find(&self, stance: &Stance, standing: &[bool], near: &mut Vec<bool>) {
        let own: Vec<[f32; 2]> = (0..self.feet.len())
            .map(|foot| vector(stance, foot))
            .collect();
        let count = self.feet.first().map_or(0, |[x, _]| x.len());
        near.clear();
        near.resize(count, false);
        let mut with_pin = vec![true; count];
        let pins = (0..self.feet.len())
            .filter(|&foot| standing[foot])
            .map(Some);
        let root = (!standing.contains(&true)).then_some(None);
        for pin in pins.chain(root) {
            with_pin.fill(true);
            if let Some(pin) = pin {
                self.compare([(pin, own[pin])].as_slice(), self.limits[0], &mut with_pin);
            }
            for foot in (0..self.feet.len()).filter(|&foot| Some(foot) != pin) {
                let moved = [Some(foot), pin].into_iter().flatten();
                let moved: Vec<(usize, [f32; 2])> = moved.map(|foot| (foot, own[foot])).collect();
                self.compare(&moved, self.limits[1], &mut with_pin);
            }
            for (near, with_pin) in near.iter_mut().zip(&with_pin) {
                *near |= with_pin;
            }
        }
    }

    /// Clears the flags of stances for which the difference of a foot's vector from that of `feet`, or that of two feet's differences, is longer
    /// than the limit.
    fn compare(&self, feet: &[(usize, [f32; 2])], limit: f32, fits: &mut [bool]) {
        let of_foot = |index: usize| {
            let (foot, own) = feet[index];
            let [x, z] = &self.feet[foot];
            (x.iter().zip(z), own)
        };
        let (first, [x, z]) = of_foot(0);
        if feet.len() == 1 {
            for (fits, (other_x, other_z)) in fits.iter_mut().zip(first) {
                let (x, z) = (x - other_x, z - other_z);
                *fits &= x * x + z * z <= limit;
            }
            return;
        }
        let (second, [pin_x, pin_z]) = of_foot(1);
        let (x, z) = (x - pin_x, z - pin_z);
        for ((fits, (foot_x, foot_z)), (pin_x, pin_z)) in fits.iter_mut().zip(first).zip(second) {
            let (x, z) = (x - foot_x + pin_x, z - foot_z + pin_z);
            *fits &= x * x + z * z <= limit;
        }
    }
}

/// The horizontal vector from a foot to the root, in the character's frame.
fn vector(stance: &Stance, foot: usize) -> [f32; 2] {
    let back = stance.placement.inverse();
    let vector = back.vector(stance.root - stance.toes[foot]);
    [vector.x, vector.z]
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::math::Rigid2;

    const LIMITS: [f32; 2] = [0.25, 0.45];

    fn stance(seed: u32) -> Stance {
        let noise = |number: u32| ((seed * 17 + number) as f32 * 12.9898).sin();
        let place = |number: u32| {
            Vec3::new(noise(number), 1.0, noise(number + 1)) * 0.2
                + Vec3::new(noise(90), 0.0, noise(91)) * 5.0
        };
        Stance {
            placement: Rigid2::new(3.0 * noise(40), noise(41), noise(42)),
            root: place(0),
            toes: [2, 4, 6, 8].map(place),
            ankles: [Vec3::ZERO; 4],
        }
    }

    #[test]
    fn what_is_near_is_found() {
        let stances: Vec<Stance> = (0..300).map(stance).collect();
        let (mut found, mut all) = ([0; 2], 0);
        for legs in [1, 2, 4] {
            let filter = NearStances::new(&stances, legs, LIMITS);
            for seed in 0..40 {
                let own = stance(1000 + seed);
                let standing: Vec<bool> = (0..legs).map(|leg| seed >> leg & 1 == 1).collect();
                let mut near = Vec::new();
                filter.find(&own, &standing, &mut near);
                let legs_in_place = (0..legs).filter(|&leg| standing[leg]).map(Some);
                let root = (!standing.contains(&true)).then_some(None);
                let pins: Vec<Option<usize>> = legs_in_place.chain(root).collect();
                for (other, near) in stances.iter().zip(near) {
                    let is_near = pins.iter().any(|&pin| {
                        let (root, feet) = own.apart(other, own.align(other, pin));
                        root <= LIMITS[0] && feet[..legs].iter().all(|&foot| foot <= LIMITS[1])
                    });
                    assert!(near || !is_near);
                    all += 1;
                    found[0] += usize::from(near);
                    found[1] += usize::from(is_near);
                }
            }
        }
        assert!(
            found[1] > 1000 && found[0] < found[1] + all / 100,
            "{found:?} of {all}"
        );
    }
}
