use super::rng::SplitMix64;
use crate::graph::{EdgeId, EdgeMotion, MotionGraph};

/// A random edge to begin at, without an event on it or soon after it.
pub(super) fn opening_edge(graph: &MotionGraph, rng: &mut SplitMix64) -> EdgeId {
    /// Number of edges without events.
    const CALM: usize = 12;
    let is_calm = |&edge: &EdgeId| {
        let next = |edge: &EdgeId| Some(graph.natural_edge(graph.edge(*edge).to));
        let mut way = std::iter::successors(Some(edge), next).take(CALM);
        way.all(|edge| {
            graph.edge(edge).event.is_none() && graph.edge(edge).motion == EdgeMotion::Clip
        })
    };
    let calm: Vec<EdgeId> = graph.edge_ids().filter(is_calm).collect();
    match calm.len() {
        0 => EdgeId(0),
        count => calm[rng.below(count)],
    }
}
