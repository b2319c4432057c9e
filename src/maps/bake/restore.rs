//! Writes the parts of a baked graph, reads and checks them, and computes what files do not store.

use super::baked_graph::{BakedGraph, Derived};
use crate::anim::{EventKind, Skeleton};
use crate::graph::stored::{ensure, from_bytes, to_bytes};
use crate::graph::{EdgeId, MotionGraph};
use crate::maps::entries::{Stance, TargetStances};
use crate::maps::grid::GridCells;
use crate::maps::regions::{BodyRows, Evasion, EvasionTracks, RegionMaps};
use crate::math::Rigid2;
use crate::math::parallel::both;

impl BakedGraph {
    pub(crate) const SECTIONS: usize = 4;

    /// Serializes the parts of the graph: clips, the rest of the motion graph, paths, and everything else.
    pub(crate) fn to_sections(&self) -> Result<[Vec<u8>; Self::SECTIONS], postcard::Error> {
        let [clips, graph] = self.graph.to_sections()?;
        let (evasions, attack_moves, atlas) = (&self.evasions, &self.attack_moves, &self.atlas);
        let rest = (
            &self.body,
            &self.retimable,
            evasions,
            attack_moves,
            atlas,
            &self.entries,
            &self.cylinders,
            self.grid_cell,
            self.push_limit,
        );
        Ok([clips, graph, to_bytes(&self.paths)?, to_bytes(&rest)?])
    }

    /// Reads the parts of a graph. [`BakedGraph::restored`] checks them.
    pub(crate) fn from_sections(
        [clips, graph, paths, rest]: [&[u8]; Self::SECTIONS],
    ) -> Result<Self, String> {
        // On some machines these are more threads than cores; the first to finish frees a core for the others.
        let (graph, (paths, rest)) = both(
            || MotionGraph::from_sections([clips, graph]),
            || both(|| from_bytes(paths), || from_bytes(rest)),
        );
        let (
            body,
            retimable,
            evasions,
            attack_moves,
            atlas,
            entries,
            cylinders,
            grid_cell,
            push_limit,
        ) = rest?;
        Ok(Self {
            graph: graph?,
            body,
            atlas,
            retimable,
            evasions,
            attack_moves,
            entries,
            paths: paths?,
            grid_cell,
            push_limit,
            cylinders,
            derived: Derived::default(),
        })
    }

    /// Checks all data and indices that were read from a file, and computes the tables that files
    /// do not store.
    ///
    /// # Errors
    /// A description of the first invalid item.
    pub fn restored(self) -> Result<Self, String> {
        self.restored_within(u64::MAX)
    }

    /// Like [`BakedGraph::restored`], but refuses graphs whose computed tables would need more than
    /// `bytes` of memory.
    ///
    /// # Errors
    /// A description of the first invalid item.
    pub fn restored_within(mut self, bytes: u64) -> Result<Self, String> {
        let _span = tracing::trace_span!("load: check and restore").entered();
        self.graph.validate()?;
        let is_whole = self.retimable.len() == self.graph.edges().len();
        ensure(is_whole, "the table of rates is not one entry an edge")?;
        let (evasions, attacks) = (&self.evasions, &self.attack_moves);
        let evasions_fit = evasions.is_sorted_by(|a, b| a.edge < b.edge)
            && evasions.iter().all(|evasion| self.evasion_fits(evasion));
        let what = "an evasion names an edge that is none, or maps that are not there";
        ensure(evasions_fit, what)?;
        let attacks_fit = attacks.is_sorted_by(|a, b| a.edge < b.edge)
            && self.atlas.attacks().len() == attacks.len()
            && attacks
                .iter()
                .all(|attack| self.event_fits(attack.edge, EventKind::Attack, attack.placement));
        let what = "an attack names an edge that is none, or has no maps";
        ensure(attacks_fit, what)?;
        let what = "the largest acceleration of the body is not above 0";
        ensure(self.push_limit > 0.0, what)?;
        let body_fits = self.body.is_sound(self.graph.skeleton());
        ensure(body_fits, "a body sphere is not sound")?;
        self.atlas.check()?;
        self.entries.check(&self.graph, evasions)?;
        let are_few = evasions.len() <= GridCells::MOST_EVASIONS;
        ensure(are_few, "it has too many evasions")?;
        let needed = self.derived_bytes();
        let what = "it would need more memory than a file of its size may take";
        ensure(needed <= bytes, what)?;
        self.derived.reach = self.body.reach(self.graph.skeleton(), self.graph.clips());
        let cylinders_fit = self.cylinders.fits(self.graph.clips(), self.derived.reach);
        let what = "the bounding cylinders are not those of the clips' frames";
        ensure(cylinders_fit, what)?;
        self.derived.placements = self.graph.placements();
        let paths = std::mem::take(&mut self.paths);
        let (paths, tables) = {
            let _span = tracing::trace_span!("load: restore paths").entered();
            let start = |evasion: &Evasion| self.graph.edge(evasion.edge).from;
            let starts: Vec<_> = self.evasions.iter().map(start).collect();
            let placements = &self.derived.placements;
            both(
                || paths.restored(&self.graph, &self.retimable, placements, &starts),
                || self.tables(),
            )
        };
        self.paths = paths?;
        Ok(self.with_tables(tables))
    }

    fn evasion_fits(&self, evasion: &Evasion) -> bool {
        self.event_fits(evasion.edge, EventKind::Evasion, evasion.placement)
            && evasion.region.index() < self.atlas.regions().len()
    }

    fn event_fits(&self, edge: EdgeId, kind: EventKind, placement: Rigid2) -> bool {
        let event = self
            .graph
            .edges()
            .get(edge.index())
            .and_then(|edge| edge.event);
        event.is_some_and(|event| self.graph.event(event).kind == kind)
            && placement.is_sound(4.0 * Skeleton::FURTHEST)
    }

    /// Estimated memory of the tables that files do not store, in bytes. It is computed from
    /// untrusted data before any allocation.
    pub(super) fn derived_bytes(&self) -> u64 {
        let of = |count: usize, bytes: usize| count as u64 * bytes as u64;
        let tracks = self.evasions.iter().enumerate().map(|(index, evasion)| {
            let frames = self.lead_in(index).map_or(0, |(_, _, frames)| frames);
            let lead_in = (f64::from(frames) / self.graph.frame_rate()) as f32;
            EvasionTracks::bytes(&self.graph, &self.body, evasion, lead_in)
        });
        let slices = self.atlas.regions().len() * self.atlas.grid().slices as usize;
        let spheres = self.body.spheres.len() + self.body.props.len();
        let stances = self.entries.targets.len() + self.entries.exit_targets.len();
        tracks.sum::<u64>()
            + of(stances, size_of::<Stance>())
            + of(
                slices + self.graph.nodes().len() + self.graph.edges().len(),
                64,
            )
            + of(spheres, 128)
    }

    /// First frame of an evasion's clip at which it can be entered: the edge that plays the frame, its frame on the edge, and the number of
    /// frames until the evasion starts; `None` if it cannot be entered.
    fn lead_in(&self, evasion: usize) -> Option<(EdgeId, u32, u32)> {
        let target = self.entries.first_target(evasion)?;
        let start = self.graph.edge(self.evasions[evasion].edge).from;
        let frames = self.graph.node(start).frame.saturating_sub(target.frame);
        Some((target.edge, target.edge_frame, frames))
    }

    /// Computes the tables that do not depend on the paths.
    pub(super) fn tables(&self) -> (BodyRows, GridCells, TargetStances) {
        let _span = tracing::trace_span!("bake: derive tables").entered();
        // Computed here, so that the first query need not compute them.
        let _ = self.atlas.coarse();
        let (evasions, reach) = (self.evasions.len(), self.derived.reach);
        (
            BodyRows::new(&self.body).with_legs(
                &self.body,
                self.graph.skeleton(),
                self.graph.feet().legs(),
            ),
            GridCells::new(self.grid_cell, reach, evasions),
            TargetStances::new(&self.graph, &self.entries),
        )
    }

    /// Sets the tables, and allocates the slots of data that is computed on first use.
    pub(super) fn with_tables(mut self, tables: (BodyRows, GridCells, TargetStances)) -> Self {
        let derived = &mut self.derived;
        (derived.body_rows, derived.grid, derived.stances) = tables;
        self.derived.tracks =
            EvasionTracks::new(&self.graph, &self.evasions, |evasion| self.lead_in(evasion));
        self.derive_from_maps();
        if self.evasions.len() <= Self::PREPARED_EVASIONS {
            self.prepare();
        }
        self
    }

    /// Maximum number of evasions whose tables are computed when a graph is baked or loaded.
    const PREPARED_EVASIONS: usize = 32;

    /// Computes the tables that depend on the maps.
    pub(super) fn derive_from_maps(&mut self) {
        let _ = self.atlas.coarse();
        let texels =
            |maps: &RegionMaps| maps.slabs.iter().map(|maps| maps.evasion.count()).collect();
        self.derived.evasion_texels = self.atlas.regions().iter().map(texels).collect();
    }
}
