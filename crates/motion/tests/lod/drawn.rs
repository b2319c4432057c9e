//! Promise: what is drawn instead of a character differs from it by no more pixels than the settings allow, and nothing on the screen jumps.

use glam::{Vec2, Vec3};
use sabaki_fixtures::captures::captures;
use sabaki_fixtures::clips::frames_of;
use sabaki_fixtures::lod::{build, drawn, points_of, random_levels, rules, screen_error};
use sabaki_motion::anim::{Clip, Skeleton};
use sabaki_motion::lod::{Choice, LevelId, Levels, Order, SwitchSettings, Switching, View};

#[test]
fn a_full_blend_is_the_next_level() {
    for seed in 0..30 {
        let (skeleton, clip, levels) = random_levels(seed);
        for joints in frames_of(&skeleton, &clip).iter().step_by(5) {
            for level in (0..levels.levels.len() as u16 - 1).map(LevelId) {
                let blended = drawn(&levels, Choice { level, blend: 1.0 }, joints);
                let next = Choice {
                    level: LevelId(level.0 + 1),
                    blend: 0.0,
                };
                for (a, b) in blended.iter().zip(drawn(&levels, next, joints)) {
                    assert!(a.abs_diff_eq(b, 3e-5), "{a} {b}");
                }
            }
        }
        assert_eq!(levels.blend(LevelId(levels.levels.len() as u16 - 1)), None);
        assert_eq!(levels.blend(LevelId(levels.levels.len() as u16 + 5)), None);
    }
}

#[test]
fn the_screen_error_is_no_larger_than_allowed() {
    for seed in 0..20 {
        let (skeleton, clip, levels) = random_levels(seed);
        let frames = frames_of(&skeleton, &clip);
        let points = points_of(&skeleton, &frames, 0.05);
        for pixels in [0.3, 2.0, 20.0] {
            for blend_step in [None, Some(0.5)] {
                let settings = SwitchSettings {
                    rule: screen_error(pixels),
                    blend_step,
                    ..SwitchSettings::default()
                };
                let switching = Switching::new(&levels, &settings).unwrap();
                for step in 1..60 {
                    let distance = levels.reach + 0.02 * 1.18f32.powi(step);
                    let joints = &frames[step as usize % frames.len()];
                    let before = Some(LevelId((step as usize % levels.levels.len()) as u16));
                    let choice = switching.choose(distance, before);
                    let shown = drawn(&levels, choice, joints);
                    for (joint, points) in points.iter().enumerate() {
                        for &point in points {
                            let truth = joints[joint].point(point);
                            let at = shown[joint].transform_point3(point);
                            // No point of the body is nearer to the camera than this.
                            let near = distance - levels.reach;
                            let error = settings.view.pixels(at.distance(truth), near);
                            assert!(error <= pixels * 1.001 + 0.02, "{error} of {pixels} pixels");
                        }
                    }
                }
            }
        }
    }
}

/// A camera at the height of the root, which it looks at from `distance` away, from a side.
struct Camera {
    view: View,
    side: f32,
    distance: f32,
}

impl Camera {
    fn pixel(&self, root: Vec3, point: Vec3) -> Vec2 {
        let (sin, cos) = self.side.sin_cos();
        let from_root = point - root;
        let depth = self.distance - (from_root.x * sin + from_root.z * cos);
        let right = from_root.x * cos - from_root.z * sin;
        Vec2::new(right, from_root.y) * (self.view.pixels_at_one_metre() / depth)
    }
}

/// A camera that comes from far away and goes again at 5 m/s, 60 frames a second, while the clip plays: how many pixels a point
/// moves at most because something else is drawn than in the frame before would have been.
fn largest_step(
    skeleton: &Skeleton,
    clip: &Clip,
    levels: &Levels,
    settings: &SwitchSettings,
    side: f32,
) -> f32 {
    let frames = frames_of(skeleton, clip);
    let points = points_of(skeleton, &frames, 0.05);
    let switching = Switching::new(levels, settings).unwrap();
    let travel = 5.0 / 60.0;
    let (nearest, furthest) = (levels.reach + 0.5, switching.furthest() + 2.0 * travel);
    let steps = ((furthest - nearest) / travel).max(0.0) as usize;
    let mut before = switching.choose(furthest, None);
    let mut largest = 0.0f32;
    for step in 0..2 * steps {
        let distance = furthest - travel * step.min(2 * steps - step) as f32;
        let now = switching.choose(distance, Some(before.level));
        if now != before {
            let frame = (step as f64 / 60.0 * clip.frame_rate()) as usize % frames.len();
            let joints = &frames[frame];
            let camera = Camera {
                view: settings.view,
                side,
                distance,
            };
            let root = joints[0].translation;
            let (old, new) = (drawn(levels, before, joints), drawn(levels, now, joints));
            for (joint, points) in points.iter().enumerate() {
                for &point in points {
                    let old = camera.pixel(root, old[joint].transform_point3(point));
                    let new = camera.pixel(root, new[joint].transform_point3(point));
                    largest = largest.max(old.distance(new));
                }
            }
        }
        before = now;
    }
    largest
}

/// The largest steps with and without blending over clips, sides and rules.
fn nothing_jumps(skeleton: &Skeleton, clips: &[Clip], order: Order) {
    let levels = build(skeleton, clips, order);
    let (mut with, mut without) = (0.0f32, 0.0f32);
    for clip in clips {
        for settings in rules() {
            for side in [0.0, 2.0] {
                let step = |settings| largest_step(skeleton, clip, &levels, settings, side);
                with = with.max(step(&settings));
                without = without.max(step(&SwitchSettings {
                    blend_step: None,
                    ..settings
                }));
            }
        }
    }
    println!("{order:?}: {with:.2} pixels with blending, {without:.1} without");
    assert!(with < 1.0, "{with} pixels");
    assert!(without > 2.0, "{without} pixels");
}

#[test]
fn nothing_jumps_in_the_embedded_motions() {
    let motions = sabaki_fixtures::demo::motions().unwrap();
    let clips: Vec<Clip> = motions.clips.iter().step_by(4).cloned().collect();
    for order in [Order::Energy, Order::Error] {
        nothing_jumps(&motions.skeleton, &clips, order);
    }
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn nothing_jumps_in_captures() {
    let set = captures("fight");
    let clips: Vec<Clip> = set.clips.iter().step_by(6).cloned().collect();
    for order in [Order::Energy, Order::Error] {
        nothing_jumps(&set.skeleton, &clips, order);
    }
}

#[test]
fn nothing_jumps_on_random_skeletons() {
    for seed in 0..12 {
        let (skeleton, clip, levels) = random_levels(seed);
        for settings in rules() {
            let step = largest_step(&skeleton, &clip, &levels, &settings, seed as f32);
            assert!(step < 1.0, "seed {seed}: {step} pixels");
        }
    }
}
