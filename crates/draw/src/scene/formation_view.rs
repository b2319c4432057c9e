//! The view of a formation by a camera: chooses levels of detail by distance, and figures and meshes by the size on the
//! screen.

use glam::Vec3;

use super::formation::{Formation, FormationError};
use super::{Camera, CrowdMember, CrowdShot, Detail, Light, MemberGroup, Shot};
use sabaki::crowd::{CrowdError, LevelId};
use sabaki::lod::{Measure, Rule, SwitchSettings, Switching, View};
use sabaki::math::{F32x16, Sphere};

/// Heights on the screen below which figures have fewer parts, then fewer triangles, in pixels.
const DISTANT: f32 = 26.0;
const TINY: f32 = 8.0;
const MIDDLE: f32 = 48.0;
const NEAR: f32 = 170.0;
/// Approximate height of a character, in metres.
const HEIGHT: f32 = 1.7;
/// Radius of the area with shadows, in metres.
const SHADOWS: f32 = 24.0;

impl Formation {
    /// Camera above the front of the column. It looks down a long column, and at the middle of a short one.
    #[must_use]
    pub fn camera(&self) -> Camera {
        /// Length from which on a column is a long one, in metres.
        const LONG: f32 = 18.0;
        let wide = 0.5 * self.abreast() as f32 * self.settings.apart;
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
    pub fn shot(
        &self,
        camera: Camera,
        size: [u32; 2],
    ) -> Result<(Shot, CrowdShot), FormationError> {
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
        for character in self
            .characters
            .iter()
            .filter(|one| is_seen(&camera, size, one.place))
        {
            let pixels = view.pixels(HEIGHT, camera.eye.distance(character.place).max(0.1));
            let (detail, afar) = match pixels {
                few if few < TINY => (Detail::Coarse, 2),
                few if few < DISTANT => (Detail::Coarse, 1),
                few if few < MIDDLE => (Detail::Coarse, 0),
                many if many > NEAR => (Detail::Fine, 0),
                _ => (Detail::Medium, 0),
            };
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
            let key = match self.skins.is_empty() {
                true => (3 * level + afar, detail, casts),
                false => (level, mesh_detail(pixels), casts),
            };
            seen.push((key, member));
        }
        seen.sort_by_key(|((figure, detail, casts), _)| (*figure, *detail as u8, *casts));
        let mut shown = CrowdShot {
            figures: self.figures.clone(),
            skins: self.skins.clone(),
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

    /// Colour of a level, from warm with all joints to cold with the fewest.
    fn tint(&self, level: usize) -> [f32; 4] {
        if !self.tinted {
            return [0.0; 4];
        }
        level_colour(level, self.levels()).extend(0.85).to_array()
    }
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
