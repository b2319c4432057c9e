//! The formation of the paper: a column of characters, seen from its front.
//!
//! Source: Hasegawa, Nishio and Kobori, last section: 10,000 characters, each with a level of
//! detail that depends on its distance.

use std::sync::Arc;

use glam::Vec3;
use thiserror::Error;

use super::{Figure, Look, Skin};
use sabaki::anim::{Clip, Skeleton};
use sabaki::crowd::{
    AnimationSet, Character, ClipId, Crowd, CrowdError, CrowdSettings, Layout, LevelId, MemberId,
    Output, Placement, WriteMode,
};
use sabaki::lod::{LevelSettings, Levels, LodError};
use sabaki::maps::Body;
use sabaki::math::{F32x16, Rigid2};

/// Settings of a formation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FormationSettings {
    /// Number of characters. Default 10,000.
    pub count: u32,
    /// Number of characters in a row. Default 10.
    pub abreast: u32,
    /// Distance between neighbours, in metres. Default 1.3.
    pub apart: f32,
    /// Delay between two rows, in seconds. Default 0.09.
    pub delay: f32,
    /// Maximum error of a level on the screen, in pixels. Default 2.
    pub error: f32,
    /// Number of threads that evaluate poses, or 0 for one thread per CPU core. Default 0.
    pub threads: usize,
    /// Colours of the characters.
    pub look: Look,
}

impl Default for FormationSettings {
    fn default() -> Self {
        Self {
            count: 10_000,
            abreast: 10,
            apart: 1.3,
            delay: 0.09,
            error: 2.0,
            threads: 0,
            look: Look::default(),
        }
    }
}

/// Reason why a formation cannot be created.
#[derive(Debug, Error)]
pub enum FormationError {
    /// Levels cannot be built or switched.
    #[error(transparent)]
    Lod(#[from] LodError),
    /// The clips cannot be converted to animations, or there are too many characters.
    #[error(transparent)]
    Crowd(#[from] CrowdError),
}

/// A column of characters that play the same clip, each row later than the row in front of it.
pub struct Formation {
    pub(super) crowd: Crowd,
    pub(super) levels: Levels,
    pub(super) settings: FormationSettings,
    pub(super) characters: Vec<FormationMember>,
    /// For each level a complete figure, then figures of its [`DISTANT_PARTS`] and [`TINY_PARTS`] largest parts.
    pub(super) figures: Vec<Figure>,
    /// For each level the mesh that is drawn in place of figures, if there is one.
    pub(super) skins: Vec<Arc<Skin>>,
    /// Duration of the clip, in seconds.
    period: f32,
    /// Length of the output when all characters have all joints, in `F32x16`s.
    start_len: usize,
    /// Whether levels depend on distance.
    pub(super) lod: bool,
    /// Whether colours show the levels.
    pub(super) tinted: bool,
}

pub(super) struct FormationMember {
    pub(super) id: MemberId,
    pub(super) place: Vec3,
    pub(super) level: LevelId,
}

/// Number of parts of a figure at a distance.
const DISTANT_PARTS: usize = 12;
/// Number of parts of a figure of a few pixels.
const TINY_PARTS: usize = 4;

/// Body and motion of all characters of a formation.
#[derive(Clone, Copy, Debug)]
pub struct Performer<'a> {
    /// Skeleton of the clip.
    pub skeleton: &'a Skeleton,
    /// Spheres of the body, from which the figure is made.
    pub body: &'a Body,
    /// Motion that is repeated.
    pub clip: &'a Clip,
    /// Mesh that is drawn in place of the figure.
    pub skin: Option<&'a Skin>,
}

impl Formation {
    /// Creates a formation in which all characters repeat the performer's clip.
    ///
    /// # Errors
    /// The levels, the animations or the crowd cannot be created.
    pub fn new(
        performer: Performer<'_>,
        settings: &FormationSettings,
    ) -> Result<Self, FormationError> {
        let Performer {
            skeleton,
            body,
            clip,
            skin,
        } = performer;
        let clips = std::slice::from_ref(clip);
        let levels = Levels::build(skeleton, clips, &LevelSettings::default())?;
        let animations = Arc::new(AnimationSet::new(skeleton, clips, &levels.levels)?);
        let whole = Figure::of(skeleton, body, &settings.look);
        let figures = levels.levels.iter().flat_map(|level| {
            let near = whole.attached(level);
            let distant = near.largest(DISTANT_PARTS);
            let tiny = near.largest(TINY_PARTS);
            [near, distant, tiny]
        });
        let skins = levels
            .levels
            .iter()
            .filter_map(|level| Some(Arc::new(skin?.attached(level))))
            .collect();
        let output = Output {
            layout: Layout::Blocks,
            write: WriteMode::Streamed,
            ..Output::default()
        };
        let period = animations.duration(ClipId(0)).unwrap_or(1.0).max(1e-3);
        let mut formation = Self {
            figures: figures.collect(),
            skins,
            crowd: Crowd::new(
                Arc::clone(&animations),
                CrowdSettings {
                    output,
                    threads: settings.threads,
                    ..CrowdSettings::default()
                },
            ),
            levels,
            settings: *settings,
            characters: Vec::new(),
            period,
            start_len: 0,
            lod: true,
            tinted: false,
        };
        formation.fill()?;
        formation.start_len = formation.crowd.output_len();
        Ok(formation)
    }

    fn fill(&mut self) -> Result<(), FormationError> {
        let FormationSettings {
            count,
            apart,
            delay,
            ..
        } = self.settings;
        let abreast = self.abreast();
        for index in 0..count {
            let (row, file) = (index / abreast, index % abreast);
            let x = (file as f32 - 0.5 * (abreast - 1) as f32) * apart;
            let z = -(row as f32) * apart;
            let time = -(row as f32) * delay;
            let character = Character {
                time: time.rem_euclid(self.period),
                speed: 1.0,
                placement: Placement {
                    ground: Rigid2::new(0.0, x, z),
                    height: 0.0,
                },
                ..Character::default()
            };
            self.characters.push(FormationMember {
                id: self.crowd.add(&character)?,
                place: Vec3::new(x, 0.0, z),
                level: LevelId(0),
            });
        }
        Ok(())
    }

    /// Number of characters in the first row.
    pub(super) fn abreast(&self) -> u32 {
        let FormationSettings { count, abreast, .. } = self.settings;
        abreast.min(count).max(1)
    }

    /// Time after which the formation repeats, in seconds.
    #[must_use]
    pub fn period(&self) -> f32 {
        self.period
    }

    /// Number of levels.
    #[must_use]
    pub fn levels(&self) -> usize {
        self.levels.levels.len()
    }

    /// Number of characters.
    #[must_use]
    pub fn len(&self) -> usize {
        self.characters.len()
    }

    /// Whether there are no characters.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.characters.is_empty()
    }

    /// Length of the column, in metres.
    #[must_use]
    pub fn length(&self) -> f32 {
        let rows = self.settings.count.div_ceil(self.abreast());
        rows.saturating_sub(1) as f32 * self.settings.apart
    }

    /// Maximum length of the poses, in [`F32x16`]s: that of all characters with all joints.
    #[must_use]
    pub fn max_output_len(&self) -> usize {
        // Characters that change their level are in additional groups for a while: at most one in sixteen.
        let groups = 2 * (self.characters.len().div_ceil(F32x16::LANES) + 2);
        let group = Output::default().group_len(self.levels.levels[0].kept.len());
        self.start_len.max(groups * group)
    }

    /// Number of parts of all figures, and of bones of all skins.
    #[must_use]
    pub fn parts(&self) -> usize {
        let bones: usize = self.skins.iter().map(|skin| skin.bones.len()).sum();
        let parts: usize = self.figures.iter().map(|figure| figure.parts.len()).sum();
        parts + bones
    }

    /// Selects levels by distance, or all joints for every character.
    pub fn use_levels(&mut self, lod: bool) {
        self.lod = lod;
    }

    /// Maximum error of a level on the screen, in pixels ([`FormationSettings::error`]).
    #[must_use]
    pub fn error(&self) -> f32 {
        self.settings.error
    }

    /// Sets the maximum error of a level, in pixels. It takes effect with the next
    /// [`Formation::look_from`].
    pub fn set_error(&mut self, pixels: f32) {
        self.settings.error = pixels;
    }

    /// Shows the characters in the colours of their levels or in their own colours.
    pub fn show_levels(&mut self, tinted: bool) {
        self.tinted = tinted;
    }

    /// Number of characters on each level.
    #[must_use]
    pub fn census(&self) -> Vec<usize> {
        let mut census = vec![0; self.levels()];
        for character in &self.characters {
            census[usize::from(character.level.0)] += 1;
        }
        census
    }

    /// Advances the time by `seconds`.
    pub fn advance(&mut self, seconds: f32) {
        self.crowd.advance(f64::from(seconds));
    }
}
