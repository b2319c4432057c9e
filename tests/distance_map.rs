//! The sliding-window distance map equals the distance that its definition gives, window pair by
//! window pair.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use common::clips::{small_skeleton, swinging_clip};
use glam::Vec3;
use proptest::prelude::*;
use sabaki::graph::distance::WindowPair;
use sabaki::graph::{PointCloud, distance};
use sabaki::math::Rigid2;

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
    distance::for_each_row(&a, &b, WINDOW, |i, row| {
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
    distance::for_each_row(&a, &b, WINDOW, |i, row| {
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
    distance::for_each_row(&cloud(9), &cloud(20), WINDOW, |_, _| {
        panic!("a row of a clip without windows")
    });
    distance::for_each_row(&cloud(20), &cloud(9), WINDOW, |_, _| {
        panic!("a row without windows")
    });
}
