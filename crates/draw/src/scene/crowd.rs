//! The paper's formation: a column of characters, seen from its head.
//!
//! Source: Hasegawa, Nishio and Kobori, their last section: 10,000 characters, each with a level of detail by its distance.

use std::sync::Arc;

use glam::Vec3;
use thiserror::Error;

use super::{
    Camera, CrowdMember, CrowdShot, Detail, Figure, FigurePart, Light, Look, MemberGroup, Shot,
};
use sabaki::anim::{Clip, JointId, Skeleton};
use sabaki::crowd::{
    self, AnimationSet, AnimationSetError, Character, CharacterId, ClipId, CrowdError,
    CrowdSettings, Layout, LevelId, Output, Placement, PoseError, WriteMode,
};
use sabaki::lod::{
    Level, LevelSettings, Levels, LodError, Measure, Rule, SwitchSettings, Switching, View,
};
use sabaki::maps::Body;
use sabaki::math::{F32x16, Rigid2};

/// Who stands where, and what they do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FormationSettings {
    /// How many. Default 10,000.
    pub count: u32,
    /// Side by side. Default 10.
    pub abreast: u32,
    /// From one to the next, metres. Default 1.3.
    pub apart: f32,
    /// Seconds by which each row begins after the one before it. Default 0.09.
    pub delay: f32,
    /// Pixels of error on the screen that a level may make. Default 2.
    pub error: f32,
    /// Threads that pose; 0 for as many as the machine has.
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

/// Why there is no formation.
#[derive(Debug, Error)]
pub enum FormationError {
    /// Levels could not be built, or switched.
    #[error(transparent)]
    Lod(#[from] LodError),
    /// The clips make no animations.
    #[error(transparent)]
    AnimationSet(#[from] AnimationSetError),
    /// Too many characters.
    #[error(transparent)]
    Crowd(#[from] CrowdError),
}

/// A column of characters who all do the same, each row a moment after the one before it.
pub struct Crowd {
    crowd: crowd::Crowd,
    levels: Levels,
    settings: FormationSettings,
    characters: Vec<Standing>,
    /// Of each level a whole figure, one of its largest parts, and one of even fewer.
    figures: Vec<Figure>,
    /// Seconds of the clip that is played.
    period: f32,
    most_lines: usize,
    /// Whether levels go by distance.
    lod: bool,
    /// Whether levels are shown by colours.
    tinted: bool,
}

struct Standing {
    id: CharacterId,
    place: Vec3,
    level: LevelId,
}

/// Parts of a figure that is seen from afar.
const PARTS_AFAR: usize = 12;
/// And of one that is a speck.
const PARTS_OF_SPECK: usize = 4;
/// Characters of fewer pixels are drawn with these; then with fewer triangles.
const AFAR: f32 = 26.0;
const SPECK: f32 = 8.0;
const MIDDLE: f32 = 48.0;
const NEAR: f32 = 170.0;
/// Roughly, metres.
const HEIGHT: f32 = 1.7;
/// How far from their middle there are shadows, metres.
const SHADOWS: f32 = 24.0;

impl Crowd {
    /// Everybody plays `clip`, over and over.
    ///
    /// # Errors
    /// What makes no levels, no animations or no crowd.
    pub fn new(
        (skeleton, body): (&Skeleton, &Body),
        clip: &Clip,
        settings: &FormationSettings,
    ) -> Result<Self, FormationError> {
        let clips = std::slice::from_ref(clip);
        let levels = Levels::build(skeleton, clips, &LevelSettings::default())?;
        let animations = Arc::new(AnimationSet::new(skeleton, clips, &levels.levels)?);
        let whole = Figure::of(skeleton, body, &settings.look);
        let figures = levels.levels.iter().flat_map(|level| {
            let seated = seated(&whole, level);
            let afar = largest(&seated, PARTS_AFAR);
            let speck = largest(&seated, PARTS_OF_SPECK);
            [seated, afar, speck]
        });
        let output = Output {
            layout: Layout::Blocks,
            write: WriteMode::Streamed,
            ..Output::default()
        };
        let period = animations.duration(ClipId(0)).unwrap_or(1.0).max(1e-3);
        let mut formation = Self {
            figures: figures.collect(),
            crowd: crowd::Crowd::new(
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
            most_lines: 0,
            lod: true,
            tinted: false,
        };
        formation.fill()?;
        formation.most_lines = formation.crowd.output_len();
        Ok(formation)
    }

    fn fill(&mut self) -> Result<(), FormationError> {
        let FormationSettings {
            count,
            abreast,
            apart,
            delay,
            ..
        } = self.settings;
        let abreast = abreast.max(1);
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
            self.characters.push(Standing {
                id: self.crowd.add(&character)?,
                place: Vec3::new(x, 0.0, z),
                level: LevelId(0),
            });
        }
        Ok(())
    }

    /// Seconds after which everything is as it was.
    #[must_use]
    pub fn period(&self) -> f32 {
        self.period
    }

    /// How many levels there are.
    #[must_use]
    pub fn levels(&self) -> usize {
        self.levels.levels.len()
    }

    /// How many characters.
    #[must_use]
    pub fn len(&self) -> usize {
        self.characters.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.characters.is_empty()
    }

    /// From the first row to the last, metres.
    #[must_use]
    pub fn long(&self) -> f32 {
        let rows = self.settings.count.div_ceil(self.settings.abreast.max(1));
        rows.saturating_sub(1) as f32 * self.settings.apart
    }

    /// Lines of memory that the poses take at most: when all have all joints.
    #[must_use]
    pub fn most_lines(&self) -> usize {
        // Those who change their kind stand in groups of their own for a while: one in sixteen at most.
        let groups = 2 * (self.characters.len().div_ceil(F32x16::LANES) + 2);
        let group = Output::default().group_len(self.levels.levels[0].kept.len());
        self.most_lines.max(groups * group)
    }

    /// Parts of all figures together.
    #[must_use]
    pub fn parts(&self) -> usize {
        self.figures.iter().map(|figure| figure.parts.len()).sum()
    }

    /// Levels by distance, or all joints for everybody.
    pub fn use_levels(&mut self, lod: bool) {
        self.lod = lod;
    }

    /// Pixels of error on the screen that a level may make: [`FormationSettings::error`].
    #[must_use]
    pub fn error(&self) -> f32 {
        self.settings.error
    }

    /// Another such error from the next [`Crowd::look_from`] on.
    pub fn set_error(&mut self, pixels: f32) {
        self.settings.error = pixels;
    }

    /// Characters in the colours of their levels, or in their own.
    pub fn show_levels(&mut self, tinted: bool) {
        self.tinted = tinted;
    }

    /// How many characters are on each level.
    #[must_use]
    pub fn census(&self) -> Vec<usize> {
        let mut census = vec![0; self.levels()];
        for character in &self.characters {
            census[usize::from(character.level.0)] += 1;
        }
        census
    }

    /// Time goes on, seconds.
    pub fn advance(&mut self, seconds: f32) {
        self.crowd.advance(f64::from(seconds));
    }

    /// From before the head of the column, above it.
    #[must_use]
    pub fn camera(&self) -> Camera {
        let wide = 0.5 * self.settings.abreast as f32 * self.settings.apart;
        Camera {
            eye: Vec3::new(0.30 * wide, 4.2, 7.5),
            target: Vec3::new(-0.05 * wide, 0.2, -9.0),
            field: 38f32.to_radians(),
        }
    }

    /// Gives everybody the level that a camera asks for.
    ///
    /// # Errors
    /// A field of view or a size that is none.
    pub fn look_from(&mut self, camera: &Camera, size: [u32; 2]) -> Result<(), FormationError> {
        let settings = SwitchSettings {
            view: View {
                fov: camera.field,
                height: size[1] as f32,
            },
            rule: Rule::ScreenError {
                pixels: self.settings.error,
                measure: Measure::Greatest,
            },
            ..SwitchSettings::default()
        };
        let switching = Switching::new(&self.levels, &settings)?;
        for character in &mut self.characters {
            let distance = camera.eye.distance(character.place + Vec3::Y);
            let level = match self.lod {
                true => switching.choose(distance, None).level,
                false => LevelId(0),
            };
            if level != character.level {
                self.crowd.set_level(character.id, level)?;
                character.level = level;
            }
        }
        Ok(())
    }

    /// Poses everybody straight into the memory that is drawn from.
    ///
    /// # Errors
    /// Less memory than [`Crowd::most_lines`].
    pub fn pose(&mut self, out: &mut [F32x16]) -> Result<(), PoseError> {
        self.crowd.pose(out)
    }

    /// What a camera sees of the crowd as it was posed last.
    ///
    /// # Errors
    /// None after [`Crowd::pose`].
    pub fn shot(
        &self,
        camera: Camera,
        size: [u32; 2],
    ) -> Result<(Shot, CrowdShot), FormationError> {
        // Shadows lie where one sees them best: before the camera.
        let ahead = camera.target - camera.eye;
        let ahead = Vec3::new(ahead.x, 0.0, ahead.z).normalize_or(Vec3::NEG_Z);
        let middle = Vec3::new(camera.eye.x, 0.0, camera.eye.z) + ahead * 20.5;
        let light = Light {
            fade: 260.0,
            grid: 0.16,
            shadow: (middle, SHADOWS),
            ..Light::default()
        };
        let view = View {
            fov: camera.field,
            height: size[1] as f32,
        };
        let mut seen = Vec::with_capacity(self.characters.len());
        for character in self
            .characters
            .iter()
            .filter(|one| is_seen(&camera, size, one.place))
        {
            let pixels = view.pixels(HEIGHT, camera.eye.distance(character.place).max(0.1));
            let (detail, afar) = match pixels {
                few if few < SPECK => (Detail::Coarse, 2),
                few if few < AFAR => (Detail::Coarse, 1),
                few if few < MIDDLE => (Detail::Coarse, 0),
                many if many > NEAR => (Detail::Fine, 0),
                _ => (Detail::Medium, 0),
            };
            let slice = self.crowd.pose_slice(character.id)?;
            // It may be posed on a finer level than its own, on which it looks alike.
            let level = usize::from(slice.level.0);
            let first = slice.position(0, 0);
            let member = CrowdMember {
                first: first as u32,
                stride: (slice.position(0, 1) - first) as u32,
                tint: self.tint(usize::from(character.level.0)),
            };
            let casts = character.place.distance(middle) < SHADOWS + HEIGHT;
            seen.push(((3 * level + afar, detail, casts), member));
        }
        seen.sort_by_key(|((figure, detail, casts), _)| (*figure, *detail as u8, *casts));
        let mut shown = CrowdShot {
            figures: self.figures.clone(),
            ..CrowdShot::default()
        };
        for alike in seen.chunk_by(|a, b| a.0 == b.0) {
            let (figure, detail, casts) = alike[0].0;
            let first = shown.members.len() as u32;
            shown
                .members
                .extend(alike.iter().map(|(_, member)| *member));
            shown.groups.push(MemberGroup {
                figure,
                members: first..shown.members.len() as u32,
                detail,
                casts,
            });
        }
        Ok((Shot::new(camera, light), shown))
    }

    /// From warm at all joints to cold at the fewest.
    fn tint(&self, level: usize) -> [f32; 4] {
        if !self.tinted {
            return [0.0; 4];
        }
        level_colour(level, self.levels()).extend(0.85).to_array()
    }
}

/// The colour of a level, linear: red with all joints, over yellow and green to blue with the fewest.
#[must_use]
pub fn level_colour(level: usize, levels: usize) -> Vec3 {
    const STOPS: [Vec3; 4] = [
        Vec3::new(0.80, 0.10, 0.06),
        Vec3::new(0.90, 0.58, 0.06),
        Vec3::new(0.14, 0.58, 0.20),
        Vec3::new(0.07, 0.20, 0.70),
    ];
    let along = 3.0 * level as f32 / levels.saturating_sub(1).max(1) as f32;
    let stop = (along as usize).min(2);
    STOPS[stop].lerp(STOPS[stop + 1], along - stop as f32)
}

/// Whether somebody there may be in the picture.
fn is_seen(camera: &Camera, size: [u32; 2], place: Vec3) -> bool {
    let middle = place + Vec3::Y;
    let ahead = (camera.target - camera.eye).normalize_or(Vec3::NEG_Z);
    let away = (middle - camera.eye).dot(ahead);
    let Some(at) = camera.pixel(middle, size) else {
        return false;
    };
    let margin = 1.6 * size[1] as f32 / (2.0 * (0.5 * camera.field).tan()) / away.max(0.1);
    let within = |at: f32, side: u32| at > -margin && at < side as f32 + margin;
    within(at.x, size[0]) && within(at.y, size[1])
}

/// A figure whose parts ride on the joints that a level keeps.
fn seated(figure: &Figure, level: &Level) -> Figure {
    let parts = figure.parts.iter().map(|part| {
        let seats = part.joints.map(|joint| &level.seats[joint.index()]);
        FigurePart {
            joints: seats.map(|seat| JointId(seat.carrier)),
            ends: [0, 1].map(|end: usize| seats[end].offset.point(part.ends[end])),
            ..*part
        }
    });
    Figure {
        parts: parts.collect(),
    }
}

/// The parts of a figure that take up most room.
fn largest(figure: &Figure, parts_left: usize) -> Figure {
    let size = |part: &FigurePart| {
        let radius = part.radii[0].max(part.radii[1]);
        radius * (part.ends[0].distance(part.ends[1]) + radius)
    };
    let mut parts = figure.parts.clone();
    parts.sort_by(|a, b| size(b).total_cmp(&size(a)));
    parts.truncate(parts_left);
    Figure { parts }
}
