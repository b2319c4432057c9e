//! The minima of a band, without the distances that a lower bound shows to be above the threshold.
//!
//! A minimum lies below the threshold, and its neighbours above the threshold are no lower. A distance that is known to be above
//! it is therefore as good as an infinite one, and the minima are bit-identical to those of the whole map. Source of the
//! bounds: [`projection`](crate::graph::search::projection).

use crate::graph::error::GraphError;
use crate::graph::search::bands::{MapBand, Minimum, SearchSettings};
use crate::graph::search::diagonal::Diagonals;
use crate::graph::search::features::{Features, NODE, NearSearch, WindowCell};
use crate::graph::search::minima::CloseMinima;
use crate::graph::search::projection::Projection;
use crate::graph::search::windows::Windows;
use crate::graph::watch::{BakeStage, BakeWatch};
use crate::math::{Isa, in_parallel, thread_count};
use std::ops::Range;

/// Number of rows that are searched together, at most.
const STRIP: usize = 64;

/// Number of window pairs that are searched together, at most, if a strip of [`NODE`] rows has no more. In still motion all of them
/// are near.
const MOST_PAIRS: usize = 1 << 22;

/// Number of windows of a block. Their projections fit the second cache.
const BLOCK: usize = 2048;

/// Number of window pairs that one thread searches at a time, at most, if they are of several bands.
const MOST_PAIRS_OF_RUN: u64 = 1 << 24;

/// Windows of clips, prepared for a search that computes few distances.
#[derive(Debug)]
pub struct PrunedSearch<'a> {
    settings: SearchSettings,
    isa: Isa,
    windows: Vec<&'a Windows>,
    features: Vec<Features>,
    /// Number of the block of each clip: neighbouring clips with about [`BLOCK`] windows in all.
    blocks: Vec<usize>,
}

/// Minima of a band, and the work of their search.
#[derive(Clone, Debug, Default)]
pub struct BandMinima {
    /// Minima, row by row.
    pub minima: Vec<Minimum>,
    /// Number of window pairs whose distance was computed. It may depend on the clips that are searched together.
    pub computed: u64,
}

/// Memory of a search, reused from band to band.
#[derive(Debug, Default)]
pub struct SearchScratch {
    diagonals: Diagonals,
    /// Pairs of the strip that may be near, in the order in which they are found.
    near: Vec<WindowCell>,
    /// Computed pairs of the last two rows and of the strip.
    cells: Vec<WindowCell>,
    /// Squared distances of two rows, of the strip's rows and of one more; infinite where they were not computed.
    squared: Vec<f32>,
    /// Distances of the rows that are carried to the next strip.
    carried: Vec<f32>,
    found: Vec<Minimum>,
}

impl<'a> PrunedSearch<'a> {
    /// Prepares the windows of clips for a search with `isa`. A [`MapBand`] names clips by their index in `windows`. The
    /// minima do not depend on which clips are searched together.
    ///
    /// # Panics
    /// Panics if the clips have different numbers of points or windows of different lengths.
    #[must_use]
    pub fn new(settings: SearchSettings, windows: Vec<&'a Windows>, threads: usize) -> Self {
        let same = |pair: &[&Windows]| pair[0].weights == pair[1].weights;
        assert!(windows.windows(2).all(same), "clouds of one skeleton");
        let projection = Projection::new(&windows);
        let features = in_parallel(threads, windows.len(), |clip| {
            Features::new(&projection, windows[clip], settings.threshold)
        });
        let mut before = 0;
        let block_of = |windows: &&Windows| {
            before += windows.count();
            before / BLOCK
        };
        Self {
            settings,
            isa: Isa::best(),
            blocks: windows.iter().map(block_of).collect(),
            windows,
            features,
        }
    }

    /// Selects an instruction set instead of the best one of the machine. The minima do not depend on it.
    #[must_use]
    pub fn with_isa(self, isa: Isa) -> Self {
        Self { isa, ..self }
    }

    /// Searches bands, part by part, and gives the minima of each to `take`, in the order of the bands. The result does not depend on the number
    /// of threads.
    ///
    /// # Errors
    /// The errors of [`PrunedSearch::minima`] and of `take`, or the watch stopped the search.
    pub fn search(
        &self,
        bands: impl Iterator<Item = MapBand> + Clone,
        threads: usize,
        watch: &dyn BakeWatch,
        mut take: impl FnMut(MapBand, BandMinima) -> Result<(), GraphError>,
    ) -> Result<(), GraphError> {
        /// Maximum number of bands of a part, and of its window pairs for each thread, if it has several bands. Parts are long enough that
        /// several clips are compared with the same windows while those are in the cache, and short enough that a search can be stopped.
        const PART: (usize, u64) = (1 << 17, 1 << 28);
        let stage = watch.stage(BakeStage::Transitions, threads);
        let (mut done, all) = (0, bands.clone().map(|band| band.pairs()).sum());
        let most = PART.1 * thread_count(threads) as u64;
        let mut bands = bands.peekable();
        while bands.peek().is_some() {
            watch.check()?;
            let mut pairs = 0;
            let next = || {
                let band = bands.next_if(|band| pairs == 0 || pairs + band.pairs() <= most)?;
                pairs += band.pairs();
                Some(band)
            };
            let part: Vec<MapBand> = std::iter::from_fn(next).take(PART.0).collect();
            let found = self.minima_of(&part, threads)?;
            for (band, found) in part.into_iter().zip(found) {
                done += band.pairs();
                take(band, found)?;
            }
            stage.progress(done, all);
        }
        Ok(())
    }

    /// Finds the minima of bands, in their order. The result does not depend on the number of threads.
    fn minima_of(&self, bands: &[MapBand], threads: usize) -> Result<Vec<BandMinima>, GraphError> {
        // Bands with columns in the same block follow each other, so that its windows stay in the cache.
        let mut order: Vec<usize> = (0..bands.len()).collect();
        order.sort_unstable_by_key(|&index| (self.blocks[bands[index].b], index));
        let mut pairs = 0;
        let runs: Vec<&[usize]> = order
            .chunk_by(|&before, &after| {
                let [before, after] = [before, after].map(|index| &bands[index]);
                pairs += before.pairs();
                let is_same = self.blocks[before.b] == self.blocks[after.b];
                let is_together = is_same && pairs + after.pairs() <= MOST_PAIRS_OF_RUN;
                if !is_together {
                    pairs = 0;
                }
                is_together
            })
            .collect();
        let found = in_parallel(threads, runs.len(), |run| {
            let mut scratch = SearchScratch::default();
            let own = runs[run].iter();
            own.map(|&index| self.minima(bands[index], &mut scratch))
                .collect::<Result<Vec<_>, _>>()
        });
        let mut all = vec![BandMinima::default(); bands.len()];
        for (run, found) in runs.iter().zip(found) {
            for (&index, found) in run.iter().zip(found?) {
                all[index] = found;
            }
        }
        Ok(all)
    }

    /// Finds the minima of a band, row by row: distances below the threshold that none of the eight around them is below.
    ///
    /// # Errors
    /// The band has more minima than a graph may have transitions.
    pub fn minima(
        &self,
        band: MapBand,
        scratch: &mut SearchScratch,
    ) -> Result<BandMinima, GraphError> {
        let (a, b) = (self.windows[band.a], self.windows[band.b]);
        let rows = band.rows();
        let beside = rows.start.saturating_sub(1)..(rows.end + 1).min(a.count());
        let search = BandSearch {
            band,
            windows: [a, b],
            isa: self.isa,
            near: NearSearch {
                features: [band.a, band.b].map(|clip| &self.features[clip]),
                limit: self.settings.threshold * self.settings.threshold,
                beyond: 0.0,
                gap: (band.a == band.b).then_some(self.settings.separation),
                columns: band.columns,
            },
        };
        let mut close = CloseMinima::new(self.settings.separation);
        let mut computed = 0;
        scratch.cells.clear();
        let strip = (MOST_PAIRS / band.columns.max(1) / NODE * NODE).clamp(NODE, STRIP);
        let mut first = beside.start;
        while first < beside.end {
            // Strips end where balls do.
            let end = ((first / strip + 1) * strip).min(beside.end);
            scratch.find_near(first..end, &search);
            computed += scratch.compute(first..end, &search);
            let last = if end == beside.end { end } else { end - 1 };
            scratch.collect(first..last, &search);
            let all = scratch
                .found
                .iter()
                .try_for_each(|&minimum| close.push(minimum));
            if let Err(error) = all {
                *scratch = SearchScratch::default();
                return Err(error);
            }
            scratch.carry(first..end, band.columns);
            first = end;
        }
        // The last rows are carried nowhere: this resets the scratch.
        scratch.carry(first..first + 2, band.columns);
        Ok(BandMinima {
            minima: close.minima,
            computed,
        })
    }
}

struct BandSearch<'a> {
    band: MapBand,
    windows: [&'a Windows; 2],
    isa: Isa,
    near: NearSearch<'a>,
}

impl SearchScratch {
    /// Finds the pairs of a strip that may be near.
    fn find_near(&mut self, rows: Range<usize>, search: &BandSearch<'_>) {
        self.near.clear();
        search.isa.run(
            #[inline(always)]
            || search.near.find(rows, &mut self.near),
        );
    }

    /// Computes the distances of the pairs that may be near, diagonal by diagonal, and returns their number.
    fn compute(&mut self, rows: Range<usize>, search: &BandSearch<'_>) -> u64 {
        let (columns, near) = (search.band.columns, &mut self.near);
        // Between searches of bands all values are infinite.
        let size = (rows.len() + 3) * columns;
        if self.squared.len() < size {
            self.squared.resize(size, f32::INFINITY);
        }
        if near.is_empty() {
            return 0;
        }
        let found = |(cell, square): (WindowCell, f32)| {
            let row = cell.row as usize - rows.start + 2;
            self.squared[row * columns + cell.column as usize] = square;
        };
        let (windows, isa) = (search.windows, search.isa);
        self.diagonals
            .for_each(windows, isa, rows.clone(), near, found);
        self.cells.extend_from_slice(near);
        near.len() as u64
    }

    /// Collects the minima of the rows before `rows.end` that were not complete before, row by row. `rows.start` is the first
    /// row of the strip.
    fn collect(&mut self, rows: Range<usize>, search: &BandSearch<'_>) {
        self.found.clear();
        let (band, columns) = (search.band.rows(), search.band.columns);
        let place = |row: usize, column: usize| (row + 2 - rows.start) * columns + column;
        let value = |row: usize, column: usize| self.squared[place(row, column)];
        for cell in &self.cells {
            let (row, column) = (cell.row as usize, cell.column as usize);
            let own = value(row, column);
            let wanted = band.contains(&row)
                && (rows.start.saturating_sub(1)..rows.end).contains(&row)
                && search.near.gap.is_none_or(|gap| column >= row + gap);
            if !wanted || own >= search.near.limit {
                continue;
            }
            let above = row.saturating_sub(1);
            let beside = column.saturating_sub(1)..(column + 2).min(columns);
            let lower = (above..row + 2).any(|row| beside.clone().any(|c| value(row, c) < own));
            if !lower {
                self.found.push(Minimum {
                    a: row as u32,
                    b: column as u32,
                    distance: own.sqrt(),
                });
            }
        }
        let place = |minimum: &Minimum| (minimum.a, minimum.b);
        self.found.sort_unstable_by_key(place);
    }

    /// Removes a strip's distances, except for those of its last two rows, which are carried to the next strip.
    fn carry(&mut self, rows: Range<usize>, columns: usize) {
        let place = |cell: &WindowCell, first: usize| {
            (cell.row as usize + 2 - first) * columns + cell.column as usize
        };
        self.carried.clear();
        self.cells.retain(|cell| {
            let here = &mut self.squared[place(cell, rows.start)];
            let value = std::mem::replace(here, f32::INFINITY);
            let kept = cell.row as usize + 2 >= rows.end;
            if kept {
                self.carried.push(value);
            }
            kept
        });
        for (cell, &value) in self.cells.iter().zip(&self.carried) {
            self.squared[place(cell, rows.end)] = value;
        }
    }
}
