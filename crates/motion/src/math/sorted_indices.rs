//! Sorts that are compiled only once.

use std::cmp::Ordering;

/// The indices below `count`, sorted by a comparison; equal ones stay in ascending order. The function is not generic. It is
/// for lists that are not sorted in every frame.
pub fn sorted_indices(count: usize, compare: &dyn Fn(&usize, &usize) -> Ordering) -> Vec<usize> {
    let mut indices: Vec<usize> = (0..count).collect();
    indices.sort_by(compare);
    indices
}

/// Sorts a list; equal values stay in their order. Little of the function is compiled for each type. It is for lists that
/// are not sorted in every frame.
pub fn sort_rarely<T>(list: &mut [T], compare: impl Fn(&T, &T) -> Ordering) {
    let mut order = sorted_indices(list.len(), &|&a, &b| compare(&list[a], &list[b]));
    // Follows each cycle of the permutation.
    for start in 0..order.len() {
        let mut at = start;
        loop {
            let from = std::mem::replace(&mut order[at], at);
            if from == start {
                break;
            }
            list.swap(at, from);
            at = from;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn equal_ones_stay_in_order() {
        let list = [3, 1, 2, 1, 3];
        let order = sorted_indices(list.len(), &|&a, &b| list[a].cmp(&list[b]));
        assert_eq!(order, [1, 3, 2, 0, 4]);
        assert!(sorted_indices(0, &|_, _| Ordering::Equal).is_empty());
    }

    proptest! {
        #[test]
        fn a_list_is_sorted_as_by_the_standard_library(keys in prop::collection::vec(0u8..20, 0..60)) {
            let mut list: Vec<(u8, usize)> = keys.into_iter().zip(0..).collect();
            let mut expected = list.clone();
            expected.sort_by_key(|(key, _)| *key);
            sort_rarely(&mut list, |a, b| a.0.cmp(&b.0));
            prop_assert_eq!(list, expected);
        }
    }
}
