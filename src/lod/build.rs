//! Which joint goes next.
//!
//! Source: Hasegawa, Nishio & Kobori, 3.1: the joint with the least energy is removed, energies are taken anew, until
//! nothing but the root and the ends is left. [`Order::Error`] goes beyond it: the joint goes whose
//! removal displaces the points of the body least, all levels so far included.

use serde::{Deserialize, Serialize};

use super::attach::{Riders, Seat};
use super::displacement::measure;
use super::energy::Energies;
use super::motion::check;
use super::samples::Samples;
use super::{EnergySettings, Level, Levels, LodError, joint_energies};
use crate::anim::{Clip, JointId, Skeleton};

/// How levels are made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LevelSettings {
    /// Which joint goes next.
    pub order: Order,
    /// What energies are made of.
    pub energy: EnergySettings,
    /// Joints that stay beside the root and the ends: a weapon's, those that inverse kinematics moves.
    pub locked: Vec<JointId>,
    /// The ends that stay; `None`: all joints without children, end sites included. Of a hand with fingers, ends that may go are
    /// levels more.
    pub ends: Option<Vec<JointId>>,
    /// What the points of a removed joint ride on.
    pub carrier: Carrier,
    /// How thick the body is around its bones, metres: without thickness a twist would be no error.
    pub skin: f32,
    /// How many frames placements are fitted to at most, evenly spread; errors are measured on all.
    pub samples: usize,
}

/// Which joint goes next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// The one with the least energy: the paper's.
    Energy,
    /// The one whose removal leaves the least sum of squared displacements of the body's points.
    Error,
}

/// What the points of a removed joint ride on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Carrier {
    /// The nearest kept joint above, or one of the nearest kept ones below: whichever displaces them less.
    Nearest,
    /// The nearest kept joint above.
    Parent,
}

impl Default for LevelSettings {
    fn default() -> Self {
        Self {
            order: Order::Energy,
            energy: EnergySettings::default(),
            locked: Vec::new(),
            ends: None,
            carrier: Carrier::Nearest,
            skin: 0.05,
            samples: 500,
        }
    }
}

impl LevelSettings {
    /// The most joints of a skeleton that levels are made for. There is a level for each joint, and each looks at all joints.
    pub const MOST_JOINTS: usize = 1024;

    /// The most joints times joints times frames that levels are made of: about a quarter of an hour on one core.
    pub const MOST_WORK: u64 = 1 << 32;

    fn check(&self, skeleton: &Skeleton) -> Result<(), LodError> {
        self.energy.check()?;
        if !(self.skin.is_finite() && self.skin > 0.0) {
            return Err(LodError::Setting {
                setting: "skin",
                value: self.skin,
                must: "above 0",
            });
        }
        let named = self.locked.iter().chain(self.ends.iter().flatten());
        match { named }.find(|id| id.index() >= skeleton.len()) {
            Some(unknown) => Err(LodError::UnknownJoint(unknown.0)),
            None => Ok(()),
        }
    }

    /// Of each joint whether it may go.
    fn removable(&self, skeleton: &Skeleton) -> Vec<bool> {
        let mut removable = match self.ends {
            Some(_) => vec![true; skeleton.len()],
            None => {
                let mut has_child = vec![false; skeleton.len()];
                for parent in skeleton.joints().iter().filter_map(|joint| joint.parent) {
                    has_child[parent.index()] = true;
                }
                has_child
            }
        };
        let stay = self.locked.iter().chain(self.ends.iter().flatten());
        for id in stay.chain([&JointId::ROOT]) {
            removable[id.index()] = false;
        }
        removable
    }
}

impl Levels {
    /// The levels of a skeleton for the clips that it plays: one order for all of them.
    ///
    /// # Errors
    /// No clip, a clip that is not of this skeleton, settings that make no sense.
    pub fn build(
        skeleton: &Skeleton,
        clips: &[Clip],
        settings: &LevelSettings,
    ) -> Result<Self, LodError> {
        settings.check(skeleton)?;
        if clips.is_empty() {
            return Err(LodError::NoClips);
        }
        clips.iter().try_for_each(|clip| check(skeleton, clip))?;
        check_work(skeleton.len(), clips.iter().map(Clip::frames).sum())?;
        let mut builder = Builder {
            skeleton,
            settings,
            energies: Energies::new(skeleton, clips, &settings.energy)?,
            samples: Samples::of(skeleton, clips, (settings.samples, settings.skin)),
            riders: Riders::none(skeleton.len()),
            keeps: vec![true; skeleton.len()],
            removable: settings.removable(skeleton),
            found: vec![None; skeleton.len()],
        };
        let mut levels = vec![builder.level()];
        let mut seats = Vec::new();
        while builder.removable.contains(&true) {
            let before = &levels[levels.len() - 1];
            let (level, seat) = builder.next(before)?;
            levels.push(level);
            seats.push(seat);
        }
        let on_level = joint_energies(skeleton, clips, &levels[0], &settings.energy)?;
        let mut energies = vec![0.0; skeleton.len()];
        for (id, energy) in levels[0].kept.iter().zip(on_level) {
            energies[id.index()] = energy;
        }
        let measured = measure(skeleton, clips, (&builder.samples, &levels, &seats));
        for (level, error) in levels.iter_mut().zip(measured.errors) {
            level.error = error;
        }
        Ok(Self {
            levels,
            energies,
            height: measured.height,
            reach: measured.reach,
            skin: settings.skin,
        })
    }
}

fn check_work(joints: usize, frames: usize) -> Result<(), LodError> {
    let product = (joints as u64 * joints as u64).saturating_mul(frames as u64);
    if joints <= LevelSettings::MOST_JOINTS && product <= LevelSettings::MOST_WORK {
        return Ok(());
    }
    Err(LodError::TooMuch {
        joints,
        frames,
        product,
    })
}

struct Builder<'a> {
    skeleton: &'a Skeleton,
    settings: &'a LevelSettings,
    energies: Energies<'a>,
    samples: Samples,
    riders: Riders,
    keeps: Vec<bool>,
    removable: Vec<bool>,
    /// Of each joint its best seat and by how much the squares grow if it goes, while that holds.
    found: Vec<Option<(Seat, f64)>>,
}

impl Builder<'_> {
    fn level(&self) -> Level {
        let mut level = Level::of(self.skeleton, &self.keeps);
        level.sit(&self.riders.seats);
        level
    }

    /// The next level, and where the joint that it has lost sits.
    fn next(&mut self, before: &Level) -> Result<(Level, Seat), LodError> {
        let energies = self.energies.update(before)?;
        let mut best: Option<(f64, usize)> = None;
        for (index, id) in before.kept.iter().enumerate() {
            if !self.removable[id.index()] {
                continue;
            }
            let price = match self.settings.order {
                Order::Energy => f64::from(energies[index]),
                Order::Error => self.seat(before, index).1,
            };
            if best.is_none_or(|(least, _)| price < least) {
                best = Some((price, index));
            }
        }
        // The caller has seen that one is left.
        let index = best.map_or(0, |(_, index)| index);
        let joint = before.kept[index];
        let (seat, _) = self.seat(before, index);
        self.riders.remove(joint, (seat.carrier, seat.offset));
        self.keeps[joint.index()] = false;
        self.removable[joint.index()] = false;
        // What saw the joint beside it, or has new riders, is fitted anew.
        for neighbour in before.neighbours(index) {
            self.found[before.kept[neighbour].index()] = None;
        }
        let level = Level {
            removed: Some(joint),
            energy: energies[index],
            ..self.level()
        };
        Ok((level, seat))
    }

    /// The best seat of a kept joint, and by how much the sum of squares grows if it goes.
    fn seat(&mut self, level: &Level, index: usize) -> (Seat, f64) {
        let joint = level.kept[index];
        if let Some(found) = self.found[joint.index()] {
            return found;
        }
        let carriers = level
            .neighbours(index)
            .filter(|&carrier| self.settings.carrier == Carrier::Nearest || carrier < index);
        let fits = carriers.map(|at| self.riders.fit(&self.samples, joint, level.kept[at]));
        // The parent stands first; it has the seat unless another is better.
        let best = fits.reduce(|best, fit| {
            if fit.squares < best.squares {
                fit
            } else {
                best
            }
        });
        let seat = best.unwrap_or_else(|| self.riders.fit(&self.samples, joint, JointId::ROOT));
        let found = (
            seat,
            seat.squares - self.riders.squares(&self.samples, joint),
        );
        self.found[joint.index()] = Some(found);
        found
    }
}
