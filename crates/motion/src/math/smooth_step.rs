//! A step without corners.

/// Rises from 0 to 1 while `x` does, and stays there outside; its slope is 0 at both ends.
#[must_use]
pub fn smooth_step(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}
