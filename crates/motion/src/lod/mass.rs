//! Masses of joints, and moments of inertia of the parts of the body below them.
//!
//! Source: Hasegawa, Nishio & Kobori, 3.1, who name a moment of inertia and leave the masses open. Here a joint's mass is distributed
//! over the bones that start at it, in proportion to their lengths. The sums below all joints come from one pass, by the parallel axis
//! theorem.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{Level, LodError};
use crate::anim::{JointId, Place, Skeleton, details};

/// Masses of the joints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Masses {
    /// A total mass in kilograms, distributed over the bones by length. A joint without a bone has no mass, nor have fingers, helpers and
    /// carried things ([`details`]); of the bones from a hand to its fingers, the longest counts.
    ByLength(f32),
    /// The mass of each joint of the skeleton, in kilograms: of the bones that start there, or at the joint itself if there are none.
    Given(Vec<f32>),
}

impl Default for Masses {
    /// A person of 70 kg.
    fn default() -> Self {
        Self::ByLength(70.0)
    }
}

/// Total length of the bones that start at each joint and have a mass, in the rest pose, in metres.
fn massive_lengths(skeleton: &Skeleton) -> Vec<f64> {
    let details = details(skeleton);
    let (mut lengths, mut longest) = (vec![0.0; skeleton.len()], vec![0f64; skeleton.len()]);
    for (joint, is_detail) in skeleton.joints().iter().zip(&details) {
        let Some(parent) = joint.parent.map(JointId::index) else {
            continue;
        };
        let length = f64::from(joint.offset.length());
        match is_detail {
            false => lengths[parent] += length,
            true if details[parent] => {}
            true => longest[parent] = longest[parent].max(length),
        }
    }
    let pairs = lengths.into_iter().zip(longest);
    pairs
        .map(|(length, longest)| if length > 0.0 { length } else { longest })
        .collect()
}

impl Masses {
    /// The mass of each joint, in kilograms.
    fn of_joints(&self, skeleton: &Skeleton) -> Result<Vec<f64>, LodError> {
        match self {
            Self::ByLength(total) => {
                if !(total.is_finite() && *total >= 0.0) {
                    return Err(LodError::setting("masses", *total, "at least 0"));
                }
                let lengths = massive_lengths(skeleton);
                let sum: f64 = lengths.iter().sum();
                let density = if sum > 0.0 {
                    f64::from(*total) / sum
                } else {
                    0.0
                };
                Ok(lengths.iter().map(|length| length * density).collect())
            }
            Self::Given(masses) if masses.len() != skeleton.len() => Err(LodError::Masses {
                found: masses.len(),
                expected: skeleton.len(),
            }),
            Self::Given(masses) => {
                let wrong = masses
                    .iter()
                    .position(|mass| !(mass.is_finite() && *mass >= 0.0));
                match wrong {
                    Some(joint) => Err(LodError::Mass {
                        joint: skeleton.joints()[joint].name.clone(),
                        kilograms: masses[joint],
                    }),
                    None => Ok(masses.iter().map(|&mass| f64::from(mass)).collect()),
                }
            }
        }
    }

    /// The mass of each joint that a level keeps, with those of the removed joints below it.
    pub(super) fn on_level(
        &self,
        skeleton: &Skeleton,
        level: &Level,
    ) -> Result<Vec<f64>, LodError> {
        let mut masses = vec![0.0; level.kept.len()];
        // Parents stand before their children, so that a removed joint's nearest kept ancestor is known.
        let mut places = level.places(skeleton.len());
        for (id, mass) in skeleton.ids().zip(self.of_joints(skeleton)?) {
            let above = skeleton.joint(id).parent;
            let kept = places[id.index()].or_else(|| places[above?.index()]);
            places[id.index()] = kept;
            masses[kept.unwrap_or(0)] += mass;
        }
        Ok(masses)
    }
}

/// The mass of a part of the body and its first two moments, about one point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Moments {
    /// Mass, in kilograms.
    mass: f64,
    /// Sum of mass times position.
    first: DVec3,
    /// Sum of mass times squared distance.
    second: f64,
}

impl Moments {
    fn add(&mut self, other: &Self) {
        self.mass += other.mass;
        self.first += other.first;
        self.second += other.second;
    }

    fn point(mass: f64, at: DVec3) -> Self {
        Self {
            mass,
            first: mass * at,
            second: mass * at.length_squared(),
        }
    }

    /// A thin uniform rod.
    fn rod(mass: f64, [from, to]: [DVec3; 2]) -> Self {
        let mut moments = Self::point(mass, 0.5 * (from + to));
        moments.second += mass / 12.0 * from.distance_squared(to);
        moments
    }

    /// The sum of mass times squared distance from `point`, in kg m².
    pub(super) fn about_point(&self, point: DVec3) -> f64 {
        let mixed = 2.0 * self.first.dot(point);
        (self.second - mixed + self.mass * point.length_squared()).max(0.0)
    }
}

/// Writes the moments of everything below each kept joint, its own bones included, to `out`. `masses` has the mass of each kept
/// joint, in kilograms. Positions are relative to `origin`.
pub(super) fn moments_below(
    level: &Level,
    masses: &[f64],
    places: &[Place],
    origin: DVec3,
    out: &mut Vec<Moments>,
) {
    let at = |index: usize| places[level.kept[index].index()].translation - origin;
    let length = |child: usize, parent: usize| (at(child) - at(parent)).length();
    let mut lengths = vec![0.0; level.kept.len()];
    for (child, parent) in level.bones() {
        lengths[parent] += length(child, parent);
    }
    out.clear();
    out.resize(level.kept.len(), Moments::default());
    for index in (0..level.kept.len()).filter(|&index| lengths[index] <= 0.0) {
        out[index] = Moments::point(masses[index], at(index));
    }
    for (child, parent) in level.bones().filter(|&(_, parent)| lengths[parent] > 0.0) {
        let mass = masses[parent] * length(child, parent) / lengths[parent];
        out[parent].add(&Moments::rod(mass, [at(parent), at(child)]));
    }
    // Children stand after their parents.
    for index in (1..level.kept.len()).rev() {
        if let Some(parent) = level.parents[index] {
            let below = out[index];
            out[usize::from(parent)].add(&below);
        }
    }
}
