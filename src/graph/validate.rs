//! Checks a graph that was read from a file.

use super::{
    ClipId, Edge, EdgeMotion, GraphEvent, GraphSettings, MotionGraph, Node, events, prune,
};
use crate::anim::{Clip, Skeleton};

impl MotionGraph {
    /// Checks that every index is in range, every edge fits its clips, and every node can be
    /// reached from every other node. Graphs that are built here always pass; graphs that come from
    /// a file are checked.
    ///
    /// # Errors
    /// A description of the first invalid item.
    pub fn validate(&self) -> Result<(), String> {
        let frames = |clip: ClipId| {
            self.clips
                .get(clip.index())
                .map_or(0, |clip| clip.frames() as u32)
        };
        let joints = self.skeleton.len();
        let clip_ok =
            |clip: &Clip| clip.frame_rate() == self.frame_rate && clip.is_sound(&self.skeleton);
        let event_ok = |e: &GraphEvent| {
            e.first < e.last
                && e.last < frames(e.clip)
                && e.joints.iter().all(|joint| joint.index() < joints)
        };
        // The order matters: each check relies on those before it.
        let checks: [(&dyn Fn() -> bool, &str); 10] = [
            (
                &|| GraphSettings::FRAME_RATES.contains(&self.frame_rate),
                "the frame rate is not possible",
            ),
            (
                &|| self.clips.iter().all(clip_ok),
                "a clip is damaged or of another frame rate",
            ),
            (&|| !self.nodes.is_empty(), "it has no nodes"),
            (
                &|| self.nodes.iter().all(|node| node.frame < frames(node.clip)),
                "a node names a frame that is not there",
            ),
            (
                &|| self.events.iter().all(event_ok),
                "an event names frames or joints that are not there",
            ),
            (
                &|| events::twice(&self.events).is_none(),
                "an event is there twice",
            ),
            (
                &|| self.edges.iter().all(|edge| self.edge_fits(edge)),
                "an edge does not fit its nodes or clips",
            ),
            (&|| self.index_fits(), "the index of edges is damaged"),
            (
                &|| self.feet_fit(),
                "the table of feet does not fit the skeleton, the clips or the edges",
            ),
            (
                &|| self.is_connected(),
                "from some node another cannot be reached",
            ),
        ];
        checks
            .iter()
            .find(|(holds, _)| !holds())
            .map_or(Ok(()), |(_, what)| Err((*what).to_owned()))
    }

    /// Whether every node has at least one edge and the index refers to exactly its edges.
    fn index_fits(&self) -> bool {
        let ends_fit = self.first_edge.len() == self.nodes.len() + 1
            && self.first_edge.first() == Some(&0)
            && self.first_edge.last() == Some(&(self.edges.len() as u32));
        ends_fit
            && self.first_edge.windows(2).enumerate().all(|(node, range)| {
                let edges = self.edges.get(range[0] as usize..range[1] as usize);
                edges.is_some_and(|edges| {
                    !edges.is_empty() && edges.iter().all(|edge| edge.from.index() == node)
                })
            })
    }

    fn is_connected(&self) -> bool {
        let ends: Vec<(u32, u32)> = self.edges.iter().map(|e| (e.from.0, e.to.0)).collect();
        let components = prune::components(self.nodes.len(), &ends);
        components.windows(2).all(|pair| pair[0] == pair[1])
    }

    fn edge_fits(&self, edge: &Edge) -> bool {
        let ends = (
            self.nodes.get(edge.from.index()),
            self.nodes.get(edge.to.index()),
        );
        let (Some(from), Some(to)) = ends else {
            return false;
        };
        let event_ok = edge.event.is_none_or(|event| {
            let whole = |e: &GraphEvent| {
                [e.first, e.last].map(|frame| Node {
                    clip: e.clip,
                    frame,
                })
            };
            edge.motion == EdgeMotion::Clip
                && self.events.get(event.index()).map(whole) == Some([*from, *to])
        });
        let motion_ok = match edge.motion {
            EdgeMotion::Clip => {
                from.clip == to.clip && from.frame.checked_add(edge.frames) == Some(to.frame)
            }
            EdgeMotion::Transition { align, distance } => {
                let last = self.clip(from.clip).frames() as u32;
                let finite = align.is_sound(4.0 * Skeleton::FURTHEST) && distance.is_finite();
                finite
                    && to.frame >= edge.frames
                    && from
                        .frame
                        .checked_add(edge.frames)
                        .is_some_and(|f| f < last)
            }
        };
        edge.frames > 0 && event_ok && motion_ok
    }
}
