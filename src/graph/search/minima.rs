//! Local minima of distance maps, without those that are close to a better one.

use crate::graph::error::GraphError;
use crate::graph::search::bands::{MapBand, Minimum, SearchSettings};
use crate::graph::search::transition::Transition;
use crate::graph::settings::GraphSettings;
use std::collections::HashMap;

/// Minima of a map. If there are very many, those close to a better one are removed early: in nearly still motion, every window is a
/// minimum.
#[derive(Debug)]
pub(crate) struct CloseMinima {
    pub(crate) minima: Vec<Minimum>,
    separation: usize,
    /// Number of minima above which close ones are removed.
    limit: usize,
}

impl CloseMinima {
    /// Number of minima that triggers the first removal of close ones. Captured motion has a few
    /// thousand in a map.
    const MOST: usize = 1 << 20;

    pub(crate) fn new(separation: usize) -> Self {
        Self {
            minima: Vec::new(),
            separation,
            limit: Self::MOST,
        }
    }

    /// Adds a minimum, unless there are more than a graph may have transitions.
    pub(crate) fn push(&mut self, minimum: Minimum) -> Result<(), GraphError> {
        self.minima.push(minimum);
        if self.minima.len() <= self.limit {
            return Ok(());
        }
        self.minima = thin_out(std::mem::take(&mut self.minima), self.separation);
        self.limit = Self::MOST.max(2 * self.minima.len());
        GraphSettings::check_transitions(self.minima.len(), GraphSettings::MOST_TRANSITIONS)
    }

    /// Takes all minima, best first, without those that are close to a better one.
    pub(crate) fn take(&mut self) -> Vec<Minimum> {
        self.limit = Self::MOST;
        thin_out(std::mem::take(&mut self.minima), self.separation)
    }
}

/// Sorts the minima, best first, and removes those that are close to a better one.
fn thin_out(mut found: Vec<Minimum>, separation: usize) -> Vec<Minimum> {
    found.sort_by(|x, y| {
        x.distance
            .total_cmp(&y.distance)
            .then((x.a, x.b).cmp(&(y.a, y.b)))
    });
    let side = separation.max(1);
    let mut cells: HashMap<(usize, usize), Vec<Minimum>> = HashMap::new();
    let mut kept = Vec::new();
    for minimum in found {
        let (row, column) = (minimum.a as usize / side, minimum.b as usize / side);
        let near = |other: &Minimum| {
            (minimum.a.abs_diff(other.a) as usize) < separation
                && (minimum.b.abs_diff(other.b) as usize) < separation
        };
        let neighbours = (row.saturating_sub(1)..=row + 1)
            .flat_map(|r| (column.saturating_sub(1)..=column + 1).map(move |c| (r, c)));
        let crowded = neighbours
            .filter_map(|cell| cells.get(&cell))
            .flatten()
            .any(near);
        if !crowded {
            cells.entry((row, column)).or_default().push(minimum);
            kept.push(minimum);
        }
    }
    kept
}

// Turns the minima of all bands into transitions.

/// Collects the minima of all bands and turns them into transitions, map by map.
#[derive(Debug)]
pub struct TransitionList {
    settings: SearchSettings,
    map: (usize, usize),
    /// Minima of the current map so far.
    minima: CloseMinima,
    transitions: Vec<Transition>,
    /// Number of distances that were computed for the minima.
    pub(crate) distances: u64,
}

impl TransitionList {
    pub(crate) fn new(settings: SearchSettings) -> Self {
        Self {
            settings,
            map: (0, 0),
            minima: CloseMinima::new(settings.separation),
            transitions: Vec::new(),
            distances: 0,
        }
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

    pub(crate) fn finish(mut self) -> Result<Vec<Transition>, GraphError> {
        self.close_map()?;
        let most = GraphSettings::MOST_TRANSITIONS;
        keep_closest(&mut self.transitions, self.settings.window, most);
        GraphSettings::check_transitions(self.transitions.len(), most)?;
        Ok(self.transitions)
    }

    fn close_map(&mut self) -> Result<(), GraphError> {
        let (a, b) = self.map;
        for minimum in self.minima.take() {
            let both = minimum.transitions(a, b, self.settings.window);
            self.transitions.extend(both);
        }
        GraphSettings::check_transitions(self.transitions.len(), GraphSettings::MOST_FOUND)
    }
}

/// If there are more than `most` transitions, keeps the closest transitions of each stretch of `length` frames of a source clip, with the same
/// maximum for all stretches. The order does not change.
fn keep_closest(transitions: &mut Vec<Transition>, length: usize, most: usize) {
    if transitions.len() <= most {
        return;
    }
    let stretch = |t: &Transition| (t.source_clip, t.source_frame / length);
    let mut order: Vec<usize> = (0..transitions.len()).collect();
    order.sort_by(|&a, &b| {
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
