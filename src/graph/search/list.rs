//! Transitions from the minima of all bands.

use super::minima::{CloseMinima, Minimum};
use super::{MapBand, SearchSettings};
use crate::graph::{GraphError, GraphSettings, Transition};

/// Collects the minima of all bands and turns them into transitions, map by map.
#[derive(Debug)]
pub struct TransitionList {
    settings: SearchSettings,
    /// Clips of the current map.
    map: (usize, usize),
    /// Minima of the current map so far.
    minima: CloseMinima,
    transitions: Vec<Transition>,
    /// Number of distances that were computed for the minima.
    distances: u64,
}

impl TransitionList {
    pub(in crate::graph) fn new(settings: SearchSettings) -> Self {
        Self {
            settings,
            map: (0, 0),
            minima: CloseMinima::new(settings.separation),
            transitions: Vec::new(),
            distances: 0,
        }
    }

    /// Counts distances that were computed for the minima.
    pub(in crate::graph) fn count(&mut self, distances: u64) {
        self.distances += distances;
    }

    /// Number of distances that were counted.
    pub(in crate::graph) fn distances(&self) -> u64 {
        self.distances
    }

    /// Adds the minima of a band. Bands are added in the order of [`SearchSettings::bands`].
    ///
    /// # Errors
    /// The graph would have too many transitions.
    pub fn add(&mut self, band: MapBand, minima: &[Minimum]) -> Result<(), GraphError> {
        if self.map != (band.a, band.b) {
            self.close_map()?;
            self.map = (band.a, band.b);
        }
        minima
            .iter()
            .try_for_each(|&minimum| self.minima.push(minimum))
    }

    /// All transitions.
    ///
    /// # Errors
    /// The graph would have too many transitions.
    pub(in crate::graph) fn finish(mut self) -> Result<Vec<Transition>, GraphError> {
        self.close_map()?;
        Ok(self.transitions)
    }

    fn close_map(&mut self) -> Result<(), GraphError> {
        let (a, b) = self.map;
        for minimum in self.minima.take() {
            let both = Transition::both_ways(a, b, &minimum, self.settings.window);
            self.transitions.extend(both);
        }
        GraphSettings::check_transitions(self.transitions.len())
    }
}
