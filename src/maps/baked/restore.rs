//! Checks a graph that was read from a file.

use super::BakedGraph;
use crate::anim::{EventKind, Skeleton};
use crate::graph::EdgeId;
use crate::maps::Evasion;
use crate::maps::grid::GridCells;
use crate::math::Rigid2;
use crate::math::parallel::both;

impl BakedGraph {
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
        let edges = self.graph.edges().len();
        let sorted = self
            .evasions
            .windows(2)
            .all(|pair| pair[0].edge < pair[1].edge)
            && self
                .attack_moves
                .windows(2)
                .all(|pair| pair[0].edge < pair[1].edge);
        let attacks_fit = self
            .attack_moves
            .iter()
            .all(|attack| self.event_fits(attack.edge, EventKind::Attack, attack.placement));
        let checks = [
            (
                self.retimable.len() == edges,
                "the table of rates is not one entry an edge",
            ),
            (
                sorted && self.evasions.iter().all(|e| self.evasion_fits(e)),
                "an evasion names an edge that is none, or maps that are not there",
            ),
            (
                attacks_fit && self.atlas.attacks().len() == self.attack_moves.len(),
                "an attack names an edge that is none, or has no maps",
            ),
            (
                self.body.is_sound(self.graph.skeleton()),
                "a body sphere is not sound",
            ),
        ];
        if let Some((_, what)) = checks.into_iter().find(|(ok, _)| !ok) {
            return Err(what.to_owned());
        }
        self.atlas.check().map_err(str::to_owned)?;
        self.entries.check(&self.graph, &self.evasions)?;
        if self.evasions.len() > GridCells::MOST_EVASIONS {
            return Err("it has too many evasions".to_owned());
        }
        let needed = self.derived_bytes();
        if needed > bytes {
            return Err(format!(
                "it would need {needed} bytes of memory, and {bytes} are the most for its size"
            ));
        }
        self.reach = self.body.reach(self.graph.skeleton(), self.graph.clips());
        if !self.cylinders.fits(self.graph.clips(), self.reach) {
            return Err("the bounding cylinders are not those of the clips' frames".to_owned());
        }
        self.placements = self.graph.placements();
        let paths = std::mem::take(&mut self.paths);
        let (paths, tables) = {
            let _span = tracing::trace_span!("load: restore paths").entered();
            let start = |evasion: &Evasion| self.graph.edge(evasion.edge).from;
            let starts: Vec<_> = self.evasions.iter().map(start).collect();
            let count = paths.count();
            both(
                || paths.restored(&self.graph, &self.retimable, &self.placements, &starts),
                || self.tables(count),
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
}
