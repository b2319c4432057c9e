use crate::anim::{Clip, CompressionSettings, Event, Skeleton};
use crate::graph::error::GraphError;
use serde::{Deserialize, Serialize};

/// Settings of a graph build.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GraphSettings {
    /// Frame rate to which all clips are resampled, in frames per second. Default 30.
    pub frame_rate: f64,
    /// Length of a transition's blend, in seconds. Default 1/3 (Kovar).
    pub window: f64,
    /// Maximum distance of a transition's windows: root of the mean squared distance of joints, in
    /// metres. Default 0.10.
    pub threshold: f32,
    /// Minimum separation of two transitions between the same clips, in seconds. Of closer ones the
    /// better one is kept. Default 1/3.
    pub separation: f64,
    /// Weight of each joint in the distance. Default: empty, which weights all joints equally.
    pub joint_weights: Vec<f32>,
    /// Thresholds for planted feet, and whether transitions keep them planted.
    #[doc(hidden)]
    pub feet: FeetSettings,
    /// Settings of links: transitions with a looser threshold that bring evasions within reach.
    /// `None` builds a graph of the transitions under `threshold` alone.
    #[doc(hidden)]
    pub links: Option<LinkSettings>,
    /// Largest errors that compressing the clips may cause. `None` keeps them plain. The graph is built from the decoded
    /// clips. Default 0.1 mm at the joints and 0.3 mm at the ends.
    pub compression: Option<CompressionSettings>,
    /// Number of threads for the distance maps, or 0 for one thread per CPU core. The graph does
    /// not depend on it.
    pub threads: usize,
    /// Memory that a build may take, in bytes. Input that would take more by an estimate is rejected before the work begins.
    /// Default 8 GiB.
    pub memory: u64,
}

impl Default for GraphSettings {
    fn default() -> Self {
        Self {
            frame_rate: 30.0,
            window: 1.0 / 3.0,
            threshold: 0.10,
            separation: 1.0 / 3.0,
            joint_weights: Vec::new(),
            feet: FeetSettings::default(),
            links: Some(LinkSettings::default()),
            compression: Some(CompressionSettings::default()),
            threads: 0,
            memory: Self::MEMORY,
        }
    }
}

impl GraphSettings {
    /// Range of frame rates that a graph may have, in frames per second.
    pub const FRAME_RATES: std::ops::RangeInclusive<f64> = 1.0..=480.0;

    /// Converts a time to whole frames, at least one.
    pub(crate) fn frames(&self, seconds: f64) -> usize {
        ((seconds * self.frame_rate).round() as usize).max(1)
    }

    /// Checks the settings and returns the weight of each joint.
    ///
    /// # Errors
    /// The first setting that is out of range.
    pub(crate) fn checked_weights(&self, joints: usize) -> Result<Vec<f32>, GraphError> {
        let threshold = f64::from(self.threshold);
        let compression = self.compression.unwrap_or_default();
        let [joint_error, end_error] =
            [compression.joint_error, compression.end_error].map(f64::from);
        let ranges = [
            (
                "frame_rate",
                self.frame_rate,
                Self::FRAME_RATES,
                "1 to 480 a second",
            ),
            ("window", self.window, 0.0..=10.0, "0 to 10 s"),
            ("separation", self.separation, 0.0..=60.0, "0 to 60 s"),
            ("threshold", threshold, 1e-6..=1e3, "0.000001 to 1000 m"),
            ("joint_error", joint_error, 1e-6..=1.0, "0.000001 to 1 m"),
            ("end_error", end_error, 1e-6..=1.0, "0.000001 to 1 m"),
        ];
        for (name, value, allowed, range) in ranges.into_iter().chain(self.feet.ranges()) {
            if !allowed.contains(&value) {
                return Err(GraphError::Setting { name, value, range });
            }
        }
        self.links.as_ref().map_or(Ok(()), LinkSettings::check)?;
        if self.joint_weights.is_empty() {
            return Ok(vec![1.0; joints]);
        }
        let weights = self.joint_weights.clone();
        let sound =
            weights.iter().all(|w| w.is_finite() && *w >= 0.0) && weights.iter().any(|&w| w > 0.0);
        let found = weights.len();
        if found == joints && sound {
            Ok(weights)
        } else {
            Err(GraphError::JointWeights { found, joints })
        }
    }
}

// Limits on the size of a graph. Larger input would exhaust memory or time.

impl GraphSettings {
    /// Default of [`GraphSettings::memory`], in bytes.
    pub const MEMORY: u64 = 8 << 30;

    /// Maximum number of events of all clips. The maps of an event take about 1 MB.
    pub const MOST_EVENTS: usize = 8192;

    /// Maximum duration of an event, in seconds.
    pub const LONGEST_EVENT: f64 = 60.0;

    /// Maximum number of transitions before pruning. If more are below the threshold, the closest of each stretch of a clip are
    /// kept.
    pub const MOST_TRANSITIONS: usize = 1 << 18;

    /// Maximum number of transitions that the closest are chosen from.
    pub const MOST_FOUND: usize = 1 << 24;

    /// Checks the limits before any memory is allocated.
    pub(crate) fn check_size(&self, source: ClipSource<'_>) -> Result<(), GraphError> {
        let needed = self.estimate(source);
        if needed > self.memory as f64 {
            return Err(GraphError::Memory {
                needed: needed as u64,
                most: self.memory,
            });
        }
        let events = source.events.len();
        if events > Self::MOST_EVENTS {
            return Err(GraphError::TooMany {
                what: "events",
                found: events as u64,
                most: Self::MOST_EVENTS as u64,
            });
        }
        let long = |seconds: f64| seconds > Self::LONGEST_EVENT;
        let mut lengths = source.events.iter().map(|event| event.end - event.start);
        match lengths.position(long) {
            Some(index) => {
                let clip = source.clips.get(source.events[index].clip);
                Err(GraphError::EventTooLong {
                    index,
                    clip: clip.map(|clip| clip.name().to_owned()),
                    max: Self::LONGEST_EVENT,
                })
            }
            None => Ok(()),
        }
    }

    /// Estimate of the memory that a build takes, in bytes.
    fn estimate(&self, source: ClipSource<'_>) -> f64 {
        // Bytes of a joint and frame: the rotation twice, the point in three layouts, and about as much again for the graph's copies.
        const JOINT: f64 = 100.0;
        // Bytes of a frame: sums and projections of its window, and its data in the search for links.
        const FRAME: f64 = 400.0;
        // Resampling adds up to one frame beyond the whole frame times of a clip.
        let frames = |clip: &Clip| (clip.duration() * self.frame_rate).ceil() + 1.0;
        let frames = source.clips.iter().map(frames).sum::<f64>();
        // Links take the time from each frame to each event.
        let events = match self.links {
            Some(_) => source.events.len() as f64 * size_of::<u16>() as f64,
            None => 0.0,
        };
        frames * (source.skeleton.len() as f64 * JOINT + FRAME + events)
    }

    /// Checks the limit on the number of transitions that the closest are chosen from.
    pub(crate) fn check_found(found: usize) -> Result<(), GraphError> {
        match found <= Self::MOST_FOUND {
            true => Ok(()),
            false => Err(GraphError::TooMany {
                what: "transitions under the threshold",
                found: found as u64,
                most: Self::MOST_FOUND as u64,
            }),
        }
    }

    /// Checks the limit on the number of transitions.
    pub(crate) fn check_transitions(found: usize) -> Result<(), GraphError> {
        match found <= Self::MOST_TRANSITIONS {
            true => Ok(()),
            false => Err(GraphError::TooMany {
                what: "transitions under the threshold",
                found: found as u64,
                most: Self::MOST_TRANSITIONS as u64,
            }),
        }
    }
}

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
    pub(crate) fn ranges(
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

/// Settings of the links that a graph gets for its events.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LinkSettings {
    /// Goals, reached one after another. Default: an evasion within 1 s from 90% of the moments and
    /// within 1.5 s from 97%; four different evasions within 1 s from 80%, and eight within 0.7 s
    /// from 95%.
    pub goals: Vec<LinkGoal>,
    /// Maximum distance of a link: root of the mean squared distance of joints, in metres, times
    /// window / blend if the blend is shorter than the graph's window. Default 0.35. Strides of a
    /// walk come no closer to a guard; all other motion needs at most 0.25.
    pub loosest: f32,
    /// Maximum time between a link's end and its event's first frame, or between its event's last
    /// frame and the link's start, in seconds. Default 0.25.
    pub lead: f64,
    /// Minimum length of a blend, used if an event is close to its clip's start or end, in seconds.
    /// Default 1/6.
    pub shortest: f64,
    /// Maximum length of a blend, used for the links with the largest distance, in seconds. Default
    /// 1/2.
    pub longest: f64,
    /// Minimum spacing in a clip between links to the same evasion, in seconds. Default 0.1.
    pub spread: f64,
    /// Minimum duration of the moments that a goal's link must help, in seconds. Default 1/30.
    pub least_gain: f64,
    /// Maximum number of links per second of clips. Links that keep an event in the graph count but
    /// are always added. Default 60.
    pub most_per_second: f64,
}

/// A goal: the number of evasions that can start in time, and the share of moments from which they
/// can.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LinkGoal {
    /// Time within which an evasion must be able to start, at rate 1, in seconds.
    pub seconds: f64,
    /// Number of different evasions that a moment should reach.
    pub evasions: usize,
    /// Share of the moments that should reach them, 0 to 1.
    pub share: f64,
}

impl Default for LinkSettings {
    fn default() -> Self {
        let goal = |seconds, evasions, share| LinkGoal {
            seconds,
            evasions,
            share,
        };
        Self {
            goals: vec![
                goal(1.0, 1, 0.90),
                goal(1.5, 1, 0.97),
                goal(1.0, 4, 0.80),
                goal(0.7, 8, 0.95),
            ],
            loosest: 0.35,
            lead: 0.25,
            shortest: 1.0 / 6.0,
            longest: 0.5,
            spread: 0.1,
            least_gain: 1.0 / 30.0,
            most_per_second: 60.0,
        }
    }
}

impl LinkSettings {
    /// # Errors
    /// The first setting that is out of its range.
    pub(crate) fn check(&self) -> Result<(), GraphError> {
        let times = (0.0..=10.0, "0 to 10 s");
        let (lengths, words) = times.clone();
        let mut checks = vec![
            (
                "links.loosest",
                f64::from(self.loosest),
                (1e-6..=1e3, "0.000001 to 1000 m"),
            ),
            ("links.lead", self.lead, times.clone()),
            ("links.longest", self.longest, times.clone()),
            (
                "links.shortest",
                self.shortest,
                (*lengths.start()..=self.longest, "0 to the longest blend"),
            ),
            ("links.spread", self.spread, times.clone()),
            ("links.least_gain", self.least_gain, times.clone()),
            (
                "links.most_per_second",
                self.most_per_second,
                (0.0..=1e6, "0 to 1000000"),
            ),
        ];
        for goal in &self.goals {
            checks.push((
                "links.goals.seconds",
                goal.seconds,
                (lengths.clone(), words),
            ));
            checks.push(("links.goals.share", goal.share, (0.0..=1.0, "0 to 1")));
        }
        checks
            .into_iter()
            .find(|(_, value, (allowed, _))| !allowed.contains(value))
            .map_or(Ok(()), |(name, value, (_, range))| {
                Err(GraphError::Setting { name, value, range })
            })
    }
}

/// Input of [`build`](crate::graph::build()).
#[derive(Clone, Copy, Debug)]
pub struct ClipSource<'a> {
    /// Skeleton of all clips.
    pub skeleton: &'a Skeleton,
    /// Clips, at any frame rates.
    pub clips: &'a [Clip],
    /// Labelled events of the clips. They may overlap; two of one kind with the same frames are an error.
    pub events: &'a [Event],
}
