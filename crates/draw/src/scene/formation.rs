//! The formation of the paper: a column of characters, seen from its front. Levels of detail go by distance, resolutions of meshes by
//! the size on the screen.
//!
//! Source: Hasegawa, Nishio and Kobori, last section: 10,000 characters, each with a level of
//! detail that depends on its distance.

use std::sync::Arc;

use glam::Vec3;

use super::{Camera, CrowdMember, CrowdShot, Detail, Light, MemberGroup, Shot, Skin};
use sabaki::anim::{Clip, Skeleton};
use sabaki::crowd::{
    AnimationSet, Character, ClipId, Crowd, CrowdError, CrowdSettings, Layout, LevelId, MemberId,
    Output, Placement, WriteMode,
};
use sabaki::lod::{LevelSettings, Levels, Measure, Rule, SwitchSettings, Switching, View};
use sabaki::math::{F32x16, Rigid2, Sphere};

/// Settings of a formation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FormationSettings {
    /// Number of characters. Default 10,000.
    pub count: u32,
    /// Maximum error of a level on the screen, in pixels. Default 2.
    pub error: f32,
    /// Number of threads that evaluate poses, or 0 for one thread per CPU core. Default 0.
    pub threads: usize,
}

impl Default for FormationSettings {
    fn default() -> Self {
        Self {
            count: 10_000,
            error: 2.0,
            threads: 0,
        }
    }
}

/// A column of characters that play the same clip, each row later than the row in front of it.
pub struct Formation {
    crowd: Crowd,
    levels: Levels,
    settings: FormationSettings,
    characters: Vec<FormationMember>,
    /// For each level the mesh that is drawn.
    skins: Vec<Arc<Skin>>,
    /// Duration of the clip, in seconds.
    period: f32,
    /// Whether levels depend on distance.
    lod: bool,
    /// Whether colours show the levels.
    tinted: bool,
}

struct FormationMember {
    id: MemberId,
    place: Vec3,
    level: LevelId,
}

/// Heights on the screen at which the resolution of meshes changes, in pixels.
const DISTANT: f32 = 26.0;
const MIDDLE: f32 = 48.0;
const NEAR: f32 = 170.0;
/// Number of characters in a row.
const ABREAST: u32 = 10;
/// Delay between two rows, in seconds.
const DELAY: f32 = 0.09;
/// Approximate height of a character, in metres.
const HEIGHT: f32 = 1.7;
/// Radius of the area with shadows, in metres.
const SHADOWS: f32 = 24.0;

impl Formation {
    /// Distance between neighbours, in metres.
    pub const APART: f32 = 1.3;

    /// Creates a formation in which all characters repeat a clip. `skin` is the mesh that is drawn.
    ///
    /// # Errors
    /// The levels, the animations or the crowd cannot be created.
    pub fn new(
        skeleton: &Skeleton,
        clip: &Clip,
        skin: &Skin,
        settings: &FormationSettings,
    ) -> Result<Self, CrowdError> {
        let clips = std::slice::from_ref(clip);
        let levels = Levels::build(skeleton, clips, &LevelSettings::default())?;
        let animations = Arc::new(AnimationSet::new(skeleton, clips, &levels.levels)?);
        let period = animations.duration(ClipId(0)).unwrap_or(1.0).max(1e-3);
        let skins = levels.levels.iter();
        let skins = skins.map(|level| Arc::new(skin.attached(level))).collect();
        let crowd_settings = CrowdSettings {
            output: Output {
                layout: Layout::Blocks,
                write: WriteMode::Streamed,
            },
            threads: settings.threads,
            ..CrowdSettings::default()
        };
        let mut crowd = Crowd::new(animations, crowd_settings);
        let (count, abreast) = (settings.count, abreast(settings.count));
        let mut characters = Vec::with_capacity(count as usize);
        for index in 0..count {
            let (row, file) = ((index / abreast) as f32, index % abreast);
            let x = (file as f32 - 0.5 * (abreast - 1) as f32) * Self::APART;
            let place = Vec3::new(x, 0.0, -row * Self::APART);
            let character = Character {
                time: (-row * DELAY).rem_euclid(period),
                speed: 1.0,
                placement: Placement {
                    ground: Rigid2::new(0.0, place.x, place.z),
                    height: 0.0,
                },
                ..Character::default()
            };
            characters.push(FormationMember {
                id: crowd.add(&character)?,
                place,
                level: LevelId(0),
            });
        }
        Ok(Self {
            crowd,
            levels,
            settings: *settings,
            characters,
            skins,
            period,
            lod: true,
            tinted: false,
        })
    }

    /// Time after which the formation repeats, in seconds.
    pub fn period(&self) -> f32 {
        self.period
    }

    /// Number of levels.
    pub fn levels(&self) -> usize {
        self.levels.levels.len()
    }

    /// Number of characters.
    pub fn len(&self) -> usize {
        self.characters.len()
    }

    /// Whether there are no characters.
    pub fn is_empty(&self) -> bool {
        self.characters.is_empty()
    }

    /// Length of the column, in metres.
    fn length(&self) -> f32 {
        let rows = self.settings.count.div_ceil(abreast(self.settings.count));
        rows.saturating_sub(1) as f32 * Self::APART
    }

    /// Maximum length of the poses, in [`F32x16`]s: that of all characters with all joints.
    pub fn max_output_len(&self) -> usize {
        self.crowd.max_output_len(self.characters.len())
    }

    /// Number of bones of the skins of all levels.
    pub fn bones(&self) -> usize {
        self.skins.iter().map(|skin| skin.bones.len()).sum()
    }

    /// Selects levels by distance, or all joints for every character.
    pub fn use_levels(&mut self, lod: bool) {
        self.lod = lod;
    }

    /// Maximum error of a level on the screen, in pixels ([`FormationSettings::error`]). A change takes effect with the next
    /// [`Formation::look_from`].
    pub fn error_mut(&mut self) -> &mut f32 {
        &mut self.settings.error
    }

    /// Shows the characters in the colours of their levels or in their own colours.
    pub fn show_levels(&mut self, tinted: bool) {
        self.tinted = tinted;
    }

    /// Number of characters on each level.
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

    /// Camera above the front of the column. It looks down a long column, and at the middle of a short one.
    pub fn camera(&self) -> Camera {
        /// Length from which on a column is a long one, in metres.
        const LONG: f32 = 18.0;
        let wide = 0.5 * abreast(self.settings.count) as f32 * Self::APART;
        let long = (self.length() / LONG).min(1.0);
        let short = 1.0 - long;
        Camera {
            eye: Vec3::new(
                0.30 * wide,
                4.2 - 1.8 * short,
                7.5 + short * (1.5 * wide - 2.5),
            ),
            target: Vec3::new(-0.05 * wide, 0.8 - 0.6 * long, -9.0 * long),
            field: 38f32.to_radians(),
        }
    }

    /// Assigns each character the level for a camera.
    ///
    /// # Errors
    /// The field of view or the size is invalid.
    pub fn look_from(&mut self, camera: &Camera, size: [u32; 2]) -> Result<(), CrowdError> {
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

    /// Evaluates all poses directly into the memory that is drawn from.
    ///
    /// # Errors
    /// `out` is smaller than [`Formation::max_output_len`].
    pub fn pose(&mut self, out: &mut [F32x16]) -> Result<(), CrowdError> {
        self.crowd.pose(out)
    }

    /// Shot of the crowd with the poses of the last [`Formation::pose`].
    ///
    /// # Errors
    /// [`Formation::pose`] has not been called.
    pub fn shot(&self, camera: Camera, size: [u32; 2]) -> Result<(Shot, CrowdShot), CrowdError> {
        // Shadows are placed in front of the camera, where they are most visible.
        let ahead = camera.target - camera.eye;
        let ahead = Vec3::new(ahead.x, 0.0, ahead.z).normalize_or(Vec3::NEG_Z);
        let middle = Vec3::new(camera.eye.x, 0.0, camera.eye.z) + ahead * 20.5;
        let light = Light {
            fade: 260.0,
            grid: 0.16,
            shadow: Sphere::new(middle, SHADOWS),
            ..Light::default()
        };
        let view = View {
            fov: camera.field,
            height: size[1] as f32,
        };
        let mut seen = Vec::with_capacity(self.characters.len());
        let characters = self.characters.iter();
        for character in characters.filter(|one| is_seen(&camera, size, one.place)) {
            let pixels = view.pixels(HEIGHT, camera.eye.distance(character.place).max(0.1));
            let slice = self.crowd.pose_slice(character.id)?;
            // The slice may have a finer level than the character's, with the same appearance.
            let level = usize::from(slice.level.0);
            let first = slice.position(0, 0);
            let member = CrowdMember {
                first: first as u32,
                stride: (slice.position(0, 1) - first) as u32,
                tint: self.tint(usize::from(character.level.0)),
            };
            let casts = character.place.distance(middle) < SHADOWS + HEIGHT;
            let key = (level, mesh_detail(pixels), casts);
            seen.push((key, member));
        }
        seen.sort_by_key(|((level, detail, casts), _)| (*level, *detail as u8, *casts));
        let mut shown = CrowdShot {
            skins: self.skins.clone(),
            ..CrowdShot::default()
        };
        for alike in seen.chunk_by(|a, b| a.0 == b.0) {
            let (skin, detail, casts) = alike[0].0;
            let first = shown.members.len() as u32;
            shown
                .members
                .extend(alike.iter().map(|(_, member)| *member));
            shown.groups.push(MemberGroup {
                skin,
                members: first..shown.members.len() as u32,
                detail,
                casts,
            });
        }
        Ok((Shot::new(camera, light), shown))
    }

    /// Colour of a level, from warm with all joints to cold with the fewest.
    fn tint(&self, level: usize) -> [f32; 4] {
        if !self.tinted {
            return [0.0; 4];
        }
        level_colour(level, self.levels()).extend(0.85).to_array()
    }
}

/// Number of characters in the first row of so many.
fn abreast(count: u32) -> u32 {
    ABREAST.min(count).max(1)
}

/// Linear colour of a level: red with all joints, then yellow and green, blue with the fewest.
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

/// Resolution of a mesh of some height on the screen, in pixels.
fn mesh_detail(pixels: f32) -> Detail {
    match pixels {
        few if few < DISTANT => Detail::Tiny,
        few if few < MIDDLE => Detail::Coarse,
        many if many > NEAR => Detail::Fine,
        _ => Detail::Medium,
    }
}

/// Whether a character at a place may be visible.
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
