use glam::{DMat3, Quat};

/// Decomposes a rotation into angles about Z, then X, then Y (`q = Z · X · Y`), in degrees.
///
/// At gimbal lock (X = ±90°) the angle about Y is 0. The angle about Z is computed from what
/// remains after the rotation about Y, so that the product of the three is accurate arbitrarily
/// close to gimbal lock.
pub(super) fn zxy_degrees(rotation: Quat) -> [f64; 3] {
    let m = DMat3::from_quat(rotation.as_dquat().normalize());
    // Row 2 of Z·X·Y: (-cos x sin y, sin x, cos x cos y).
    let (r20, r21, r22) = (m.x_axis.z, m.y_axis.z, m.z_axis.z);
    let cos_x = r20.hypot(r22);
    let x = r21.atan2(cos_x);
    let y = if cos_x < 1e-9 { 0.0 } else { (-r20).atan2(r22) };
    let (sin_y, cos_y) = y.sin_cos();
    let z =
        (m.x_axis.y * cos_y + m.z_axis.y * sin_y).atan2(m.x_axis.x * cos_y + m.z_axis.x * sin_y);
    [z, x, y].map(f64::to_degrees)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, DVec3};

    fn again([z, x, y]: [f64; 3]) -> DQuat {
        let turn = |axis, degrees: f64| DQuat::from_axis_angle(axis, degrees.to_radians());
        turn(DVec3::Z, z) * turn(DVec3::X, x) * turn(DVec3::Y, y)
    }

    #[test]
    fn the_angles_make_up_the_rotation_at_and_near_gimbal_lock() {
        for x in [
            0.0, 45.0, 89.9, 89.999_9, 90.0, 90.000_01, -90.0, -89.99, 179.0,
        ] {
            for z in [-170.0, 0.0, 33.0] {
                for y in [-90.0, 10.0, 180.0] {
                    let rotation = again([z, x, y]).as_quat();
                    let exact = rotation.as_dquat().normalize();
                    let angle = exact.angle_between(again(zxy_degrees(rotation)));
                    assert!(angle < 1e-7, "z {z} x {x} y {y}: {angle}");
                }
            }
        }
    }
}
