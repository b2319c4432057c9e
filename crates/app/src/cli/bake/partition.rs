//! Which bands a shard searches.

use std::ops::Range;

use sabaki::internal::MapBand;

/// Divides the bands among shards of about equal cost that read few clips each.
///
/// Clips are put into groups of about equal length, and bands are ordered by the groups of their two clips. Each shard takes a run
/// of that order. With N shards there are about √(2N) groups, so that a shard reads a few of the groups only.
pub(super) struct Partition {
    bands: Vec<MapBand>,
    /// Indices of all bands, in the order in which the shards take them.
    order: Vec<usize>,
    /// The run of `order` that each shard takes.
    runs: Vec<Range<usize>>,
}

impl Partition {
    pub(super) fn new(bands: Vec<MapBand>, frames: &[usize], shards: usize) -> Self {
        let groups = (2.0 * shards as f64).sqrt().ceil() as usize;
        let all: usize = frames.iter().sum::<usize>().max(1);
        let mut before = 0;
        let group: Vec<usize> = frames
            .iter()
            .map(|frames| {
                let group = before * groups / all;
                before += frames;
                group
            })
            .collect();
        let mut order: Vec<usize> = (0..bands.len()).collect();
        order.sort_by_key(|&index| (group[bands[index].a], group[bands[index].b], index));
        let total: u64 = bands.iter().map(MapBand::pairs).sum();
        let mut ends = Vec::with_capacity(shards);
        let (mut taken, mut end) = (0, 0);
        for shard in 1..=shards as u64 {
            let share = u128::from(total) * u128::from(shard) / shards as u128;
            while end < order.len() && u128::from(taken) < share {
                taken += bands[order[end]].pairs();
                end += 1;
            }
            ends.push(end);
        }
        let mut first = 0;
        let runs = ends
            .into_iter()
            .map(|end| std::mem::replace(&mut first, end)..end);
        Self {
            runs: runs.collect(),
            bands,
            order,
        }
    }

    /// The bands of a shard.
    pub(super) fn bands(&self, shard: usize) -> impl Iterator<Item = MapBand> {
        self.order[self.runs[shard].clone()]
            .iter()
            .map(|&band| self.bands[band])
    }

    /// Index of each band, shard by shard.
    pub(super) fn order(&self) -> impl Iterator<Item = usize> {
        self.order.iter().copied()
    }
}
