//! The parts of a baked graph that files store separately, so that they can be read in parallel.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::BakedGraph;
use crate::graph::MotionGraph;
use crate::graph::section;
use crate::maps::entries::{EntryTable, EntryTracks};
use crate::maps::grid::{GridCells, GridSettings, PathTable};
use crate::maps::regions::{ClipCylinders, EvasionTracks};
use crate::maps::{AttackMove, Body, BodyRows, Evasion, OnFirstUse, RegionAtlas, Retimable};
use crate::math::parallel::both;

/// All small parts of a baked graph, stored together.
#[derive(Deserialize)]
struct Rest {
    body: Body,
    retimable: Vec<Retimable>,
    evasions: Vec<Evasion>,
    attack_moves: Vec<AttackMove>,
    grid_settings: GridSettings,
}

/// [`Rest`] by reference, for writing.
#[derive(Serialize)]
struct RestOf<'a> {
    body: &'a Body,
    retimable: &'a [Retimable],
    evasions: &'a [Evasion],
    attack_moves: &'a [AttackMove],
    grid_settings: &'a GridSettings,
}

impl BakedGraph {
    /// Number of parts.
    pub(crate) const SECTIONS: usize = MotionGraph::SECTIONS + 5;

    /// Serializes the parts of the graph.
    pub(crate) fn to_sections(&self) -> Result<[Vec<u8>; Self::SECTIONS], postcard::Error> {
        let [rest, clips, edges, feet] = self.graph.to_sections()?;
        let beside = RestOf {
            body: &self.body,
            retimable: &self.retimable,
            evasions: &self.evasions,
            attack_moves: &self.attack_moves,
            grid_settings: &self.grid_settings,
        };
        Ok([
            rest,
            clips,
            edges,
            feet,
            section::to_bytes(&beside)?,
            section::to_bytes(&self.atlas)?,
            section::to_bytes(&self.entries)?,
            section::to_bytes(&self.paths)?,
            section::to_bytes(&self.cylinders)?,
        ])
    }

    /// Reads the parts of a graph. [`BakedGraph::restored`] checks them.
    pub(crate) fn from_sections(
        [
            graph_rest,
            clips,
            edges,
            feet,
            rest,
            atlas,
            entries,
            paths,
            cylinders,
        ]: [&[u8]; Self::SECTIONS],
    ) -> Result<Self, String> {
        // On some machines these are more threads than cores; the first to finish frees a core for the others.
        let (graph, ((atlas, entries), (paths, cylinders))) = both(
            || MotionGraph::from_sections([graph_rest, clips, edges, feet]),
            || {
                both(
                    || {
                        let atlas = section::from_bytes::<RegionAtlas>(atlas);
                        (atlas, section::from_bytes::<EntryTable>(entries))
                    },
                    || {
                        let paths = section::from_bytes::<PathTable>(paths);
                        (paths, section::from_bytes::<ClipCylinders>(cylinders))
                    },
                )
            },
        );
        let Rest {
            body,
            retimable,
            evasions,
            attack_moves,
            grid_settings,
        } = section::from_bytes(rest)?;
        Ok(Self {
            graph: graph?,
            body,
            atlas: atlas?,
            retimable,
            evasions,
            attack_moves,
            entries: entries?,
            paths: paths?,
            grid_settings,
            cylinders: cylinders?,
            grid: GridCells::default(),
            tracks: EvasionTracks::default(),
            entry_tracks: EntryTracks::default(),
            frames_to_evasion: OnFirstUse::default(),
            reach: 0.0,
            body_rows: BodyRows::default(),
            evasion_texels: Vec::new(),
            placements: Vec::new(),
            identity: Arc::default(),
        })
    }
}
