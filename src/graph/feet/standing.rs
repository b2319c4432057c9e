//! Whether a foot is planted at a frame of an edge.

use crate::graph::{EdgeId, MotionGraph};

impl MotionGraph {
    /// Whether the foot of a leg is planted at a frame of an edge. In a transition the side with the larger weight decides.
    pub(crate) fn foot_stands(&self, edge: EdgeId, frame: f32, leg: usize) -> bool {
        let moment = self.edge_moment(self.edge(edge), frame);
        let position = match moment.target {
            Some(target) if target.weight > 0.5 => target.at,
            _ => moment.source,
        };
        let frame = position.frame.max(0.0) as u32;
        leg < self.feet.legs.len() && self.feet.stands(position.clip, leg, frame)
    }
}
