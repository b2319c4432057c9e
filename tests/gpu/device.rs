//! Promise: a component leaves the device as it found it, whether it was destroyed, or failed half
//! made; and what is missing is said by name.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_fixtures as common;

use std::ffi::c_void;

use common::cull::atlas;
use common::random::Random;
use common::{device, finish};
use sabaki::gpu::ash::{
    self,
    vk::{self, Handle},
};
use sabaki::gpu::{
    Block, Context, ContextDesc, Culler, CullerDesc, Features, GpuError, Memory, MemoryDesc,
    Rasterizer, RasterizerDesc, check, raw_device, raw_instance, requirements,
};
use sabaki::maps::MapGrid;
use sabaki::query::cull::CullPath;
use sabaki_fixtures::headless::Headless;

/// Runs out after some allocations.
struct Scarce<'a> {
    memory: &'a mut dyn Memory,
    left: u32,
    live: u32,
}

impl Memory for Scarce<'_> {
    fn allocate(&mut self, desc: &MemoryDesc<'_>) -> Result<Block, GpuError> {
        if self.left == 0 {
            return Err(GpuError::Memory {
                name: desc.name.to_owned(),
                reason: "scarce".to_owned(),
            });
        }
        let block = self.memory.allocate(desc)?;
        (self.left, self.live) = (self.left - 1, self.live + 1);
        Ok(block)
    }

    fn free(&mut self, block: Block) {
        self.live -= 1;
        self.memory.free(block);
    }
}

/// Makes something with ever more memory until it succeeds; returns how often it failed.
fn starve<T>(
    device: &mut Headless,
    make: impl Fn(&Context, &mut dyn Memory) -> Result<T, GpuError>,
    destroy: impl Fn(T, &mut dyn Memory),
) -> u32 {
    device
        .make(|context, memory| {
            for left in 0..100 {
                let mut scarce = Scarce {
                    memory,
                    left,
                    live: 0,
                };
                match make(context, &mut scarce) {
                    Ok(made) => {
                        assert_eq!(scarce.live, left);
                        destroy(made, &mut scarce);
                        assert_eq!(scarce.live, 0);
                        return Ok(left);
                    }
                    Err(GpuError::Memory { reason, .. }) => assert_eq!(reason, "scarce"),
                    Err(other) => panic!("{other}"),
                }
                assert_eq!(scarce.live, 0, "after failure {left}");
            }
            panic!("it never succeeds");
        })
        .unwrap()
}

#[test]
fn a_failed_creation_leaves_nothing_behind() {
    let mut device = device();
    let atlas = atlas(&mut Random::new(1), MapGrid::PAPER, 3);
    let desc = RasterizerDesc::default();
    let failures = starve(
        &mut device,
        |context, memory| Rasterizer::new(context, memory, &desc),
        |made, memory| made.destroy(memory),
    );
    assert_eq!(failures, 3);
    let failures = starve(
        &mut device,
        |context, memory| Culler::new(context, memory, &CullerDesc::new(CullPath::Stencil, &atlas)),
        |made, memory| made.destroy(memory),
    );
    // The maps, the target, the instances, and the counts of each slot.
    assert_eq!(failures, 5);
    assert_eq!(device.memory().unwrap().live_blocks(), 0);
    // Validation names whatever is left when the device goes.
    finish(device);
}

#[test]
fn raw_handles_make_the_same_context() {
    let device = device();
    let context = device.context().unwrap();
    // SAFETY: the loader's own lookup function and the headless device's handles; the entry
    // outlives the call.
    let raw = unsafe {
        let entry = ash::Entry::load().unwrap();
        let lookup = entry.static_fn().get_instance_proc_addr as *const c_void;
        assert!(raw_instance(lookup, 0).is_err() && raw_instance(std::ptr::null(), 1).is_err());
        let instance = raw_instance(lookup, context.instance().handle().as_raw()).unwrap();
        assert!(raw_device(&instance, 0).is_err());
        Context::new(&ContextDesc {
            instance: &instance,
            physical_device: context.physical_device(),
            device: &raw_device(&instance, context.device().handle().as_raw()).unwrap(),
            queue_family: context.queue_family(),
            features: Features::ALL,
            debug_utils: true,
            api_version: vk::API_VERSION_1_3,
        })
    }
    .unwrap();
    assert_eq!(raw.stencil_format(), context.stencil_format());
    assert_eq!(raw.max_target_side(), context.max_target_side());
    finish(device);
}

#[test]
fn the_report_knows_every_requirement() {
    let device = device();
    let context = device.context().unwrap();
    // SAFETY: both handles are of the headless device.
    let report = unsafe {
        check(
            context.instance(),
            context.physical_device(),
            vk::API_VERSION_1_3,
        )
    };
    assert!(report.is_usable());
    assert_eq!(report.stencil_format, Some(context.stencil_format()));
    assert_eq!(report, *context.report());
    assert!(report.stencil.runs() && report.stencil.counts_exact && report.compute.counts_exact);
    let required = requirements().iter().take_while(|one| one.is_required());
    let optional = requirements().iter().filter(|one| !one.is_required());
    assert_eq!(required.count() + optional.count(), requirements().len());
    finish(device);
}
