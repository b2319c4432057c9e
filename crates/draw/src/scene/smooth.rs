//! How what is drawn comes and goes.

/// Rises smoothly from 0 to 1 while `x` does, and stays there outside.
pub(super) fn smooth(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}
