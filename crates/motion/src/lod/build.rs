//! The order in which joints are removed.
//!
//! Source: Hasegawa, Nishio & Kobori, 3.1: the joint with the least energy is removed and the energies are computed again, until only
//! the root and the ends are left. [`Order::Error`] goes beyond the paper: it removes the joint whose removal displaces the points of the
//! body least, together with all earlier removals.

use super::attach::{Attachments, FittedAttachment, Samples};
use super::displacement::measure;
use super::level::check;
use super::settings::{LevelSettings, Order};
use super::{Level, Levels, LodError};
use crate::anim::{Clip, JointId, Skeleton};

impl Levels {
    /// Builds the levels of a skeleton from the clips that it plays. All clips share one order.
    ///
    /// # Errors
    /// No clip, a clip of another skeleton, settings out of range.
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
            clips,
            samples: Samples::new(skeleton, clips, settings.samples, settings.skin),
            attachments: Attachments::none(skeleton.len()),
            keeps: vec![true; skeleton.len()],
            removable: settings.removable(skeleton),
            found: vec![None; skeleton.len()],
        };
        let mut levels = vec![builder.level()];
        let mut attachments = Vec::new();
        while builder.removable.contains(&true) {
            let before = &levels[levels.len() - 1];
            let (level, attachment) = builder.next(before)?;
            levels.push(level);
            attachments.push(attachment);
        }
        let on_level = levels[0].joint_energies(skeleton, clips, settings)?;
        let mut energies = vec![0.0; skeleton.len()];
        for (id, energy) in levels[0].kept.iter().zip(on_level) {
            energies[id.index()] = energy;
        }
        let measured = measure(skeleton, clips, &builder.samples, &levels, &attachments);
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
    clips: &'a [Clip],
    samples: Samples,
    attachments: Attachments,
    keeps: Vec<bool>,
    removable: Vec<bool>,
    /// Best attachment of each joint and the increase of the squared displacement by its removal; `None` when out of date.
    found: Vec<Option<(FittedAttachment, f64)>>,
}

impl Builder<'_> {
    fn level(&self) -> Level {
        let mut level = Level::keeping(self.skeleton, &self.keeps);
        level.attach(&self.attachments.by_joint);
        level
    }

    /// The next level, and the attachment of the joint that it has lost.
    fn next(&mut self, before: &Level) -> Result<(Level, FittedAttachment), LodError> {
        let energies = before.joint_energies(self.skeleton, self.clips, self.settings)?;
        let mut best: Option<(f64, usize)> = None;
        for (index, id) in before.kept.iter().enumerate() {
            if !self.removable[id.index()] {
                continue;
            }
            let price = match self.settings.order {
                Order::Energy => f64::from(energies[index]),
                Order::Error => self.fitted(before, index).1,
            };
            if best.is_none_or(|(least, _)| price < least) {
                best = Some((price, index));
            }
        }
        // The caller has checked that a removable joint is left.
        let index = best.map_or(0, |(_, index)| index);
        let joint = before.kept[index];
        let (attachment, _) = self.fitted(before, index);
        self.attachments.remove(joint, &attachment);
        self.keeps[joint.index()] = false;
        self.removable[joint.index()] = false;
        // The neighbours' attachments are out of date.
        for neighbour in before.neighbours(index) {
            self.found[before.kept[neighbour].index()] = None;
        }
        let level = Level {
            removed: Some(joint),
            energy: energies[index],
            ..self.level()
        };
        Ok((level, attachment))
    }

    /// The best attachment of a kept joint, and the increase of the squared displacement by its removal.
    fn fitted(&mut self, level: &Level, index: usize) -> (FittedAttachment, f64) {
        let joint = level.kept[index];
        if let Some(found) = self.found[joint.index()] {
            return found;
        }
        let carriers = level.neighbours(index);
        let fits = carriers.map(|at| self.attachments.fit(&self.samples, joint, level.kept[at]));
        // The parent stands first and wins ties.
        let best = fits.reduce(|best, fit| {
            if fit.squares < best.squares {
                fit
            } else {
                best
            }
        });
        let attachment =
            best.unwrap_or_else(|| self.attachments.fit(&self.samples, joint, JointId::ROOT));
        let found = (
            attachment,
            attachment.squares - self.attachments.squares(&self.samples, joint),
        );
        self.found[joint.index()] = Some(found);
        found
    }
}
