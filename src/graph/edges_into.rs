use super::{EdgeId, MotionGraph, NodeId};

/// The edges that lead to each node.
pub(crate) struct EdgesInto {
    /// Edges by the node to which they lead.
    edges: Vec<EdgeId>,
    /// Index of each node's first edge. The last entry is the number of edges.
    first: Vec<u32>,
}

impl EdgesInto {
    pub(crate) fn new(graph: &MotionGraph) -> Self {
        let mut first = vec![0; graph.nodes().len() + 1];
        for edge in graph.edges() {
            first[edge.to.index() + 1] += 1;
        }
        for node in 1..first.len() {
            first[node] += first[node - 1];
        }
        let mut next = first.clone();
        let mut edges = vec![EdgeId(0); graph.edges().len()];
        for (edge, id) in graph.edges().iter().zip(0..) {
            let slot = &mut next[edge.to.index()];
            edges[*slot as usize] = EdgeId(id);
            *slot += 1;
        }
        Self { edges, first }
    }

    /// The edges that lead to a node, in their order.
    pub(crate) fn of(&self, node: NodeId) -> &[EdgeId] {
        let first = &self.first[node.index()..];
        &self.edges[first[0] as usize..first[1] as usize]
    }
}
