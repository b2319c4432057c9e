use std::f32::consts::PI;

use serde::{Deserialize, Serialize};

use super::LodError;

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
    #[must_use]
    pub fn pixels_at_one_metre(self) -> f32 {
        self.height / (2.0 * (0.5 * self.fov).tan())
    }

    /// Pixels covered by a length at a distance, both in metres.
    #[must_use]
    pub fn pixels(self, length: f32, distance: f32) -> f32 {
        length * self.pixels_at_one_metre() / distance
    }

    /// Distance at which a length in metres covers a number of pixels, in metres. With a character's height and the size in pixels below
    /// which its motion is not visible, this is the paper's L.
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
