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
    /// Squared distances of the strip's rows and of those beside it; infinite where they were not computed.
    squared: Vec<f32>,
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
        let search = BandSearch {
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
        let strip = (MOST_PAIRS / band.columns.max(1) / NODE * NODE).clamp(NODE, STRIP);
        let mut first = rows.start;
        while first < rows.end {
            // Strips end where balls do.
            let own = first..((first / strip + 1) * strip).min(rows.end);
            first = own.end;
            let beside = own.start.saturating_sub(1)..(own.end + 1).min(a.count());
            scratch.find_near(beside.clone(), &search);
            computed += scratch.compute(beside.clone(), &search);
            scratch.collect(own, beside, &search);
            for &minimum in &scratch.found {
                close.push(minimum)?;
            }
        }
        Ok(BandMinima {
            minima: close.minima,
            computed,
        })
    }
}

struct BandSearch<'a> {
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
        let (columns, near) = (search.near.columns, &mut self.near);
        // Between strips all values are infinite.
        let size = rows.len() * columns;
        if self.squared.len() < size {
            self.squared.resize(size, f32::INFINITY);
        }
        if near.is_empty() {
            return 0;
        }
        let found = |(cell, square): (WindowCell, f32)| {
            self.squared[place(cell, rows.start, columns)] = square;
        };
        let (windows, isa) = (search.windows, search.isa);
        self.diagonals
            .for_each(windows, isa, rows.clone(), near, found);
        near.len() as u64
    }

    /// Collects the minima of a strip, row by row, and removes its distances. `beside` has the rows of the distances.
    fn collect(&mut self, own: Range<usize>, beside: Range<usize>, search: &BandSearch<'_>) {
        self.found.clear();
        let NearSearch { columns, gap, .. } = search.near;
        let first = beside.start;
        for &cell in &self.near {
            let (row, column) = (cell.row as usize, cell.column as usize);
            let value = self.squared[place(cell, first, columns)];
            let is_wanted = own.contains(&row) && gap.is_none_or(|gap| column >= row + gap);
            if !is_wanted || value >= search.near.limit {
                continue;
            }
            let around = column.saturating_sub(1)..(column + 2).min(columns);
            let mut rows = row.saturating_sub(1).max(first)..(row + 2).min(beside.end);
            let is_lower = rows.any(|row| {
                let row = &self.squared[(row - first) * columns..];
                row[around.clone()].iter().any(|&other| other < value)
            });
            if !is_lower {
                self.found.push(Minimum {
                    a: cell.row,
                    b: cell.column,
                    distance: value.sqrt(),
                });
            }
        }
        for &cell in &self.near {
            self.squared[place(cell, first, columns)] = f32::INFINITY;
        }
        self.found
            .sort_unstable_by_key(|minimum| (minimum.a, minimum.b));
    }
}

/// Index of a cell's distance among those of rows from `first` on.
fn place(cell: WindowCell, first: usize, columns: usize) -> usize {
    (cell.row as usize - first) * columns + cell.column as usize
}
