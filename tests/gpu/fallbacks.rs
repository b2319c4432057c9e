//! Promise: whatever optional thing a device lacks, its answers are the same; what it lacks is said by name, with what is
//! done instead.

use sabaki::gpu::ash::vk;
use sabaki::gpu::{RasterizerDesc, check, requirements};
use sabaki::maps::MapGrid;
use sabaki::query::cull::Overlap;
use sabaki_fixtures::cull::{CullCase, atlas, counted, drifting, map_rect, sliced};
use sabaki_fixtures::headless::Headless;
use sabaki_fixtures::random::Random;
use sabaki_fixtures::shim::{self, Hidden};
use sabaki_fixtures::with;
use sabaki_fixtures::{device_without, finish};

use super::{destroy, each_culler};

const CURRENT: u32 = vk::API_VERSION_1_3;
const S8: vk::Format = vk::Format::S8_UINT;
const D24_S8: vk::Format = vk::Format::D24_UNORM_S8_UINT;
const D32_S8: vk::Format = vk::Format::D32_SFLOAT_S8_UINT;

/// All that is optional.
const OPTIONAL: Hidden = Hidden {
    formats: &[S8, D24_S8],
    precise_queries: true,
    generous_limits: true,
    queues: vk::QueueFlags::empty(),
    driver: None,
};

fn without(formats: &'static [vk::Format]) -> Hidden {
    with(|s: &mut Hidden| s.formats = formats)
}

/// Runs all components on a device without what is hidden, and holds them against the CPU's.
fn all_agree(hidden: Hidden, api_version: u32) {
    let mut device = device_without(hidden, api_version);
    for grid in [MapGrid::PAPER, sliced(32)] {
        let mut random = Random::new(7);
        let atlas = atlas(&mut random, grid, 12);
        let mut cullers = each_culler(&mut device, &atlas, 1);
        for _ in 0..4 {
            let case = CullCase::any(&mut random, &atlas, 60);
            let input = case.input(&atlas);
            let expected = counted(&input);
            let [(_, stencil), (_, compute)] = &mut cullers;
            let counts = device.cull(compute, &input).unwrap();
            assert_eq!(counts, expected, "compute: {hidden:?}");
            let counts = device.cull(stencil, &input).unwrap();
            let precise = device.context().unwrap().features().precise_queries;
            assert_eq!(precise, !hidden.precise_queries);
            for (found, expected) in counts.iter().zip(&expected) {
                let (found, expected) = match precise {
                    true => (*found, *expected),
                    false => (any_of(found), any_of(expected)),
                };
                assert_eq!(found, expected, "stencil: {hidden:?}");
            }
        }
        destroy(&mut device, cullers);
    }
    maps_agree(&mut device);
    assert_eq!(device.memory().unwrap().live_blocks(), 0);
    finish(device);
}

/// What is left of counts where a query only says whether there is any; evasion overlaps are then counted by the CPU.
fn any_of(overlap: &Overlap) -> Overlap {
    Overlap {
        body: overlap.body.min(1),
        outer: overlap.outer.min(1),
        evasion: overlap.evasion,
    }
}

fn maps_agree(device: &mut Headless) {
    let mut random = Random::new(8);
    let rect = map_rect(-30, 12, 70, 51);
    let drawings: Vec<_> = (1..30)
        .map(|frames| drifting(&mut random, rect, frames, 4))
        .collect();
    super::raster::agree(device, RasterizerDesc::default().side, &drawings);
}

#[test]
fn what_is_missing_changes_no_answer() {
    let queries = with(|s: &mut Hidden| s.precise_queries = true);
    let limits = with(|s: &mut Hidden| s.generous_limits = true);
    all_agree(queries, CURRENT);
    all_agree(limits, CURRENT);
    all_agree(Hidden::default(), vk::API_VERSION_1_1);
    all_agree(Hidden::default(), vk::API_VERSION_1_2);
    all_agree(without(&[S8]), CURRENT);
    all_agree(without(&[S8, D24_S8]), CURRENT);
    all_agree(OPTIONAL, vk::API_VERSION_1_1);
    let device = device_without(limits, CURRENT);
    let limits = device.context().unwrap().limits();
    assert_eq!(limits.max_storage_buffer_range, 1 << 27);
    assert_eq!(limits.max_compute_work_group_count[0], 65_535);
    assert_eq!(device.context().unwrap().max_target_side(), 4096);
    finish(device);
}

#[test]
fn the_report_says_what_is_done_instead() {
    let device = device_without(Hidden::default(), CURRENT);
    let context = device.context().unwrap();
    let report = |hidden: Hidden, api_version| {
        shim::hide(hidden);
        // SAFETY: both handles are of the headless device, whose instance knows these versions.
        let report = unsafe { check(context.instance(), context.physical_device(), api_version) };
        shim::hide(Hidden::default());
        report
    };
    let lacks = |hidden: Hidden, api_version| -> Vec<&str> {
        let fallbacks = report(hidden, api_version).fallbacks;
        fallbacks.iter().map(|one| one.name).collect()
    };
    let nothing = Hidden::default();
    assert!(lacks(nothing, CURRENT).is_empty());
    let whole = report(nothing, CURRENT);
    assert_eq!(whole, *context.report());
    assert!(whole.stencil.counts_exact && whole.compute.counts_exact);
    let optional = ["S8_UINT", "occlusionQueryPrecise"];
    assert_eq!(lacks(OPTIONAL, CURRENT), optional);
    let format = |formats: &'static [_]| report(without(formats), CURRENT).stencil_format;
    assert_eq!(format(&[]), Some(S8));
    assert_eq!(format(&[D24_S8]), Some(S8));
    assert_eq!(format(&[S8]), Some(D24_S8));
    assert_eq!(format(&[S8, D24_S8]), Some(D32_S8));
    assert_eq!(format(&[S8, D24_S8, D32_S8]), None);

    for (api_version, extensions) in [
        (vk::API_VERSION_1_1, 5),
        (vk::API_VERSION_1_2, 3),
        (vk::API_VERSION_1_3, 0),
    ] {
        let report = report(nothing, api_version);
        assert!(report.is_usable(), "{report:?}");
        assert_eq!(report.extensions.len(), extensions);
    }
    assert_eq!(lacks(nothing, vk::API_VERSION_1_2), ["Vulkan 1.3"]);
    let ancient = report(nothing, vk::API_VERSION_1_0);
    let needed = ["Vulkan 1.1", "dynamicRendering", "extendedDynamicState"];
    assert_eq!(ancient.stencil.lacks, needed);
    assert_eq!(ancient.compute.lacks, ["Vulkan 1.1"]);
    assert!(ancient.extensions.is_empty(), "{ancient:?}");
    let known: Vec<_> = requirements().iter().map(|one| one.name).collect();
    assert!(ancient.missing().iter().all(|name| known.contains(name)));
    finish(device);
}
