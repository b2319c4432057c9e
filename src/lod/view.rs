use std::f32::consts::PI;

use serde::{Deserialize, Serialize};

use super::LodError;

/// How large things are on the screen.
///
/// A length of s metres across the line of sight, d metres away, has s · height / (2 tan(fov / 2)) / d pixels in the
/// middle of the screen; away from it by an angle b, up to 1 / cos² b as many.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// The vertical field of view, radians.
    pub fov: f32,
    /// The screen's height, pixels.
    pub height: f32,
}

impl Default for View {
    /// 1080 lines and 60 degrees.
    fn default() -> Self {
        Self {
            fov: PI / 3.0,
            height: 1080.0,
        }
    }
}

impl View {
    /// Pixels of a metre that is a metre away.
    #[must_use]
    pub fn pixels_at_one_metre(self) -> f32 {
        self.height / (2.0 * (0.5 * self.fov).tan())
    }

    /// Pixels of a length, metres, at a distance, metres.
    #[must_use]
    pub fn pixels(self, length: f32, distance: f32) -> f32 {
        length * self.pixels_at_one_metre() / distance
    }

    /// The distance at which a length has so many pixels, metres: the paper's L, of a character's height and the pixels
    /// below which no motion can be made out.
    #[must_use]
    pub fn distance(self, length: f32, pixels: f32) -> f32 {
        length * self.pixels_at_one_metre() / pixels
    }

    pub(super) fn check(self) -> Result<(), LodError> {
        let wrong = |setting, value, must| LodError::Setting {
            setting,
            value,
            must,
        };
        if !(self.fov > 0.0 && self.fov < PI) {
            return Err(wrong("fov", self.fov, "above 0 and below pi"));
        }
        if !(self.height.is_finite() && self.height > 0.0) {
            return Err(wrong("height", self.height, "above 0"));
        }
        Ok(())
    }
}
