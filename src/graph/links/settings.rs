use serde::{Deserialize, Serialize};

use crate::graph::GraphError;

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
    pub(in crate::graph) fn check(&self) -> Result<(), GraphError> {
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
