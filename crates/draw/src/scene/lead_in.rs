//! A motion that leads to a given state of a character.

use sabaki::graph::{Edge, EdgeId, EdgeMotion, Motion, MotionGraph, MotionStep, Playhead};

/// Motion that ends at `playhead` after at least `seconds`, and its duration.
pub(super) fn lead_in(graph: &MotionGraph, playhead: Playhead, seconds: f32) -> (Motion, f32) {
    let rate = graph.frame_rate() as f32;
    let (mut edges, mut first) = (Vec::new(), playhead);
    let mut lasts = playhead.frame / rate;
    while lasts < seconds {
        let Some((edge, before)) = edge_before(graph, first.edge) else {
            break;
        };
        edges.push(first.edge);
        lasts += before.frames as f32 / rate;
        // The space of the previous edge's end is the space of this edge's start.
        let change = graph.clip_change(edge);
        first = Playhead {
            edge,
            frame: 0.0,
            clip_to_world: first.clip_to_world * change.inverse(),
        };
    }
    let first = Playhead {
        frame: 0.0,
        ..first
    };
    let steps: Vec<MotionStep> = edges
        .iter()
        .rev()
        .map(|&edge| MotionStep { edge, rate: 1.0 })
        .collect();
    let motion = Motion::new(graph, first, &steps);
    (motion, lasts)
}

/// An edge that leads to `edge`: the clip's previous frames if possible, otherwise the closest
/// transition.
fn edge_before(graph: &MotionGraph, edge: EdgeId) -> Option<(EdgeId, &Edge)> {
    let from = graph.edge(edge).from;
    let cost = |edge: &Edge| match edge.motion {
        EdgeMotion::Clip => 0.0,
        EdgeMotion::Transition { distance, .. } => distance,
    };
    let leading = graph.edge_ids().map(|id| (id, graph.edge(id)));
    leading
        .filter(|(_, edge)| edge.to == from)
        .min_by(|a, b| cost(a.1).total_cmp(&cost(b.1)))
}
