//! Renders the mesh of the characters from four sides, in poses of the graph's clips: standing, lowest, and with the hands highest.

use std::f32::consts::FRAC_PI_2;

use glam::Vec3;
use sabaki::anim::{Facing, JointTransform, Limbs, Pose, forward_kinematics};
use sabaki::math::Sphere;
use sabaki_draw::scene::{
    Camera, Light, Orbit, Shot, SkinnedBody, skinned_positions, standing_pose,
};

use super::{OutArgs, Written, draw_all, on_a_sheet, paint};
use crate::cli::Failure;
use crate::cli::bake::GraphArgs;

#[derive(clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    graph: GraphArgs,
    #[command(flatten)]
    out: OutArgs,
}

/// Sides that the body is seen from.
const SIDES: u32 = 4;

pub(super) fn run(args: &Args) -> Result<Written, Failure> {
    let baked = args.graph.load_unprepared()?;
    let graph = baked.graph();
    let (skeleton, clips) = (graph.skeleton(), graph.clips());
    let Some(bound) = args.out.mesh.load(&args.graph, skeleton, clips)? else {
        let why = args.out.mesh.why_none();
        return Err(Failure::Usage(format!(
            "render body draws a mesh, but {why}: say --mesh FILE"
        )));
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
    let mut canvas = args.out.canvas_of(Some(&bound))?;
    let skin = &bound.outfit.skins[0];
    let mesh = &bound.outfit.meshes[skin.mesh];
    let aspect = args.out.size[0] as f32 / args.out.size[1] as f32;
    let shots = poses.iter().flat_map(|joints| {
        let heading = Facing::of(skeleton).placement(joints).heading();
        let cameras = cameras(&skinned_positions(mesh, skin, joints), heading, aspect);
        cameras.map(|camera| (joints, camera))
    });
    let pictures = draw_all(shots.collect(), |(joints, camera)| {
        let mut shot = shot(camera);
        shot.skinned.push(SkinnedBody::new(skin, joints));
        paint(&mut canvas, &shot, None)
    })?;
    drop(canvas);
    let sheet = on_a_sheet(&pictures, SIDES);
    args.out.write(vec![sheet], 0.0, Some(&bound))
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
