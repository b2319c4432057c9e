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
use crate::anim::{Clip, Skeleton};

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

/// The energy of every joint that `level` keeps, in its order, joules: as the level plays the clips, with what hung on removed
/// joints on those that took their children. 0 where no clip has a second frame.
///
/// The root has no bone to a parent, and an end none to a child: they count as straight.
///
/// # Errors
/// Settings that make no sense, a clip or a level that is not of this skeleton.
pub fn joint_energies(
    skeleton: &Skeleton,
    clips: &[Clip],
    level: &Level,
    settings: &EnergySettings,
) -> Result<Vec<f32>, LodError> {
    settings.check()?;
    level.check(skeleton)?;
    let mut sums = Sums {
        level,
        settings,
        masses: settings.masses.on_level(skeleton, level)?,
        moments: Vec::new(),
        energies: vec![0.0; level.kept.len()],
    };
    let mut seconds = 0.0;
    let (mut before, mut now) = (Vec::new(), Vec::new());
    for clip in clips {
        check(skeleton, clip)?;
        place_all(skeleton, clip, 0, &mut before);
        for frame in 1..clip.frames() {
            place_all(skeleton, clip, frame, &mut now);
            sums.add(&before, &now, 1.0 / clip.frame_rate());
            std::mem::swap(&mut before, &mut now);
        }
        seconds += clip.duration();
    }
    let mean = |sum: &f64| (if seconds > 0.0 { sum / seconds } else { 0.0 }) as f32;
    Ok(sums.energies.iter().map(mean).collect())
}

/// Energies by time, frame after frame.
struct Sums<'a> {
    level: &'a Level,
    settings: &'a EnergySettings,
    masses: Vec<f64>,
    moments: Vec<Moments>,
    energies: Vec<f64>,
}

impl Sums<'_> {
    fn add(&mut self, before: &[Place], now: &[Place], seconds: f64) {
        let origin = now[0].translation;
        let mass = (self.masses.as_slice(), self.settings.shape);
        moments_below(self.level, (now, origin), mass, &mut self.moments);
        let bends = self.bends(now);
        for (index, id) in self.level.kept.iter().enumerate() {
            let above =
                self.level.parents[index].map(|parent| self.level.kept[usize::from(parent)]);
            let local = |places: &[Place]| match above {
                Some(above) => places[above.index()].sees(&places[id.index()]).rotation,
                None => places[id.index()].rotation,
            };
            let turn = local(before).conjugate() * local(now);
            let (axis, angle) = (turn.xyz(), 2.0 * turn.xyz().length().atan2(turn.w.abs()));
            let place = now[id.index()];
            let at = place.translation - origin;
            let inertia = match (self.settings.inertia, axis.try_normalize()) {
                (Inertia::Axis, Some(axis)) => {
                    self.moments[index].about_axis(at, place.rotation * axis)
                }
                _ => self.moments[index].about_point(at),
            };
            let speed = angle / seconds;
            let weight = self.settings.weight(bends[index]);
            self.energies[index] += 0.5 * inertia * speed * speed * weight * seconds;
        }
    }

    /// The inner angle at every joint, radians.
    fn bends(&self, now: &[Place]) -> Vec<f64> {
        let at = |index: usize| now[self.level.kept[index].index()].translation;
        // Of the children so far: what speaks for the best one, and its angle.
        let mut best: Vec<Option<(f64, f64)>> = vec![None; self.level.kept.len()];
        for (child, joint) in self.level.bones() {
            let Some(parent) = self.level.parents[joint].map(usize::from) else {
                continue;
            };
            let Some(angle) = angle_between(at(parent) - at(joint), at(child) - at(joint)) else {
                continue;
            };
            let claim = match self.settings.branch {
                Branch::Straightest => angle,
                Branch::Heaviest => self.moments[child].mass(),
            };
            if best[joint].is_none_or(|(other, _)| claim > other) {
                best[joint] = Some((claim, angle));
            }
        }
        { best.into_iter() }
            .map(|best| best.map_or(PI, |(_, angle)| angle))
            .collect()
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
