//! Promise: recording and polling a cull allocates nothing, from the second cull on.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_fixtures as common;
use sabaki_fixtures::memory as counting;

use common::cull_cases::Way;
use common::maps::{attack_of, untimed};
use common::{Random, desc, drifting};
use counting::allocations;
use sabaki::gpu::{Culler, CullerDesc};
use sabaki::internal::CullCandidate;
use sabaki::maps::{FixedTransform2, MapGrid, MapRect, RegionAtlas, RegionId, RegionMaps, Slab};
use sabaki::math::Rigid2;
use sabaki::query::cull::CullInput;
use sabaki_fixtures::headless::{Headless, HeadlessDesc};

#[test]
fn a_cull_allocates_nothing() {
    // Without validation, which allocates for itself on this thread's behalf.
    let mut device = Headless::new(&HeadlessDesc {
        validation: false,
        ..desc()
    })
    .unwrap();
    let mut random = Random(1);
    let rect = MapRect {
        u: -20,
        v: -20,
        width: 60,
        height: 50,
    };
    let region = RegionMaps {
        first_slab: Slab(0),
        slabs: (0..4)
            .map(|_| untimed(&drifting(&mut random, rect, 5, 4)))
            .collect(),
        seconds: 1.0,
    };
    let atlas = RegionAtlas::new(MapGrid::PAPER, vec![region], Vec::new());
    let attack = attack_of((0..3).map(|slab| (Slab(slab), drifting(&mut random, rect, 5, 4))));
    let candidates: Vec<_> = (0..100)
        .map(|index| CullCandidate {
            region: RegionId(0),
            clock: 0,
            open: false,
            transform: FixedTransform2::new(
                Rigid2::new(index as f32, 0.1, 0.0),
                rect,
                MapGrid::PAPER,
            ),
        })
        .collect();
    let input = CullInput {
        atlas: &atlas,
        attack: &attack,
        candidates: &candidates,
    };
    for way in [Way::STENCIL, Way::ATOMICS] {
        culls_allocate_nothing(&mut device, &way.desc(&atlas), &input);
    }
    assert!(device.destroy().is_empty());
}

fn culls_allocate_nothing(device: &mut Headless, desc: &CullerDesc<'_>, input: &CullInput<'_>) {
    let mut culler = device
        .make(|context, memory| Culler::new(context, memory, desc))
        .unwrap();
    let mut overlaps = Vec::new();
    for cull in 0..4 {
        let (ticket, recording) = device
            .run(|cmd| {
                let before = allocations();
                // SAFETY: `run` gives a buffer that is being recorded, and has waited for the cull
                // before.
                let ticket = unsafe { culler.record(cmd, 0, input) }?;
                Ok((ticket, allocations() - before))
            })
            .unwrap();
        let before = allocations();
        assert!(culler.poll(ticket, &mut overlaps).unwrap());
        let polling = allocations() - before;
        if cull > 0 {
            assert_eq!((recording, polling), (0, 0), "cull {cull}");
        }
    }
    culler.destroy(device.memory().unwrap());
}
