//! The clips that two bakes have in common.

use rustc_hash::FxHashMap;

use super::ClipKey;

/// Clips that a bake has in common with an earlier bake, in the same order.
#[derive(Clone, Debug, Default)]
pub struct ClipMatch {
    /// For each clip of this bake, its index in the earlier bake.
    earlier: Vec<Option<u32>>,
    /// For each clip of the earlier bake, its index in this bake.
    now: Vec<Option<u32>>,
}

impl ClipMatch {
    /// Finds as many common clips as possible: the longest list of them that has the same order in both bakes.
    pub(super) fn new(now: &[ClipKey], earlier: &[ClipKey]) -> Self {
        let places: FxHashMap<ClipKey, usize> = earlier
            .iter()
            .enumerate()
            .map(|(at, &key)| (key, at))
            .collect();
        let pairs: Vec<(usize, usize)> = now
            .iter()
            .enumerate()
            .filter_map(|(at, key)| Some((at, *places.get(key)?)))
            .collect();
        let mut found = Self {
            earlier: vec![None; now.len()],
            now: vec![None; earlier.len()],
        };
        for (now, earlier) in longest_ascending(&pairs) {
            found.earlier[now] = Some(earlier as u32);
            found.now[earlier] = Some(now as u32);
        }
        found
    }

    /// The match of two bakes with the same `clips` clips.
    #[must_use]
    pub fn same(clips: usize) -> Self {
        let all: Vec<Option<u32>> = (0..clips as u32).map(Some).collect();
        Self {
            earlier: all.clone(),
            now: all,
        }
    }

    /// Number of clips of this bake.
    pub(crate) fn len(&self) -> usize {
        self.earlier.len()
    }

    /// Number of common clips.
    #[must_use]
    pub fn count(&self) -> usize {
        self.earlier.iter().flatten().count()
    }

    /// Whether both bakes have the same clips.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.earlier.iter().chain(&self.now).all(Option::is_some)
    }

    /// Index of a clip of this bake in the earlier bake, or `None` if the clip is new.
    pub(crate) fn earlier(&self, now: usize) -> Option<u32> {
        self.earlier.get(now).copied().flatten()
    }

    /// Index of a clip of the earlier bake in this bake, or `None` if the clip was removed.
    pub(crate) fn now(&self, earlier: u32) -> Option<u32> {
        self.now.get(earlier as usize).copied().flatten()
    }
}

/// The longest list of pairs whose second numbers ascend, by patience sorting. The first numbers ascend.
fn longest_ascending(pairs: &[(usize, usize)]) -> Vec<(usize, usize)> {
    // `ends`: for each length, the pair that ends a list of this length with the smallest number. `before`: for each pair, the one before it.
    let (mut ends, mut before): (Vec<usize>, Vec<Option<usize>>) = (Vec::new(), Vec::new());
    for (index, &(_, number)) in pairs.iter().enumerate() {
        let length = ends.partition_point(|&end| pairs[end].1 < number);
        before.push(length.checked_sub(1).map(|shorter| ends[shorter]));
        match ends.get_mut(length) {
            Some(end) => *end = index,
            None => ends.push(index),
        }
    }
    let last = ends.last().copied();
    let mut found: Vec<(usize, usize)> = std::iter::successors(last, |&index| before[index])
        .map(|index| pairs[index])
        .collect();
    found.reverse();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matched(now: &[u64], earlier: &[u64]) -> Vec<(usize, u32)> {
        let keys = |numbers: &[u64]| -> Vec<ClipKey> {
            let key = |&hash| ClipKey {
                hash,
                crc32: 0,
                bytes: 0,
            };
            numbers.iter().map(key).collect()
        };
        let found = ClipMatch::new(&keys(now), &keys(earlier));
        let pairs: Vec<(usize, u32)> = (0..now.len())
            .filter_map(|clip| Some((clip, found.earlier(clip)?)))
            .collect();
        assert!(
            pairs
                .iter()
                .all(|&(now, old)| found.now(old) == Some(now as u32))
        );
        assert_eq!(found.count(), pairs.len());
        pairs
    }

    #[test]
    fn common_clips_keep_their_order() {
        assert_eq!(matched(&[1, 2, 3], &[1, 2, 3]), [(0, 0), (1, 1), (2, 2)]);
        assert_eq!(matched(&[1, 9, 3], &[1, 2, 3]), [(0, 0), (2, 2)]);
        assert_eq!(matched(&[2, 3, 1], &[1, 2, 3]), [(0, 1), (1, 2)]);
        assert_eq!(matched(&[9], &[1, 2, 3]), []);
        assert_eq!(matched(&[], &[1]), []);
    }

    #[test]
    fn a_match_is_whole_where_no_bake_has_a_clip_that_the_other_lacks() {
        let key = |hash| ClipKey {
            hash,
            crc32: 0,
            bytes: 0,
        };
        let is_whole = |now: &[u64], earlier: &[u64]| {
            let [now, earlier] = [now, earlier]
                .map(|hashes| hashes.iter().map(|&hash| key(hash)).collect::<Vec<_>>());
            ClipMatch::new(&now, &earlier).is_whole()
        };
        assert!(is_whole(&[1, 2], &[1, 2]));
        assert!(!is_whole(&[1, 2, 3], &[1, 2]) && !is_whole(&[1], &[1, 2]));
        assert!(!is_whole(&[2, 1], &[1, 2]) && !is_whole(&[1, 2], &[]));
    }

    #[test]
    fn a_clip_that_is_there_twice_is_matched_once() {
        assert_eq!(matched(&[5, 5], &[5]).len(), 1);
        assert_eq!(matched(&[5], &[5, 5]).len(), 1);
    }
}
