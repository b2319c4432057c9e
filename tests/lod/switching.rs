//! Promise: levels change with distance as the settings say, and nothing on the screen jumps.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_testing as common;

use common::captures::captures;
use common::lod::{build, frames_of, points_of, random_levels, screen_error, setting_of};
use glam::{Affine3A, Quat, Vec2, Vec3};
use sabaki::anim::{Clip, ClipDesc, Joint, JointId, JointKind, JointTransform, Skeleton};
use sabaki::internal::affine;
use sabaki::lod::{
    Choice, Level, LevelId, LevelSettings, Levels, LodError, Measure, Order, Rule, SwitchSettings,
    Switching, View,
};

/// Energy to 60 m and errors of 1 pixel, with blending.
fn rules() -> [SwitchSettings; 2] {
    [Rule::Energy { furthest: 60.0 }, screen_error(1.0)].map(|rule| SwitchSettings {
        rule,
        ..SwitchSettings::default()
    })
}

#[test]
fn the_papers_distances_are_linear_in_energy() {
    for seed in 0..30 {
        let (_, _, levels) = random_levels(seed);
        let settings = SwitchSettings {
            rule: Rule::Energy { furthest: 50.0 },
            hysteresis: 0.0,
            blend_step: None,
            ..SwitchSettings::default()
        };
        let switching = Switching::new(&levels, &settings).unwrap();
        let last = levels.levels.len() - 1;
        let greatest = levels.levels.iter().map(|l| l.energy).fold(0.0, f32::max);
        let mut energy = 0.0f32;
        for (index, level) in levels.levels.iter().enumerate().skip(1) {
            energy = energy.max(level.energy);
            let share = if greatest > 0.0 {
                energy / greatest
            } else {
                0.0
            };
            let band = switching.bands()[index - 1];
            assert_eq!(band.end, 50.0 * share);
            assert_eq!((band.start, band.full), (band.end, band.end));
            let at = switching.choose(band.end, None);
            assert!(at.level.index() >= index && at.blend == 0.0);
            if band.end > 0.0 {
                assert!(switching.choose(band.end * 0.9999, None).level.index() < index);
            }
        }
        for distance in [50.0, 51.0, 1e9, f32::INFINITY] {
            let choice = switching.choose(distance, Some(LevelId(0)));
            assert_eq!(
                choice,
                Choice {
                    level: LevelId(last as u16),
                    blend: 0.0
                }
            );
        }
        if greatest > 0.0 {
            assert_eq!(switching.choose(-1.0, None).level, LevelId(0));
            assert_eq!(switching.choose(f32::NAN, None).level, LevelId(0));
        }
    }
}

#[test]
fn the_mean_error_asks_for_no_more_than_the_greatest() {
    for seed in 0..20 {
        let (_, _, levels) = random_levels(seed);
        let [mean, greatest] = [Measure::Mean, Measure::Greatest].map(|measure| {
            let settings = SwitchSettings {
                rule: Rule::ScreenError {
                    pixels: 2.0,
                    measure,
                },
                blend_step: None,
                ..SwitchSettings::default()
            };
            Switching::new(&levels, &settings).unwrap()
        });
        let mut worst = 0.0f32;
        for (index, level) in levels.levels.iter().enumerate().skip(1) {
            worst = worst.max(level.error.mean);
            let (mean, greatest) = (mean.bands()[index - 1], greatest.bands()[index - 1]);
            assert!(mean.end <= greatest.end);
            // Less is lost in the rounding of distances.
            if worst > 1e-4 {
                let view = View::default();
                let error = view.pixels(worst, mean.start - levels.reach);
                assert!(error <= 2.0 * 1.001, "{error}");
            }
        }
    }
}

#[test]
fn the_screen_is_that_of_a_pinhole() {
    let view = View::default();
    // 1080 lines for 2 tan 30° metres at one metre.
    let expected = 1080.0 / (2.0 / 3f32.sqrt());
    assert!((view.pixels_at_one_metre() - expected).abs() < 1e-2);
    assert!((view.pixels(1.7, view.distance(1.7, 20.0)) - 20.0).abs() < 1e-3);
}

#[test]
fn bands_follow_each_other_and_leave_room() {
    for seed in 0..40 {
        let (_, _, levels) = random_levels(seed);
        for settings in rules() {
            let switching = Switching::new(&levels, &settings).unwrap();
            assert_eq!(switching.bands().len(), levels.levels.len() - 1);
            let mut before = 0.0;
            for (band, level) in switching.bands().iter().zip(&levels.levels[1..]) {
                assert!(before <= band.start && band.start <= band.full && band.full <= band.end);
                before = band.end;
                if level.error.step > 1e-6 {
                    let width = band.full - band.start;
                    let near = settings
                        .view
                        .pixels(level.error.step, band.start - levels.reach);
                    let step = near * (5.0 / 60.0) / width;
                    assert!(step <= 0.5 * 1.002, "{step} pixels in {band:?}");
                }
            }
        }
    }
}

#[test]
fn the_blend_is_continuous_and_hysteresis_keeps_the_level() {
    for seed in 0..20 {
        let (_, _, levels) = random_levels(seed);
        for settings in rules() {
            let switching = Switching::new(&levels, &settings).unwrap();
            for (index, band) in switching.bands().iter().enumerate() {
                if band.full >= band.end {
                    continue;
                }
                let between = 0.5 * (band.full + band.end);
                let finer = switching.choose(between, Some(LevelId(index as u16)));
                let coarser = switching.choose(between, Some(LevelId(index as u16 + 1)));
                assert_eq!(
                    finer,
                    Choice {
                        level: LevelId(index as u16),
                        blend: 1.0
                    }
                );
                assert_eq!(coarser.level.index(), index + 1);
                assert_eq!(coarser.blend, 0.0);
            }
            // Whatever the level was, the same is seen.
            for step in 0..5000 {
                let distance = (switching.furthest() + 1.0) * step as f32 / 5000.0;
                let seen = |before| {
                    let choice = switching.choose(distance, before);
                    f32::from(choice.level.0) + choice.blend
                };
                for before in 0..levels.levels.len() as u16 {
                    assert_eq!(seen(Some(LevelId(before))), seen(None), "{distance} m");
                }
            }
        }
    }
}

/// The matrices of all joints of the full skeleton as drawn.
fn drawn(levels: &Levels, choice: Choice, joints: &[JointTransform]) -> Vec<Affine3A> {
    let level: &Level = &levels.levels[choice.level.index()];
    let mut matrices: Vec<Affine3A> = level
        .kept
        .iter()
        .map(|id| affine(&joints[id.index()]))
        .collect();
    if choice.blend > 0.0 {
        let blend = levels.blend(choice.level).unwrap();
        blend.apply(choice.blend, &mut matrices);
    }
    let seat = |seat: &sabaki::internal::Seated| {
        matrices[usize::from(seat.carrier)] * affine(&seat.offset)
    };
    level.seats.iter().map(seat).collect()
}

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

/// A character that a camera comes near to.
struct Approach<'a> {
    skeleton: &'a Skeleton,
    clip: &'a Clip,
    levels: &'a Levels,
}

impl Approach<'_> {
    /// A camera that comes from far away and goes again at 5 m/s, 60 frames a second, while the clip plays: how many pixels a point
    /// moves at most because something else is drawn than in the frame before would have been.
    fn largest_step(&self, settings: &SwitchSettings, side: f32) -> f32 {
        let &Self {
            skeleton,
            clip,
            levels,
        } = self;
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
}

fn without_blend(settings: &SwitchSettings) -> SwitchSettings {
    SwitchSettings {
        blend_step: None,
        ..*settings
    }
}

/// The largest steps with and without blending over clips, sides and rules, pixels.
fn steps_of(skeleton: &Skeleton, clips: &[Clip], order: Order) -> (f32, f32) {
    let levels = build(skeleton, clips, order);
    let (mut with, mut without) = (0.0f32, 0.0f32);
    for clip in clips {
        for settings in rules() {
            for side in [0.0, 2.0] {
                let case = Approach {
                    skeleton,
                    clip,
                    levels: &levels,
                };
                with = with.max(case.largest_step(&settings, side));
                without = without.max(case.largest_step(&without_blend(&settings), side));
            }
        }
    }
    (with, without)
}

#[test]
fn nothing_jumps_in_the_embedded_motions() {
    let motions = sabaki_app::demo::motions().unwrap();
    let clips: Vec<Clip> = motions.clips.iter().step_by(4).cloned().collect();
    for order in [Order::Energy, Order::Error] {
        let (with, without) = steps_of(&motions.skeleton, &clips, order);
        println!("{order:?}: {with:.2} pixels with blending, {without:.1} without");
        assert!(with < 1.0, "{with} pixels");
        assert!(without > 2.0, "{without} pixels");
    }
}

#[test]
fn nothing_jumps_in_captures() {
    let Some(set) = captures("fight") else {
        return;
    };
    let clips: Vec<Clip> = set.clips.iter().step_by(6).cloned().collect();
    for order in [Order::Energy, Order::Error] {
        let (with, without) = steps_of(&set.skeleton, &clips, order);
        println!("{order:?}: {with:.2} pixels with blending, {without:.1} without");
        assert!(with < 1.0, "{with} pixels");
        assert!(without > 2.0, "{without} pixels");
    }
}

#[test]
fn nothing_jumps_on_random_skeletons() {
    for seed in 0..12 {
        let (skeleton, clip, levels) = random_levels(seed);
        let case = Approach {
            skeleton: &skeleton,
            clip: &clip,
            levels: &levels,
        };
        for settings in rules() {
            let step = case.largest_step(&settings, seed as f32);
            assert!(step < 1.0, "seed {seed}: {step} pixels");
            // The library measures the same from the front.
            let at_once = without_blend(&settings);
            for settings in [settings, at_once] {
                let step = case.largest_step(&settings, 0.0);
                let found = levels.largest_step(&skeleton, &clip, &settings).unwrap();
                assert!(
                    (found - step).abs() <= 0.1 * step + 0.02,
                    "seed {seed}: {found} {step}"
                );
            }
        }
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

#[test]
fn settings_that_make_no_sense_are_errors() {
    let (_, _, levels) = random_levels(1);
    let fails = |change: &dyn Fn(&mut SwitchSettings)| {
        let mut settings = SwitchSettings::default();
        change(&mut settings);
        setting_of(Switching::new(&levels, &settings).unwrap_err())
    };
    for wrong in [0.0, -1.0, f32::NAN, f32::NEG_INFINITY] {
        assert_eq!(fails(&|s| s.view.fov = wrong), "fov");
        assert_eq!(fails(&|s| s.view.height = wrong), "height");
        assert_eq!(
            fails(&|s| s.rule = Rule::Energy { furthest: wrong }),
            "furthest"
        );
        assert_eq!(fails(&|s| s.rule = screen_error(wrong)), "pixels");
        assert_eq!(fails(&|s| s.blend_step = Some(wrong)), "blend_step");
        assert_eq!(fails(&|s| s.camera_speed = wrong), "camera_speed");
        assert_eq!(fails(&|s| s.frame_rate = wrong), "frame_rate");
    }
    for wrong in [-0.1, 1.0, f32::NAN] {
        assert_eq!(fails(&|s| s.hysteresis = wrong), "hysteresis");
    }
}

/// A chain of short bones that ends in a long one.
fn chain(joints: usize) -> Skeleton {
    let joint = |index: usize| Joint {
        name: format!("j{index}"),
        parent: index.checked_sub(1).map(|parent| JointId(parent as u16)),
        offset: Vec3::Y * if index == joints { 1.0 } else { 0.03 },
        kind: if index == joints {
            JointKind::EndSite
        } else {
            JointKind::Moving
        },
    };
    Skeleton::new((0..=joints).map(joint).collect()).unwrap()
}

/// A clip of a chain in which all joints swing by `angle` radians.
fn swinging(skeleton: &Skeleton, frames: usize, angle: f32) -> Clip {
    let turn = |at: usize| {
        let (frame, joint) = (at / skeleton.len(), at % skeleton.len());
        let is_end = joint + 1 == skeleton.len();
        let phase = 0.3 * frame as f32 + 0.1 * joint as f32;
        Quat::from_rotation_x(if is_end { 0.0 } else { angle * phase.sin() })
    };
    let desc = ClipDesc {
        name: "chain".into(),
        frame_rate: 30.0,
        roots: vec![Vec3::ZERO; frames],
        rotations: (0..frames * skeleton.len()).map(turn).collect(),
        translations: Vec::new(),
    };
    Clip::new(skeleton, desc).unwrap()
}

/// Without motion the errors are rounding, and the room that blending needs is less than the distance can show.
#[test]
fn a_chain_without_motion_has_finite_bands_and_is_measured() {
    for (joints, angle) in [(12, 0.0), (12, 1e-6), (12, 0.05), (100, 0.0), (300, 0.0)] {
        let skeleton = chain(joints);
        let clip = swinging(&skeleton, 20, angle);
        let levels = build(&skeleton, std::slice::from_ref(&clip), Order::Energy);
        for settings in rules() {
            let switching = Switching::new(&levels, &settings).unwrap();
            let mut before = 0.0;
            for band in switching.bands() {
                let [start, full, end] = [band.start, band.full, band.end];
                assert!(end.is_finite(), "{joints} joints: {band:?}");
                assert!(before <= start && start <= full && full <= end, "{band:?}");
                before = end;
            }
            let step = levels.largest_step(&skeleton, &clip, &settings).unwrap();
            assert!(step.is_finite() && step < 1.0, "{joints} joints: {step}");
        }
    }
}

/// However far away the coarsest level begins, the camera's way there is walked in bounded time.
#[test]
fn a_camera_that_comes_from_very_far_arrives() {
    let skeleton = chain(12);
    let clip = swinging(&skeleton, 20, 0.3);
    let levels = build(&skeleton, std::slice::from_ref(&clip), Order::Energy);
    for furthest in [1e4, 1e8, 1e20, 1e38] {
        let settings = SwitchSettings {
            rule: Rule::Energy { furthest },
            ..SwitchSettings::default()
        };
        let step = levels.largest_step(&skeleton, &clip, &settings).unwrap();
        assert!(step.is_finite(), "{furthest}: {step}");
    }
}

#[test]
fn skeletons_and_clips_that_would_take_hours_are_refused() {
    for (joints, frames) in [(1024, 2), (400, 30_000)] {
        let skeleton = chain(joints);
        let clip = swinging(&skeleton, frames, 0.0);
        let error = Levels::build(&skeleton, &[clip], &LevelSettings::default()).unwrap_err();
        let LodError::TooMuch {
            joints: of,
            frames: over,
            ..
        } = error
        else {
            panic!("{error}")
        };
        assert_eq!((of, over), (joints + 1, frames));
        let words = format!("{} joints in {frames} frames: 1024 joints", joints + 1);
        assert!(error.to_string().contains(&words), "{error}");
    }
}
