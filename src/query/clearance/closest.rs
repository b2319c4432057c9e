//! The smallest distance of two moving spheres, in closed form.
//!
//! Source: the reduction to a moving point and a sphere with the sum of the radii is that of Ericson, "Real-Time Collision Detection" (2005),
//! section 5.5.5. Differs: the result is the smallest distance instead of the time of contact, and radii may change. The closed form for
//! changing radii is our own.

use glam::Vec3;

/// The smallest distance of two spheres that move along straight lines. `apart` is the vector from one centre to the other at the start and at
/// the end, and `radii` is the sum of the radii at the start and at the end. Returns the time (0 at the start, 1 at the end) and the distance
/// of the surfaces.
///
/// With d(t) = |a + t v| - (r + t k), a convex function, the smallest value lies at an end or where d' = 0:
/// `(v·a + t v·v)² = k² |a + t v|²`.
#[must_use]
pub fn closest(apart: [Vec3; 2], radii: [f32; 2]) -> (f32, f32) {
    let (start, motion) = (apart[0], apart[1] - apart[0]);
    let growth = radii[1] - radii[0];
    let distance = |t: f32| (start + motion * t).length() - (radii[0] + growth * t);
    let (vv, av, aa) = (
        motion.length_squared(),
        start.dot(motion),
        start.length_squared(),
    );
    let mut best = if distance(1.0) < distance(0.0) {
        (1.0, distance(1.0))
    } else {
        (0.0, distance(0.0))
    };
    if vv > growth * growth {
        // The point of the line that is nearest to the other centre lies at -av/vv. The growing radius shifts the minimum.
        let shift = match growth {
            0.0 => 0.0,
            _ => {
                let gap = (aa - av * av / vv).max(0.0);
                growth * (gap / (vv * (vv - growth * growth))).sqrt()
            }
        };
        let t = (shift - av / vv).clamp(0.0, 1.0);
        if distance(t) < best.1 {
            best = (t, distance(t));
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-2.0f32..2.0).prop_map(Vec3::from)
    }

    proptest! {
        #[test]
        fn closest_is_no_further_than_any_sampled_moment(a in vector(), b in vector(), r in 0.01f32..0.5, s in 0.01f32..0.5) {
            let (t, metres) = closest([a, b], [r, s]);
            let at = |t: f32| a.lerp(b, t).length() - (r + (s - r) * t);
            prop_assert!((at(t) - metres).abs() < 1e-4);
            let sampled = (0..=2000).map(|i| at(i as f32 / 2000.0)).fold(f32::INFINITY, f32::min);
            prop_assert!(metres <= sampled + 1e-5, "{} > {}", metres, sampled);
            prop_assert!(metres >= sampled - 5e-3);
        }
    }
}
