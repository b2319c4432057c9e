use super::GraphSettings;
use super::distance::{DistanceMap, Windows};

/// A pair of similar windows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Minimum {
    /// First frame of the first clip's window.
    pub a: usize,
    /// First frame of the second clip's window.
    pub b: usize,
    /// Root of the mean squared point distance, in metres.
    pub distance: f32,
}

/// Settings of the search for minima.
#[derive(Clone, Copy, Debug)]
pub(super) struct MinimaSettings {
    /// Maximum distance, in metres.
    pub threshold: f32,
    /// Minimum separation of two minima along either clip, in frames. Of closer minima the smaller
    /// one is kept.
    pub separation: usize,
    /// Minimum number of frames by which the second clip's window starts after the first clip's. It
    /// is used for a clip against itself, where the map is symmetric and 0 on its diagonal.
    pub only_after: Option<usize>,
}

/// Local minima of the distance map below the threshold, best first. The map is read row by row and
/// never stored completely.
pub(super) fn find(a: &Windows, b: &Windows, settings: &MinimaSettings) -> Vec<Minimum> {
    let mut found = Vec::new();
    // The two rows before the newest one.
    let (mut before, mut middle): (Vec<f32>, Vec<f32>) = (Vec::new(), Vec::new());
    let (mut rows, mut room) = (0, MOST);
    // Set once there are more minima than a graph may have, which is an error.
    let mut is_full = false;
    DistanceMap::new(a, b).for_each_row(|row, distances| {
        if let (Some(index), false) = (row.checked_sub(1), is_full) {
            let three = Rows {
                index,
                above: &before,
                here: &middle,
                below: distances,
            };
            three.collect(settings, &mut found);
            if found.len() > room {
                // For nearly still motion, every window is a minimum.
                found = thin_out(std::mem::take(&mut found), settings.separation);
                room = MOST.max(2 * found.len());
                is_full = found.len() > GraphSettings::MOST_TRANSITIONS;
            }
        }
        std::mem::swap(&mut before, &mut middle);
        middle.clear();
        middle.extend_from_slice(distances);
        rows = row + 1;
    });
    if rows > 0 {
        let last = Rows {
            index: rows - 1,
            above: &before,
            here: &middle,
            below: &[],
        };
        last.collect(settings, &mut found);
    }
    thin_out(found, settings.separation)
}

/// Number of minima that triggers the first removal of close ones. Captured motion has a few
/// thousand in a map.
const MOST: usize = 1 << 20;

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
    /// Adds the minima of the middle row.
    fn collect(&self, settings: &MinimaSettings, found: &mut Vec<Minimum>) {
        let limit = settings.threshold * settings.threshold;
        let first = settings.only_after.map_or(0, |gap| self.index + gap);
        // Most parts of a row have no value below the limit, so 16 values are tested together.
        for (part, values) in self.here.chunks(PART).enumerate() {
            if values.iter().fold(f32::INFINITY, |a, &b| a.min(b)) < limit {
                let columns = part * PART..part * PART + values.len();
                for column in columns.skip_while(|&column| column < first) {
                    self.collect_at(column, limit, found);
                }
            }
        }
    }

    /// Adds the minimum in one column, if there is one.
    fn collect_at(&self, column: usize, limit: f32, found: &mut Vec<Minimum>) {
        let value = self.here[column];
        let around = column.saturating_sub(1)..(column + 2).min(self.here.len());
        let lower = |row: &[f32]| {
            row.get(around.clone())
                .is_some_and(|values| values.iter().any(|&other| other < value))
        };
        if value < limit && !lower(self.above) && !lower(self.here) && !lower(self.below) {
            found.push(Minimum {
                a: self.index,
                b: column,
                distance: value.sqrt(),
            });
        }
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
    let mut cells: std::collections::HashMap<(usize, usize), Vec<Minimum>> =
        std::collections::HashMap::new();
    let mut kept = Vec::new();
    for minimum in found {
        let (row, column) = (minimum.a / side, minimum.b / side);
        let near = |other: &Minimum| {
            minimum.a.abs_diff(other.a) < separation && minimum.b.abs_diff(other.b) < separation
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
