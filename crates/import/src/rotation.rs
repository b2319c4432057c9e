//! The rotation that fits pairs of vectors best.
//!
//! Source: Horn, "Closed-form solution of absolute orientation using unit quaternions", 1987, section 4.

use glam::{DMat3, DMat4, DQuat, DVec3, DVec4};

/// The matrix with entry `a[i] b[j]` in row i and column j.
pub(crate) fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// The rotation that takes vectors a nearest to vectors b, given the sum of their [outer] products.
pub(crate) fn nearest_rotation(sums: DMat3) -> DQuat {
    /// Number of times that the matrix is squared. The ratios of its eigenvalues are raised to the power 2 to this number.
    const SQUARINGS: usize = 32;
    let [x, y, z] = sums.transpose().to_cols_array_2d();
    let diagonal = DVec4::new(
        x[0] + y[1] + z[2],
        x[0] - y[1] - z[2],
        y[1] - x[0] - z[2],
        z[2] - x[0] - y[1],
    );
    let (a, b, c) = (y[2] - z[1], z[0] - x[2], x[1] - y[0]);
    let (d, e, f) = (x[1] + y[0], z[0] + x[2], y[2] + z[1]);
    let mut matrix = DMat4::from_cols(
        DVec4::new(diagonal.x, a, b, c),
        DVec4::new(a, diagonal.y, d, e),
        DVec4::new(b, d, diagonal.z, f),
        DVec4::new(c, e, f, diagonal.w),
    );
    let size = |matrix: &DMat4| matrix.to_cols_array().map(f64::abs).iter().sum::<f64>();
    // Eigenvalues become positive, so that the greatest one is also the one of greatest size.
    matrix += DMat4::IDENTITY * size(&matrix);
    for _ in 0..SQUARINGS {
        matrix *= 1.0 / size(&matrix).max(f64::MIN_POSITIVE);
        matrix *= matrix;
    }
    let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis, matrix.w_axis];
    let longest = |one: DVec4, other: DVec4| match one.length_squared() >= other.length_squared() {
        true => one,
        false => other,
    };
    let found = columns.into_iter().fold(DVec4::ZERO, longest);
    match found.try_normalize() {
        Some(found) => DQuat::from_xyzw(found.y, found.z, found.w, found.x),
        None => DQuat::IDENTITY,
    }
}
