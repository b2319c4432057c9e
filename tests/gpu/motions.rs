//! Promise: on every map and every query of the embedded motions and of real motion capture, the device's stencil buffer, its
//! compute path and the CPU agree to the texel, and validation has nothing to say.

use sabaki::gpu::{Culler, CullerDesc, Rasterizer, RasterizerDesc};
use sabaki::maps::{BakeSettings, BakedGraph, Baker, Drawing, DrawnMaps, MapGrid, raster};
use sabaki::query::cull::{CullPath, cpu};
use sabaki::query::{Enumerate, Query, QueryContext, QuerySettings};
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::captures::fight;
use sabaki_fixtures::headless::Headless;
use sabaki_fixtures::throw::{ThrowSettings, throw};
use sabaki_fixtures::{device, finish};

/// Draws what a bake asks for on the device, and holds it against the CPU's.
fn draw(device: &mut Headless, rasterizer: &mut Rasterizer, baker: &Baker) -> DrawnMaps {
    let drawn = DrawnMaps {
        every_frame: device
            .every_frame(rasterizer, baker.every_frame_drawings())
            .unwrap(),
        any_frame: device
            .any_frame(rasterizer, baker.any_frame_drawings())
            .unwrap(),
    };
    let expected = baker.draw_on_cpu();
    let every = drawn.every_frame.iter().zip(&expected.every_frame);
    for (index, (device, cpu)) in every.enumerate() {
        assert_eq!(device, cpu, "map {index} of every frame");
    }
    for (index, (device, cpu)) in drawn.any_frame.iter().zip(&expected.any_frame).enumerate() {
        assert_eq!(device, cpu, "map {index} of any frame");
    }
    drawn
}

/// Draws everything that a bake and many queries draw on the paper's maps, and counts everything
/// that they count; counts the same on maps of slices.
fn agree(device: &mut Headless, baked: &BakedGraph) {
    let by_all_paths = |device: &mut Headless, baked: &BakedGraph| {
        counts_agree(device, baked, CullPath::Compute, Enumerate::Whole);
        counts_agree(device, baked, CullPath::Stencil, Enumerate::default())
    };
    let mut maps = MapGrid::default();
    for (slices, slice_seconds) in [(8, maps.slice_seconds), (64, 1.0 / 60.0)] {
        (maps.slices, maps.slice_seconds) = (slices, slice_seconds);
        by_all_paths(device, &baked.with_maps(maps).unwrap());
    }
    by_all_paths(device, baked);
    let settings = BakeSettings {
        maps: MapGrid::PAPER,
        ..BakeSettings::default()
    };
    let baker = Baker::new(baked.graph().clone(), settings).unwrap();
    let desc = RasterizerDesc {
        name: "bake",
        ..RasterizerDesc::default()
    };
    let mut rasterizer = device
        .make(|context, memory| Rasterizer::new(context, memory, &desc))
        .unwrap();
    let drawn = draw(device, &mut rasterizer, &baker);
    assert!(drawn.every_frame.len() >= 8 * 5 && drawn.any_frame.len() >= 8 * 5 + 10);
    assert!(
        drawn.any_frame.iter().all(|map| map.count() > 0),
        "an attack that passes nowhere"
    );
    let attacks = by_all_paths(device, &baker.finish(drawn).unwrap());
    let drawn = device.any_frame(&mut rasterizer, &attacks).unwrap();
    for (drawing, map) in attacks.iter().zip(&drawn) {
        assert_eq!(*map, raster::any_frame(drawing));
    }
    rasterizer.destroy(device.memory().unwrap());
}

/// Counts what many queries count; returns the attacks' inner maps as drawings.
fn counts_agree(
    device: &mut Headless,
    baked: &BakedGraph,
    path: CullPath,
    enumerate: Enumerate,
) -> Vec<Drawing> {
    let desc = CullerDesc::new(path, baked.atlas());
    let mut culler = device
        .make(|context, memory| Culler::new(context, memory, &desc))
        .unwrap();
    let settings = QuerySettings {
        enumerate,
        ..QuerySettings::default()
    };
    let mut context = QueryContext::default();
    let (mut body, mut outer, mut evasion) = (0u64, 0u64, 0u64);
    let mut attacks = Vec::new();
    for index in 0..24 {
        let throw = throw(baked, &ThrowSettings::default(), 11, index).unwrap();
        let query = Query::new(baked, &settings);
        let mut session = query.start(throw.request(), &mut context);
        session.draw_outer_maps();
        let input = session.cull_input();
        let mut expected = Vec::new();
        cpu::count(&input, &mut expected);
        assert_eq!(
            device.cull(&mut culler, &input).unwrap(),
            expected,
            "{path}, attack {index}"
        );
        for overlap in &expected {
            body += u64::from(overlap.body);
            outer += u64::from(overlap.outer);
            evasion += u64::from(overlap.evasion);
        }
        attacks.extend(input.attack.layers.iter().map(|layer| {
            let [inner, _] = input.attack.discs_of(layer);
            Drawing {
                rect: input.attack.rect,
                discs: inner.iter().map(|timed| timed.disc).collect(),
                frame_ends: vec![inner.len() as u32],
            }
        }));
    }
    assert!(
        body > 1000 && outer > 1000 && evasion > 1000,
        "hardly anything overlaps, so this shows nothing: {body} {outer} {evasion}"
    );
    culler.destroy(device.memory().unwrap());
    attacks
}

/// Of the many little maps of slices of time some, on the device as on the CPU.
#[test]
fn slices_of_time_are_drawn_alike() {
    let mut device = device();
    let settings = BakeSettings {
        maps: MapGrid {
            slab_height: 0.05,
            slices: 32,
            slice_seconds: 1.0 / 30.0,
            ..MapGrid::default()
        },
        ..BakeSettings::default()
    };
    let baker = Baker::new(embedded().graph().clone(), settings).unwrap();
    let desc = RasterizerDesc {
        name: "slices",
        ..RasterizerDesc::default()
    };
    let mut rasterizer = device
        .make(|context, memory| Rasterizer::new(context, memory, &desc))
        .unwrap();
    let some = |drawings: &[Drawing]| -> Vec<Drawing> {
        drawings.iter().step_by(61).take(400).cloned().collect()
    };
    let (every, any) = (
        some(baker.every_frame_drawings()),
        some(baker.any_frame_drawings()),
    );
    assert!(every.len() > 200 && any.len() > 200);
    let drawn = device.every_frame(&mut rasterizer, &every).unwrap();
    for (drawing, maps) in every.iter().zip(&drawn) {
        assert_eq!(*maps, raster::every_frame(drawing));
    }
    assert!(drawn.iter().filter(|maps| maps.body.count() > 0).count() > 50);
    let drawn = device.any_frame(&mut rasterizer, &any).unwrap();
    for (drawing, map) in any.iter().zip(&drawn) {
        assert_eq!(*map, raster::any_frame(drawing));
    }
    rasterizer.destroy(device.memory().unwrap());
    finish(device);
}

#[test]
fn on_the_embedded_motions() {
    let mut device = device();
    agree(&mut device, embedded());
    finish(device);
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn on_real_motion_capture() {
    let baked = fight();
    let mut device = device();
    agree(&mut device, baked);
    finish(device);
}
