//! Promise: on every map and every query of the embedded motions and of real motion capture, the device's stencil buffer, its
//! compute path and the CPU agree to the texel, and validation has nothing to say.

use sabaki::gpu::{Culler, CullerDesc, RasterizerDesc};
use sabaki::maps::{BakeSettings, BakedGraph, Baker, Drawing, MapGrid};
use sabaki::query::cull::CullPath;
use sabaki::query::{Enumerate, Query, QueryContext, QuerySettings};
use sabaki_fixtures::cull::counted;
use sabaki_fixtures::headless::Headless;
use sabaki_fixtures::throw::throws;
use sabaki_fixtures::with;
use sabaki_fixtures::{device, finish};

use super::raster;

on_both!(maps_and_counts_agree);

/// Draws everything that a bake and many queries draw on the paper's maps, and counts everything
/// that they count; counts the same on maps of slices.
fn maps_and_counts_agree(baked: &BakedGraph) {
    let mut device = device();
    let by_all_paths = |device: &mut Headless, baked: &BakedGraph| {
        counts_agree(device, baked, CullPath::Compute, Enumerate::Whole);
        counts_agree(device, baked, CullPath::Stencil, Enumerate::default())
    };
    // Masks of one word, and of two.
    by_all_paths(&mut device, baked);
    let many = with(|s: &mut MapGrid| (s.slices, s.slice_seconds) = (64, 1.0 / 60.0));
    by_all_paths(&mut device, &baked.with_maps(many).unwrap());
    let settings = with(|s: &mut BakeSettings| s.maps = MapGrid::PAPER);
    let baker = Baker::new(baked.graph().clone(), settings).unwrap();
    let drawn = device.draw_maps(&baker).unwrap();
    assert!(drawn == baker.draw_on_cpu(), "other maps than the CPU's");
    assert!(drawn.every_frame.len() >= 8 * 5 && drawn.any_frame.len() >= 8 * 5 + 10);
    // Each attack passes somewhere.
    assert!(drawn.any_frame.iter().all(|map| map.count() > 0));
    let attacks = by_all_paths(&mut device, &baker.finish(drawn).unwrap());
    raster::agree(&mut device, RasterizerDesc::default().side, &attacks);
    finish(device);
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
    let settings = with(|s: &mut QuerySettings| s.enumerate = enumerate);
    let mut context = QueryContext::default();
    let (mut body, mut outer, mut evasion) = (0u64, 0u64, 0u64);
    let mut attacks = Vec::new();
    for (index, throw) in throws(baked, 11, 24).enumerate() {
        let query = Query::new(baked, &settings);
        let mut session = query.start(throw.request(), &mut context);
        session.draw_outer_maps();
        let input = session.cull_input();
        let expected = counted(&input);
        let counts = device.cull(&mut culler, &input).unwrap();
        assert_eq!(counts, expected, "{path}, attack {index}");
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
        body.min(outer).min(evasion) > 1000,
        "{body} {outer} {evasion}"
    );
    culler.destroy(device.memory().unwrap());
    attacks
}
