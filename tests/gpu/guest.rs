//! Promise: a renderer that somebody else wrote hosts a dodge: wgpu's device by its raw handles, wgpu's command encoder, wgpu's
//! submission; the answer is the CPU's, wgpu's own work goes on, and validation is silent over both.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_testing as common;
#[path = "../../examples/common/plain_memory.rs"]
#[allow(dead_code)]
mod plain_memory;

use std::{
    convert::Infallible,
    ffi::c_void,
    future::Future,
    pin::pin,
    task::{Poll, Waker},
};

use common::{answer::answer_throw, baked::embedded, cull_cases::Way};
use plain_memory::PlainMemory;
use sabaki::gpu::ash::vk::{self, Handle};
use sabaki::gpu::{Context, Culler, Features, RawContextDesc, Terms, command_buffer};
use sabaki::query::{Answer, Evaluation, Query, QueryContext, QuerySettings};
use sabaki_app::demo::throw::{ThrowSettings, throw};
use wgpu::hal::api::Vulkan;

fn block_on<F: Future>(future: F) -> F::Output {
    let mut future = pin!(future);
    let mut context = std::task::Context::from_waker(Waker::noop());
    loop {
        if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
            return output;
        }
    }
}

/// wgpu as a renderer has it. The features that sabaki needs, and wgpu does not, are switched on when the device is made.
struct Host {
    context: Context,
    device: wgpu::Device,
    queue: wgpu::Queue,
    _instance: wgpu::Instance,
}

impl Host {
    fn new() -> Self {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::VULKAN,
            flags: wgpu::InstanceFlags::debugging(),
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let options = wgpu::RequestAdapterOptions {
            force_fallback_adapter: true,
            ..Default::default()
        };
        let adapter = block_on(instance.request_adapter(&options)).expect("a software device");
        // SAFETY: handles are only borrowed, and the device is made from this adapter with nothing taken away.
        let (context, device, queue) = unsafe {
            let vulkan = adapter.as_hal::<Vulkan>().unwrap();
            let mut rendering =
                vk::PhysicalDeviceDynamicRenderingFeatures::default().dynamic_rendering(true);
            let mut synchronization =
                vk::PhysicalDeviceSynchronization2Features::default().synchronization2(true);
            let desc = wgpu::DeviceDescriptor::default();
            let open = vulkan
                .open_with_callback(
                    desc.required_features,
                    &desc.required_limits,
                    &desc.memory_hints,
                    Some(Box::new(|arguments| {
                        let info = std::mem::take(arguments.create_info);
                        *arguments.create_info = info
                            .push_next(&mut rendering)
                            .push_next(&mut synchronization);
                    })),
                )
                .unwrap();
            let shared = vulkan.shared_instance();
            let lookup = shared.entry().static_fn().get_instance_proc_addr;
            let context = Context::from_raw(&RawContextDesc {
                get_instance_proc_addr: lookup as *const c_void,
                instance: shared.raw_instance().handle().as_raw(),
                physical_device: vulkan.raw_physical_device().as_raw(),
                device: open.device.raw_device().handle().as_raw(),
                queue_family: open.device.queue_family_index(),
                features: Features {
                    // wgpu does not enable it: queries say any or none.
                    precise_queries: false,
                    ..Features::ALL
                },
                debug_utils: false,
                terms: Terms {
                    api_version: shared.instance_api_version(),
                    ..Terms::default()
                },
            });
            let (device, queue) = adapter.create_device_from_hal(open, &desc).unwrap();
            (context.unwrap(), device, queue)
        };
        Self {
            context,
            device,
            queue,
            _instance: instance,
        }
    }

    /// A frame of the host's: it writes a buffer, lets the guest record, copies the buffer, and submits.
    fn frame<T>(&self, number: u32, guest: impl FnOnce(vk::CommandBuffer) -> T) -> T {
        let buffer = |usage| {
            self.device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: 256,
                usage,
                mapped_at_creation: false,
            })
        };
        use wgpu::BufferUsages as Usage;
        let ours = buffer(Usage::COPY_SRC | Usage::COPY_DST);
        let read = buffer(Usage::MAP_READ | Usage::COPY_DST);
        self.queue
            .write_buffer(&ours, 0, &number.to_le_bytes().repeat(64));
        let encoder = || self.device.create_command_encoder(&Default::default());
        let (mut before, mut guests, mut after) = (encoder(), encoder(), encoder());
        before.clear_buffer(&ours, 128, None);
        // wgpu wants an encoder for itself where somebody records by hand.
        // SAFETY: the guest records into the encoder's own command buffer, which it neither ends nor keeps.
        let recorded = unsafe {
            guests.as_hal_mut::<Vulkan, _, _>(|encoder| {
                guest(command_buffer(encoder.unwrap().raw_handle().as_raw()))
            })
        };
        after.copy_buffer_to_buffer(&ours, 0, &read, 0, 256);
        let frame = [before, guests, after];
        self.queue.submit(frame.map(wgpu::CommandEncoder::finish));
        read.slice(..)
            .map_async(wgpu::MapMode::Read, |mapped| mapped.unwrap());
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .unwrap();
        let expected = [number.to_le_bytes().repeat(32), vec![0; 128]].concat();
        assert_eq!(
            read.slice(..).get_mapped_range().unwrap().to_vec(),
            expected
        );
        recorded
    }
}

#[test]
fn wgpu_hosts_a_dodge() {
    let baked = embedded();
    let host = Host::new();
    // SAFETY: the handles are the host's, which outlives the memory.
    let mut memory = unsafe {
        PlainMemory::new(
            host.context.instance(),
            host.context.physical_device(),
            host.context.device(),
        )
    };
    let [mut stencil, mut atomics, mut compute] = Way::ALL
        .map(|way| Culler::new(&host.context, &mut memory, &way.desc(baked.atlas())).unwrap());
    assert!(!stencil.counts_exact() && atomics.counts_exact());

    let settings = QuerySettings::default();
    let query = Query::new(baked, &settings);
    let (mut avoided, mut removed) = (0, 0);
    for index in 0..8 {
        let throw = throw(baked, &ThrowSettings::default(), 3, index).unwrap();
        let (mut context, mut answer) = (QueryContext::default(), Answer::default());
        let (mut counts, mut any, mut summed) = (Vec::new(), Vec::new(), Vec::new());
        let mut session = query.start(throw.request(), &mut context);
        let Ok(()) = session.run(&mut answer, |input, wanted| {
            // SAFETY: the host gives a buffer that is being recorded, and has waited for the one before.
            let tickets = host.frame(index as u32, |cmd| unsafe {
                (
                    stencil.record(cmd, 0, input).unwrap(),
                    compute.record(cmd, 0, input).unwrap(),
                    atomics.record(cmd, 0, input).unwrap(),
                )
            });
            assert!(stencil.poll(tickets.0, &mut any).unwrap());
            assert!(compute.poll(tickets.1, &mut counts).unwrap());
            assert!(atomics.poll(tickets.2, &mut summed).unwrap());
            assert_eq!(summed, counts);
            for (any, counted) in any.iter().zip(&counts) {
                assert_eq!(any.body > 0, counted.body > 0);
            }
            removed += counts.iter().filter(|one| one.body > 0).count();
            wanted.clone_from(&counts);
            Ok::<_, Infallible>(())
        });
        let expected = answer_throw(&query, &throw, Evaluation::Lazy);
        assert_eq!(
            format!("{answer:?}"),
            format!("{expected:?}"),
            "throw {index}"
        );
        avoided += u32::from(answer.avoided);
    }
    assert!(avoided > 3 && removed > 3, "{avoided} {removed}");

    stencil.destroy(&mut memory);
    atomics.destroy(&mut memory);
    compute.destroy(&mut memory);
    assert_eq!(memory.live_blocks(), 0);
    host.frame(77, |_| ());
    drop(memory);
    drop(host);
    let heard = wgpu_hal::VALIDATION_CANARY.get_and_reset();
    assert!(heard.is_empty(), "{heard:#?}");
}
