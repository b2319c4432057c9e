//! What the command measures of answers: coverage, times of contact, and quality.

pub(crate) mod by_time;
pub(crate) mod coverage;
pub(crate) mod quality;

use sabaki::anim::JointId;
use sabaki::graph::MotionGraph;

/// Number of legs; they come before the arms.
const LEGS: usize = 2;

/// Position in [`MotionGraph::limbs`] of the limb that carries a joint.
fn limb_of(graph: &MotionGraph, joint: JointId) -> Option<usize> {
    let parent = |joint: &JointId| graph.skeleton().joints()[joint.index()].parent;
    let above: Vec<JointId> = std::iter::successors(Some(joint), parent).collect();
    let mut limbs = graph.limbs().iter();
    limbs.position(|limb| limb.is_some_and(|limb| above.contains(&limb.hip)))
}

/// The 95% interval (E. B. Wilson, "Probable inference", 1927) of the share that `count` of `all` stands for; 0 to 1 where nothing was counted.
fn wilson(count: u32, all: u32) -> [f64; 2] {
    /// Standard deviations that 95% of a normal distribution lie within.
    const Z: f64 = 1.959_963_985;
    if all == 0 {
        return [0.0, 1.0];
    }
    let (n, share) = (f64::from(all), f64::from(count) / f64::from(all));
    let middle = share + Z * Z / (2.0 * n);
    let half = Z * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
    let scale = 1.0 / (1.0 + Z * Z / n);
    [(middle - half) * scale, (middle + half) * scale].map(|end| end.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_is_that_of_the_tables() {
        // Newcombe 1998, table I: 81 of 263, 15 of 148, 0 of 20.
        for (count, all, low, high) in [
            (81, 263, 0.2553, 0.3662),
            (15, 148, 0.0624, 0.1605),
            (0, 20, 0.0, 0.1611),
        ] {
            let [found_low, found_high] = wilson(count, all);
            assert!((found_low - low).abs() < 1e-4, "{found_low}");
            assert!((found_high - high).abs() < 1e-4, "{found_high}");
        }
        assert_eq!(wilson(0, 0), [0.0, 1.0]);
    }
}
