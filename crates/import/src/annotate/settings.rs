/// Criteria of events. A stature is the height of the figure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AnnotateSettings {
    /// Attacks.
    pub attacks: AttackSettings,
    /// Evasions.
    pub evasions: EvasionSettings,
}

/// Criteria of attacks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttackSettings {
    /// Least peak speed of the hand or foot, in statures per second. Default: 1.95.
    pub min_peak_speed: f32,
    /// An attack begins when the speed rises above this value, in statures per second. Default: 0.53.
    pub start_speed: f32,
    /// An attack ends when the speed falls below this share of the peak. Default: 0.35.
    pub end_share: f32,
    /// Longest time from the start to the peak, in seconds. Default: 0.4.
    pub max_rise: f32,
    /// Longest time from the peak until the speed has fallen, in seconds. Default: 0.3.
    pub max_fall: f32,
    /// Time that is added behind the fall of the speed, for the limb at full reach, in seconds. Default: 0.07.
    pub full_reach: f32,
    /// Least time from the contact to the end, in seconds. Default: 0.13, a part of the return: some annotators count none of it,
    /// others all.
    pub after_contact: f32,
    /// Least score: peak speed times gain in reach, in square statures per second. Default: 0.35.
    pub min_score: f32,
    /// Least height of the hand or foot at the contact over the lowest hand or foot at that time, in statures. It excludes steps.
    /// Default: 0.22.
    pub min_height: f32,
}

impl Default for AttackSettings {
    fn default() -> Self {
        Self {
            min_peak_speed: 1.95,
            start_speed: 0.53,
            end_share: 0.35,
            max_rise: 0.4,
            max_fall: 0.3,
            full_reach: 0.07,
            after_contact: 0.13,
            min_score: 0.35,
            min_height: 0.22,
        }
    }
}

/// Criteria of evasions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EvasionSettings {
    /// The trunk moves while head or root is faster than this value, in statures per second. Default: 0.15.
    pub min_speed: f32,
    /// Least peak speed of head or root, in statures per second. Default: 0.31.
    pub min_peak_speed: f32,
    /// Shortest evasion, in seconds. Default: 0.3.
    pub min_seconds: f32,
    /// Longest rest that does not end an evasion, in seconds. Default: 0.25.
    pub max_gap: f32,
    /// Longest rest in a posture away from the first, in seconds. Default: 0.8.
    pub max_hold: f32,
    /// Distance of the head from its place over the root at the start, from which on it counts as away, in statures. Default: 0.07.
    pub away: f32,
    /// Least lean of a dodge: displacement of the head against the root along the ground, in statures. Default: 0.115.
    pub min_lean: f32,
    /// Least drop of the head of a duck, in statures. Default: 0.105.
    pub min_drop: f32,
    /// Longest dodge or duck, in seconds. Default: 3.
    pub max_seconds: f32,
    /// Least distance of an evasive step, in statures. Default: 0.265.
    pub min_travel: f32,
    /// Largest cosine of the angle between an evasive step and the direction of the guard. Default: 0.5.
    pub max_forward: f32,
    /// Least mean height of the hands over the root during an evasive step, in statures. It excludes walks. Default: 0.05.
    pub min_guard: f32,
    /// Largest speed of a hand relative to the root, in statures per second. It excludes attacks and blocks. Dodges and
    /// ducks of twice the least displacement may have twice this speed. Default: 1.2.
    pub max_hand_speed: f32,
}

impl Default for EvasionSettings {
    fn default() -> Self {
        Self {
            min_speed: 0.15,
            min_peak_speed: 0.31,
            min_seconds: 0.3,
            max_gap: 0.25,
            max_hold: 0.8,
            away: 0.07,
            min_lean: 0.115,
            min_drop: 0.105,
            max_seconds: 3.0,
            min_travel: 0.265,
            max_forward: 0.5,
            min_guard: 0.05,
            max_hand_speed: 1.2,
        }
    }
}
