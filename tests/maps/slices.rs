//! Inner maps lie within the body during a whole slice of time, and outer maps contain everything
//! that the body touches in it.

use glam::Vec3;
use sabaki::maps::{
    BakeError, BakeSettings, BakedGraph, BodyTrack, MapGrid, RegionId, Section, Slab,
};
use sabaki_fixtures::random::Random;
use sabaki_fixtures::small::small;
use sabaki_fixtures::with;

fn bake(maps: MapGrid, threads: usize) -> BakedGraph {
    let settings = with(|s: &mut BakeSettings| (s.maps, s.threads) = (maps, threads));
    sabaki_fixtures::baked::bake(small().graph().clone(), settings)
}

#[test]
fn a_graph_with_other_maps_is_the_graph_that_is_baked_with_them() {
    let baked = bake(MapGrid::default(), 1);
    let slabs = with(|s: &mut MapGrid| s.slab_height = 0.2);
    for maps in [MapGrid::PAPER, slabs, MapGrid::default()] {
        let other = baked.with_maps(maps).unwrap();
        assert!(other == bake(maps, 1), "{maps:?}");
        assert_eq!(other == baked, maps == MapGrid::default());
    }
    let none = with(|s: &mut MapGrid| s.slab_height = 0.0);
    assert!(matches!(baked.with_maps(none), Err(BakeError::Grid(_))));
}

/// The body's spheres at any time on its track.
fn spheres(baked: &BakedGraph, track: &BodyTrack, time: f32) -> Vec<(Vec3, f32)> {
    let tick = ((time * BodyTrack::RATE) as usize).min(track.ticks() - 2);
    let share = time * BodyTrack::RATE - tick as f32;
    let centre = |tick, index| track.centre(tick, index);
    let place = |index| centre(tick, index).lerp(centre(tick + 1, index), share);
    let body = baked.body().spheres.iter().enumerate();
    body.map(|(index, sphere)| (place(index), sphere.radius))
        .collect()
}

fn share(random: &mut Random) -> f32 {
    random.below(1 << 20) as f32 / (1 << 20) as f32
}

/// Moments of every slice, its ends included, and points of the body or near it.
fn check(grid: MapGrid) {
    let baked = bake(grid, 1);
    let evasion = baked.evasions()[0];
    let seconds = grid.seconds() + 0.1;
    let playhead = evasion.playhead();
    let track = BodyTrack::along(baked.graph(), baked.body(), playhead, seconds);
    let mut random = Random::new(5);
    let (mut inside, mut certain) = (0, 0);
    for round in 0..grid.slices * 40 {
        let slice = round % grid.slices;
        let within = [0.0, 1.0, share(&mut random)][random.below(3)];
        let now = spheres(&baked, &track, (slice as f32 + within) * grid.slice_seconds);
        let touched = |point: Vec3| {
            let reaches = |&(centre, radius): &(Vec3, f32)| centre.distance(point) <= radius;
            now.iter().any(reaches)
        };
        for _ in 0..40 {
            let (centre, radius) = now[random.below(now.len())];
            let offset = Vec3::from([(); 3].map(|()| 2.0 * share(&mut random) - 1.0));
            let mut point = centre + 1.3 * radius * offset;
            let slab = Slab((point.y / grid.slab_height).floor() as i32);
            let texel = |place: f32| (place / grid.texel).floor() as i32;
            let (u, v) = (texel(point.x), texel(point.z));
            let maps = baked.atlas().maps(RegionId(0), slab);
            if touched(point) {
                inside += 1;
                let outer = &maps.unwrap().outer;
                // Wherever the centre of the attack's texel lies that the point is in.
                let [u, v] = [point.x, point.z].map(|place| {
                    let half = 0.5 * grid.texel;
                    let aside = [-1.0, 1.0, 2.0 * share(&mut random) - 1.0][random.below(3)];
                    texel(place + half * aside)
                });
                let mask = outer.get(u - outer.rect().u, v - outer.rect().v);
                let is_set = mask >> slice & 1 == 1;
                assert!(is_set, "{point} in slice {slice} is not in the outer map");
            }
            let Some(body) = maps.map(|maps| &maps.body) else {
                continue;
            };
            let mask = body.get(u - body.rect().u, v - body.rect().v);
            if grid.section == Section::Plane && mask >> slice & 1 == 1 {
                // Any point of the texel, at the plane's height.
                certain += 1;
                point.y = (slab.0 as f32 + 0.5) * grid.slab_height;
                let is_in = touched(point);
                assert!(is_in, "{point} in slice {slice} is not in the body");
            }
        }
    }
    assert!(inside > 1000, "{inside}");
    assert!(grid.section != Section::Plane || certain > 300, "{certain}");
}

#[test]
fn inner_maps_lie_within_the_body_and_outer_maps_around_it() {
    check(MapGrid::default());
    check(MapGrid {
        texel: 0.01,
        slab_height: 0.08,
        slices: 50,
        slice_seconds: 0.017,
        ..MapGrid::default()
    });
    check(MapGrid {
        slices: 8,
        slice_seconds: 0.1,
        section: Section::Outline,
        ..MapGrid::PAPER
    });
}
