//! The order of a list that is not sorted itself.

use std::cmp::Ordering;

/// The indices below `count`, sorted by a comparison; equal ones stay in ascending order. The function is not generic, so
/// that it is compiled once.
pub fn sorted_indices(count: usize, compare: &dyn Fn(&usize, &usize) -> Ordering) -> Vec<usize> {
    let mut indices: Vec<usize> = (0..count).collect();
    indices.sort_by(compare);
    indices
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_ones_stay_in_order() {
        let list = [3, 1, 2, 1, 3];
        let order = sorted_indices(list.len(), &|&a, &b| list[a].cmp(&list[b]));
        assert_eq!(order, [1, 3, 2, 0, 4]);
        assert!(sorted_indices(0, &|_, _| Ordering::Equal).is_empty());
    }
}
