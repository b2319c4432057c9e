//! An order of the targets of which each prefix is spread evenly.

/// A permutation of the numbers below `count` in which each prefix is spread evenly.
pub(super) fn spread(count: usize) -> impl Iterator<Item = usize> {
    let is_coprime = |step: &usize| {
        let (mut a, mut b) = (*step, count);
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a == 1
    };
    // A step of about the golden section, which spreads prefixes evenly.
    let first = (count * 89 / 144).max(1);
    let step = (first..).find(is_coprime).unwrap_or(1);
    (0..count).map(move |index| index * step % count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_order_has_each_number_once() {
        for count in [0, 1, 2, 3, 10, 144, 159, 256] {
            let mut order: Vec<usize> = spread(count).collect();
            order.sort_unstable();
            assert_eq!(order, (0..count).collect::<Vec<_>>());
        }
        let first: Vec<usize> = spread(100).take(4).collect();
        let far = |a: usize, b: usize| a.abs_diff(b) > 10;
        assert!(
            first.windows(2).all(|pair| far(pair[0], pair[1])),
            "{first:?}"
        );
    }
}
