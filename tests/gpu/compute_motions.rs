//! Promise: on every query of the embedded motions, and of real motion capture where it is there,
//! the compute path and the CPU agree to the texel, and validation has nothing to say.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_fixtures as common;

use common::baked::embedded;
use common::captures::fight;
use common::{device, finish};
use sabaki::gpu::{Culler, CullerDesc};
use sabaki::maps::{BakedGraph, MapGrid};
use sabaki::query::cull::{CullPath, cpu};
use sabaki::query::{Enumerate, Query, QueryContext, QuerySettings};
use sabaki_fixtures::throw::{ThrowSettings, throw};

/// Counts everything that many queries count.
fn agree(baked: &BakedGraph) {
    let mut device = device();
    let desc = CullerDesc::new(CullPath::Compute, baked.atlas());
    let mut culler = device
        .make(|context, memory| Culler::new(context, memory, &desc))
        .unwrap();
    let settings = QuerySettings {
        enumerate: Enumerate::Whole,
        ..QuerySettings::default()
    };
    let (mut context, mut expected) = (QueryContext::default(), Vec::new());
    let (mut body, mut outer, mut evasion) = (0u64, 0u64, 0u64);
    for index in 0..60 {
        let throw = throw(baked, &ThrowSettings::default(), 11, index).unwrap();
        let query = Query::new(baked, &settings);
        let mut session = query.start(throw.request(), &mut context);
        session.draw_outer_maps();
        let input = session.cull_input();
        cpu::count(&input, &mut expected);
        let counts = device.cull(&mut culler, &input).unwrap();
        assert_eq!(counts, expected, "attack {index}");
        for one in &expected {
            body += u64::from(one.body);
            outer += u64::from(one.outer);
            evasion += u64::from(one.evasion);
        }
    }
    assert!(
        body > 1000 && outer > 1000 && evasion > 1000,
        "hardly anything overlaps, so this shows nothing"
    );
    culler.destroy(device.memory().unwrap());
    finish(device);
}

#[test]
fn on_the_embedded_motions() {
    agree(embedded());
}

#[test]
fn on_the_embedded_motions_with_the_papers_maps() {
    agree(&embedded().with_maps(MapGrid::PAPER).unwrap());
}

#[test]
fn on_the_embedded_motions_with_two_words_a_mask() {
    let maps = MapGrid {
        slices: 64,
        slice_seconds: 1.0 / 60.0,
        ..MapGrid::default()
    };
    agree(&embedded().with_maps(maps).unwrap());
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn on_real_motion_capture() {
    let baked = fight();
    agree(baked);
}
