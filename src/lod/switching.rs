//! Which level a distance asks for, and how one becomes the next.
//!
//! Source: Hasegawa, Nishio & Kobori, 3.2: a level's distance is linear in the energy of the joint that it has lost, and
//! beyond L nothing but root and ends is left. Their 4.2 and 5 leave the jumps between levels to future work. Here each joint
//! goes in a band of distance, in which it is blended from its motion to where it is drawn without it ([`super::Blend`]).
//!
//! A band's width w follows from how fast a camera moves: a point that is s metres away from where the next level draws it
//! goes s v t / w metres in a frame of t seconds at v m/s, and this must be no more than a wanted number of pixels at the body's nearest
//! point. Bands do not overlap, so that one joint at a time is blended; where the distances lie too close together, the later ones are moved
//! outwards. Between where a band is complete and where the coarser level begins both look the same: that is the room for hysteresis.
//!
//! Energies need not grow from level to level, since they are taken anew: the greatest so far counts.

use serde::{Deserialize, Serialize};

use super::{LevelId, Levels, LodError, View};

/// When levels are switched.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SwitchSettings {
    /// The screen.
    pub view: View,
    /// What a distance stands for.
    pub rule: Rule,
    /// Coming nearer, the finer level is taken this share of the distance later.
    pub hysteresis: f32,
    /// How one level becomes the next; `None`: at once, as in the paper.
    pub blend: Option<BlendSettings>,
}

/// What a distance stands for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Rule {
    /// The paper's: linear in the energy of the removed joint, and `furthest` metres for the greatest.
    Energy {
        /// L: see [`View::distance`].
        furthest: f32,
    },
    /// The body is drawn no further from where it should be than so many pixels, as near to the camera as any of its points is.
    ScreenError {
        /// On the middle of the screen.
        pixels: f32,
        /// Which error it is.
        measure: Measure,
    },
}

/// Which of a level's errors is held against the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// The greatest of any point in any frame: a promise, which a single moment of a long clip can make dear.
    Greatest,
    /// The mean over the points of removed joints and over frames.
    Mean,
}

impl Measure {
    pub(super) fn of(self, error: &super::LevelError) -> f32 {
        match self {
            Self::Greatest => error.max,
            Self::Mean => error.mean,
        }
    }
}

/// How wide the bands are in which joints are blended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct BlendSettings {
    /// The most that blending moves a point from one frame to the next, pixels.
    pub step: f32,
    /// Of the camera against the character, metres per second.
    pub speed: f32,
    /// Frames per second on the screen.
    pub frame_rate: f32,
}

impl Default for SwitchSettings {
    /// A person of 1.7 m, who is 20 pixels high at L.
    fn default() -> Self {
        let view = View::default();
        Self {
            view,
            rule: Rule::Energy {
                furthest: view.distance(1.7, 20.0),
            },
            hysteresis: 0.02,
            blend: Some(BlendSettings::default()),
        }
    }
}

impl Default for BlendSettings {
    fn default() -> Self {
        Self {
            step: 0.5,
            speed: 5.0,
            frame_rate: 60.0,
        }
    }
}

impl SwitchSettings {
    fn check(&self) -> Result<(), LodError> {
        self.view.check()?;
        let blend = self.blend.unwrap_or_default();
        let rule = match self.rule {
            Rule::Energy { furthest } => ("furthest", furthest),
            Rule::ScreenError { pixels, .. } => ("pixels", pixels),
        };
        let above_0 = [
            rule,
            ("step", blend.step),
            ("speed", blend.speed),
            ("frame_rate", blend.frame_rate),
        ];
        for (setting, value) in above_0 {
            // An error of any size may be allowed.
            let may_be_endless = setting == "pixels" && value == f32::INFINITY;
            if !(value > 0.0 && (value.is_finite() || may_be_endless)) {
                let must = "above 0";
                return Err(LodError::Setting {
                    setting,
                    value,
                    must,
                });
            }
        }
        if !(0.0..1.0).contains(&self.hysteresis) {
            return Err(LodError::Setting {
                setting: "hysteresis",
                value: self.hysteresis,
                must: "at least 0 and below 1",
            });
        }
        Ok(())
    }
}

/// Where one level becomes the next, metres from the camera to the character's root.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Band {
    /// Up to here the finer level is drawn as it is.
    pub start: f32,
    /// From here on the finer level, blended, looks like the coarser one.
    pub full: f32,
    /// From here on the coarser level is used.
    pub end: f32,
}

/// What is drawn at a distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// The level whose joints are posed.
    pub level: LevelId,
    /// How far [`Levels::blend`] of this level has gone: 0 not at all, 1 all the way.
    pub blend: f32,
}

/// The bands of all levels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Switching {
    bands: Vec<Band>,
    blends: bool,
}

impl Switching {
    /// The bands of these levels.
    ///
    /// # Errors
    /// Settings that make no sense.
    pub fn new(levels: &Levels, settings: &SwitchSettings) -> Result<Self, LodError> {
        let mut switching = Self::default();
        switching.update(levels, settings)?;
        Ok(switching)
    }

    /// The same in place: for settings that change from frame to frame. Allocates nothing once there were as many levels.
    ///
    /// # Errors
    /// Settings that make no sense; the bands are then as before.
    pub fn update(&mut self, levels: &Levels, settings: &SwitchSettings) -> Result<(), LodError> {
        settings.check()?;
        self.blends = settings.blend.is_some();
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
                error = error.max(measure.of(&level.error));
            }
            let near = levels.reach;
            let band = match settings.rule {
                // Where nothing moves, nothing is lost at any distance.
                Rule::Energy { furthest } => {
                    let share = if greatest > 0.0 {
                        energy / greatest
                    } else {
                        0.0
                    };
                    let end = furthest * share;
                    Band::ending(end, (near, before, level.error.step), settings)
                }
                Rule::ScreenError { pixels, .. } if error > 0.0 => {
                    let start = near + settings.view.distance(error, pixels);
                    Band::starting(start.max(before), (near, level.error.step), settings)
                }
                Rule::ScreenError { .. } => {
                    Band::starting(before, (near, level.error.step), settings)
                }
            };
            before = band.end;
            self.bands.push(band);
        }
        Ok(())
    }

    /// One for each level but the first: where it becomes the level.
    #[must_use]
    pub fn bands(&self) -> &[Band] {
        &self.bands
    }

    /// Whether one level is blended into the next.
    pub(crate) fn blends(&self) -> bool {
        self.blends
    }

    /// The distance beyond which the coarsest level is drawn, metres: the paper's L, unless bands had to be moved outwards.
    #[must_use]
    pub fn furthest(&self) -> f32 {
        self.bands.last().map_or(0.0, |band| band.end)
    }

    /// What is drawn at a distance; `before`: the level in the frame before, which is kept while that is allowed.
    #[must_use]
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
    /// What width · (start − near) has to be at least, square metres, for a displacement of `step` metres.
    fn least_area(step: f32, settings: &SwitchSettings) -> f32 {
        let Some(blend) = settings.blend else {
            return 0.0;
        };
        let travel = blend.speed / blend.frame_rate;
        step * settings.view.pixels_at_one_metre() * travel / blend.step
    }

    /// The narrowest band that is over at `end`, or as soon as it can be after `before`.
    fn ending(end: f32, (near, before, step): (f32, f32, f32), settings: &SwitchSettings) -> Self {
        let area = Self::least_area(step, settings);
        // With x from `near` to `full` and y to `start`: (x - y) y = area.
        let x = end * (1.0 - settings.hysteresis) - near;
        let root = x * x - 4.0 * area;
        let start = near + 0.5 * (x + root.max(0.0).sqrt());
        if area <= 0.0 {
            let full = (end * (1.0 - settings.hysteresis)).max(before);
            return Self {
                start: full,
                full,
                end: end.max(before),
            };
        }
        if root >= 0.0 && x > 0.0 && start >= before {
            let full = near + x;
            return Self { start, full, end };
        }
        Self::starting(before, (near, step), settings)
    }

    /// The band that starts at `start`, or as soon as it can.
    fn starting(start: f32, (near, step): (f32, f32), settings: &SwitchSettings) -> Self {
        let area = Self::least_area(step, settings);
        // Nearer than this a band would have to be so wide that it ended further away.
        let start = if area > 0.0 {
            start.max(near + area.sqrt())
        } else {
            start
        };
        // Where the area is too small to move the start, the difference is 0 and the square root is the width.
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
