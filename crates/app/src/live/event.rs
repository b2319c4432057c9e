use std::path::PathBuf;

use serde::Serialize;

use sabaki::query::Source;

/// Something that has happened in a window: one line of `sabaki view --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// The window is there.
    Opened {
        /// Which device draws.
        device: String,
        /// Columns and rows.
        size: [u32; 2],
    },
    /// A ball was thrown.
    Throw {
        /// Counts from 1.
        number: u32,
        /// Where it is thrown from, in the world, metres.
        from: [f32; 3],
        /// What it is aimed at.
        target: [f32; 3],
        /// Whether that is on the body.
        at_body: bool,
        /// Seconds until the throw.
        lead: f32,
        /// Metres per second.
        speed: f32,
        /// Metres.
        radius: f32,
    },
    /// A click while a ball was on its way: nothing is thrown.
    Ignored {
        /// The ball that is on its way.
        number: u32,
    },
    /// What the query answered.
    Answer {
        /// Which throw.
        number: u32,
        /// Whether the chosen motion avoids the ball.
        avoided: bool,
        /// `evasion` or `move`: what was chosen.
        chosen: &'static str,
        /// The smallest distance of body and ball on it, metres.
        clearance: f32,
        /// When that is, seconds since the click.
        nearest_at: f32,
        /// Where the candidates come from.
        source: Source,
        /// How many there were.
        candidates: usize,
        /// Of these, removed by the maps.
        culled: usize,
        /// Found to be hit by the exact test.
        hits: usize,
        /// Found to be clean.
        clean: usize,
        /// Who culled: `exact`, `cpu`, `stencil` or `compute`.
        cull: &'static str,
        /// Of the maps that culled, metres.
        slab_height: f32,
        /// Whether the node's grid was used.
        grid: bool,
        /// How long the query took, milliseconds.
        query_ms: f64,
    },
    /// An attack of a duel has come, and passed or hit.
    Exchange {
        /// Counts from 1.
        number: u32,
        /// `white` or `blue`.
        attacker: &'static str,
        /// Its clip.
        attack: String,
        /// Whether it missed.
        avoided: bool,
        /// The smallest distance of body and attack, metres; negative where it hit.
        clearance: f32,
        /// Seconds from its announcement to its start.
        lead: f32,
    },
    /// A query that was asked for could not be made, and why; the CPU's answer comes instead.
    Trouble {
        /// In words.
        why: String,
    },
    /// The ball has flown past, as it was shown.
    Passed {
        /// Which throw.
        number: u32,
        /// The smallest distance of body and ball in the pictures shown, metres; negative where it hit.
        nearest: f32,
        /// In how many pictures it flew.
        pictures: u32,
    },
    /// The window has another size.
    Resized {
        /// Columns and rows of what is drawn.
        size: [u32; 2],
    },
    /// Nobody can see the window.
    Hidden,
    /// It can be seen again.
    Shown,
    /// What the window shows was written to a file.
    Screenshot {
        /// The file.
        file: PathBuf,
    },
    /// The window is gone.
    Closed {
        /// Whether a query had not been answered yet.
        asking: bool,
        /// How many pictures were shown.
        frames: u64,
        /// From one picture to the next, milliseconds, the median of the last ones.
        median_frame_ms: f64,
        /// Of that, what the host needed to pose a crowd.
        #[serde(skip_serializing_if = "Option::is_none")]
        median_pose_ms: Option<f64>,
        /// What validation said, where it was listened to.
        validation: Vec<String>,
    },
}
