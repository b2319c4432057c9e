//! The sliding-window distance map equals a naive computation of every pair of windows.

use glam::Vec3;
use proptest::prelude::*;
use sabaki::graph::search::{DistanceMap, PointCloud, WindowPair, Windows};
use sabaki::math::{Isa, Rigid2};
use sabaki_fixtures::captures::captures;
use sabaki_fixtures::clips::{small_skeleton, swinging_clip};

const WINDOW: usize = 10;

/// The weighted mean of squared distances once the second window is moved by `moved`, straight from
/// the definition.
fn mean_square(a: &PointCloud, i: usize, b: &PointCloud, j: usize, moved: Rigid2) -> f64 {
    let mut sum = 0.0;
    for frame in 0..WINDOW {
        for joint in 0..a.joints() {
            let p = a.point(joint, i + frame) + a.centre();
            let q = moved.point(b.point(joint, j + frame) + b.centre());
            sum += f64::from(a.weight(joint)) * f64::from((p - q).length_squared());
        }
    }
    sum / WINDOW as f64
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

fn clouds(seeds: (f32, f32), weights: &[f32]) -> (PointCloud, PointCloud) {
    let skeleton = small_skeleton();
    let cloud =
        |frames, seed| PointCloud::new(&skeleton, &swinging_clip(&skeleton, frames, seed), weights);
    (cloud(40, seeds.0), cloud(33, seeds.1))
}

#[test]
fn every_pair_of_windows_equals_the_definition() {
    let weights = [1.0, 0.5, 0.2, 2.0, 0.3, 1.0, 1.0, 0.7, 1.4];
    let (a, b) = clouds((0.3, 2.2), &weights);
    let mut rows = 0;
    for_each_row(&a, &b, |i, row| {
        assert_eq!((i, row.len()), (rows, b.frames() + 1 - WINDOW));
        rows += 1;
        for (j, &distance) in row.iter().enumerate() {
            let expected = mean_square(&a, i, &b, j, pair(&a, i, &b, j).alignment());
            let error = (f64::from(distance) - expected).abs();
            assert!(
                error < 2e-5 * (1.0 + expected),
                "window {i}, {j}: {distance} instead of {expected}"
            );
        }
    });
    assert_eq!(rows, a.frames() + 1 - WINDOW);
}

proptest! {
    /// The closed form's transform is the best: none beside it does better.
    #[test]
    fn no_other_alignment_is_closer(
        seeds in (0.0f32..6.0, 0.0f32..6.0),
        (i, j) in (0usize..30, 0usize..23),
        (turn, x, z) in (-0.3f32..0.3, -0.2f32..0.2, -0.2f32..0.2),
    ) {
        let (a, b) = clouds(seeds, &[1.0; 9]);
        let best = pair(&a, i, &b, j).alignment();
        // Turned about the window itself, not about a far origin.
        let pivot = best.point(b.centre());
        let about = Rigid2::new(turn, pivot.x + x, pivot.z + z) * Rigid2::new(0.0, -pivot.x, -pivot.z);
        let (least, other) = (mean_square(&a, i, &b, j, best), mean_square(&a, i, &b, j, about * best));
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
    let copy = sabaki::anim::Clip::new(&skeleton, desc).unwrap();
    let weights = [1.0; 9];
    let (a, b) = (
        PointCloud::new(&skeleton, &clip, &weights),
        PointCloud::new(&skeleton, &copy, &weights),
    );
    for_each_row(&a, &b, |i, row| {
        assert!(row[i] < 1e-5, "window {i}: {}", row[i])
    });
    let back = pair(&a, 5, &b, 5).alignment() * moved;
    assert!(back.point(Vec3::X).distance(Vec3::X) < 1e-3);
}

#[test]
fn clips_shorter_than_the_window_have_no_rows() {
    let skeleton = small_skeleton();
    let cloud =
        |frames| PointCloud::new(&skeleton, &swinging_clip(&skeleton, frames, 0.0), &[1.0; 9]);
    for_each_row(&cloud(9), &cloud(20), |_, _| {
        panic!("a row of a clip without windows")
    });
    for_each_row(&cloud(20), &cloud(9), |_, _| {
        panic!("a row without windows")
    });
}

/// Whatever the window, however the frames fall into tiles and blocks, with joints that count for
/// nothing: the sums of the map are those of each pair of windows alone, on every instruction set.
#[test]
fn any_window_any_length_any_instruction_set() {
    let skeleton = small_skeleton();
    let weights = [1.0, 0.0, 0.2, 2.0, 0.0, 1.0, 1.0, 0.7, 1.4];
    let cloud = |frames, seed| {
        PointCloud::new(&skeleton, &swinging_clip(&skeleton, frames, seed), &weights)
    };
    for frames in [1, 3, 4, 10, 13, 40] {
        for (length_a, length_b) in [(40, 40), (41, 47), (64, 48), (55, 49), (97, 63), (13, 17)] {
            let (a, b) = (cloud(length_a, 0.3), cloud(length_b, 2.2));
            let [windows_a, windows_b] = [&a, &b].map(|cloud| Windows::new(cloud, frames));
            assert_eq!(windows_a.count(), (length_a + 1).saturating_sub(frames));
            let map = DistanceMap::new(&windows_a, &windows_b);
            let mut plain = Vec::new();
            map.with_isa(Isa::Portable).for_each_row(|i, row| {
                for (j, &found) in row.iter().enumerate() {
                    let pair = WindowPair {
                        frames,
                        ..pair(&a, i, &b, j)
                    };
                    let expected = pair.distance().powi(2);
                    let error = (found - expected).abs();
                    assert!(
                        error < 2e-6 * (1.0 + expected),
                        "{frames}, {i}, {j}: {found}, {expected}"
                    );
                }
                plain.push(row.to_vec());
            });
            assert_eq!(
                plain.len() * windows_b.count(),
                windows_a.count() * windows_b.count()
            );
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
                let best = pair(a, i, b, j).alignment();
                let expected = mean_square(a, i, b, j, best);
                let error = (f64::from(found) - expected).abs();
                assert!(
                    error < 2e-5 * (1.0 + expected),
                    "window {i}, {j}: {found}, {expected}"
                );
                compared += 1;
            }
        });
    }
    assert!(compared > 1000);
}
