//! Turns the minima of all bands into transitions.

use super::minima::{CloseMinima, Minimum};
use super::{MapBand, SearchSettings};
use crate::graph::{GraphError, GraphSettings, Transition};
use crate::math::sorted_indices;

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
        let most = GraphSettings::MOST_TRANSITIONS;
        keep_closest(&mut self.transitions, self.settings.window, most);
        GraphSettings::check_transitions(self.transitions.len())?;
        Ok(self.transitions)
    }

    fn close_map(&mut self) -> Result<(), GraphError> {
        let (a, b) = self.map;
        for minimum in self.minima.take() {
            let both = minimum.transitions(a, b, self.settings.window);
            self.transitions.extend(both);
        }
        GraphSettings::check_found(self.transitions.len())
    }
}

/// If there are more than `most` transitions, keeps the closest transitions of each stretch of `length` frames of a source clip, with the same
/// maximum for all stretches. The order does not change.
fn keep_closest(transitions: &mut Vec<Transition>, length: usize, most: usize) {
    if transitions.len() <= most {
        return;
    }
    let stretch = |t: &Transition| (t.source_clip, t.source_frame / length);
    let order = sorted_indices(transitions.len(), &|&a, &b| {
        let (a, b) = (&transitions[a], &transitions[b]);
        stretch(a)
            .cmp(&stretch(b))
            .then(a.distance.total_cmp(&b.distance))
    });
    let same = |&a: &usize, &b: &usize| stretch(&transitions[a]) == stretch(&transitions[b]);
    let stretches = order.chunk_by(same).count();
    let each = (most / stretches).max(1);
    let mut kept = vec![false; transitions.len()];
    for own in order.chunk_by(same) {
        for &index in own.iter().take(each) {
            kept[index] = true;
        }
    }
    let mut kept = kept.into_iter();
    transitions.retain(|_| kept.next().unwrap_or(false));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closest_of_each_stretch_are_kept() {
        let transition = |index: usize| Transition {
            source_clip: index % 3,
            source_frame: index * 7 % 40,
            target_clip: 0,
            target_frame: index,
            frames: 10,
            distance: (index * 37 % 101) as f32,
        };
        let all: Vec<Transition> = (0..600).map(transition).collect();
        let mut same = all.clone();
        keep_closest(&mut same, 10, 600);
        assert_eq!(same, all);
        // Twelve stretches keep eight each.
        let mut few = all.clone();
        keep_closest(&mut few, 10, 100);
        let expected = all.iter().filter(|own| {
            let stretch = |t: &Transition| (t.source_clip, t.source_frame / 10);
            let beside = all.iter().filter(|other| stretch(other) == stretch(own));
            let closer = |other: &&Transition| {
                (other.distance, other.target_frame) < (own.distance, own.target_frame)
            };
            beside.filter(closer).count() < 8
        });
        assert_eq!(few, expected.copied().collect::<Vec<_>>());
        assert_eq!(few.len(), 96);
    }
}
