//! Promise: on every map and every query of the embedded motions, and of real motion capture where
//! it is there, the device's stencil buffer and the CPU agree to the texel, and validation has
//! nothing to say.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use std::path::PathBuf;

use common::baked::embedded_graph;
use common::{device, finish};
use sabaki::avoid::cull::cpu;
use sabaki::avoid::{Query, QuerySettings};
use sabaki::demo::throw::{ThrowSettings, throw};
use sabaki::gpu::Headless;
use sabaki::gpu::stencil::{Culler, CullerDesc, Rasterizer, RasterizerDesc};
use sabaki::graph::{self, ClipSource, GraphSettings, MotionGraph};
use sabaki::io::{ReadOptions, read_clips};
use sabaki::region::{BakeSettings, Baker, Drawing, DrawnMaps, raster};

/// Draws everything that a bake and many queries draw, and counts everything that they count.
fn agree(device: &mut Headless, graph: MotionGraph) {
    let baker = Baker::new(graph, BakeSettings::default()).unwrap();
    let desc = RasterizerDesc {
        name: "bake",
        ..RasterizerDesc::default()
    };
    let mut rasterizer = device
        .make(|context, memory| Rasterizer::new(context, memory, &desc))
        .unwrap();
    let drawn = DrawnMaps {
        evasions: device
            .every_frame(&mut rasterizer, baker.evasion_drawings())
            .unwrap(),
        attacks: device
            .any_frame(&mut rasterizer, baker.attack_drawings())
            .unwrap(),
    };
    assert!(drawn.evasions.len() >= 8 * 5 && drawn.attacks.len() >= 10);
    assert!(
        drawn.attacks.iter().all(|map| map.count() > 0),
        "an attack that passes nowhere"
    );
    let expected = baker.draw_on_cpu();
    for (index, (device, cpu)) in drawn.evasions.iter().zip(&expected.evasions).enumerate() {
        assert_eq!(device, cpu, "evasion map {index}");
    }
    for (index, (device, cpu)) in drawn.attacks.iter().zip(&expected.attacks).enumerate() {
        assert_eq!(device, cpu, "attack map {index}");
    }
    let baked = baker.finish(drawn).unwrap();

    let desc = CullerDesc::new("cull", baked.atlas());
    let mut culler = device
        .make(|context, memory| Culler::new(context, memory, &desc))
        .unwrap();
    let (settings, mut context) = (QuerySettings::default(), QueryContext::default());
    let (mut body, mut evasion, mut attacks) = (0u64, 0u64, Vec::<Drawing>::new());
    for index in 0..60 {
        let throw = throw(&baked, &ThrowSettings::default(), 11, index).unwrap();
        let query = Query::new(&baked, &settings);
        let prepared = query.prepare(throw.playhead, &throw.attack, &mut context);
        let input = prepared.cull_input();
        let mut expected = Vec::new();
        cpu::count(&input, &mut expected);
        assert_eq!(
            device.cull(&mut culler, &input).unwrap(),
            expected,
            "attack {index}"
        );
        body += expected
            .iter()
            .map(|overlap| u64::from(overlap.body))
            .sum::<u64>();
        evasion += expected
            .iter()
            .map(|overlap| u64::from(overlap.evasion))
            .sum::<u64>();
        attacks.extend(input.attack.iter().map(|slab| slab.drawing.clone()));
    }
    assert!(
        body > 1000 && evasion > 1000,
        "hardly anything overlaps, so this shows nothing"
    );
    let drawn = device.any_frame(&mut rasterizer, &attacks).unwrap();
    for (drawing, map) in attacks.iter().zip(&drawn) {
        assert_eq!(*map, raster::any_frame(drawing));
    }
    let memory = device.memory().unwrap();
    rasterizer.destroy(memory);
    culler.destroy(memory);
}

#[test]
fn on_the_embedded_motions() {
    let mut device = device();
    agree(
        &mut device,
        embedded_graph(&GraphSettings {
            threshold: 0.06,
            ..GraphSettings::default()
        }),
    );
    finish(device);
}

#[test]
fn on_real_motion_capture() {
    let Some(folder) = std::env::var_os("SABAKI_MOCAP") else {
        println!("skipped: SABAKI_MOCAP names no folder with motion capture");
        return;
    };
    let fight = PathBuf::from(folder).join("fight");
    let set = read_clips(
        std::slice::from_ref(&fight),
        Some(&fight.join("events.json")),
        &ReadOptions::default(),
    )
    .unwrap();
    let source = ClipSource {
        skeleton: &set.skeleton,
        clips: &set.clips,
        events: &set.events,
    };
    let (graph, _) = graph::build(source, &GraphSettings::default()).unwrap();
    let mut device = device();
    agree(&mut device, graph);
    finish(device);
}
