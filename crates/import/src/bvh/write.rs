use std::io::{self, Write};

use glam::{DMat3, Quat, Vec3};
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
    let (moves, units_per_metre) = (moving_joints(skeleton, clip), 1.0 / metres_per_unit);
    let units = |place: Vec3| (place.as_dvec3() * units_per_metre).to_array();
    let order = write_hierarchy(out, skeleton, &moves, units)?;
    writeln!(out, "MOTION\nFrames: {}", clip.frames())?;
    writeln!(out, "Frame Time: {}", 1.0 / clip.frame_rate())?;
    let mut pose = Pose::default();
    for frame in 0..clip.frames() {
        clip.pose(frame, &mut pose);
        let mut blank = "";
        for id in &order {
            if moves[id.index()] {
                let place = match *id {
                    JointId::ROOT => pose.root,
                    id => pose.translations[id.index()],
                };
                for value in units(place) {
                    write!(out, "{blank}{value:.8}")?;
                    blank = " ";
                }
            }
            for value in zxy_degrees(pose.rotations[id.index()]) {
                write!(out, "{blank}{value:.6}")?;
            }
        }
        writeln!(out)?;
    }
    Ok(())
}

/// Writes the tree and returns the joints with channels, in the order of the file. Joints that `moves` have positions.
fn write_hierarchy(
    out: &mut impl Write,
    skeleton: &Skeleton,
    moves: &[bool],
    units: impl Fn(Vec3) -> [f64; 3],
) -> io::Result<Vec<JointId>> {
    let mut line = |depth: usize, text: &str| {
        // The indentation is limited, so that a chain of thousands of joints stays a small file.
        writeln!(out, "{}{text}", "\t".repeat(depth.min(40)))
    };
    let mut children = vec![Vec::new(); skeleton.len()];
    for id in skeleton.ids().rev() {
        if let Some(parent) = skeleton.joint(id).parent {
            children[parent.index()].push(id);
        }
    }
    line(0, "HIERARCHY")?;
    let (mut order, mut open) = (Vec::new(), Vec::new());
    let mut next = vec![JointId::ROOT];
    while let Some(id) = next.pop() {
        let (joint, below) = (skeleton.joint(id), &children[id.index()]);
        while open.last().copied() != joint.parent {
            open.pop();
            line(open.len(), "}")?;
        }
        let is_root = id == JointId::ROOT;
        let is_end = joint.kind == JointKind::EndSite && below.is_empty() && !is_root;
        let title = match (is_end, is_root) {
            (true, _) => "End Site".to_owned(),
            (false, true) => format!("ROOT {}", file_name(&joint.name)),
            (false, false) => format!("JOINT {}", file_name(&joint.name)),
        };
        line(open.len(), &title)?;
        line(open.len(), "{")?;
        open.push(id);
        let [x, y, z] = units(joint.offset);
        line(open.len(), &format!("OFFSET {x:.8} {y:.8} {z:.8}"))?;
        if !is_end {
            let channels = match moves[id.index()] {
                true => format!("CHANNELS 6 {POSITIONS} {ROTATIONS}"),
                false => format!("CHANNELS 3 {ROTATIONS}"),
            };
            line(open.len(), &channels)?;
            order.push(id);
        }
        next.extend(below);
    }
    while open.pop().is_some() {
        line(open.len(), "}")?;
    }
    Ok(order)
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
    let is_bad = |c: char| c.is_control() || matches!(c, '{' | '}');
    match name.trim() {
        "" => "_".to_owned(),
        name => name.replace(is_bad, "_"),
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
