//! The parts of a graph that files store separately, so that they can be read in parallel.

use crate::anim::Skeleton;
use crate::graph::ClipId;
use crate::graph::build::prune::components;
use crate::graph::motion_graph::{
    Edge, EdgeMotion, GraphEvent, KnownRig, LegBlend, MotionGraph, Plant, twice,
};
use crate::graph::settings::GraphSettings;
use crate::math::in_parallel;
use crate::math::parallel::both;
use serde::Serialize;
use serde::de::DeserializeOwned;

impl MotionGraph {
    /// The clips, and everything else.
    pub(crate) fn to_sections(&self) -> Result<[Vec<u8>; 2], postcard::Error> {
        let (skeleton, frame_rate, leads) = (&self.skeleton, self.frame_rate, &self.leads);
        let (nodes, edges, first_edge) = (&self.nodes, &self.edges, &self.first_edge);
        let (events, feet) = (&self.events, &self.feet);
        let rest = (
            skeleton, frame_rate, events, nodes, edges, first_edge, feet, leads,
        );
        Ok([to_bytes(&self.clips)?, to_bytes(&rest)?])
    }

    /// Reads the parts of a graph. [`MotionGraph::validate`] checks them.
    pub(crate) fn from_sections([clips, rest]: [&[u8]; 2]) -> Result<Self, String> {
        let (clips, rest) = both(|| from_bytes(clips), || from_bytes(rest));
        let (skeleton, frame_rate, events, nodes, edges, first_edge, feet, leads) = rest?;
        let mut graph = Self {
            skeleton,
            frame_rate,
            clips: clips?,
            events,
            nodes,
            edges,
            first_edge,
            feet,
            leads,
            rig: KnownRig::default(),
        };
        // Lists grow as they are read, to up to twice their length.
        graph.edges.shrink_to_fit();
        graph.feet.blends.shrink_to_fit();
        graph.feet.root_drops.shrink_to_fit();
        Ok(graph)
    }
}

// Serializes the parts of a file one by one, so that they can be read in parallel.

pub(crate) fn to_bytes<T: Serialize + ?Sized>(part: &T) -> Result<Vec<u8>, postcard::Error> {
    postcard::to_extend(part, Vec::new())
}

/// Reads a part. It must use all bytes.
pub(crate) fn from_bytes<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, String> {
    let (part, rest) = postcard::take_from_bytes(bytes).map_err(|error| error.to_string())?;
    match rest.len() {
        0 => Ok(part),
        left => Err(format!("{left} bytes follow its end")),
    }
}

// Checks a graph that was read from a file.

/// An error that says `what` is wrong, unless a condition holds.
pub(crate) fn ensure(holds: bool, what: &str) -> Result<(), String> {
    match holds {
        true => Ok(()),
        false => Err(what.to_owned()),
    }
}

impl MotionGraph {
    /// Checks that every index is in range, every edge fits its clips, and every node can be
    /// reached from every other node. Graphs that are built here always pass; graphs that come from
    /// a file are checked.
    ///
    /// # Errors
    /// A description of the first invalid item.
    pub fn validate(&self) -> Result<(), String> {
        let is_possible = GraphSettings::FRAME_RATES.contains(&self.frame_rate);
        ensure(is_possible, "the frame rate is not possible")?;
        let is_sound = |clip: usize| {
            let clip = &self.clips[clip];
            clip.frame_rate() == self.frame_rate && clip.is_sound(&self.skeleton)
        };
        let (sound, tables) = both(
            || in_parallel(0, self.clips.len(), is_sound),
            || self.validate_tables(),
        );
        let are_sound = !sound.contains(&false);
        ensure(are_sound, "a clip is damaged or of another frame rate")?;
        tables
    }

    /// Checks what the contents of the clips' frames do not matter to. The order matters: each check relies on those before it.
    fn validate_tables(&self) -> Result<(), String> {
        let frames = |clip: ClipId| {
            let clip = self.clips.get(clip.index());
            clip.map_or(0, |clip| clip.frames() as u32)
        };
        let mut leads = self.leads.iter().zip(&self.clips);
        let leads_fit = self.leads.is_empty()
            || self.leads.len() == self.clips.len()
                && leads.all(|(&lead, clip)| (lead as usize) < clip.frames());
        ensure(leads_fit, "the frames before its clips do not fit them")?;
        ensure(!self.nodes.is_empty(), "it has no nodes")?;
        let mut nodes = self.nodes.iter();
        let nodes_fit = nodes.all(|node| node.frame < frames(node.clip));
        ensure(nodes_fit, "a node names a frame that is not there")?;
        let joints = self.skeleton.len();
        let events_fit = self.events.iter().all(|e| {
            e.first < e.last
                && e.last < frames(e.clip)
                && e.joints.iter().all(|joint| joint.index() < joints)
        });
        let what = "an event names frames or joints that are not there";
        ensure(events_fit, what)?;
        ensure(twice(&self.events).is_none(), "an event is there twice")?;
        let edges_fit = self.edges.iter().all(|edge| self.edge_fits(edge));
        ensure(edges_fit, "an edge does not fit its nodes or clips")?;
        ensure(self.index_fits(), "the index of edges is damaged")?;
        let what = "the table of feet does not fit the skeleton, the clips or the edges";
        ensure(self.feet_fit(), what)?;
        let what = "from some node another cannot be reached";
        ensure(self.is_connected(), what)
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

    /// Whether every node can be reached from every other one.
    fn is_connected(&self) -> bool {
        let ends = self.edges.iter().map(|edge| (edge.from.0, edge.to.0));
        let components = components(self.nodes.len(), &ends.collect::<Vec<_>>());
        components.iter().all(|one| *one == components[0])
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
            let ends = self.events.get(event.index()).map(GraphEvent::ends);
            edge.motion == EdgeMotion::Clip && ends == Some([*from, *to])
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

    /// Whether the foot data fits the graph. It checks data from a file, after the clips and edges
    /// were found valid.
    pub(crate) fn feet_fit(&self) -> bool {
        let (legs, plants) = (&self.feet.legs, &self.feet.plants);
        let (blends, root_drops) = (&self.feet.blends, &self.feet.root_drops);
        let frames = |table: usize| self.clips[table / legs.len()].frames() as u32;
        let ordered = |plants: &[Plant]| plants.windows(2).all(|pair| pair[0].last < pair[1].first);
        let plants_fit = plants.len() == self.clips.len() * legs.len()
            && plants.iter().enumerate().all(|(table, plants)| {
                let inside =
                    |plant: &Plant| plant.first <= plant.last && plant.last < frames(table);
                ordered(plants) && plants.iter().all(inside)
            });
        let edges = self.edges.len();
        let tables_fit = [[0, 0], [edges * legs.len(), edges]];
        let blend_fits = |(index, blend): (usize, &Option<LegBlend>)| {
            blend.is_none_or(|blend| {
                blend.is_sound(self.edges[index / legs.len()].frames, Skeleton::FURTHEST)
            })
        };
        legs.iter().all(|leg| leg.is_sound(&self.skeleton))
            && plants_fit
            && tables_fit.contains(&[blends.len(), root_drops.len()])
            && blends.iter().enumerate().all(blend_fits)
            && root_drops
                .iter()
                .all(|drop| (0.0..=Skeleton::FURTHEST).contains(drop))
    }
}
