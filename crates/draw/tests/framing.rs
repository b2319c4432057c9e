//! Cameras show what their scenes are about.

use glam::{Vec2, Vec3};
use sabaki::graph::{EdgeId, Playhead};
use sabaki::maps::{BakedGraph, SphereKey};
use sabaki::math::{F32x16, Rigid2, Sphere};
use sabaki::query::{Answer, Attack, Query, QueryContext, QuerySettings, Request};
use sabaki_draw::scene::{Camera, Dodge, DodgeSettings, Formation, FormationSettings, Orbit, Skin};
use sabaki_fixtures::demo;
use sabaki_fixtures::with;

use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::throw::key;

const SIZE: [u32; 2] = [640, 400];

fn is_inside(camera: &Camera, place: Vec3) -> bool {
    let size = Vec2::new(SIZE[0] as f32, SIZE[1] as f32);
    let at = camera.pixel(place, SIZE);
    at.is_some_and(|at| at.cmpgt(Vec2::ZERO).all() && at.cmplt(size).all())
}

/// The answer to an attack on a character in the first pose, and what is checked of its playback.
pub(super) fn dodge(
    spheres: Vec<Vec<SphereKey>>,
    shown: &DodgeSettings,
    check: impl FnOnce(&BakedGraph, &Dodge<'_>),
) {
    let baked = embedded();
    let playhead = Playhead::at(baked.graph(), EdgeId(0), 0.0, Rigid2::IDENTITY);
    let attack = Attack::new(spheres).unwrap();
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    let settings = QuerySettings::default();
    let request = Request::new(playhead, &attack);
    Query::new(baked, &settings).answer(request, &mut context, &mut answer);
    check(baked, &Dodge::new(baked, playhead, &attack, &answer, shown));
}

fn ball(from: Vec3, to: Vec3, seconds: [f32; 2]) -> Vec<SphereKey> {
    vec![key(seconds[0], from, 0.1), key(seconds[1], to, 0.1)]
}

#[test]
fn of_several_balls_the_camera_follows_the_nearest_and_shows_the_body() {
    let far = ball(
        Vec3::new(0.0, 1.2, 8.0),
        Vec3::new(0.0, 1.2, 6.0),
        [0.1, 0.3],
    );
    let near = ball(
        Vec3::new(4.0, 1.5, 0.0),
        Vec3::new(-2.0, 1.5, 0.0),
        [0.9, 1.4],
    );
    let other = ball(
        Vec3::new(0.3, 1.3, 4.0),
        Vec3::new(0.3, 1.3, -2.0),
        [0.7, 1.2],
    );
    dodge(
        vec![far, near, other],
        &DodgeSettings::default(),
        |_, dodge| {
            let camera = dodge.camera(1.6);
            let t = dodge.clearance().time;
            let nearest = dodge.nearest(t).unwrap();
            assert!(dodge.ball(t).centre.distance(nearest.attack) < 0.11);
            let mut joints = Vec::new();
            dodge.joints(t, &mut joints);
            for joint in &joints {
                assert!(is_inside(&camera, joint.translation), "{joint:?}");
            }
            assert!(is_inside(&camera, dodge.ball(t).centre));
            // The body is not a dot.
            let heights = joints
                .iter()
                .map(|joint| camera.pixel(joint.translation, SIZE).unwrap().y);
            let [top, low] = [f32::min, f32::max].map(|of| heights.clone().reduce(of).unwrap());
            assert!(low - top > 0.25 * SIZE[1] as f32, "{top} {low}");
        },
    );
}

#[test]
fn the_ball_is_before_the_body_when_it_is_nearest() {
    for index in 0..16 {
        let angle = index as f32 * std::f32::consts::TAU / 16.0;
        let out = Vec3::new(angle.sin(), 0.0, angle.cos());
        for height in [0.5, 1.1, 1.5] {
            let [from, to] = [4.0, -2.0].map(|along| out * along + Vec3::Y * height);
            let balls = vec![ball(from, to, [0.9, 1.4])];
            dodge(balls, &DodgeSettings::default(), |baked, dodge| {
                let (t, camera) = (dodge.clearance().time, dodge.camera(1.6));
                let (mut joints, mut centres) = (Vec::new(), Vec::new());
                dodge.joints(t, &mut joints);
                baked.body().centres(&joints, &mut centres);
                let ball = dodge.ball(t).centre;
                let toward = (camera.eye - ball).normalize();
                let hidden = centres
                    .iter()
                    .zip(&baked.body().spheres)
                    .any(|(centre, part)| {
                        let away = *centre - ball;
                        away.dot(toward) > 0.0
                            && away.reject_from(toward).length() < 0.8 * part.radius
                    });
                assert!(!hidden, "from {angle} at {height}");
            });
        }
    }
}

#[test]
fn a_crowd_of_few_is_in_the_middle_of_the_picture() {
    let motions = demo::motions().unwrap();
    let (mesh, bones) = (0, Vec::new());
    let skin = Skin { mesh, bones };
    for count in 1..10u32 {
        let settings = with(|s: &mut FormationSettings| (s.count, s.threads) = (count, 1));
        let mut formation =
            Formation::new(&motions.skeleton, &motions.clips[0], &skin, &settings).unwrap();
        let camera = formation.camera();
        for index in 0..count {
            let x = (index as f32 - 0.5 * (count - 1) as f32) * Formation::APART;
            for height in [0.0, 1.7] {
                let place = Vec3::new(x, height, 0.0);
                assert!(is_inside(&camera, place), "{index} of {count}, {height}");
            }
        }
        let mut poses = vec![F32x16::ZERO; formation.max_output_len()];
        formation.look_from(&camera, SIZE).unwrap();
        formation.pose(&mut poses).unwrap();
        let (_, shown) = formation.shot(camera, SIZE).unwrap();
        assert_eq!(shown.members.len(), count as usize);
    }
}

fn orbit(up: f32, distance: f32) -> Camera {
    Camera::orbit(Orbit {
        target: Vec3::new(0.3, 1.0, -0.2),
        around: 0.7,
        up,
        distance,
    })
}

#[test]
fn enclosed_spheres_are_inside_of_the_picture_and_one_of_them_touches_its_edge() {
    let camera = orbit(0.2, 0.5);
    let places = [
        Vec3::ZERO,
        Vec3::new(1.5, 1.8, 1.0),
        Vec3::new(-2.0, 1.0, 0.6),
    ];
    let size = [600, 400];
    let near = camera.enclosing(places.map(|place| Sphere::new(place, 0.0)), 1.5);
    let edge = places.map(|place| {
        let at = near.pixel(place, size).unwrap();
        (at.min(Vec2::new(600.0, 400.0) - at)).min_element()
    });
    let least = edge.into_iter().fold(f32::MAX, f32::min);
    assert!(least.abs() < 0.1, "{edge:?}");
    let far = camera.enclosing(places.map(|place| Sphere::new(place, 0.3)), 1.5);
    assert!(far.eye.distance(far.target) > near.eye.distance(near.target) + 0.3);
    assert_eq!(far.enclosing([Sphere::new(Vec3::ZERO, 0.1)], 1.5), far);
}

#[test]
fn a_pixel_is_seen_where_its_ray_goes() {
    let camera = orbit(0.3, 4.0);
    let size = [640, 360];
    let middle = camera.pixel(camera.target, size).unwrap();
    assert!(middle.distance(Vec2::new(320.0, 180.0)) < 1e-2, "{middle}");
    let place = Vec3::new(-0.5, 0.2, 0.4);
    let pixel = camera.pixel(place, size).unwrap();
    let ray = camera.ray(pixel, size);
    let along = (place - camera.eye).dot(ray);
    assert!((camera.eye + along * ray).distance(place) < 1e-3);
    // Higher places are closer to the top edge, and places behind the camera are not visible.
    assert!(camera.pixel(place + Vec3::Y, size).unwrap().y < pixel.y);
    assert_eq!(camera.pixel(2.0 * camera.eye - camera.target, size), None);
}
