//! How much a joint moves: its energy.
//!
//! Source: Hasegawa, Nishio & Kobori, 3.1, equations 1 to 3:
//! E_j = mean over frames of 1/2 I w² W, W = a / theta, a = pi/2.
//!
//! - w: angular speed of the local rotation from the frame before to this one; frames count from the second on. Over
//!   several clips the mean is over their time.
//! - I: of everything below, about the joint, in this frame ([`Masses`]).
//! - theta: the inner angle between the bone to the parent and the bone to a child, pi where they lie in a line.
//!
//! Differs: the text wants the weight to *raise* the energy of what is bent beyond the threshold, so the
//! default is max(1, W); the equation to the letter is [`Flexion::Literal`]. W is bounded by a least theta.

use std::f64::consts::PI;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::frames::{Place, place_all};
use super::mass::{Moments, moments_below};
use super::motion::check;
use super::{BoneShape, Level, LodError, Masses};
use crate::anim::{Clip, JointId, Skeleton};

/// What energies are made of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EnergySettings {
    /// What the joints weigh.
    pub masses: Masses,
    /// How a bone's mass lies on it.
    pub shape: BoneShape,
    /// About what a joint turns.
    pub inertia: Inertia,
    /// How bending counts.
    pub flexion: Flexion,
    /// Which child's bone the bend is measured to.
    pub branch: Branch,
    /// The angle a at which a joint counts as bent, radians.
    pub threshold: f32,
    /// No angle counts as smaller than this one, radians.
    pub least_angle: f32,
}

/// About what a joint's moment of inertia is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Inertia {
    /// About the joint itself: the sum of mass by squared distance, whichever way it turns.
    Joint,
    /// About the axis that it turns about in the frame: true kinetic energy, in which a limb's twist is nearly none.
    Axis,
}

/// How bending weighs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Flexion {
    /// max(1, a / theta): what is bent beyond the threshold counts for more.
    Raised,
    /// a / theta, as the equation has it: what is straight counts for half.
    Literal,
    /// 1 throughout.
    Ignored,
}

/// Where several bones leave a joint: the one that its bend is measured to. Bones without length do not count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Branch {
    /// That which goes on straightest in the frame: a chest is not bent because arms leave it sideways.
    Straightest,
    /// That to the child with the greatest mass below it, in the frame.
    Heaviest,
}

impl Default for EnergySettings {
    fn default() -> Self {
        Self {
            masses: Masses::default(),
            shape: BoneShape::Rod,
            inertia: Inertia::Joint,
            flexion: Flexion::Raised,
            branch: Branch::Straightest,
            threshold: 0.5 * std::f32::consts::PI,
            least_angle: std::f32::consts::PI / 18.0,
        }
    }
}

impl EnergySettings {
    pub(super) fn check(&self) -> Result<(), LodError> {
        let angles = [
            ("threshold", self.threshold),
            ("least_angle", self.least_angle),
        ];
        for (setting, value) in angles {
            if !(value > 0.0 && value <= std::f32::consts::PI) {
                let must = "above 0 and at most pi";
                return Err(LodError::Setting {
                    setting,
                    value,
                    must,
                });
            }
        }
        Ok(())
    }

    fn weight(&self, theta: f64) -> f64 {
        let weight = f64::from(self.threshold) / theta.max(f64::from(self.least_angle));
        match self.flexion {
            Flexion::Raised => weight.max(1.0),
            Flexion::Literal => weight,
            Flexion::Ignored => 1.0,
        }
    }
}

/// The energy of every joint that `level` keeps, in its order, joules, as the level plays the clips. What hung on removed joints
/// counts for the joints that took their children. 0 where no clip has a second frame.
///
/// The root has no bone to a parent and an end none to a child: they count as straight.
///
/// # Errors
/// Settings out of range, a clip or a level that is not of this skeleton.
pub fn joint_energies(
    skeleton: &Skeleton,
    clips: &[Clip],
    level: &Level,
    settings: &EnergySettings,
) -> Result<Vec<f32>, LodError> {
    level.check(skeleton)?;
    let mut energies = Energies::new(skeleton, clips, settings)?;
    energies.update(level)
}

/// The energies of levels, one level after another. Turns and energies that the removal of a joint does not change are kept, which
/// gives the same bits.
pub(super) struct Energies<'a> {
    skeleton: &'a Skeleton,
    clips: &'a [Clip],
    settings: &'a EnergySettings,
    /// The joints in all frames, frame by frame; empty where they are more than [`MOST_KEPT`].
    places: Vec<Place>,
    /// How the joints turn in all frames but each clip's first, in the order of `places`.
    turns: Vec<Turn>,
    /// Sum over frames of energy by time, for each joint of the skeleton.
    sums: Vec<f64>,
    /// Whether a level has been evaluated, from which the next one differs by one joint.
    has_level: bool,
}

/// Places that are kept, frames times joints. More are computed again for each level.
const MOST_KEPT: usize = 1 << 20;

/// How a joint turns from one frame to the next.
#[derive(Clone, Copy)]
struct Turn {
    /// Radians per second.
    speed: f64,
    /// What the bend at the joint multiplies the energy by.
    weight: f64,
    /// In the space of the motion; `None` where the joint does not turn.
    axis: Option<DVec3>,
}

impl Turn {
    const NONE: Self = Self {
        speed: 0.0,
        weight: 1.0,
        axis: None,
    };
}

impl<'a> Energies<'a> {
    pub(super) fn new(
        skeleton: &'a Skeleton,
        clips: &'a [Clip],
        settings: &'a EnergySettings,
    ) -> Result<Self, LodError> {
        settings.check()?;
        clips.iter().try_for_each(|clip| check(skeleton, clip))?;
        let count = clips.iter().map(Clip::frames).sum::<usize>() * skeleton.len();
        let (mut places, mut frame_places) = (Vec::new(), Vec::new());
        if count <= MOST_KEPT {
            for clip in clips {
                for frame in 0..clip.frames() {
                    place_all(skeleton, clip, frame, &mut frame_places);
                    places.extend_from_slice(&frame_places);
                }
            }
        }
        Ok(Self {
            skeleton,
            clips,
            settings,
            turns: vec![Turn::NONE; places.len()],
            places,
            sums: vec![0.0; skeleton.len()],
            has_level: false,
        })
    }

    /// The energies on a level: the first that is asked for, or the one that follows the last by the removal of a joint.
    pub(super) fn update(&mut self, level: &Level) -> Result<Vec<f32>, LodError> {
        let masses = self.settings.masses.on_level(self.skeleton, level)?;
        let follows = std::mem::replace(&mut self.has_level, true);
        let changes = if self.places.is_empty() || !follows {
            Changes::all(level)
        } else {
            Changes::of(self.skeleton, level, self.settings.branch)
        };
        for &index in &changes.energies {
            self.sums[level.kept[index].index()] = 0.0;
        }
        let mut pass = Pass {
            level,
            settings: self.settings,
            masses,
            moments: Vec::new(),
            changes,
            children: children(level),
        };
        let joints = self.skeleton.len();
        let mut start = 0;
        let (mut before, mut now) = (Vec::new(), Vec::new());
        for clip in self.clips {
            let seconds = 1.0 / clip.frame_rate();
            if self.places.is_empty() {
                let mut turns = vec![Turn::NONE; joints];
                place_all(self.skeleton, clip, 0, &mut before);
                for frame in 1..clip.frames() {
                    place_all(self.skeleton, clip, frame, &mut now);
                    pass.add([&before, &now], seconds, &mut turns, &mut self.sums);
                    std::mem::swap(&mut before, &mut now);
                }
            } else {
                let end = start + clip.frames() * joints;
                for at in (start + joints..end).step_by(joints) {
                    let pair = [at - joints, at].map(|at| &self.places[at..at + joints]);
                    let turns = &mut self.turns[at..at + joints];
                    pass.add(pair, seconds, turns, &mut self.sums);
                }
                start = end;
            }
        }
        let seconds: f64 = self.clips.iter().map(Clip::duration).sum();
        let mean = |id: &JointId| {
            let sum = self.sums[id.index()];
            (if seconds > 0.0 { sum / seconds } else { 0.0 }) as f32
        };
        Ok(level.kept.iter().map(mean).collect())
    }
}

fn children(level: &Level) -> Vec<Vec<usize>> {
    let mut children = vec![Vec::new(); level.kept.len()];
    for (child, parent) in level.bones() {
        children[parent].push(child);
    }
    children
}

/// Which of a level's joints differ from the level before, as indices into its kept joints.
struct Changes {
    /// Joints that turn or bend otherwise: the parent of the removed joint, and the parent's children.
    turns: Vec<usize>,
    /// Joints with another energy: those, and all above them, which carry the straightened bones.
    energies: Vec<usize>,
}

impl Changes {
    fn all(level: &Level) -> Self {
        let all: Vec<usize> = (0..level.kept.len()).collect();
        Self {
            turns: all.clone(),
            energies: all,
        }
    }

    fn of(skeleton: &Skeleton, level: &Level, branch: Branch) -> Self {
        let Some(removed) = level.removed else {
            return Self::all(level);
        };
        let places = level.places(skeleton.len());
        let parent = { skeleton.ancestry(removed) }.find_map(|above| places[above.index()]);
        let Some(parent) = parent else {
            return Self::all(level);
        };
        let mut turns = vec![parent];
        turns.extend(level.neighbours(parent).filter(|&index| index > parent));
        let above = |&index: &usize| level.parents[index].map(usize::from);
        let mut energies = turns.clone();
        energies.extend(std::iter::successors(above(&parent), above));
        if branch == Branch::Heaviest {
            // Sums of masses are rounded otherwise, which may decide between two children as heavy as one another.
            turns.clone_from(&energies);
        }
        Self { turns, energies }
    }
}

/// One pass over the frames, for one level.
struct Pass<'a> {
    level: &'a Level,
    settings: &'a EnergySettings,
    masses: Vec<f64>,
    moments: Vec<Moments>,
    changes: Changes,
    /// Of each kept joint its children, as indices into the kept joints.
    children: Vec<Vec<usize>>,
}

impl Pass<'_> {
    /// Adds what the joints do from one frame to the next.
    fn add(
        &mut self,
        [before, now]: [&[Place]; 2],
        seconds: f64,
        turns: &mut [Turn],
        sums: &mut [f64],
    ) {
        let origin = now[0].translation;
        let mass = (self.masses.as_slice(), self.settings.shape);
        moments_below(self.level, (now, origin), mass, &mut self.moments);
        for &index in &self.changes.turns {
            turns[self.level.kept[index].index()] = self.turn(index, [before, now], seconds);
        }
        for &index in &self.changes.energies {
            let joint = self.level.kept[index].index();
            let at = now[joint].translation - origin;
            let Turn {
                speed,
                weight,
                axis,
            } = turns[joint];
            let inertia = match (self.settings.inertia, axis) {
                (Inertia::Axis, Some(axis)) => self.moments[index].about_axis(at, axis),
                _ => self.moments[index].about_point(at),
            };
            sums[joint] += 0.5 * inertia * speed * speed * weight * seconds;
        }
    }

    fn turn(&self, index: usize, [before, now]: [&[Place]; 2], seconds: f64) -> Turn {
        let id = self.level.kept[index];
        let above = self.level.parents[index].map(|parent| self.level.kept[usize::from(parent)]);
        let local = |places: &[Place]| match above {
            Some(above) => places[above.index()].sees(&places[id.index()]).rotation,
            None => places[id.index()].rotation,
        };
        let turn = local(before).conjugate() * local(now);
        let (axis, angle) = (turn.xyz(), 2.0 * turn.xyz().length().atan2(turn.w.abs()));
        let axis = axis.try_normalize();
        Turn {
            speed: angle / seconds,
            weight: self.settings.weight(self.bend(index, now)),
            axis: axis.map(|axis| now[id.index()].rotation * axis),
        }
    }

    /// The inner angle at a joint, radians.
    fn bend(&self, joint: usize, now: &[Place]) -> f64 {
        let at = |index: usize| now[self.level.kept[index].index()].translation;
        let Some(parent) = self.level.parents[joint].map(usize::from) else {
            return PI;
        };
        // The best child so far: its claim, and the angle to it.
        let mut best: Option<(f64, f64)> = None;
        for &child in &self.children[joint] {
            let Some(angle) = angle_between(at(parent) - at(joint), at(child) - at(joint)) else {
                continue;
            };
            let claim = match self.settings.branch {
                Branch::Straightest => angle,
                Branch::Heaviest => self.moments[child].mass(),
            };
            if best.is_none_or(|(other, _)| claim > other) {
                best = Some((claim, angle));
            }
        }
        best.map_or(PI, |(_, angle)| angle)
    }
}

/// `None` where one of them has no length.
fn angle_between(a: DVec3, b: DVec3) -> Option<f64> {
    /// Metres.
    const NO_LENGTH: f64 = 1e-6;
    if a.length() < NO_LENGTH || b.length() < NO_LENGTH {
        return None;
    }
    Some(a.cross(b).length().atan2(a.dot(b)))
}
