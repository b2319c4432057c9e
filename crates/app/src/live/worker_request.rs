//! Requests to a query worker, and its responses.

use std::time::Duration;

use super::map_choices::MapChoice;
use sabaki::graph::Playhead;
use sabaki::query::{Answer, Attack, CullPath, QuerySettings};
use sabaki_fixtures::headless::DeviceChoice;

/// Settings of a [`QueryWorker`](super::QueryWorker).
#[derive(Clone, Debug, Default)]
pub struct QueryWorkerDesc {
    /// Device that culls; it is opened by the first request that needs it.
    pub device: DeviceChoice,
    /// Enables validation on that device.
    pub validation: bool,
    /// Delay of every response, as on a slow device. Default: none.
    pub delay: Duration,
}

/// A query for the worker.
#[derive(Clone, Debug)]
pub struct WorkerRequest {
    /// Number that the caller chooses; the response repeats it.
    pub number: u32,
    /// Place of the character in the graph.
    pub playhead: Playhead,
    /// The attack, in the world of the playhead.
    pub attack: Attack,
    /// Settings of the query.
    pub settings: QuerySettings,
    /// Culling path.
    pub culling: CullPath,
    /// Maps to cull by.
    pub maps: MapChoice,
}

/// The response to a [`WorkerRequest`].
#[derive(Clone, Debug)]
pub struct WorkerResponse {
    /// Number of the request.
    pub number: u32,
    /// Answer of the query.
    pub answer: Answer,
    /// Culling path that was used.
    pub culling: CullPath,
    /// Maps that were used.
    pub maps: MapChoice,
    /// Time of the query, in seconds, without the delay and without drawing maps.
    pub seconds: f64,
    /// Why another path or other maps were used than requested.
    pub trouble: Option<String>,
}
