use std::io::{self, Write};

use glam::{DMat3, Quat};
use sabaki::anim::{Clip, JointId, JointKind, Pose, Skeleton};

use crate::figure::on_whole;

const ROTATIONS: &str = "Zrotation Xrotation Yrotation";
const POSITIONS: &str = "Xposition Yposition Zposition";

/// Writes a motion as BVH, with lengths in units of `metres_per_unit`: 0.01 for centimetres. The root has positions and Z X Y rotations; the other joints have
/// rotations, and positions if the clip moves them.
///
/// The joints that the skeleton's file has above and beside the body come back ([`Skeleton::whole`]). Joints are written depth first. Skeletons from BVH files keep their order. Characters that BVH
/// names cannot contain (braces, line ends) are replaced by `_`.
///
/// # Errors
/// An error of `out`, or `InvalidInput` if the scale is not a positive number.
pub fn write(
    out: &mut impl Write,
    skeleton: &Skeleton,
    clip: &Clip,
    metres_per_unit: f64,
) -> io::Result<()> {
    if !(metres_per_unit.is_finite() && metres_per_unit > 0.0) {
        let what = format!("a scale of {metres_per_unit} metres per unit is not possible");
        return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
    }
    if let Some(whole) = skeleton.whole() {
        let clip = on_whole(&whole, clip).map_err(io::Error::other)?;
        return write(out, &whole.skeleton, &clip, metres_per_unit);
    }
    let mut writer = Writer {
        out,
        skeleton,
        moves: moving_joints(skeleton, clip),
        units_per_metre: 1.0 / metres_per_unit,
    };
    let order = writer.hierarchy()?;
    writeln!(writer.out, "MOTION\nFrames: {}", clip.frames())?;
    writeln!(writer.out, "Frame Time: {}", 1.0 / clip.frame_rate())?;
    let mut pose = Pose::default();
    for frame in 0..clip.frames() {
        clip.pose(frame, &mut pose);
        writer.frame(&order, &pose)?;
    }
    Ok(())
}

struct Writer<'a, W> {
    out: &'a mut W,
    skeleton: &'a Skeleton,
    /// Whether each joint has positions.
    moves: Vec<bool>,
    units_per_metre: f64,
}

impl<W: Write> Writer<'_, W> {
    /// Writes the tree and returns the joints with channels, in the order of the file.
    fn hierarchy(&mut self) -> io::Result<Vec<JointId>> {
        let skeleton = self.skeleton;
        let mut children = vec![Vec::new(); skeleton.len()];
        for id in skeleton.ids().rev() {
            if let Some(parent) = skeleton.joint(id).parent {
                children[parent.index()].push(id);
            }
        }
        writeln!(self.out, "HIERARCHY")?;
        let mut order = Vec::new();
        let mut open: Vec<JointId> = Vec::new();
        let mut next = vec![JointId::ROOT];
        while let Some(id) = next.pop() {
            while open.last().copied() != skeleton.joint(id).parent {
                open.pop();
                self.line(open.len(), "}")?;
            }
            let below = &children[id.index()];
            let has_channels = self.block(id, open.len(), below.is_empty())?;
            if has_channels {
                order.push(id);
            }
            open.push(id);
            next.extend(below);
        }
        while open.pop().is_some() {
            self.line(open.len(), "}")?;
        }
        Ok(order)
    }

    /// Writes the start of a joint's block, up to its channels. Returns whether the joint has
    /// channels.
    fn block(&mut self, id: JointId, depth: usize, is_leaf: bool) -> io::Result<bool> {
        let joint = self.skeleton.joint(id);
        let is_root = id == JointId::ROOT;
        let is_end = joint.kind == JointKind::EndSite && is_leaf && !is_root;
        let title = match (is_end, is_root) {
            (true, _) => "End Site".to_owned(),
            (false, true) => format!("ROOT {}", file_name(&joint.name)),
            (false, false) => format!("JOINT {}", file_name(&joint.name)),
        };
        self.line(depth, &title)?;
        self.line(depth, "{")?;
        let [x, y, z] = (joint.offset.as_dvec3() * self.units_per_metre).to_array();
        self.line(depth + 1, &format!("OFFSET {x:.8} {y:.8} {z:.8}"))?;
        if !is_end {
            let channels = if self.has_positions(id) {
                format!("CHANNELS 6 {POSITIONS} {ROTATIONS}")
            } else {
                format!("CHANNELS 3 {ROTATIONS}")
            };
            self.line(depth + 1, &channels)?;
        }
        Ok(!is_end)
    }

    fn has_positions(&self, id: JointId) -> bool {
        self.moves[id.index()]
    }

    fn line(&mut self, depth: usize, text: &str) -> io::Result<()> {
        // The indentation is limited, so that a chain of thousands of joints stays a small file.
        for _ in 0..depth.min(40) {
            self.out.write_all(b"\t")?;
        }
        writeln!(self.out, "{text}")
    }

    fn frame(&mut self, order: &[JointId], pose: &Pose) -> io::Result<()> {
        let mut blank = "";
        for &id in order {
            if self.has_positions(id) {
                let place = if id == JointId::ROOT {
                    pose.root
                } else {
                    pose.translations[id.index()]
                };
                for value in (place.as_dvec3() * self.units_per_metre).to_array() {
                    write!(self.out, "{blank}{value:.8}")?;
                    blank = " ";
                }
            }
            for value in zxy_degrees(pose.rotations[id.index()]) {
                write!(self.out, "{blank}{value:.6}")?;
            }
        }
        writeln!(self.out)
    }
}

/// Whether each joint leaves its place in the skeleton. The root does.
pub(crate) fn moving_joints(skeleton: &Skeleton, clip: &Clip) -> Vec<bool> {
    let places = clip.desc().translations;
    let frames = places.chunks_exact(skeleton.len());
    let moves = |id: JointId| {
        let offset = skeleton.joint(id).offset;
        id == JointId::ROOT || frames.clone().any(|frame| frame[id.index()] != offset)
    };
    skeleton.ids().map(moves).collect()
}

fn file_name(name: &str) -> String {
    let clean: String = name
        .trim()
        .chars()
        .map(|c| {
            if c.is_control() || matches!(c, '{' | '}') {
                '_'
            } else {
                c
            }
        })
        .collect();
    if clean.is_empty() {
        "_".to_owned()
    } else {
        clean
    }
}

/// Decomposes a rotation into angles about Z, then X, then Y (`q = Z · X · Y`), in degrees.
///
/// At gimbal lock (X = ±90°) the angle about Y is 0. The angle about Z is computed from what
/// remains after the rotation about Y, so that the product of the three is accurate arbitrarily
/// close to gimbal lock.
fn zxy_degrees(rotation: Quat) -> [f64; 3] {
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
