//! The search in bands finds what a naive look at the whole map finds, for any bands and instruction sets, and what it finds
//! can be stored.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_testing as common;

use common::captures::{captures, source_of};
use common::clips::{small_skeleton, swinging_clip};
use sabaki::anim::Clip;
use sabaki::graph::{self, ClipSource, GraphSettings};
use sabaki::internal::{
    DistanceMap, GraphBuilder, MapBand, Minimum, PointCloud, SearchSettings, Windows,
};
use sabaki::math::Isa;

const SETTINGS: SearchSettings = SearchSettings {
    window: 10,
    separation: 10,
    threshold: 0.6,
};

fn windows(frames: usize, seed: f32) -> Windows {
    let skeleton = small_skeleton();
    let clip = swinging_clip(&skeleton, frames, seed);
    Windows::new(
        &PointCloud::new(&skeleton, &clip, &[1.0; 9]),
        SETTINGS.window,
    )
}

/// The minima of a map, straight from the definition.
fn naive([a, b]: [&Windows; 2], own: bool) -> Vec<Minimum> {
    let mut map: Vec<Vec<f32>> = Vec::new();
    DistanceMap::new(a, b).for_each_row(|_, row| map.push(row.to_vec()));
    let near = |i: usize, of: usize| i.saturating_sub(1)..(i + 2).min(of);
    let mut found = Vec::new();
    for (i, row) in map.iter().enumerate() {
        for (j, &value) in row.iter().enumerate() {
            let around = near(i, map.len()).flat_map(|i| near(j, row.len()).map(move |j| (i, j)));
            let least = around.map(|(i, j)| map[i][j]).fold(f32::INFINITY, f32::min);
            let apart = !own || j >= i + SETTINGS.separation;
            if apart && value <= least && value < SETTINGS.threshold * SETTINGS.threshold {
                found.push(Minimum {
                    a: i as u32,
                    b: j as u32,
                    distance: value.sqrt(),
                });
            }
        }
    }
    found
}

fn band(rows: std::ops::Range<usize>, [a, b]: [usize; 2], columns: usize) -> MapBand {
    MapBand {
        a,
        b,
        first: rows.start,
        rows: rows.len(),
        columns,
    }
}

#[test]
fn any_bands_find_what_the_whole_map_has() {
    let (a, b) = (windows(157, 0.4), windows(203, 1.9));
    for (windows, clips) in [([&a, &b], [0, 1]), ([&b, &a], [0, 1]), ([&b, &b], [1, 1])] {
        let (rows, columns) = (windows[0].count(), windows[1].count());
        let expected = naive(windows, clips[0] == clips[1]);
        assert!(!expected.is_empty());
        for height in [1, 7, 10, 64, 65, rows] {
            for isa in Isa::available() {
                let mut found = Vec::new();
                for first in (0..rows).step_by(height) {
                    let band = band(first..(first + height).min(rows), clips, columns);
                    let minima = SETTINGS.minima(band, windows, isa).unwrap();
                    assert!(band.admits(&minima, &SETTINGS));
                    found.extend(minima);
                }
                assert_eq!(found, expected, "bands of {height} rows, {isa:?}");
            }
        }
    }
}

#[test]
fn bands_cover_every_window_pair_once() {
    let frames = [2500, 5, 1033, 10];
    let bands: Vec<MapBand> = SETTINGS.bands(&frames).collect();
    let count = |frames: usize| (frames + 1).saturating_sub(SETTINGS.window);
    for a in 0..frames.len() {
        for b in a..frames.len() {
            let mut next = 0;
            for band in bands.iter().filter(|band| (band.a, band.b) == (a, b)) {
                assert_eq!((band.first, band.columns), (next, count(frames[b])));
                assert!(band.rows > 0);
                next += band.rows;
            }
            let rows = if count(frames[b]) == 0 {
                0
            } else {
                count(frames[a])
            };
            assert_eq!(next, rows, "map {a}, {b}");
        }
    }
    assert!(
        bands
            .iter()
            .filter(|band| (band.a, band.b) == (0, 0))
            .count()
            > 1
    );
}

#[test]
fn minima_outside_their_band_are_not_admitted() {
    let band = band(10..20, [0, 1], 30);
    let minimum = |a, b, distance| [Minimum { a, b, distance }];
    assert!(band.admits(&minimum(19, 29, 0.1), &SETTINGS));
    for wrong in [
        minimum(9, 3, 0.1),
        minimum(20, 3, 0.1),
        minimum(12, 30, 0.1),
        minimum(12, 3, f32::NAN),
        minimum(12, 3, -0.1),
        minimum(12, 3, 0.7),
    ] {
        assert!(!band.admits(&wrong, &SETTINGS), "{wrong:?}");
    }
}

/// Searches the bands in reverse order, from points and minima that were stored, and builds the graph from them.
fn built_in_bands(
    source: ClipSource<'_>,
    settings: &GraphSettings,
) -> (graph::MotionGraph, graph::BuildReport) {
    let builder = GraphBuilder::new(source, settings).unwrap();
    let search = builder.search();
    let stored: Vec<Vec<u8>> = builder
        .clouds()
        .iter()
        .map(|cloud| postcard::to_stdvec(cloud).unwrap())
        .collect();
    let bands: Vec<MapBand> = builder.bands().collect();
    let mut found: Vec<Vec<u8>> = bands
        .iter()
        .rev()
        .map(|&band| {
            let windows = [band.a, band.b].map(|clip| {
                let cloud: PointCloud = postcard::from_bytes(&stored[clip]).unwrap();
                assert!(cloud.is_sound());
                Windows::new(&cloud, search.window)
            });
            let minima = search.minima(band, [&windows[0], &windows[1]], Isa::Portable);
            postcard::to_stdvec(&minima.unwrap()).unwrap()
        })
        .collect();
    found.reverse();
    let mut list = builder.transition_list();
    for (&band, minima) in bands.iter().zip(&found) {
        let minima: Vec<Minimum> = postcard::from_bytes(minima).unwrap();
        list.add(band, &minima).unwrap();
    }
    builder.build(list).unwrap()
}

#[test]
fn a_graph_from_stored_minima_is_the_graph_of_one_build() {
    let skeleton = small_skeleton();
    let clips: Vec<Clip> = [(1400, 0.3), (90, 1.1), (120, 2.0)]
        .map(|(frames, seed)| swinging_clip(&skeleton, frames, seed))
        .into();
    let source = ClipSource {
        skeleton: &skeleton,
        clips: &clips,
        events: &[],
    };
    let settings = GraphSettings::default();
    assert_eq!(
        built_in_bands(source, &settings),
        graph::build(source, &settings).unwrap()
    );
}

#[test]
fn captures_in_bands_give_the_graph_of_one_build() {
    let Some(set) = captures("fight") else { return };
    let source = ClipSource {
        clips: &set.clips[..8],
        events: &[],
        ..source_of(&set)
    };
    let settings = GraphSettings::default();
    assert_eq!(
        built_in_bands(source, &settings),
        graph::build(source, &settings).unwrap()
    );
}
