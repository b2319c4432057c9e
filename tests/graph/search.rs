//! The search in bands finds what a naive look at the whole map finds, for any bands and instruction sets.

use sabaki::anim::{Clip, Skeleton};
use sabaki::graph::Unwatched;
use sabaki::graph::search::{
    BandMinima, DistanceMap, MapBand, Minimum, PointCloud, PrunedSearch, SearchScratch,
    SearchSettings, Windows,
};
use sabaki::math::Isa;
use sabaki_fixtures::captures::captures;
use sabaki_fixtures::clips::{small_skeleton, swinging_clip};

const SETTINGS: SearchSettings = SearchSettings {
    window: 10,
    separation: 10,
    threshold: 0.6,
};

fn windows(frames: usize, seed: f32) -> Windows {
    let skeleton = small_skeleton();
    let clip = swinging_clip(&skeleton, frames, seed);
    windows_of(&skeleton, &clip, &[1.0; 9], SETTINGS.window)
}

fn windows_of(skeleton: &Skeleton, clip: &Clip, weights: &[f32], window: usize) -> Windows {
    Windows::new(&PointCloud::new(skeleton, clip, weights), window)
}

/// The minima of a map, straight from the definition.
fn naive(settings: SearchSettings, [a, b]: [&Windows; 2], own: bool, isa: Isa) -> Vec<Minimum> {
    let mut map: Vec<Vec<f32>> = Vec::new();
    let distances = DistanceMap::new(a, b).with_isa(isa);
    distances.for_each_row(|_, row| map.push(row.to_vec()));
    let near = |i: usize, of: usize| i.saturating_sub(1)..(i + 2).min(of);
    let mut found = Vec::new();
    for (i, row) in map.iter().enumerate() {
        let first = if own { i + settings.separation } else { 0 };
        for (j, &value) in row.iter().enumerate().skip(first) {
            let is_near = value < settings.threshold * settings.threshold;
            let around =
                || near(i, map.len()).flat_map(|i| near(j, row.len()).map(move |j| (i, j)));
            if is_near && around().all(|(i, j)| map[i][j] >= value) {
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
    let own = bands.iter().filter(|band| (band.a, band.b) == (0, 0));
    assert!(own.count() > 1);
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

/// Searches bands of some heights, compares them with the whole map, and returns the share of the distances that were computed.
fn compare(settings: SearchSettings, windows: &[Windows], heights: &[usize]) -> f64 {
    let all: Vec<&Windows> = windows.iter().collect();
    let (mut computed, mut pairs, mut most) = (0, 0, 0);
    let mut scratch = SearchScratch::default();
    for isa in Isa::available() {
        let search = PrunedSearch::new(settings, all.clone(), 2).with_isa(isa);
        for a in 0..windows.len() {
            for b in a..windows.len() {
                let expected = naive(settings, [&windows[a], &windows[b]], a == b, isa);
                most = most.max(expected.len());
                let (rows, columns) = (windows[a].count(), windows[b].count());
                for &height in heights {
                    let mut found = Vec::new();
                    for first in (0..rows).step_by(height) {
                        let band = band(first..(first + height).min(rows), [a, b], columns);
                        let pruned = search.minima(band, &mut scratch).unwrap();
                        assert!(band.admits(&pruned.minima, &settings));
                        found.extend(pruned.minima);
                        computed += pruned.computed;
                        pairs += band.pairs();
                    }
                    assert!(found == expected, "{a} and {b}, {height} rows, {isa:?}");
                }
            }
        }
    }
    assert!(most > 0);
    computed as f64 / pairs as f64
}

#[test]
fn bounds_lose_no_minimum() {
    let windows = [(157, 0.4), (203, 1.9), (10, 0.4), (75, 0.5), (9, 1.0)]
        .map(|(frames, seed)| windows(frames, seed));
    for threshold in [0.05, 0.6, 100.0] {
        for separation in [1, 2, 10] {
            let settings = SearchSettings {
                threshold,
                separation,
                ..SETTINGS
            };
            compare(settings, &windows, &[1, 7, 64, 65, 1000]);
        }
    }
}

#[test]
fn bounds_hold_for_windows_of_any_length_and_weight() {
    let skeleton = small_skeleton();
    let weights = [0.0, 3.0, 0.0, 1e-3, 0.0, 1.0, 0.0, 0.0, 0.2];
    for window in [1, 2, 3, 25] {
        let clips = [(90, 0.2), (70, 0.25), (66, 4.0)].map(|(frames, seed)| {
            let clip = swinging_clip(&skeleton, frames, seed);
            windows_of(&skeleton, &clip, &weights, window)
        });
        let settings = SearchSettings {
            window,
            separation: 5,
            threshold: 0.3,
        };
        compare(settings, &clips, &[13, 128]);
    }
}

#[test]
fn bounds_hold_for_still_motion_and_far_from_the_origin() {
    let skeleton = small_skeleton();
    let clip = |still: bool, scale: f32| {
        let clip = swinging_clip(&skeleton, 100, 0.7);
        let mut desc = clip.desc().clone();
        if still {
            let root = desc.roots[0];
            desc.roots.fill(root);
            let first = desc.rotations[..9].to_vec();
            desc.rotations = first.repeat(100);
        }
        for root in &mut desc.roots {
            *root *= scale;
        }
        let clip = Clip::new(&skeleton, desc).unwrap();
        windows_of(&skeleton, &clip, &[1.0; 9], SETTINGS.window)
    };
    let all = [(true, 1.0), (false, 1.0), (false, 40.0), (true, 900.0)]
        .map(|(still, scale)| clip(still, scale));
    compare(SETTINGS, &all, &[33, 64]);
}

#[test]
fn bands_that_are_searched_together_keep_their_minima() {
    // More windows than are searched as one block.
    let frames: Vec<usize> = (0..25).map(|clip| 100 + 13 * (clip % 7)).collect();
    let clips = frames.iter().enumerate();
    let windows: Vec<Windows> = clips
        .map(|(clip, &frames)| windows(frames, 0.1 * clip as f32))
        .collect();
    assert!(windows.iter().map(Windows::count).sum::<usize>() > 3000);
    let bands: Vec<MapBand> = SETTINGS.bands(&frames).collect();
    let search = PrunedSearch::new(SETTINGS, windows.iter().collect(), 2);
    let mut scratch = SearchScratch::default();
    let mut single = |band: &MapBand| search.minima(*band, &mut scratch).unwrap();
    let expected: Vec<_> = bands.iter().map(|band| single(band).minima).collect();
    assert!(expected.iter().filter(|minima| !minima.is_empty()).count() > 100);
    for threads in [1, 2, 3] {
        let (mut searched, mut found) = (Vec::new(), Vec::new());
        let take = |band, minima: BandMinima| {
            searched.push(band);
            found.push(minima.minima);
            Ok(())
        };
        let all = bands.iter().copied();
        search.search(all, threads, &Unwatched, take).unwrap();
        assert!(searched == bands && found == expected, "{threads} threads");
    }
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn captures_need_few_of_all_distances() {
    let set = captures("fight");
    let weights = vec![1.0; set.skeleton.len()];
    let windows = set.clips.iter().step_by(5).map(|clip| {
        let clip = clip.resampled(30.0).unwrap();
        windows_of(&set.skeleton, &clip, &weights, SETTINGS.window)
    });
    let windows: Vec<_> = windows.collect();
    let mut settings = SETTINGS;
    settings.threshold = 0.1;
    let share = compare(settings, &windows, &[64, 1024]);
    assert!(share < 0.2, "{share}");
}
