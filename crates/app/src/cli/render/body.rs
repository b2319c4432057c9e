//! Renders the mesh of the characters from four sides, in poses of the graph's clips: standing, lowest, and with the hands highest.

use std::f32::consts::FRAC_PI_2;

use glam::Vec3;
use sabaki::anim::{Facing, JointTransform, Limbs, Pose, forward_kinematics};
use sabaki::math::Sphere;
use sabaki_app::film::{Delay, Film};
use sabaki_draw::StageDesc;
use sabaki_draw::scene::{
    Camera, Light, Orbit, Shot, SkinnedBody, skinned_positions, standing_pose,
};

use super::canvas::Canvas;
use super::file::{self, Kind};
use super::{Args, Written};
use crate::cli::culling::DeviceArgs;
use crate::cli::picture::Picture;
use crate::cli::{Failure, cancel};

/// Sides that the body is seen from.
const SIDES: u32 = 4;
/// Pixels between pictures.
const GAP: u32 = 6;

pub(super) fn run(args: &Args, kind: Kind, device: &DeviceArgs) -> Result<Written, Failure> {
    let baked = args.graph.load_unprepared()?;
    let graph = baked.graph.graph();
    let (skeleton, clips) = (graph.skeleton(), graph.clips());
    let bound_outfit = args.mesh.load(skeleton, clips)?;
    let Some(bound_outfit) = bound_outfit else {
        let what = "render body needs --mesh: a file, or body".to_owned();
        return Err(Failure::Usage(what));
    };
    let hands = Limbs::of(skeleton).hands;
    let raised = |joints: &[JointTransform]| {
        let all = hands.iter().map(|hand| joints[hand.index()].translation.y);
        all.sum::<f32>()
    };
    let low =
        |joints: &[JointTransform]| -joints.iter().map(|joint| joint.translation.y).sum::<f32>();
    let all = || {
        clips
            .iter()
            .flat_map(|clip| (0..clip.frames()).map(move |at| (clip, at)))
    };
    let best = |score: &dyn Fn(&[JointTransform]) -> f32| {
        let (mut best, mut found) = (f32::MIN, Vec::new());
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        for (clip, frame) in all() {
            clip.pose(frame, &mut pose);
            forward_kinematics(skeleton, &pose, &mut joints);
            if score(&joints) > best {
                best = score(&joints);
                found.clone_from(&joints);
            }
        }
        found
    };
    let poses = [standing_pose(skeleton, clips), best(&low), best(&raised)];
    let desc = StageDesc {
        meshes: &bound_outfit.outfit.meshes,
        ..StageDesc::default()
    };
    let mut canvas = Canvas::new(device, args.size, &desc)?;
    let size = args.size;
    let whole = [
        SIDES * (size[0] + GAP) + GAP,
        poses.len() as u32 * (size[1] + GAP) + GAP,
    ];
    let mut sheet = Picture::new(whole);
    let skin = &bound_outfit.outfit.skins[0];
    let mesh = &bound_outfit.outfit.meshes[skin.mesh];
    let aspect = size[0] as f32 / size[1] as f32;
    for (row, joints) in (0..).zip(&poses) {
        let heading = Facing::of(skeleton).placement(joints).heading();
        let cameras = cameras(&skinned_positions(mesh, skin, joints), heading, aspect);
        for (column, camera) in (0..).zip(cameras) {
            cancel::check()?;
            let mut shot = shot(camera);
            shot.skinned.push(SkinnedBody::new(skin, joints));
            let picture = canvas.paint(&shot, None)?;
            sheet.place(
                [GAP + column * (size[0] + GAP), GAP + row * (size[1] + GAP)],
                &picture,
            );
        }
    }
    drop(canvas);
    let film = Film {
        size: whole,
        delay: Delay::default(),
        pictures: vec![sheet.into_pixels()],
    };
    Ok(Written {
        bytes: file::write(&args.out, kind, &film)?,
        pictures: 1,
        text: bound_outfit.report,
        more: Vec::new(),
    })
}

/// Cameras on all sides of a character with this heading, the front first, that show all positions of its mesh at the same scale.
fn cameras(positions: &[Vec3], heading: f32, aspect: f32) -> [Camera; SIDES as usize] {
    /// Room around the mesh, in metres.
    const ROOM: f32 = 0.05;
    let low = positions.iter().copied().fold(Vec3::MAX, Vec3::min);
    let high = positions.iter().copied().fold(Vec3::MIN, Vec3::max);
    let camera = |side: usize, distance| {
        let orbit = Orbit {
            target: 0.5 * (low + high),
            around: heading + 0.35 + side as f32 * FRAC_PI_2,
            up: 0.12,
            distance,
        };
        let field = 30f32.to_radians();
        Camera {
            field,
            ..Camera::orbit(orbit)
        }
    };
    let distances: [f32; SIDES as usize] = std::array::from_fn(|side| {
        let spheres = positions.iter().map(|&place| Sphere::new(place, ROOM));
        let camera = camera(side, 0.5).enclosing(spheres, aspect);
        camera.eye.distance(camera.target)
    });
    let most = distances.into_iter().fold(0.0, f32::max);
    std::array::from_fn(|side| camera(side, most))
}

fn shot(camera: Camera) -> Shot {
    let light = Light {
        shadow: Sphere::new(camera.target.with_y(0.0), 2.5),
        ..Light::default()
    };
    Shot::new(camera, light)
}
