//! Promise: each path runs on a device that has what it needs, and what a queue or a device lacks is said by name.

use std::ffi::c_void;

use sabaki_fixtures::shim::{self, Hidden};
use sabaki_fixtures::with;

use super::shimmed_device;
use sabaki::gpu::ash::{
    self,
    vk::{self, Handle},
};
use sabaki::gpu::{
    Context, ContextDesc, Culler, CullerDesc, Features, GpuError, raw_device, raw_instance,
};
use sabaki::maps::MapGrid;
use sabaki::query::cull::CullPath;
use sabaki_fixtures::cull::{CullCase, DEVICE_PATHS, atlas, counted};
use sabaki_fixtures::finish;
use sabaki_fixtures::random::Random;

/// Each path runs where its own needs are met, whatever the other one lacks.
#[test]
fn a_path_runs_with_what_it_needs_alone() {
    let atlas = atlas(&mut Random::new(1), MapGrid::PAPER, 4);
    let case = CullCase::any(&mut Random::new(2), &atlas, 40);
    let input = case.input(&atlas);
    let none = Features::default();
    let graphics = "a queue family with graphics";
    let compute = "a queue family with compute";
    let rendering = "dynamicRendering";
    let (of_graphics, of_compute) = (vk::QueueFlags::GRAPHICS, vk::QueueFlags::COMPUTE);
    let all = Features::ALL;
    let cases = [
        (of_graphics, all, vec![graphics], vec![]),
        (of_compute, all, vec![], vec![compute]),
        (vk::QueueFlags::empty(), none, vec![rendering], vec![]),
        (of_graphics, none, vec![graphics, rendering], vec![]),
    ];
    for (hidden, features, stencil_lacks, compute_lacks) in cases {
        let mut device = shimmed_device();
        let whole = device.context().unwrap().clone();
        shim::hide(without(hidden));
        let context = again(&whole, features).unwrap();
        assert_eq!(context.report().stencil.lacks, stencil_lacks);
        assert_eq!(context.report().compute.lacks, compute_lacks);
        for path in DEVICE_PATHS {
            let lacks = match path {
                CullPath::Stencil => &stencil_lacks,
                _ => &compute_lacks,
            };
            let desc = CullerDesc::new(path, &atlas);
            let made = Culler::new(&context, device.memory().unwrap(), &desc);
            let mut culler = match made {
                Ok(culler) => culler,
                Err(GpuError::Missing(names)) => {
                    assert_eq!(names, *lacks);
                    continue;
                }
                Err(other) => panic!("{other}"),
            };
            assert!(lacks.is_empty(), "{lacks:?}");
            let counts = device.cull(&mut culler, &input).unwrap();
            assert_eq!(counts, counted(&input), "{path:?}");
            culler.destroy(device.memory().unwrap());
        }
        shim::hide(Hidden::default());
        finish(device);
    }
    let device = shimmed_device();
    shim::hide(without(of_graphics | of_compute));
    let error = again(device.context().unwrap(), Features::ALL).unwrap_err();
    shim::hide(Hidden::default());
    assert!(error.to_string().contains(graphics) && error.to_string().contains(compute));
    finish(device);
}

/// Queues that cannot do this.
fn without(queues: vk::QueueFlags) -> Hidden {
    with(|s: &mut Hidden| s.queues = queues)
}

/// The same device, borrowed anew.
fn again(context: &Context, features: Features) -> Result<Context, GpuError> {
    // SAFETY: the handles are of a living headless device, which has all features enabled.
    unsafe {
        Context::new(&ContextDesc {
            instance: context.instance(),
            physical_device: context.physical_device(),
            device: context.device(),
            queue_family: context.queue_family(),
            features,
            debug_utils: false,
            api_version: vk::API_VERSION_1_3,
        })
    }
}

#[test]
fn raw_handles_make_the_same_context() {
    let device = shimmed_device();
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
