use crate::anim::{Clip, CompressionSettings, Event, Skeleton, details};
use crate::graph::error::GraphError;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

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
    /// Largest distance at which a clip that nothing near leads to or from is joined to the graph, in metres. Default `None`: no such clip is
    /// lost, whatever its links cost. 0 joins none.
    #[serde(default)]
    pub farthest_join: Option<f32>,
    /// Minimum separation of two transitions between the same clips, in seconds. Of closer ones the
    /// better one is kept. Default 1/3.
    pub separation: f64,
    /// Weight of each joint in the distance. Default: empty, which weights all joints equally, without fingers, faces and helpers
    /// ([`details`]).
    pub joint_weights: Vec<f32>,
    /// Whether transitions keep planted feet from sliding. If not, feet slide as root and joints blend (Kovar 2002). Plants are
    /// found and slides are measured in both cases. Default true.
    pub keep_feet: bool,
    /// Speed of a toe, in metres per second, above which a transition is left out if the toe is also faster than 1.3 times the
    /// faster clip. Transitions in which the body pushes harder than in any clip are left out, too. `None` keeps all transitions. Default 5.
    pub fastest_step: Option<f32>,
    /// Links: transitions with a looser threshold that bring evasions within reach. `None` builds a graph of the transitions
    /// under `threshold` alone.
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
            farthest_join: None,
            separation: 1.0 / 3.0,
            joint_weights: Vec::new(),
            keep_feet: true,
            fastest_step: Some(5.0),
            links: Some(LinkSettings::default()),
            compression: Some(CompressionSettings::default()),
            threads: 0,
            memory: Self::MEMORY,
        }
    }
}

impl GraphSettings {
    /// Range of frame rates that a graph may have, in frames per second.
    pub const FRAME_RATES: RangeInclusive<f64> = 1.0..=480.0;

    /// Converts a time to whole frames, at least one.
    pub(crate) fn frames(&self, seconds: f64) -> usize {
        ((seconds * self.frame_rate).round() as usize).max(1)
    }

    /// Checks the settings and returns the weight of each joint.
    pub(crate) fn checked_weights(&self, skeleton: &Skeleton) -> Result<Vec<f32>, GraphError> {
        let joints = skeleton.len();
        let compression = self.compression.unwrap_or_default();
        let [threshold, step, joint_error, end_error] = [
            self.threshold,
            self.fastest_step.unwrap_or(0.0),
            compression.joint_error,
            compression.end_error,
        ]
        .map(f64::from);
        check_ranges([
            (
                "frame_rate",
                self.frame_rate,
                Self::FRAME_RATES,
                "1 to 480 a second",
            ),
            ("window", self.window, 0.0..=10.0, "0 to 10 s"),
            ("separation", self.separation, 0.0..=60.0, "0 to 60 s"),
            ("threshold", threshold, 1e-6..=1e3, "0.000001 to 1000 m"),
            ("fastest_step", step, 0.0..=1e3, "0 to 1000 m/s"),
            ("joint_error", joint_error, 1e-6..=1.0, "0.000001 to 1 m"),
            ("end_error", end_error, 1e-6..=1.0, "0.000001 to 1 m"),
        ])?;
        let join = f64::from(self.farthest_join.unwrap_or(0.0));
        check_ranges([("farthest_join", join, 0.0..=1e3, "0 to 1000 m")])?;
        self.links.as_ref().map_or(Ok(()), LinkSettings::check)?;
        if self.joint_weights.is_empty() {
            let weights = details(skeleton).into_iter();
            let weights: Vec<f32> = weights
                .map(|is_detail| if is_detail { 0.0 } else { 1.0 })
                .collect();
            return Ok(match weights.contains(&1.0) {
                true => weights,
                false => vec![1.0; joints],
            });
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

    // Limits on the size of a graph. Larger input would exhaust memory or time.

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

    /// Checks the number of transitions against a limit, before or after the closest are chosen.
    pub(crate) fn check_transitions(found: usize, most: usize) -> Result<(), GraphError> {
        match found <= most {
            true => Ok(()),
            false => Err(GraphError::TooMany {
                what: "transitions under the threshold",
                found: found as u64,
                most: most as u64,
            }),
        }
    }
}

/// Checks numbers, each given by its name, its value, its range, and the range in words.
fn check_ranges(
    numbers: impl IntoIterator<Item = (&'static str, f64, RangeInclusive<f64>, &'static str)>,
) -> Result<(), GraphError> {
    let mut numbers = numbers.into_iter();
    match numbers.find(|(_, value, allowed, _)| !allowed.contains(value)) {
        Some((name, value, _, range)) => Err(GraphError::Setting { name, value, range }),
        None => Ok(()),
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
            most_per_second: 60.0,
        }
    }
}

impl LinkSettings {
    pub(crate) fn check(&self) -> Result<(), GraphError> {
        let loosest = f64::from(self.loosest);
        let goals = self.goals.iter().flat_map(|goal| {
            [
                ("links.goals.seconds", goal.seconds, 0.0..=10.0, "0 to 10 s"),
                ("links.goals.share", goal.share, 0.0..=1.0, "0 to 1"),
            ]
        });
        check_ranges(goals)?;
        check_ranges([
            ("links.loosest", loosest, 1e-6..=1e3, "0.000001 to 1000 m"),
            (
                "links.most_per_second",
                self.most_per_second,
                0.0..=1e6,
                "0 to 1000000",
            ),
        ])
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
