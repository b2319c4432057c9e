//! Rounding that needs no function call on targets without an instruction for it.

/// The whole number at or below `value`: `value.floor() as i32`.
#[inline(always)]
pub fn floor(value: f32) -> i32 {
    let cut = value as i32;
    cut.saturating_sub(i32::from(cut as f32 > value))
}

/// The nearest whole number, rounding halves away from 0: `value.round() as i32`.
#[inline(always)]
pub fn round(value: f32) -> i32 {
    let cut = value as i32;
    let rest = value - cut as f32;
    cut.saturating_add(i32::from(rest >= 0.5) - i32::from(rest <= -0.5))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn they_are_the_standard_librarys(value in prop::num::f32::ANY, small in -1000.0f32..1000.0) {
            prop_assert_eq!(floor(value), value.floor() as i32);
            prop_assert_eq!(floor(small), small.floor() as i32);
            prop_assert_eq!(floor(small.round()), small.round() as i32);
            prop_assert_eq!(round(value), value.round() as i32);
            prop_assert_eq!(round(small), small.round() as i32);
            prop_assert_eq!(round(small.floor() + 0.5), (small.floor() + 0.5).round() as i32);
        }
    }
}
