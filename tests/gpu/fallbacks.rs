//! Promise: whatever optional thing a device lacks, its answers are the same; what it lacks is said by name, with what is
//! done instead.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_fixtures as common;

use common::cull::{CullCase, atlas, culler, drifting, sliced};
use common::random::Random;
use common::{device_on, finish};
use sabaki::gpu::ash::vk;
use sabaki::gpu::{CullerDesc, Rasterizer, RasterizerDesc, Terms, check, requirements};
use sabaki::maps::{MapGrid, MapRect, raster};
use sabaki::query::cull::{CullPath, Overlap, cpu};
use sabaki_fixtures::headless::Headless;

/// Terms that do without all that is optional.
const LEAST: Terms = Terms {
    api_version: vk::API_VERSION_1_3,
    without_precise_queries: true,
    without_s8: true,
    without_d24_s8: true,
    without_generous_limits: true,
};

/// Runs all components on a device of these terms, and holds them against the CPU's.
fn all_agree(terms: Terms) {
    let mut device = device_on(terms);
    for grid in [MapGrid::PAPER, sliced(32)] {
        let mut random = Random::new(7);
        let atlas = atlas(&mut random, grid, 12);
        let mut stencil = culler(&mut device, &CullerDesc::new(CullPath::Stencil, &atlas));
        let mut compute = culler(&mut device, &CullerDesc::new(CullPath::Compute, &atlas));
        for _ in 0..4 {
            let case = CullCase::any(&mut random, &atlas, 60);
            let input = case.input(&atlas);
            let mut expected = Vec::new();
            cpu::count(&input, &mut expected);
            let counts = device.cull(&mut compute, &input).unwrap();
            assert_eq!(counts, expected, "compute: {terms:?}");
            let counts = device.cull(&mut stencil, &input).unwrap();
            let precise = device.context().unwrap().features().precise_queries;
            assert_eq!(precise, !terms.without_precise_queries);
            for (found, expected) in counts.iter().zip(&expected) {
                let (found, expected) = match precise {
                    true => (*found, *expected),
                    false => (any_of(found), any_of(expected)),
                };
                assert_eq!(found, expected, "stencil: {terms:?}");
            }
        }
        stencil.destroy(device.memory().unwrap());
        compute.destroy(device.memory().unwrap());
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
    let rect = MapRect {
        u: -30,
        v: 12,
        width: 70,
        height: 51,
    };
    let drawings: Vec<_> = (1..30)
        .map(|frames| drifting(&mut random, rect, frames, 4))
        .collect();
    let desc = RasterizerDesc::default();
    let mut rasterizer = device
        .make(|context, memory| Rasterizer::new(context, memory, &desc))
        .unwrap();
    let maps = device.every_frame(&mut rasterizer, &drawings).unwrap();
    for (drawing, maps) in drawings.iter().zip(&maps) {
        assert_eq!(*maps, raster::every_frame(drawing));
    }
    rasterizer.destroy(device.memory().unwrap());
}

#[test]
fn without_precise_queries() {
    all_agree(Terms {
        without_precise_queries: true,
        ..Terms::default()
    });
}

#[test]
fn within_the_limits_that_vulkan_guarantees() {
    let terms = Terms {
        without_generous_limits: true,
        ..Terms::default()
    };
    let device = device_on(terms);
    let limits = device.context().unwrap().limits();
    assert_eq!(limits.max_push_constants_size, 128);
    assert_eq!(limits.max_viewports, 1);
    assert_eq!(limits.max_image_array_layers, 256);
    assert_eq!(limits.max_storage_buffer_range, 1 << 27);
    assert_eq!(device.context().unwrap().max_target_side(), 4096);
    finish(device);
    all_agree(terms);
}

#[test]
fn on_older_vulkan_with_extensions() {
    for api_version in [vk::API_VERSION_1_1, vk::API_VERSION_1_2] {
        all_agree(Terms {
            api_version,
            ..Terms::default()
        });
    }
}

#[test]
fn without_all_of_them_at_once() {
    let terms = Terms {
        api_version: vk::API_VERSION_1_1,
        ..LEAST
    };
    all_agree(terms);
}

#[test]
fn the_report_says_what_is_done_instead() {
    let device = device_on(Terms::default());
    let context = device.context().unwrap();
    let report = |terms: Terms| {
        // SAFETY: both handles are of the headless device, whose instance knows these versions.
        unsafe { check(context.instance(), context.physical_device(), &terms) }
    };
    let lacks = |terms: Terms| -> Vec<&str> {
        let fallbacks = report(terms).fallbacks;
        fallbacks.iter().map(|one| one.name).collect()
    };
    assert!(lacks(Terms::default()).is_empty());
    assert_eq!(lacks(LEAST), ["S8_UINT", "occlusionQueryPrecise"]);
    let format = |without_s8, without_d24_s8| {
        let terms = Terms {
            without_s8,
            without_d24_s8,
            ..Terms::default()
        };
        report(terms).stencil_format.unwrap()
    };
    assert_eq!(format(false, false), vk::Format::S8_UINT);
    assert_eq!(format(false, true), vk::Format::S8_UINT);
    assert_eq!(format(true, false), vk::Format::D24_UNORM_S8_UINT);
    assert_eq!(format(true, true), vk::Format::D32_SFLOAT_S8_UINT);

    let version = |api_version| Terms {
        api_version,
        ..Terms::default()
    };
    for (api_version, extensions) in [
        (vk::API_VERSION_1_1, 5),
        (vk::API_VERSION_1_2, 3),
        (vk::API_VERSION_1_3, 0),
    ] {
        let report = report(version(api_version));
        assert!(report.is_usable(), "{report:?}");
        assert_eq!(report.extensions.len(), extensions);
    }
    assert_eq!(lacks(version(vk::API_VERSION_1_2)), ["Vulkan 1.3"]);
    let ancient = report(version(vk::API_VERSION_1_0));
    assert_eq!(
        ancient.stencil.lacks,
        ["Vulkan 1.1", "dynamicRendering", "extendedDynamicState"]
    );
    assert_eq!(ancient.compute.lacks, ["Vulkan 1.1"]);
    assert!(ancient.extensions.is_empty(), "{ancient:?}");
    let known: Vec<_> = requirements().iter().map(|one| one.name).collect();
    assert!(ancient.missing().iter().all(|name| known.contains(name)));
    finish(device);
}
