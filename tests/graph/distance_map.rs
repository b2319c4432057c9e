//! The sliding-window distance map equals a naive computation of every pair of windows.

use glam::Vec3;
use proptest::prelude::*;
use sabaki::anim::Clip;
use sabaki::graph::search::{DistanceMap, PointCloud, WindowPair, Windows};
use sabaki::math::{Isa, Rigid2};
use sabaki_fixtures::captures::captures;
use sabaki_fixtures::clips::{small_skeleton, swinging_clip};

const WINDOW: usize = 10;

/// The weighted mean of squared distances once the second window is moved by `moved`, straight from
/// the definition.
fn mean_square(pair: &WindowPair<'_>, moved: Rigid2) -> f64 {
    let WindowPair { a, b, frames, .. } = *pair;
    let mut sum = 0.0;
    for frame in 0..frames {
        for joint in 0..a.joints() {
            let p = a.point(joint, pair.start_a + frame) + a.centre();
            let q = moved.point(b.point(joint, pair.start_b + frame) + b.centre());
            sum += f64::from(a.weight(joint)) * f64::from((p - q).length_squared());
        }
    }
    sum / frames as f64
}

/// Asserts that a distance of the map is that of the definition, after the best alignment.
fn assert_defined(distance: f32, pair: &WindowPair<'_>) {
    let expected = mean_square(pair, pair.alignment());
    let error = (f64::from(distance) - expected).abs();
    let at = [pair.frames, pair.start_a, pair.start_b];
    assert!(error < 2e-5 * (1.0 + expected), "{at:?}: {distance}");
}

fn for_each_row(a: &PointCloud, b: &PointCloud, row: impl FnMut(usize, &[f32])) {
    let [a, b] = [a, b].map(|cloud| Windows::new(cloud, WINDOW));
    DistanceMap::new(&a, &b).for_each_row(row);
}

fn pair<'a>(a: &'a PointCloud, i: usize, b: &'a PointCloud, j: usize) -> WindowPair<'a> {
    WindowPair {
        a,
        start_a: i,
        b,
        start_b: j,
        frames: WINDOW,
    }
}

fn cloud(frames: usize, seed: f32, weights: &[f32]) -> PointCloud {
    let skeleton = small_skeleton();
    PointCloud::new(&skeleton, &swinging_clip(&skeleton, frames, seed), weights)
}

proptest! {
    /// The closed form's transform is the best: none beside it does better.
    #[test]
    fn no_other_alignment_is_closer(
        seeds in (0.0f32..6.0, 0.0f32..6.0),
        (i, j) in (0usize..30, 0usize..23),
        (turn, x, z) in (-0.3f32..0.3, -0.2f32..0.2, -0.2f32..0.2),
    ) {
        let (a, b) = (cloud(40, seeds.0, &[1.0; 9]), cloud(33, seeds.1, &[1.0; 9]));
        let pair = pair(&a, i, &b, j);
        let best = pair.alignment();
        // Turned about the window itself, not about a far origin.
        let pivot = best.point(b.centre());
        let about = Rigid2::new(turn, pivot.x + x, pivot.z + z) * Rigid2::new(0.0, -pivot.x, -pivot.z);
        let (least, other) = (mean_square(&pair, best), mean_square(&pair, about * best));
        prop_assert!(least <= other + 1e-6, "{} is further than {}", least, other);
    }
}

#[test]
fn a_moved_and_turned_copy_has_no_distance() {
    let skeleton = small_skeleton();
    let clip = swinging_clip(&skeleton, 40, 1.0);
    let moved = Rigid2::new(2.0, 3.0, -1.0);
    let mut desc = clip.desc().clone();
    desc.roots
        .iter_mut()
        .for_each(|root| *root = moved.point(*root));
    desc.rotations
        .iter_mut()
        .step_by(skeleton.len())
        .for_each(|root| *root = moved.rotation() * *root);
    let copy = Clip::new(&skeleton, desc).unwrap();
    let [a, b] = [&clip, &copy].map(|clip| PointCloud::new(&skeleton, clip, &[1.0; 9]));
    for_each_row(&a, &b, |i, row| {
        assert!(row[i] < 1e-5, "window {i}: {}", row[i])
    });
    let back = pair(&a, 5, &b, 5).alignment() * moved;
    assert!(back.point(Vec3::X).distance(Vec3::X) < 1e-3);
}

/// Whatever the window, however the frames fall into tiles and blocks, with joints that count for
/// nothing, with clips that are shorter than the window: the map is that of each pair of windows alone, on every instruction set.
#[test]
fn any_window_any_length_any_instruction_set() {
    let weights = [1.0, 0.0, 0.2, 2.0, 0.0, 1.0, 1.0, 0.7, 1.4];
    let lengths = [
        (40, 33),
        (41, 47),
        (64, 48),
        (55, 49),
        (97, 63),
        (13, 17),
        (9, 20),
        (20, 9),
    ];
    for frames in [1, 3, 4, WINDOW, 13, 40] {
        for (length_a, length_b) in lengths {
            let (a, b) = (
                cloud(length_a, 0.3, &weights),
                cloud(length_b, 2.2, &weights),
            );
            let [windows_a, windows_b] = [&a, &b].map(|cloud| Windows::new(cloud, frames));
            assert_eq!(windows_a.count(), (length_a + 1).saturating_sub(frames));
            let map = DistanceMap::new(&windows_a, &windows_b);
            let mut plain = Vec::new();
            map.with_isa(Isa::Portable).for_each_row(|i, row| {
                assert_eq!((i, row.len()), (plain.len(), windows_b.count()));
                for (j, &found) in row.iter().enumerate() {
                    let mut pair = pair(&a, i, &b, j);
                    pair.frames = frames;
                    let expected = pair.distance().powi(2);
                    let error = (found - expected).abs();
                    assert!(
                        error < 2e-6 * (1.0 + expected),
                        "{frames}, {i}, {j}: {found}"
                    );
                    assert_defined(found, &pair);
                }
                plain.push(row.to_vec());
            });
            let rows = if windows_b.count() > 0 {
                windows_a.count()
            } else {
                0
            };
            assert_eq!(plain.len(), rows);
            for isa in Isa::available() {
                let mut rows = 0;
                map.with_isa(isa).for_each_row(|i, row| {
                    assert_eq!(row, plain[i], "{isa:?}, window {i} of {frames} frames");
                    rows += 1;
                });
                assert_eq!(rows, plain.len());
            }
        }
    }
}

/// On real motion: the closest windows of a long clip far from where it began, too.
#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn real_motion_capture_equals_the_definition() {
    let set = captures("fight");
    let weights = vec![1.0; set.skeleton.len()];
    let clouds: Vec<PointCloud> = set
        .clips
        .iter()
        .map(|clip| PointCloud::new(&set.skeleton, &clip.resampled(30.0).unwrap(), &weights))
        .collect();
    let mut compared = 0;
    for (a, b) in clouds.iter().step_by(5).zip(clouds.iter().rev().step_by(3)) {
        for_each_row(a, b, |i, row| {
            for (j, &found) in row.iter().enumerate().step_by(7) {
                assert_defined(found, &pair(a, i, b, j));
                compared += 1;
            }
        });
    }
    assert!(compared > 1000);
}
