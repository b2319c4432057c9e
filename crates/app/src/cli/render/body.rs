//! Renders the mesh of the characters from four sides, in poses of the graph's clips: standing, lowest, and with the hands highest.

use sabaki::anim::{JointTransform, Pose, Skeleton, forward_kinematics};
use sabaki::internal::Limbs;
use sabaki::math::Sphere;
use sabaki_app::film::{Delay, Film};
use sabaki_draw::StageDesc;
use sabaki_draw::scene::{Camera, Light, Orbit, Shot, SkinnedBody, standing_pose};

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
    let wardrobe = args.mesh.load(skeleton, clips)?;
    let Some(wardrobe) = wardrobe else {
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
        meshes: &wardrobe.outfit.meshes,
        ..StageDesc::default()
    };
    let mut canvas = Canvas::new(device, args.size, &desc)?;
    let size = args.size;
    let whole = [
        SIDES * (size[0] + GAP) + GAP,
        poses.len() as u32 * (size[1] + GAP) + GAP,
    ];
    let mut sheet = Picture::new(whole);
    for (row, joints) in (0..).zip(&poses) {
        for column in 0..SIDES {
            cancel::check()?;
            let mut shot = shot(skeleton, joints, column);
            shot.skinned
                .push(SkinnedBody::new(&wardrobe.outfit.skins[0], joints));
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
        text: wardrobe.report,
        more: Vec::new(),
    })
}

/// A shot of a pose from one of the sides, the front first.
fn shot(skeleton: &Skeleton, joints: &[JointTransform], side: u32) -> Shot {
    let ground = sabaki::internal::Facing::of(skeleton).placement(joints);
    let middle = ground.point(glam::Vec3::ZERO);
    let turn = 0.35 + side as f32 * std::f32::consts::FRAC_PI_2;
    let heights = joints.iter().map(|joint| joint.translation.y);
    let high = heights.fold(0.5, f32::max) + 0.25;
    let field = 30f32.to_radians();
    let camera = Camera {
        field,
        ..Camera::orbit(Orbit {
            target: middle + glam::Vec3::Y * (0.5 * high - 0.05),
            around: ground.heading() + turn,
            up: 0.12,
            distance: 0.55 * high / (0.5 * field).tan(),
        })
    };
    let light = Light {
        shadow: Sphere::new(middle, 2.5),
        ..Light::default()
    };
    Shot::new(camera, light)
}
