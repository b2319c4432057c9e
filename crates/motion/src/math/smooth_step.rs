//! A smooth step function.

/// Rises smoothly from 0 at `x` = 0 to 1 at `x` = 1 and is constant outside. Its slope is 0 at both ends.
pub fn smooth_step(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}
