//! The parts of a graph that files store separately, so that they can be read in parallel.

use crate::anim::{Clip, Skeleton};
use crate::graph::ClipId;
use crate::graph::build::prune::components;
use crate::graph::motion_graph::{
    Edge, EdgeMotion, Feet, GraphEvent, KnownRig, LegBlend, MotionGraph, Plant, twice,
};
use crate::graph::settings::GraphSettings;
use crate::math::in_parallel;
use crate::math::parallel::both;
use serde::Serialize;
use serde::de::DeserializeOwned;

impl MotionGraph {
    pub(crate) const SECTIONS: usize = 4;

    pub(crate) fn to_sections(&self) -> Result<[Vec<u8>; Self::SECTIONS], postcard::Error> {
        let (events, nodes, first_edge) = (&self.events, &self.nodes, &self.first_edge);
        let rest = (&self.skeleton, self.frame_rate, events, nodes, first_edge);
        let mut rest = to_bytes(&rest)?;
        // Graphs whose clips were not lengthened need no more.
        if !self.leads.is_empty() {
            rest.extend(to_bytes(&self.leads)?);
        }
        Ok([
            rest,
            to_bytes(&self.clips)?,
            to_bytes(&self.edges)?,
            to_bytes(&self.feet)?,
        ])
    }

    /// Reads the parts of a graph. [`MotionGraph::validate`] checks them.
    pub(crate) fn from_sections(
        [rest, clips, edges, feet]: [&[u8]; Self::SECTIONS],
    ) -> Result<Self, String> {
        let (clips, (edges, (feet, rest))) = both(
            || from_bytes::<Vec<Clip>>(clips),
            || {
                let edges = from_bytes::<Vec<Edge>>(edges);
                let feet = from_bytes::<Feet>(feet);
                (edges, (feet, postcard::take_from_bytes(rest)))
            },
        );
        let (rest, leads) = rest.map_err(|error| error.to_string())?;
        let (skeleton, frame_rate, events, nodes, first_edge) = rest;
        let leads = match leads {
            [] => Vec::new(),
            leads => from_bytes(leads)?,
        };
        // Lists grow as they are read, to up to twice their length.
        let (mut edges, mut feet) = (edges?, feet?);
        edges.shrink_to_fit();
        feet.blends.shrink_to_fit();
        feet.root_drops.shrink_to_fit();
        Ok(Self {
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
        })
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
        let leads_fit = || {
            let mut pairs = self.leads.iter().zip(&self.clips);
            let is_short = |(&lead, clip): (&u32, &Clip)| (lead as usize) < clip.frames();
            self.leads.is_empty() || self.leads.len() == self.clips.len() && pairs.all(is_short)
        };
        let checks: [(&(dyn Fn() -> bool + Sync), &str); 9] = [
            (&leads_fit, "the frames before its clips do not fit them"),
            (&|| !self.nodes.is_empty(), "it has no nodes"),
            (
                &|| self.nodes.iter().all(|node| node.frame < frames(node.clip)),
                "a node names a frame that is not there",
            ),
            (
                &|| self.events.iter().all(event_ok),
                "an event names frames or joints that are not there",
            ),
            (&|| twice(&self.events).is_none(), "an event is there twice"),
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
