//! Checks a graph that was read from a file.

use super::{
    ClipId, Edge, EdgeMotion, EdgesInto, GraphEvent, GraphSettings, MotionGraph, Node, NodeId,
    events,
};
use crate::anim::{Clip, Skeleton};
use crate::math::in_parallel;
use crate::math::parallel::both;

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
        if !GraphSettings::FRAME_RATES.contains(&self.frame_rate) {
            return Err("the frame rate is not possible".to_owned());
        }
        let clips_are_sound = || {
            let is_sound = |clip: usize| clip_ok(&self.clips[clip]);
            let sound = in_parallel(0, self.clips.len(), is_sound);
            sound.iter().all(|&is_sound| is_sound)
        };
        // The order matters: each check relies on those before it. None relies on the contents of the clips' frames.
        let checks: [(&(dyn Fn() -> bool + Sync), &str); 8] = [
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
        let first_wrong = || checks.iter().find(|(holds, _)| !holds());
        let (is_sound, wrong) = both(clips_are_sound, first_wrong);
        match wrong {
            _ if !is_sound => Err("a clip is damaged or of another frame rate".to_owned()),
            Some((_, what)) => Err((*what).to_owned()),
            None => Ok(()),
        }
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

    /// Whether the first node reaches every node, and every node reaches it.
    fn is_connected(&self) -> bool {
        let forwards = |node: NodeId| self.edges_from(node).map(|edge| self.edge(edge).to);
        let into = EdgesInto::new(self);
        let backwards = |node: NodeId| into.of(node).iter().map(|&edge| self.edge(edge).from);
        self.reaches_all(forwards) && self.reaches_all(backwards)
    }

    /// Whether a search from the first node on finds every node.
    fn reaches_all<N: Iterator<Item = NodeId>>(&self, next: impl Fn(NodeId) -> N) -> bool {
        let mut seen = vec![false; self.nodes.len()];
        let (mut open, mut count) = (vec![NodeId(0)], 1);
        seen[0] = true;
        while let Some(node) = open.pop() {
            for to in next(node) {
                if !std::mem::replace(&mut seen[to.index()], true) {
                    count += 1;
                    open.push(to);
                }
            }
        }
        count == self.nodes.len()
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
