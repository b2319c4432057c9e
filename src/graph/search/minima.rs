//! Local minima of a distance map.

use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use super::{MapBand, SearchSettings};
use crate::graph::distance::DistanceMap;
use crate::graph::{GraphError, GraphSettings};
use crate::math::sort_rarely;

/// A pair of similar windows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Minimum {
    /// First frame of the first clip's window.
    pub a: u32,
    /// First frame of the second clip's window.
    pub b: u32,
    /// Root of the mean squared point distance, in metres.
    pub distance: f32,
}

/// Local minima of a band below the threshold, row by row. The map is never stored completely.
pub(super) fn find(
    map: DistanceMap<'_>,
    band: MapBand,
    settings: &SearchSettings,
) -> Result<Vec<Minimum>, GraphError> {
    let rows = band.rows();
    // The map of a clip with itself is symmetric and 0 on its diagonal.
    let gap = (band.a == band.b).then_some(settings.separation);
    let limit = settings.threshold * settings.threshold;
    let mut found = CloseMinima::new(settings.separation);
    let mut outcome = Ok(());
    let mut collect = |three: &Rows<'_>| {
        if outcome.is_ok() && rows.contains(&three.index) {
            let first = gap.map_or(0, |gap| three.index + gap);
            outcome = three.collect(first, limit, &mut found);
        }
    };
    // The two rows before the newest one.
    let (mut before, mut middle): (Vec<f32>, Vec<f32>) = (Vec::new(), Vec::new());
    let mut next = 0;
    // A minimum is compared with the rows on both sides of it.
    let beside = rows.start.saturating_sub(1)..rows.end + 1;
    map.for_each_row_of(beside, |row, distances| {
        if !middle.is_empty() {
            collect(&Rows {
                index: row - 1,
                above: &before,
                here: &middle,
                below: distances,
            });
        }
        std::mem::swap(&mut before, &mut middle);
        middle.clear();
        middle.extend_from_slice(distances);
        next = row + 1;
    });
    if next > 0 {
        collect(&Rows {
            index: next - 1,
            above: &before,
            here: &middle,
            below: &[],
        });
    }
    outcome.map(|()| found.minima)
}

/// Minima of a map. If there are very many, those close to a better one are removed early: in nearly still motion, every window is a
/// minimum.
#[derive(Debug)]
pub(super) struct CloseMinima {
    pub(super) minima: Vec<Minimum>,
    separation: usize,
    /// Number of minima above which close ones are removed.
    limit: usize,
}

impl CloseMinima {
    /// Number of minima that triggers the first removal of close ones. Captured motion has a few
    /// thousand in a map.
    const MOST: usize = 1 << 20;

    pub(super) fn new(separation: usize) -> Self {
        Self {
            minima: Vec::new(),
            separation,
            limit: Self::MOST,
        }
    }

    /// Adds a minimum.
    ///
    /// # Errors
    /// There are more minima than a graph may have transitions.
    pub(super) fn push(&mut self, minimum: Minimum) -> Result<(), GraphError> {
        self.minima.push(minimum);
        if self.minima.len() <= self.limit {
            return Ok(());
        }
        self.minima = thin_out(std::mem::take(&mut self.minima), self.separation);
        self.limit = Self::MOST.max(2 * self.minima.len());
        GraphSettings::check_transitions(self.minima.len())
    }

    /// Takes all minima, best first, without those that are close to a better one.
    pub(super) fn take(&mut self) -> Vec<Minimum> {
        self.limit = Self::MOST;
        thin_out(std::mem::take(&mut self.minima), self.separation)
    }
}

/// Number of columns that are tested together.
const PART: usize = 16;

/// A row of the map, with the rows above and below it. Rows beyond the map are empty.
struct Rows<'a> {
    index: usize,
    above: &'a [f32],
    here: &'a [f32],
    below: &'a [f32],
}

impl Rows<'_> {
    /// Adds the minima of the middle row from the column `first` on whose squared distance is below `limit`.
    fn collect(&self, first: usize, limit: f32, found: &mut CloseMinima) -> Result<(), GraphError> {
        // Most parts of a row have no value below the limit, so 16 values are tested together.
        for (part, values) in self.here.chunks(PART).enumerate() {
            if values.iter().fold(f32::INFINITY, |a, &b| a.min(b)) < limit {
                let columns = part * PART..part * PART + values.len();
                for column in columns.skip_while(|&column| column < first) {
                    if self.is_minimum(column, limit) {
                        found.push(Minimum {
                            a: self.index as u32,
                            b: column as u32,
                            distance: self.here[column].sqrt(),
                        })?;
                    }
                }
            }
        }
        Ok(())
    }

    fn is_minimum(&self, column: usize, limit: f32) -> bool {
        let value = self.here[column];
        let around = column.saturating_sub(1)..(column + 2).min(self.here.len());
        let lower = |row: &[f32]| {
            row.get(around.clone())
                .is_some_and(|values| values.iter().any(|&other| other < value))
        };
        value < limit && !lower(self.above) && !lower(self.here) && !lower(self.below)
    }
}

/// Sorts the minima, best first, and removes those that are close to a better one.
fn thin_out(mut found: Vec<Minimum>, separation: usize) -> Vec<Minimum> {
    sort_rarely(&mut found, |x, y| {
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
