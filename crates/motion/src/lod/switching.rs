//! The level at each distance from the camera, and the bands of distance in which one level is blended into the next.
//!
//! Source: Hasegawa, Nishio & Kobori, 3.2: the distance of a level is linear in the energy of the joint that it has lost; beyond L only
//! the root and the ends are left. Their sections 4.2 and 5 leave the jumps between levels to future work. Here each joint is removed in
//! a band of distance, in which it is blended from its own motion to its attachment ([`super::Blend`]).
//!
//! The width w of a band follows from the camera's speed. A point that the next level draws s metres away moves by s v t / w metres in a
//! frame of t seconds at v m/s. This must not exceed a given number of pixels at the nearest point of the body. Bands do not overlap, so
//! that one joint at a time is blended; where distances lie too close together, the later bands are moved outwards. Between the end of
//! the blend and the start of the coarser level both look the same, which leaves room for hysteresis.
//!
//! Energies are computed again for each level and need not increase from level to level. The largest so far counts.

use std::f32::consts::PI;

use serde::{Deserialize, Serialize};

use super::{LevelId, Levels, LodError};

/// Settings of [`Switching`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SwitchSettings {
    /// Screen and field of view.
    pub view: View,
    /// Relation of distance and level. Default: [`Rule::Energy`], a person of 1.7 m being 20 pixels high at L.
    pub rule: Rule,
    /// Share of the distance by which an approaching camera switches to the finer level later. Default 0.02.
    pub hysteresis: f32,
    /// Largest step of a point by blending from one frame to the next, in pixels; it sets the width of the bands. `None` switches at
    /// once, as in the paper. Default 0.5.
    pub blend_step: Option<f32>,
    /// Speed of the camera relative to the character, in metres per second. Default 5.
    pub camera_speed: f32,
    /// Frame rate of the screen, in frames per second. Default 60.
    pub frame_rate: f32,
}

/// Relation of distance and level.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Rule {
    /// The paper's: the distance is linear in the energy of the removed joint.
    Energy {
        /// L, the distance for the largest energy, in metres. See [`View::distance`].
        furthest: f32,
    },
    /// The displacement on the screen, at the point of the body nearest to the camera, stays below a number of pixels.
    ScreenError {
        /// Largest displacement in the middle of the screen, in pixels.
        pixels: f32,
        /// Displacement that is limited.
        measure: Measure,
    },
}

/// A measure of a level's displacement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// The largest displacement of any point in any frame. It is a guarantee, but a single moment of a long clip can make it expensive.
    Greatest,
    /// The mean displacement over the points of removed joints and over frames.
    Mean,
}

impl Default for SwitchSettings {
    /// A person of 1.7 m is 20 pixels high at L.
    fn default() -> Self {
        let view = View::default();
        Self {
            view,
            rule: Rule::Energy {
                furthest: view.distance(1.7, 20.0),
            },
            hysteresis: 0.02,
            blend_step: Some(0.5),
            camera_speed: 5.0,
            frame_rate: 60.0,
        }
    }
}

impl SwitchSettings {
    /// Distance that the camera travels in a frame, in metres.
    pub(super) fn travel(&self) -> f32 {
        self.camera_speed / self.frame_rate
    }

    fn check(&self) -> Result<(), LodError> {
        self.view.check()?;
        let rule = match self.rule {
            Rule::Energy { furthest } => ("furthest", furthest),
            Rule::ScreenError { pixels, .. } => ("pixels", pixels),
        };
        let above_0 = [
            rule,
            ("blend_step", self.blend_step.unwrap_or(1.0)),
            ("camera_speed", self.camera_speed),
            ("frame_rate", self.frame_rate),
        ];
        for (setting, value) in above_0 {
            // An infinite error allows every level.
            let may_be_endless = setting == "pixels" && value == f32::INFINITY;
            if !(value > 0.0 && (value.is_finite() || may_be_endless)) {
                return Err(LodError::setting(setting, value, "above 0"));
            }
        }
        if !(0.0..1.0).contains(&self.hysteresis) {
            let must = "at least 0 and below 1";
            return Err(LodError::setting("hysteresis", self.hysteresis, must));
        }
        Ok(())
    }
}

/// Distances at which one level becomes the next, in metres from the camera to the character's root.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Band {
    /// Start of the blend: the finer level is unchanged up to here.
    pub start: f32,
    /// End of the blend: the blended finer level looks like the coarser one from here on.
    pub full: f32,
    /// Start of the coarser level.
    pub end: f32,
}

/// The level and blend at a distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// Level whose joints are posed.
    pub level: LevelId,
    /// Weight of the level's [`Levels::blend`], from 0 to 1.
    pub blend: f32,
}

/// The bands of all levels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Switching {
    bands: Vec<Band>,
    blends: bool,
}

impl Switching {
    /// Computes the bands of `levels`.
    ///
    /// # Errors
    /// Settings out of range.
    pub fn new(levels: &Levels, settings: &SwitchSettings) -> Result<Self, LodError> {
        let mut switching = Self::default();
        switching.update(levels, settings)?;
        Ok(switching)
    }

    /// Computes the bands in place. Does not allocate unless the number of levels grows.
    ///
    /// # Errors
    /// Settings out of range. The bands are then unchanged.
    pub fn update(&mut self, levels: &Levels, settings: &SwitchSettings) -> Result<(), LodError> {
        settings.check()?;
        self.blends = settings.blend_step.is_some();
        self.bands.clear();
        let greatest = levels
            .levels
            .iter()
            .map(|level| level.energy)
            .fold(0.0, f32::max);
        let (mut energy, mut error) = (0.0f32, 0.0f32);
        let mut before = 0.0;
        for level in levels.levels.iter().skip(1) {
            energy = energy.max(level.energy);
            if let Rule::ScreenError { measure, .. } = settings.rule {
                error = error.max(match measure {
                    Measure::Greatest => level.error.max,
                    Measure::Mean => level.error.mean,
                });
            }
            let (near, step) = (levels.reach, level.error.step);
            let band = match settings.rule {
                // Without motion every level is exact at any distance.
                Rule::Energy { furthest } => {
                    let share = if greatest > 0.0 {
                        energy / greatest
                    } else {
                        0.0
                    };
                    let end = furthest * share;
                    Band::ending(end, near, before, step, settings)
                }
                Rule::ScreenError { pixels, .. } if error > 0.0 => {
                    let start = near + settings.view.distance(error, pixels);
                    Band::starting(start.max(before), near, step, settings)
                }
                Rule::ScreenError { .. } => Band::starting(before, near, step, settings),
            };
            before = band.end;
            self.bands.push(band);
        }
        Ok(())
    }

    /// One band for each level but the first, at which that level starts.
    pub fn bands(&self) -> &[Band] {
        &self.bands
    }

    /// Whether levels are blended.
    pub(crate) fn blends(&self) -> bool {
        self.blends
    }

    /// Distance beyond which the coarsest level is drawn, in metres: the paper's L, unless bands were moved outwards.
    pub fn furthest(&self) -> f32 {
        self.bands.last().map_or(0.0, |band| band.end)
    }

    /// The level and blend at a distance. `before` is the level of the previous frame; it is kept within the hysteresis.
    pub fn choose(&self, distance: f32, before: Option<LevelId>) -> Choice {
        let coarsest = self.bands.partition_point(|band| band.full <= distance);
        let finest = self.bands.partition_point(|band| band.end <= distance);
        let level = before.map_or(finest, |before| before.index().clamp(finest, coarsest));
        let blend = match self.bands.get(level) {
            Some(band) if self.blends && distance > band.start => {
                let width = band.full - band.start;
                let gone = (distance - band.start) / width;
                if gone < 1.0 { gone } else { 1.0 }
            }
            _ => 0.0,
        };
        Choice {
            level: LevelId(level as u16),
            blend,
        }
    }
}

impl Band {
    /// Lower bound of width · (start − near) for a displacement of `step` metres, in square metres.
    fn least_area(step: f32, settings: &SwitchSettings) -> f32 {
        let Some(blend_step) = settings.blend_step else {
            return 0.0;
        };
        step * settings.view.pixels_at_one_metre() * settings.travel() / blend_step
    }

    /// The narrowest band that ends at `end`, or the first one possible after `before`, the end of the band before. `near` is the largest
    /// distance of a point from the root, `step` the largest displacement of a point by the switch; all in metres.
    fn ending(end: f32, near: f32, before: f32, step: f32, settings: &SwitchSettings) -> Self {
        let area = Self::least_area(step, settings);
        // With x from `near` to `full` and y to `start`: (x - y) y = area.
        let x = end * (1.0 - settings.hysteresis) - near;
        let root = x * x - 4.0 * area;
        // Rounding must not put the end of the blend behind `end`, nor its start.
        let full = (near + x).min(end);
        let start = (near + 0.5 * (x + root.max(0.0).sqrt())).min(full);
        if area <= 0.0 {
            let full = (end * (1.0 - settings.hysteresis)).max(before);
            return Self {
                start: full,
                full,
                end: end.max(before),
            };
        }
        if root >= 0.0 && x > 0.0 && start >= before {
            return Self { start, full, end };
        }
        Self::starting(before, near, step, settings)
    }

    /// The band that starts at `start`, or the first one possible after it.
    fn starting(start: f32, near: f32, step: f32, settings: &SwitchSettings) -> Self {
        let area = Self::least_area(step, settings);
        // A band that started nearer would be so wide that it ended further away.
        let start = if area > 0.0 {
            start.max(near + area.sqrt())
        } else {
            start
        };
        // If the area is too small to move the start, the difference is 0 and the square root is the width.
        let room = if start > near {
            start - near
        } else {
            area.sqrt()
        };
        let full = if area > 0.0 {
            start + area / room
        } else {
            start
        };
        Self {
            start,
            full,
            end: full / (1.0 - settings.hysteresis),
        }
    }
}

/// Screen and field of view.
///
/// A length of s metres across the line of sight at a distance of d metres covers s · height / (2 tan(fov / 2)) / d pixels in the middle
/// of the screen, and up to 1 / cos² b times as many at an angle b from the middle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// Vertical field of view, in radians. Default π/3.
    pub fov: f32,
    /// Height of the screen, in pixels. Default 1080.
    pub height: f32,
}

impl Default for View {
    /// 1080 pixels and 60 degrees.
    fn default() -> Self {
        Self {
            fov: PI / 3.0,
            height: 1080.0,
        }
    }
}

impl View {
    /// Pixels covered by a length of 1 m at a distance of 1 m.
    pub fn pixels_at_one_metre(self) -> f32 {
        self.height / (2.0 * (0.5 * self.fov).tan())
    }

    /// Pixels covered by a length at a distance, both in metres.
    pub fn pixels(self, length: f32, distance: f32) -> f32 {
        length * self.pixels_at_one_metre() / distance
    }

    /// Distance at which a length in metres covers a number of pixels, in metres. With a character's height and the size in pixels below
    /// which its motion is not visible, this is the paper's L.
    pub fn distance(self, length: f32, pixels: f32) -> f32 {
        length * self.pixels_at_one_metre() / pixels
    }

    pub(super) fn check(self) -> Result<(), LodError> {
        if !(self.fov > 0.0 && self.fov < PI) {
            return Err(LodError::setting("fov", self.fov, "above 0 and below pi"));
        }
        if !(self.height.is_finite() && self.height > 0.0) {
            return Err(LodError::setting("height", self.height, "above 0"));
        }
        Ok(())
    }
}
