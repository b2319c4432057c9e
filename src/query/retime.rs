//! The playback rate of a path that makes its evasion start when the attack starts.
//!
//! Source: Masaoka & Oshita, section 5.2. F is the duration of the edges with a fixed rate, E that of the edges whose rate may change in the
//! needed direction, and T the available time. Then p = E / (T - F).

use serde::{Deserialize, Serialize};

use super::settings::RateSettings;
use crate::graph::{EdgeId, MotionStep};
use crate::maps::{BakedGraph, NodePath};

/// Durations of the edges of a path at rate 1, in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Durations {
    pub total: f32,
    /// Duration of the edges that may be played faster.
    pub faster: f32,
    /// Duration of the edges that may be played slower.
    pub slower: f32,
}

impl Durations {
    pub(super) fn new(baked: &BakedGraph, path: &NodePath) -> Self {
        let seconds = |frames: u16| (f64::from(frames) / baked.graph().frame_rate()) as f32;
        Self {
            total: seconds(path.frames),
            faster: seconds(path.faster),
            slower: seconds(path.slower),
        }
    }
}

/// The edges whose rate is changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Direction {
    /// No edges, because the path is in time.
    Unchanged,
    /// Edges that may be played faster.
    Faster,
    /// Edges that may be played slower.
    Slower,
}

/// Playback rate of a path's retimable edges.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rate {
    /// Playback rate. Above 1 is faster than captured.
    pub rate: f32,
    /// Edges that are played at this rate.
    pub(crate) direction: Direction,
}

impl Rate {
    /// All edges are played as captured.
    pub const UNCHANGED: Self = Self {
        rate: 1.0,
        direction: Direction::Unchanged,
    };

    /// A rate of all edges.
    pub(super) fn for_all(rate: f32) -> Self {
        let direction = match rate {
            faster if faster > 1.0 => Direction::Faster,
            slower if slower < 1.0 => Direction::Slower,
            _ => Direction::Unchanged,
        };
        Self { rate, direction }
    }
}

/// The reason why no rate brings a path in time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum RateError {
    /// No edge may change its rate in the needed direction.
    #[error("no edge of the path may be played {}", if *.faster { "faster" } else { "slower" })]
    NothingRetimable {
        /// Whether the path would have to be faster instead of slower.
        faster: bool,
    },
    /// The required rate exceeds the limits. It is infinite if the other edges alone take too long.
    #[error("a rate of {rate:.2} would be needed")]
    OutOfRange {
        /// The needed rate.
        rate: f32,
    },
}

/// The rate at which a path lasts `available` seconds.
pub(super) fn rate(
    durations: &Durations,
    available: f32,
    settings: &RateSettings,
) -> Result<Rate, RateError> {
    if (durations.total - available).abs() <= settings.tolerance {
        return Ok(Rate::UNCHANGED);
    }
    let faster = durations.total > available;
    let (retimable, direction) = if faster {
        (durations.faster, Direction::Faster)
    } else {
        (durations.slower, Direction::Slower)
    };
    if retimable <= 0.0 {
        return Err(RateError::NothingRetimable { faster });
    }
    let left = available - (durations.total - retimable);
    let rate = if left > 0.0 {
        retimable / left
    } else {
        f32::INFINITY
    };
    if (settings.slowest..=settings.fastest).contains(&rate) {
        Ok(Rate { rate, direction })
    } else {
        Err(RateError::OutOfRange { rate })
    }
}

/// The steps of a path whose retimable edges are played at a rate.
pub(super) fn retimed<'a>(
    baked: &'a BakedGraph,
    rate: Rate,
    edges: impl Iterator<Item = EdgeId> + 'a,
) -> impl Iterator<Item = MotionStep> + 'a {
    edges.map(move |edge| {
        let retimable = baked.retimable(edge);
        let is_changed = match rate.direction {
            Direction::Unchanged => false,
            Direction::Faster => retimable.faster,
            Direction::Slower => retimable.slower,
        };
        MotionStep {
            edge,
            rate: if is_changed { rate.rate } else { 1.0 },
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF_FASTER: Durations = Durations {
        total: 2.0,
        faster: 1.0,
        slower: 0.0,
    };

    #[test]
    fn only_retimable_edges_make_up_the_time() {
        let found = |rate, direction| Ok(Rate { rate, direction });
        for (available, expected) in [
            // One second is fixed, so the other must pass in half a second.
            (1.5, found(2.0, Direction::Faster)),
            (2.01, found(1.0, Direction::Unchanged)),
            (3.0, Err(RateError::NothingRetimable { faster: false })),
            (1.25, Err(RateError::OutOfRange { rate: 4.0 })),
            (
                0.9,
                Err(RateError::OutOfRange {
                    rate: f32::INFINITY,
                }),
            ),
        ] {
            let found = rate(&HALF_FASTER, available, &RateSettings::default());
            assert_eq!(found, expected);
        }
    }
}
