//! The kinetic energy of joints.
//!
//! Source: Hasegawa, Nishio & Kobori, 3.1, equations 1 to 3:
//! E_j = mean over frames of 1/2 I w² W, W = a / theta, a = pi/2.
//!
//! - w: angular speed of the local rotation between the previous frame and this one. Over several clips the mean is over their time.
//! - I: moment of inertia of everything below the joint, about the joint, in this frame: the sum of mass times squared
//!   distance, for every axis of rotation ([`Masses`](super::Masses)).
//! - theta: inner angle between the bone to the parent and the bone to a child; pi when they lie in a line. Of several children, the
//!   straightest continuation in the frame; bones without length are ignored.
//!
//! Differs: by the text, W *raises* the energy of a joint that is bent beyond the threshold. So the default is max(1, W); the equation to
//! the letter is [`Flexion::Literal`]. A smallest theta bounds W.

use std::f64::consts::PI;

use glam::DVec3;

use super::level::check;
use super::mass::{Moments, moments_below};
use super::settings::{Flexion, LevelSettings};
use super::{Level, LodError};
use crate::anim::{Clip, JointId, Place, Skeleton, place_all};

impl LevelSettings {
    /// Factor of a joint's energy by its bend.
    fn weight(&self, theta: f64) -> f64 {
        let weight = f64::from(self.bend_threshold) / theta.max(f64::from(self.least_angle));
        match self.flexion {
            Flexion::Raised => weight.max(1.0),
            Flexion::Literal => weight,
        }
    }
}

impl Level {
    /// The energies of the kept joints, in their order, in joules, as this level plays the clips. The mass of a removed joint
    /// counts for its nearest kept ancestor. Clips of one frame have energies of 0.
    ///
    /// The root and the ends count as straight.
    ///
    /// # Errors
    /// Settings out of range, a clip or a level of another skeleton.
    pub fn joint_energies(
        &self,
        skeleton: &Skeleton,
        clips: &[Clip],
        settings: &LevelSettings,
    ) -> Result<Vec<f32>, LodError> {
        self.check(skeleton)?;
        let mut energies = Energies::new(skeleton, clips, settings)?;
        energies.update(self)
    }
}

/// The energies of one level after another. Rotations and energies that the removal of a joint does not change are kept, to the same
/// bits.
pub(super) struct Energies<'a> {
    skeleton: &'a Skeleton,
    clips: &'a [Clip],
    settings: &'a LevelSettings,
    /// Joint transforms of all frames, `[frame][joint]`; empty for more than [`MOST_KEPT`].
    places: Vec<Place>,
    /// Rotation from the previous frame, in the order of `places`.
    turns: Vec<Turn>,
    /// Sum over frames of energy times frame time, for each joint of the skeleton.
    sums: Vec<f64>,
    /// Whether a level has been evaluated. The next one then differs from it by one joint.
    has_level: bool,
}

/// Largest number of joint transforms that are kept. More are computed again for each level.
const MOST_KEPT: usize = 1 << 20;

/// The rotation of a joint between two frames.
#[derive(Clone, Copy)]
struct Turn {
    /// Angular speed, in radians per second.
    speed: f64,
    /// Factor of the energy by the joint's bend.
    weight: f64,
}

impl Turn {
    const NONE: Self = Self {
        speed: 0.0,
        weight: 1.0,
    };
}

impl<'a> Energies<'a> {
    pub(super) fn new(
        skeleton: &'a Skeleton,
        clips: &'a [Clip],
        settings: &'a LevelSettings,
    ) -> Result<Self, LodError> {
        settings.check_angles()?;
        clips.iter().try_for_each(|clip| check(skeleton, clip))?;
        let count = clips.iter().map(Clip::frames).sum::<usize>() * skeleton.len();
        let (mut places, mut frame_places) = (Vec::new(), Vec::new());
        if count <= MOST_KEPT {
            for clip in clips {
                for frame in 0..clip.frames() {
                    place_all(skeleton, clip.at(frame as f32), &mut frame_places);
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

    /// The energies on a level: the first level, or the one that follows the previous one by the removal of a joint.
    pub(super) fn update(&mut self, level: &Level) -> Result<Vec<f32>, LodError> {
        let masses = self.settings.masses.on_level(self.skeleton, level)?;
        let follows = std::mem::replace(&mut self.has_level, true);
        let changes = if self.places.is_empty() || !follows {
            Changes::all(level)
        } else {
            Changes::by_removal(self.skeleton, level)
        };
        for &index in &changes.energies {
            self.sums[level.kept[index].index()] = 0.0;
        }
        let mut children = vec![Vec::new(); level.kept.len()];
        for (child, parent) in level.bones() {
            children[parent].push(child);
        }
        let mut pass = Pass {
            level,
            settings: self.settings,
            masses,
            moments: Vec::new(),
            changes,
            children,
            sums: &mut self.sums,
        };
        let joints = self.skeleton.len();
        let mut start = 0;
        let (mut before, mut now) = (Vec::new(), Vec::new());
        for clip in self.clips {
            let seconds = 1.0 / clip.frame_rate();
            if self.places.is_empty() {
                let mut turns = vec![Turn::NONE; joints];
                place_all(self.skeleton, clip.at(0.0), &mut before);
                for frame in 1..clip.frames() {
                    place_all(self.skeleton, clip.at(frame as f32), &mut now);
                    pass.add([&before, &now], seconds, &mut turns);
                    std::mem::swap(&mut before, &mut now);
                }
            } else {
                let end = start + clip.frames() * joints;
                for at in (start + joints..end).step_by(joints) {
                    let pair = [at - joints, at].map(|at| &self.places[at..at + joints]);
                    let turns = &mut self.turns[at..at + joints];
                    pass.add(pair, seconds, turns);
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

/// The joints that differ from the previous level, as indices into the level's kept joints.
struct Changes {
    /// Joints with another rotation or bend: the parent of the removed joint, and the parent's children.
    turns: Vec<usize>,
    /// Joints with another energy: those above, and all their ancestors, which carry the straightened bones.
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

    fn by_removal(skeleton: &Skeleton, level: &Level) -> Self {
        let Some(removed) = level.removed else {
            return Self::all(level);
        };
        let places = level.places(skeleton.len());
        let parent = skeleton
            .ancestry(removed)
            .find_map(|above| places[above.index()]);
        let Some(parent) = parent else {
            return Self::all(level);
        };
        let mut turns = vec![parent];
        turns.extend(level.neighbours(parent).filter(|&index| index > parent));
        let above = |&index: &usize| level.parents[index].map(usize::from);
        let mut energies = turns.clone();
        energies.extend(std::iter::successors(above(&parent), above));
        Self { turns, energies }
    }
}

/// One pass over the frames, for one level.
struct Pass<'a> {
    level: &'a Level,
    settings: &'a LevelSettings,
    masses: Vec<f64>,
    moments: Vec<Moments>,
    changes: Changes,
    /// Children of each kept joint, as indices into the kept joints.
    children: Vec<Vec<usize>>,
    /// [`Energies::sums`].
    sums: &'a mut [f64],
}

impl Pass<'_> {
    /// Adds the energies between two frames.
    fn add(&mut self, [before, now]: [&[Place]; 2], seconds: f64, turns: &mut [Turn]) {
        let origin = now[0].translation;
        moments_below(self.level, &self.masses, now, origin, &mut self.moments);
        for &index in &self.changes.turns {
            turns[self.level.kept[index].index()] = self.turn(index, [before, now], seconds);
        }
        for &index in &self.changes.energies {
            let joint = self.level.kept[index].index();
            let at = now[joint].translation - origin;
            let Turn { speed, weight } = turns[joint];
            let inertia = self.moments[index].about_point(at);
            self.sums[joint] += 0.5 * inertia * speed * speed * weight * seconds;
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
        let angle = 2.0 * turn.xyz().length().atan2(turn.w.abs());
        Turn {
            speed: angle / seconds,
            weight: self.settings.weight(self.bend(index, now)),
        }
    }

    /// The inner angle at a joint, in radians.
    fn bend(&self, joint: usize, now: &[Place]) -> f64 {
        let at = |index: usize| now[self.level.kept[index].index()].translation;
        let Some(parent) = self.level.parents[joint].map(usize::from) else {
            return PI;
        };
        // The straightest continuation: a chest is not bent because arms leave it sideways.
        let mut straightest: Option<f64> = None;
        for &child in &self.children[joint] {
            let angle = angle_between(at(parent) - at(joint), at(child) - at(joint));
            if let Some(angle) = angle
                && straightest.is_none_or(|other| angle > other)
            {
                straightest = Some(angle);
            }
        }
        straightest.unwrap_or(PI)
    }
}

/// The angle between two vectors in radians; `None` if one of them has no length.
fn angle_between(a: DVec3, b: DVec3) -> Option<f64> {
    /// Length below which a vector has no direction, in metres.
    const NO_LENGTH: f64 = 1e-6;
    if a.length() < NO_LENGTH || b.length() < NO_LENGTH {
        return None;
    }
    Some(a.cross(b).length().atan2(a.dot(b)))
}
