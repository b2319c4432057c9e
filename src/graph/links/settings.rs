use serde::{Deserialize, Serialize};

use crate::graph::GraphError;

/// Which links a graph gets for the sake of its events.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LinkSettings {
    /// What is to be reached, one after the other. Default: an evasion within 1 s from 90% of the
    /// moments and within 1.5 s from 97%; four different ones within 1 s from 80%, and eight within
    /// 0.7 s from 95%.
    pub goals: Vec<LinkGoal>,
    /// Windows that lie further apart are not linked: root of the mean squared distance of joints,
    /// metres; times window / blend where the blend is shorter than the graph's window. Default
    /// 0.35: strides of a walk come no closer to a guard, and only they need more than 0.25.
    pub loosest: f32,
    /// A link may end this long before the event's first frame, or start this long after its last,
    /// seconds. Default 0.25.
    pub lead: f64,
    /// The shortest blend, where an event lies near its clip's start or end, seconds. Default 1/6.
    pub shortest: f64,
    /// The longest blend, that of the loosest links, seconds. Default 1/2.
    pub longest: f64,
    /// Into each evasion at most one link starts in each stretch of a clip of this length, seconds.
    /// Default 0.1.
    pub spread: f64,
    /// A goal's link must help at least this long a stretch of moments, seconds. Default 1/30.
    pub least_gain: f64,
    /// Most links for each second of clips; those that keep an event in the graph are counted but
    /// always made. Default 60.
    pub most_per_second: f64,
}

/// How soon how many evasions are wanted, and from how many moments.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LinkGoal {
    /// An evasion counts when it can start within this time, at rate 1.
    pub seconds: f64,
    /// How many different evasions a moment should reach.
    pub evasions: usize,
    /// Share of the moments that should, 0 to 1.
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
