use std::path::PathBuf;

use serde::Serialize;

use sabaki::query::Source;

/// An event of a window: one line of `sabaki view --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// The window was opened.
    Opened {
        /// Device that draws.
        device: String,
        /// Size of the picture, in pixels.
        size: [u32; 2],
    },
    /// A ball was thrown.
    Throw {
        /// Number, counted from 1.
        number: u32,
        /// Start of the flight in the world, in metres.
        from: [f32; 3],
        /// Target in the world, in metres.
        target: [f32; 3],
        /// Whether the target is on the body.
        at_body: bool,
        /// Time until the throw, in seconds.
        lead: f32,
        /// Speed of the ball, in metres per second.
        speed: f32,
        /// Radius of the ball, in metres.
        radius: f32,
    },
    /// A click while a ball was flying; it throws nothing.
    Ignored {
        /// Number of the flying ball.
        number: u32,
    },
    /// The answer of a query.
    Answer {
        /// Number of the throw.
        number: u32,
        /// Whether the chosen motion avoids the ball.
        avoided: bool,
        /// The chosen answer: `evasion` or `move`.
        chosen: &'static str,
        /// Smallest distance of body and ball, in metres.
        clearance: f32,
        /// Time of the smallest distance, in seconds since the click.
        nearest_at: f32,
        /// Source of the candidates.
        source: Source,
        /// Number of candidates.
        candidates: usize,
        /// Number of candidates that the maps removed.
        culled: usize,
        /// Number of candidates that the exact test found hit.
        hits: usize,
        /// Number of candidates that the exact test found clean.
        clean: usize,
        /// Culling path: `exact`, `cpu`, `stencil` or `compute`.
        cull: &'static str,
        /// Slab height of the maps that culled, in metres.
        slab_height: f32,
        /// Whether the node's grid was used.
        grid: bool,
        /// Time of the query, in milliseconds.
        query_ms: f64,
    },
    /// The end of an attack of a duel.
    Exchange {
        /// Number, counted from 1.
        number: u32,
        /// The attacker: `white` or `blue`.
        attacker: &'static str,
        /// Clip of the attack.
        attack: String,
        /// Whether the attack was avoided.
        avoided: bool,
        /// Smallest distance of body and attack, in metres; negative for a hit.
        clearance: f32,
        /// Time from the announcement to the start, in seconds.
        lead: f32,
    },
    /// A query could not be made as requested; the CPU answers it instead.
    Trouble {
        /// Reason, as text.
        why: String,
    },
    /// The end of a ball's flight, as shown.
    Passed {
        /// Number of the throw.
        number: u32,
        /// Smallest distance of body and ball in the shown pictures, in metres; negative for a hit.
        nearest: f32,
        /// Number of pictures with the ball.
        pictures: u32,
    },
    /// The size of the window changed.
    Resized {
        /// Size of the drawing, in pixels.
        size: [u32; 2],
    },
    /// The window was hidden.
    Hidden,
    /// The window is visible again.
    Shown,
    /// A screenshot was written.
    Screenshot {
        /// Path of the file.
        file: PathBuf,
    },
    /// The window was closed.
    Closed {
        /// Whether a query had no answer yet.
        asking: bool,
        /// Number of pictures shown.
        frames: u64,
        /// Median time from one picture to the next of the last pictures, in milliseconds.
        median_frame_ms: f64,
        /// Median time to pose the crowd, in milliseconds.
        #[serde(skip_serializing_if = "Option::is_none")]
        median_pose_ms: Option<f64>,
        /// Validation messages, if validation was enabled.
        validation: Vec<String>,
    },
}
