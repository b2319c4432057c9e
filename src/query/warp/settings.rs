use serde::{Deserialize, Serialize};

use super::linear::Scales;
use crate::anim::{Bend, Envelope, Rig};

/// Settings of warps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct WarpSettings {
    /// Maximum number of candidates that are warped if no candidate is clean, the shallowest hits first. 0 disables warps. Default 2. Of a
    /// fighter's hits by thrown balls, a value of 1 avoids 67%, 2 avoids 72% and 4 avoids 73%.
    pub candidates: usize,
    /// Maximum depth of a hit that is warped, in metres. Default 0.3.
    pub deepest: f32,
    /// Clearance below which a clean answer is warped away from the attack, in metres. Default 0, which never warps it away.
    pub nearest: f32,
    /// Clearance above which a clean answer is warped towards the attack if that lowers its score, in metres. Default `None`, which never warps it
    /// towards the attack.
    pub widest: Option<f32>,
    /// Wanted clearance of a warped motion, in metres. Default 0.01.
    pub margin: f32,
    /// Maximum number of linearisations. Default 5.
    pub rounds: usize,
    /// Maximum displacements.
    #[doc(hidden)]
    pub bounds: WarpBounds,
    /// Maximum speeds and durations.
    #[doc(hidden)]
    pub limits: WarpLimits,
}

impl Default for WarpSettings {
    fn default() -> Self {
        Self {
            candidates: 2,
            deepest: 0.3,
            nearest: 0.0,
            widest: None,
            margin: 0.01,
            rounds: 5,
            bounds: WarpBounds::default(),
            limits: WarpLimits::default(),
        }
    }
}

/// Name of a setting, its value, its valid range, and the range in words.
pub(in crate::query) type RangedSetting = (
    &'static str,
    f64,
    (std::ops::RangeInclusive<f64>, &'static str),
);

impl WarpSettings {
    /// Settings without warps.
    #[must_use]
    pub fn off() -> Self {
        Self::OFF
    }

    /// All settings with their names and ranges.
    pub(in crate::query) fn ranges(&self) -> [RangedSetting; 25] {
        let (bounds, limits) = (&self.bounds, &self.limits);
        let number =
            |name, value: f32, most: f64, range| (name, f64::from(value), (0.0..=most, range));
        let metres = |name, value| number(name, value, 1.0, "0 to 1 m");
        let angle = |name, value| number(name, value, 1.6, "0 to 1.6 rad");
        let seconds = |name, value| number(name, value, 10.0, "0 to 10 s");
        let speed = |name, value| number(name, value, 1e6, "0 to 1000000");
        let count = |name, value: usize| (name, value as f64, (0.0..=1e3, "0 to 1000"));
        [
            count("warp.candidates", self.candidates),
            metres("warp.deepest", self.deepest),
            metres("warp.nearest", self.nearest),
            number(
                "warp.widest",
                self.widest.unwrap_or(0.0),
                100.0,
                "0 to 100 m",
            ),
            metres("warp.margin", self.margin),
            count("warp.rounds", self.rounds),
            angle("warp.bounds.spine", bounds.spine),
            metres("warp.bounds.pelvis", bounds.pelvis),
            metres("warp.bounds.foot", bounds.foot),
            metres("warp.bounds.hand", bounds.hand),
            seconds("warp.bounds.time", bounds.time),
            seconds("warp.limits.way_in", limits.way_in),
            seconds("warp.limits.shortest_way_in", limits.shortest_way_in),
            seconds("warp.limits.way_out", limits.way_out),
            seconds("warp.limits.reaction", limits.reaction),
            seconds("warp.limits.hold", limits.hold),
            speed("warp.limits.angular_velocity", limits.angular_velocity),
            speed(
                "warp.limits.angular_acceleration",
                limits.angular_acceleration,
            ),
            speed("warp.limits.root_speed", limits.root_speed),
            speed("warp.limits.root_acceleration", limits.root_acceleration),
            speed("warp.limits.end_speed", limits.end_speed),
            number("warp.limits.rate", limits.rate, 0.9, "0 to 0.9"),
            metres("warp.limits.balance", limits.balance),
            number("warp.limits.folded", limits.folded, 3.2, "0 to 3.2 rad"),
            metres("warp.limits.slide", limits.slide),
        ]
    }

    /// Settings without warps.
    pub const OFF: Self = Self {
        candidates: 0,
        deepest: 0.0,
        nearest: 0.0,
        widest: None,
        margin: 0.0,
        rounds: 0,
        bounds: WarpBounds::NONE,
        limits: WarpLimits::STILL,
    };
}

/// Maximum displacements of a warp. 0 leaves a part unchanged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct WarpBounds {
    /// Maximum rotation of the whole spine, in radians. Default 15°.
    pub spine: f32,
    /// Maximum translation of the pelvis, in metres. Default 0.10.
    pub pelvis: f32,
    /// Maximum translation of a lifted foot, in metres. Default 0.25.
    pub foot: f32,
    /// Maximum translation of a hand, in metres. Default 0.20.
    pub hand: f32,
    /// Maximum offset in time, ahead or behind, in seconds. Default 0.04.
    pub time: f32,
}

impl Default for WarpBounds {
    fn default() -> Self {
        Self {
            spine: 15f32.to_radians(),
            pelvis: 0.10,
            foot: 0.25,
            hand: 0.20,
            time: 0.04,
        }
    }
}

impl WarpBounds {
    /// Bounds that allow no displacement.
    pub const NONE: Self = Self {
        spine: 0.0,
        pelvis: 0.0,
        foot: 0.0,
        hand: 0.0,
        time: 0.0,
    };

    /// The bound of a limb's end: a foot or a hand.
    #[must_use]
    pub fn end(&self, limb: usize) -> f32 {
        if limb < Rig::LEGS {
            self.foot
        } else {
            self.hand
        }
    }

    /// Sum of the squared shares of the bounds that a bend uses.
    #[must_use]
    pub(crate) fn effort(&self, bend: &Bend) -> f32 {
        let share = |length: f32, bound: f32| match length {
            0.0 => 0.0,
            _ => (length / bound).powi(2),
        };
        let ends = bend.ends.iter().enumerate();
        let ends: f32 = ends
            .map(|(limb, end)| share(end.length(), self.end(limb)))
            .sum();
        share(bend.spine.length(), self.spine)
            + share(bend.pelvis.length(), self.pelvis)
            + ends
            + share(bend.ahead, self.time)
    }

    /// Reduces the bounds so that no part exceeds the limits of speed within the envelope.
    pub(super) fn within(&self, limits: &WarpLimits, envelope: &Envelope, spine: usize) -> Scales {
        let way = envelope.shortest_way();
        let by_speed = |speed: f32| speed * way / Envelope::STEEPEST;
        let turn = by_speed(limits.angular_velocity)
            .min(limits.angular_acceleration * way * way / Envelope::SHARPEST);
        let shift = by_speed(limits.root_speed)
            .min(limits.root_acceleration * way * way / Envelope::SHARPEST);
        let end = by_speed(limits.end_speed);
        Scales {
            spine: self.spine.min(turn * spine as f32),
            pelvis: self.pelvis.min(shift),
            ends: std::array::from_fn(|limb| self.end(limb).min(end)),
            ahead: self.time.min(by_speed(limits.rate)),
        }
    }
}

/// Maximum speeds of a warp, and durations of its fades.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct WarpLimits {
    /// Duration of the fade-in if there is time, in seconds. Default 0.35.
    pub way_in: f32,
    /// Minimum duration of the fade-in, in seconds. Default 0.12.
    pub shortest_way_in: f32,
    /// Duration of the fade-out, in seconds. Default 0.4.
    pub way_out: f32,
    /// Minimum time from the query to the start of a warp, in seconds. Default 0.
    pub reaction: f32,
    /// Time at full weight before and after the attack is nearest, in seconds. Default 0.03.
    pub hold: f32,
    /// Maximum angular velocity of a joint in its parent's frame, in rad/s. It limits the velocity that a warp adds, and the velocity of the
    /// warped motion unless the motion itself exceeds it. Default 20.
    pub angular_velocity: f32,
    /// Maximum angular acceleration of a joint, in rad/s², limited in the same way. Default 500.
    pub angular_acceleration: f32,
    /// Maximum velocity that a warp adds to the pelvis, in m/s. Default 1.
    pub root_speed: f32,
    /// Maximum acceleration that a warp adds to the pelvis, in m/s². Default 12.
    pub root_acceleration: f32,
    /// Maximum velocity that a warp adds to a lifted foot or a hand, in m/s. Default 2.5.
    pub end_speed: f32,
    /// Maximum change of the playback rate. Default 0.25.
    pub rate: f32,
    /// Maximum distance of the centre of mass from the support while the body stands still, in metres, unless the motion itself exceeds
    /// it. Default 0.02.
    pub balance: f32,
    /// Minimum angle between the bones of a knee or an elbow, in radians. Default 35°.
    pub folded: f32,
    /// Maximum displacement of a planted foot, in metres. Default 0.001.
    pub slide: f32,
}

impl Default for WarpLimits {
    fn default() -> Self {
        Self {
            way_in: 0.35,
            shortest_way_in: 0.12,
            way_out: 0.4,
            reaction: 0.0,
            hold: 0.03,
            angular_velocity: 20.0,
            angular_acceleration: 500.0,
            root_speed: 1.0,
            root_acceleration: 12.0,
            end_speed: 2.5,
            rate: 0.25,
            balance: 0.02,
            folded: 35f32.to_radians(),
            slide: 0.001,
        }
    }
}

impl WarpLimits {
    /// Limits that allow no motion.
    pub const STILL: Self = Self {
        way_in: 0.0,
        shortest_way_in: 0.0,
        way_out: 0.0,
        reaction: 0.0,
        hold: 0.0,
        angular_velocity: 0.0,
        angular_acceleration: 0.0,
        root_speed: 0.0,
        root_acceleration: 0.0,
        end_speed: 0.0,
        rate: 0.0,
        balance: 0.0,
        folded: 0.0,
        slide: 0.0,
    };

    /// Envelope around the time at which the attack is nearest, or `None` if there is no time for the fade-in.
    pub(super) fn envelope(&self, [from, to]: [f32; 2]) -> Option<Envelope> {
        /// Minimum duration of a fade, in seconds.
        const LONGEST: f32 = 10.0;
        let hold = self.hold.min(LONGEST);
        let (full, release) = (from - hold, to + hold);
        let way_in = (full - self.reaction).min(self.way_in).min(LONGEST);
        let way_out = self.way_out.min(LONGEST);
        let has_time = way_in >= self.shortest_way_in && way_in > 0.0 && way_out > 0.0;
        has_time.then_some(Envelope {
            start: full - way_in,
            full,
            release,
            end: release + way_out,
        })
    }
}
