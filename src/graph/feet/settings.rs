use serde::{Deserialize, Serialize};

/// Thresholds for planted feet, and whether transitions keep them planted. Lengths and speeds are
/// in leg lengths (hip to ankle), so that they fit any body and unit.
///
/// The defaults come from captures of fighting and walking at 30 frames per second. In the fighting
/// motions, the slower of a foot's two points moves slower than 0.25 in 76% of all frames and
/// slower than 0.55 in 82%. Above that, the speeds of swinging feet spread up to 4 and more. Feet
/// slower than 0.2 are below 0.04 in 99% of the frames, and below 0.06 in 90% of those of a
/// crouched sneaking motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FeetSettings {
    /// Whether transitions keep planted feet from sliding. If not, feet slide as root and joints
    /// blend (Kovar 2002). Plants are found and slides are reported in both cases. Default true.
    pub keep: bool,
    /// Speed below which a foot is planted, in leg lengths per second. Default 0.25.
    pub still_speed: f32,
    /// Speed above which a foot is not planted, in leg lengths per second. Between the two speeds
    /// it keeps its state. Default 0.55.
    pub moving_speed: f32,
    /// Height above the clip's ground below which a foot may become planted, in leg lengths.
    /// Default 0.06.
    pub low: f32,
    /// Height above the clip's ground above which a foot is not planted, in leg lengths. Between
    /// the two heights it keeps its state. Default 0.11.
    pub high: f32,
    /// Minimum duration of a plant, in seconds. Default 0.1.
    pub shortest: f64,
    /// Gap between two plants below which they are merged, in seconds. Default 0.07: two frames at
    /// 30 frames per second.
    pub gap: f64,
    /// Speed of a toe, in metres per second, above which a transition is left out if the toe is also faster than 1.3 times the faster
    /// clip. `None` keeps all transitions. Default 5.
    pub fastest_step: Option<f32>,
}

impl Default for FeetSettings {
    fn default() -> Self {
        Self {
            keep: true,
            still_speed: 0.25,
            moving_speed: 0.55,
            low: 0.06,
            high: 0.11,
            shortest: 0.1,
            gap: 0.07,
            fastest_step: Some(5.0),
        }
    }
}

impl FeetSettings {
    /// Name, value and range of each number.
    pub(in crate::graph) fn ranges(
        &self,
    ) -> [(
        &'static str,
        f64,
        std::ops::RangeInclusive<f64>,
        &'static str,
    ); 7] {
        let legs = |name, value: f32| (name, f64::from(value), 0.0..=1e3, "0 to 1000 legs");
        let seconds = |name, value| (name, value, 0.0..=10.0, "0 to 10 s");
        [
            legs("feet.still_speed", self.still_speed),
            legs("feet.moving_speed", self.moving_speed),
            legs("feet.low", self.low),
            legs("feet.high", self.high),
            seconds("feet.shortest", self.shortest),
            seconds("feet.gap", self.gap),
            (
                "feet.fastest_step",
                f64::from(self.fastest_step.unwrap_or(0.0)),
                0.0..=1e3,
                "0 to 1000 m/s",
            ),
        ]
    }
}
