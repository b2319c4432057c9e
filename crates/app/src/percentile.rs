//! Percentiles of what was measured.

/// The value below which a share of all values lies; 0 without values.
#[must_use]
pub fn percentile(mut values: Vec<f64>, share: f64) -> f64 {
    let index = (share * (values.len().saturating_sub(1)) as f64).round() as usize;
    if index >= values.len() {
        return 0.0;
    }
    *values.select_nth_unstable_by(index, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_those_of_the_sorted_values() {
        let values = vec![5.0, 1.0, 4.0, 2.0, 3.0];
        let of = |share: f64| percentile(values.clone(), share);
        assert_eq!(
            [0.0, 0.25, 0.5, 0.9, 1.0].map(of),
            [1.0, 2.0, 3.0, 5.0, 5.0]
        );
        assert_eq!(percentile(Vec::new(), 0.5), 0.0);
        assert_eq!(percentile(vec![7.0], 0.999), 7.0);
    }
}
