use super::rng::SplitMix64;
use crate::graph::{EdgeId, MotionGraph};

/// A random start edge with no event on it or soon after it.
pub(super) fn opening_edge(graph: &MotionGraph, rng: &mut SplitMix64) -> EdgeId {
    /// Number of edges, from the start edge on, that must have no event.
    const CALM: usize = 12;
    let natural: Vec<EdgeId> = graph.natural_edges().collect();
    let is_natural = |edge: &EdgeId| natural.binary_search(edge).is_ok();
    let is_calm = |&edge: &EdgeId| {
        let next = |edge: &EdgeId| Some(graph.natural_edge(graph.edge(*edge).to));
        let mut way = std::iter::successors(Some(edge), next).take(CALM);
        way.all(|edge| is_natural(&edge))
    };
    let calm: Vec<EdgeId> = graph.edge_ids().filter(is_calm).collect();
    match calm.len() {
        0 => EdgeId(0),
        count => calm[rng.below(count)],
    }
}
