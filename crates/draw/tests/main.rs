//! Pictures are deterministic, show objects where the camera sees them, and cause no validation
//! messages.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod framing;
mod skins;
mod strange;

use std::sync::Arc;

use glam::{Vec2, Vec3};
use sabaki::anim::{JointId, JointTransform};
use sabaki::gpu::ash::vk::{self, Handle};
use sabaki::maps::{BitMap, Body};
use sabaki::math::{Rigid2, Sphere};
use sabaki_app::Painter;
use sabaki_draw::StageDesc;
use sabaki_draw::scene::{
    Camera, Capsule, Figure, Formation, FormationSettings, Layer, Light, Look, Mesh, MeshBone,
    MeshVertex, Orbit, Outfit, Shot, Skin,
};
use sabaki_fixtures::clips::joints_at;
use sabaki_fixtures::cull::map_rect;
use sabaki_fixtures::demo::{self, Motions};
use sabaki_fixtures::headless::Headless;
use sabaki_fixtures::with;
use sabaki_fixtures::{device, shim};
use strange::limit_of;

const SIZE: [u32; 2] = [240, 160];
const PIXELS: u32 = SIZE[0] * SIZE[1];
const RED: [f32; 4] = [0.9, 0.1, 0.05, 1.0];

struct Picture(Vec<u8>);

impl Picture {
    fn at(&self, pixel: Vec2) -> [i32; 3] {
        let (x, y) = (pixel.x as usize, pixel.y as usize);
        let first = 4 * (y * SIZE[0] as usize + x);
        [0, 1, 2].map(|channel| i32::from(self.0[first + channel]))
    }

    fn differs(&self, other: &Self, pixel: Vec2) -> bool {
        let pairs = self.at(pixel).into_iter().zip(other.at(pixel));
        pairs.map(|(a, b)| (a - b).abs()).sum::<i32>() > 20
    }

    /// How many pixels differ.
    fn apart(&self, other: &Self) -> u32 {
        let differs = |&at: &u32| {
            let at = Vec2::new((at % SIZE[0]) as f32, (at / SIZE[0]) as f32);
            self.differs(other, at)
        };
        (0..PIXELS).filter(differs).count() as u32
    }
}

fn camera() -> Camera {
    Camera::orbit(Orbit {
        target: Vec3::new(0.0, 0.9, 0.0),
        around: 0.6,
        up: 0.2,
        distance: 5.0,
    })
}

fn empty() -> Shot {
    Shot::new(camera(), Light::default())
}

fn paint(painter: &mut Painter, shot: &Shot) -> Picture {
    Picture(painter.paint(shot, None).unwrap())
}

fn painter(meshes: &[Mesh]) -> Painter {
    let desc = StageDesc {
        meshes,
        ..StageDesc::default()
    };
    Painter::new(device(), SIZE, &desc).unwrap()
}

/// Ends a test: any message of validation fails it.
fn end(mut painter: Painter) {
    let messages = painter.close();
    assert!(messages.is_empty(), "validation says: {messages:#?}");
}

fn is_red([red, green, blue]: [i32; 3]) -> bool {
    red > 2 * green && red > 2 * blue
}

fn ball_of(centre: Vec3, radius: f32, colour: [f32; 4]) -> Capsule {
    Capsule::ball(Sphere::new(centre, radius), colour)
}

fn fighter(motions: &Motions) -> Vec<Capsule> {
    let body = Body::from_bones(&motions.skeleton);
    let figure = Figure::of(&motions.skeleton, &body, &Look::default());
    let joints = joints_at(&motions.skeleton, &motions.clips[0], 0);
    let mut capsules = Vec::new();
    figure.capsules(&joints, 1.0, &mut capsules);
    capsules
}

fn middle(capsule: &Capsule) -> Vec3 {
    let end = |end: [f32; 4]| Vec3::new(end[0], end[1], end[2]);
    0.5 * (end(capsule.a) + end(capsule.b))
}

/// A white vertex that moves with bone 0.
fn vertex(position: Vec3, normal: Vec3, uv: [f32; 2]) -> MeshVertex {
    MeshVertex {
        position: position.to_array(),
        normal: normal.to_array(),
        uv,
        colour: [u16::MAX; 4],
        bones: [0; 4],
        weights: [u16::MAX, 0, 0, 0],
    }
}

/// A skin of mesh 0 whose bone is where a joint is.
fn skin_on(joint: u16) -> Arc<Skin> {
    let bone = MeshBone {
        joint: JointId(joint),
        bind: JointTransform::IDENTITY,
    };
    Arc::new(Skin {
        mesh: 0,
        bones: vec![bone],
    })
}

#[test]
fn passes_have_labels_and_pipelines_the_cache_of_the_host() {
    // SAFETY: the shim calls the system's loader.
    let device = unsafe { Headless::with_loader(shim::entry(), &sabaki_fixtures::desc()) };
    let device = device.unwrap();
    let context = device.context().unwrap().clone();
    let info = vk::PipelineCacheCreateInfo::default();
    // SAFETY: the device is valid.
    let cache = unsafe { context.device().create_pipeline_cache(&info, None) }.unwrap();
    shim::heard();
    let desc = StageDesc {
        pipeline_cache: cache,
        ..StageDesc::default()
    };
    let mut painter = Painter::new(device, SIZE, &desc).unwrap();
    let caches = shim::heard().caches;
    assert!(!caches.is_empty() && caches.iter().all(|&one| one == cache.as_raw()));
    shim::heard();
    paint(&mut painter, &empty());
    assert_eq!(shim::heard().labels, ["sabaki: shadows", "sabaki: picture"]);
    // SAFETY: nothing is created with it any more.
    unsafe { context.device().destroy_pipeline_cache(cache, None) };
    end(painter);
}

#[test]
fn bodies_balls_ghosts_and_maps_are_where_the_camera_sees_them() {
    let mut painter = painter(&[]);
    let floor = paint(&mut painter, &empty());
    let ball = Vec3::new(0.7, 1.4, -0.3);
    let mut shot = empty();
    shot.solids = fighter(&demo::motions().unwrap());
    shot.solids.push(ball_of(ball, 0.12, RED));
    let picture = paint(&mut painter, &shot);
    let seen = |place| camera().pixel(place, SIZE).unwrap();
    assert!(is_red(picture.at(seen(ball))));
    assert!(!is_red(picture.at(seen(ball + 0.2 * Vec3::Y))));
    for capsule in &shot.solids {
        let pixel = seen(middle(capsule));
        assert!(picture.differs(&floor, pixel), "{capsule:?} at {pixel}");
    }
    // The sun is behind the left shoulder: the ball's shadow lies on the other side, where nothing else is drawn.
    let sunward = shot.light.sunward.normalize();
    let shadow = ball - sunward * (ball.y / sunward.y);
    assert!(picture.differs(&floor, seen(shadow)));
    let sum = |picture: &Picture, at| picture.at(at).iter().sum::<i32>();
    assert!(sum(&picture, seen(shadow)) < sum(&floor, seen(shadow)));

    let mut ghost = empty();
    ghost
        .ghosts
        .push(ball_of(ball, 0.12, [0.9, 0.1, 0.05, 0.4]));
    let through = paint(&mut painter, &ghost);
    assert!(through.differs(&floor, seen(ball)) && through.differs(&picture, seen(ball)));

    let mut mapped = empty();
    let mut map = BitMap::new(map_rect(10, -5, 40, 30));
    (0..30).for_each(|row| (0..20).for_each(|column| map.set(column, row)));
    let placement = Rigid2::new(0.4, -0.6, 0.3);
    mapped.layers.push(Layer {
        map,
        texel: 0.02,
        placement,
        height: 0.8,
        colour: RED,
    });
    let layered = paint(&mut painter, &mapped);
    let texel =
        |column: f32, row: f32| seen(placement.point(Vec3::new(column * 0.02, 0.8, row * 0.02)));
    assert!(is_red(layered.at(texel(20.0, 10.0))), "a set texel");
    assert!(!is_red(layered.at(texel(40.0, 10.0))), "not set");
    assert!(!is_red(layered.at(texel(4.0, 10.0))), "outside of the map");

    let again = paint(&mut painter, &shot);
    assert!(again.0 == picture.0, "the same shot is the same picture");
    end(painter);
}

#[test]
fn one_sample_a_pixel_and_another_device_draw_the_same_scene() {
    let mut shot = empty();
    shot.solids = fighter(&demo::motions().unwrap());
    let pictures: Vec<Picture> = [4, 4, 1]
        .into_iter()
        .map(|samples| {
            let desc = StageDesc {
                samples,
                ..StageDesc::default()
            };
            let mut painter = Painter::new(device(), SIZE, &desc).unwrap();
            let picture = paint(&mut painter, &shot);
            end(painter);
            picture
        })
        .collect();
    assert!(pictures[0].0 == pictures[1].0, "another device");
    // Edges alone.
    let apart = pictures[0].apart(&pictures[2]);
    assert!((1..PIXELS / 20).contains(&apart), "{apart} of {PIXELS}");
}

#[test]
fn a_crowd_stands_where_it_was_posed_with_levels_and_without() {
    let motions = demo::motions().unwrap();
    let settings = with(|s: &mut FormationSettings| (s.count, s.threads) = (300, 1));
    let outfit = Outfit::human(&motions.skeleton, &motions.clips).unwrap();
    // Those in blue: in the light white clothes have the colour of the floor.
    let mut formation = Formation::new(
        &motions.skeleton,
        &motions.clips[0],
        &outfit.skins[1],
        &settings,
    )
    .unwrap();
    let desc = StageDesc::for_crowd(&formation, &outfit.meshes);
    let mut painter = Painter::new(device(), SIZE, &desc).unwrap();
    let camera = formation.camera();
    let mut taken = Vec::new();
    for (lod, tinted) in [(true, false), (false, false), (true, true)] {
        formation.use_levels(lod);
        formation.show_levels(tinted);
        formation.look_from(&camera, SIZE).unwrap();
        formation.pose(painter.poses().unwrap()).unwrap();
        let (shot, shown) = formation.shot(camera, SIZE).unwrap();
        assert!(shown.groups.len() >= 3 || !lod, "a draw for each level");
        let nobody = Picture(painter.paint(&shot, None).unwrap());
        let everybody = Picture(painter.paint(&shot, Some(&shown)).unwrap());
        // The first row's trunks.
        for file in 2..8 {
            let place = Vec3::new((file as f32 - 4.5) * Formation::APART, 1.05, 0.0);
            let pixel = camera.pixel(place, SIZE).unwrap();
            assert!(everybody.differs(&nobody, pixel), "{file} {lod}");
        }
        taken.push(everybody);
    }
    let changed = taken[0].apart(&taken[1]);
    assert!(changed < 2000, "levels change little: {changed}");
    assert!(taken[0].apart(&taken[2]) > 2000, "colours show");
    assert!(formation.census()[0] < 300);
    end(painter);
}

#[test]
fn more_than_a_stage_was_made_for_is_an_error_that_names_the_limit() {
    let desc = StageDesc {
        max_capsules: 3,
        max_map_words: 2,
        ..StageDesc::default()
    };
    let mut painter = Painter::new(device(), SIZE, &desc).unwrap();
    let mut shot = empty();
    shot.solids = vec![ball_of(Vec3::Y, 0.1, RED); 4];
    let refused = painter.paint(&shot, None);
    assert_eq!(limit_of(refused), "StageDesc::max_capsules");
    let mut shot = empty();
    shot.layers.push(Layer {
        map: BitMap::new(map_rect(0, 0, 33, 2)),
        texel: 0.02,
        placement: Rigid2::IDENTITY,
        height: 0.0,
        colour: RED,
    });
    let refused = painter.paint(&shot, None);
    assert_eq!(limit_of(refused), "StageDesc::max_map_words");
    painter.paint(&empty(), None).unwrap();
    end(painter);
}

#[test]
fn the_shader_table_is_that_of_the_spirv() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    sabaki_fixtures::shader_table::is_current(&folder.join("shaders"));
}
