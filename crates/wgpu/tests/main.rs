//! Promise: a renderer that somebody else wrote hosts a dodge, by its own device and submissions; the answer is the CPU's, the host's
//! work goes on, and validation is silent over both.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::convert::Infallible;

use pollster::block_on;
use sabaki::gpu::{BatchEntry, CullerDesc, GpuError};
use sabaki::query::cull::{CullInput, Overlap};
use sabaki::query::{Answer, CullPath, Evaluation, Query, QueryContext, QuerySettings};
use sabaki_fixtures::throw::throws;
use sabaki_fixtures::{answer::answer_throw, baked::embedded, cull::DEVICE_PATHS};
use sabaki_wgpu::{Host, HostError, HostedCuller};

fn adapter() -> wgpu::Adapter {
    // One test at a time has devices.
    drop(sabaki_fixtures::desc());
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::VULKAN,
        flags: wgpu::InstanceFlags::debugging(),
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let options = wgpu::RequestAdapterOptions {
        force_fallback_adapter: true,
        ..Default::default()
    };
    block_on(instance.request_adapter(&options)).expect("a software device")
}

/// A host's device and queue.
struct Renderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
}

impl Renderer {
    /// A frame of the host's: it writes a buffer, submits the guests' work, copies the buffer and reads it.
    fn frame(&self, guests: Vec<wgpu::CommandBuffer>) {
        let Self { device, queue } = self;
        let buffer = |usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: 256,
                usage,
                mapped_at_creation: false,
            })
        };
        use wgpu::BufferUsages as Usage;
        let number = guests.len() as u32 + 7;
        let ours = buffer(Usage::COPY_SRC | Usage::COPY_DST);
        let read = buffer(Usage::MAP_READ | Usage::COPY_DST);
        queue.write_buffer(&ours, 0, &number.to_le_bytes().repeat(64));
        let encoder = || device.create_command_encoder(&Default::default());
        let (mut before, mut after) = (encoder(), encoder());
        before.clear_buffer(&ours, 128, None);
        after.copy_buffer_to_buffer(&ours, 0, &read, 0, 256);
        let frame = std::iter::once(before.finish()).chain(guests);
        queue.submit(frame.chain([after.finish()]));
        read.slice(..)
            .map_async(wgpu::MapMode::Read, |mapped| mapped.unwrap());
        device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let expected = [number.to_le_bytes().repeat(32), vec![0; 128]].concat();
        let found = read.slice(..).get_mapped_range().unwrap().to_vec();
        assert_eq!(found, expected);
    }

    /// Counts by all cullers in one frame.
    fn count(&self, cullers: &mut [HostedCuller], input: &CullInput<'_>) -> Vec<Vec<Overlap>> {
        let (mut buffers, mut tickets) = (Vec::new(), Vec::new());
        for culler in &mut *cullers {
            let mut batch = [BatchEntry {
                slot: 0,
                input: *input,
                ticket: None,
            }];
            // SAFETY: `frame` waits for the submission, which is in the order of recording.
            buffers.push(unsafe { culler.record(&mut batch) }.unwrap());
            tickets.push(batch[0].ticket.unwrap());
        }
        let mut overlaps = Vec::new();
        assert!(!cullers[0].poll(tickets[0], &mut overlaps).unwrap());
        self.frame(buffers);
        let polled = cullers.iter().zip(tickets).map(|(culler, ticket)| {
            let mut overlaps = Vec::new();
            assert!(culler.poll(ticket, &mut overlaps).unwrap());
            overlaps
        });
        polled.collect()
    }
}

fn host() -> (Host, Renderer) {
    let desc = wgpu::DeviceDescriptor::default();
    let (host, queue) = Host::open(&adapter(), &desc).unwrap();
    let device = host.device().clone();
    (host, Renderer { device, queue })
}

#[test]
fn wgpu_hosts_a_dodge() {
    let baked = embedded();
    let (host, renderer) = host();
    // Occlusion queries, which are not precise on wgpu, and the compute shader.
    let mut cullers =
        DEVICE_PATHS.map(|path| host.culler(&CullerDesc::new(path, baked.atlas())).unwrap());
    drop(host);
    let exact = cullers.each_ref().map(|one| one.get().counts_exact());
    assert_eq!(exact, [false, true]);

    let settings = QuerySettings::default();
    let query = Query::new(baked, &settings);
    let (mut avoided, mut removed) = (0, 0);
    for (index, throw) in throws(baked, 3, 8).enumerate() {
        let (mut context, mut answer) = (QueryContext::default(), Answer::default());
        let mut session = query.start(throw.request(), &mut context);
        let Ok(()) = session.run(&mut answer, |input, wanted| {
            let counts = renderer.count(&mut cullers, input);
            let [any, counted] = &counts[..] else {
                unreachable!("as many counts as cullers");
            };
            for (any, counted) in any.iter().zip(counted) {
                assert_eq!(any.body > 0, counted.body > 0);
            }
            removed += counted.iter().filter(|one| one.body > 0).count();
            wanted.clone_from(counted);
            Ok::<_, Infallible>(())
        });
        let expected = answer_throw(&query, &throw, Evaluation::Lazy);
        assert_eq!(format!("{answer:?}"), format!("{expected:?}"), "{index}");
        avoided += u32::from(answer.avoided);
    }
    assert!(avoided > 3 && removed > 3, "{avoided} {removed}");
    for culler in &mut cullers {
        // SAFETY: every frame has been waited for. The culls below run without staging.
        unsafe { culler.release_staging() };
    }

    // A device that the program has made by itself culls by the compute shader alone.
    let (device, queue) = block_on(adapter().request_device(&Default::default())).unwrap();
    let own = Renderer { device, queue };
    let host = Host::new(&own.device).unwrap();
    assert!(host.report().compute.runs() && !host.report().stencil.runs());
    let refused = host.culler(&CullerDesc::new(CullPath::Stencil, baked.atlas()));
    let Err(HostError::Gpu(GpuError::Missing(lacks))) = refused else {
        panic!("{refused:?}");
    };
    assert!(lacks.contains(&"dynamicRendering"), "{lacks:?}");
    let compute = host.culler(&CullerDesc::new(CullPath::Compute, baked.atlas()));
    let mut others = [compute.unwrap()];
    let mut compared = 0;
    for (index, throw) in throws(baked, 3, 8).enumerate() {
        let mut context = QueryContext::default();
        let session = query.start(throw.request(), &mut context);
        let input = session.cull_input();
        if !input.candidates.is_empty() {
            let expected = renderer.count(&mut cullers[1..], &input);
            assert_eq!(own.count(&mut others, &input), expected, "throw {index}");
            compared += 1;
        }
    }
    assert!(compared > 3, "{compared}");

    drop((cullers, others));
    renderer.frame(Vec::new());
    drop((renderer, host, own));
    let heard = wgpu_hal::VALIDATION_CANARY.get_and_reset();
    assert!(heard.is_empty(), "{heard:#?}");
}

/// What a command buffer uses lives as long as the command buffer, and not longer.
#[test]
fn a_culler_is_dropped_before_its_commands_are_submitted() {
    let baked = embedded();
    let (host, renderer) = host();
    let settings = QuerySettings::default();
    let throw = throws(baked, 3, 1).next().unwrap();
    let mut context = QueryContext::default();
    let query = Query::new(baked, &settings);
    let session = query.start(throw.request(), &mut context);
    for path in DEVICE_PATHS {
        let mut culler = host.culler(&CullerDesc::new(path, baked.atlas())).unwrap();
        let [first, second] = [0, 1].map(|slot| {
            let mut batch = [BatchEntry {
                slot,
                input: session.cull_input(),
                ticket: None,
            }];
            // SAFETY: each slot is recorded once; what is submitted is in the order of recording.
            unsafe { culler.record(&mut batch) }.unwrap()
        });
        drop(culler);
        renderer.frame(vec![first]);
        drop(second);
    }
    renderer.frame(Vec::new());
    // Anything that is left would be reported when the device is destroyed.
    drop((renderer, host));
    let heard = wgpu_hal::VALIDATION_CANARY.get_and_reset();
    assert!(heard.is_empty(), "{heard:#?}");
}

#[test]
fn a_device_with_what_the_adapter_lacks_is_refused_by_name() {
    let adapter = adapter();
    let experimental = wgpu::Features::all_experimental_mask();
    let lacking = wgpu::Features::all() - adapter.features() - experimental;
    let feature = lacking.iter().next().expect("a feature that is missing");
    let open = |required_features, required_limits| {
        let desc = wgpu::DeviceDescriptor {
            required_features,
            required_limits,
            ..Default::default()
        };
        Host::open(&adapter, &desc)
    };
    let refused = open(feature, wgpu::Limits::default());
    assert!(matches!(refused, Err(HostError::Features(named)) if named == feature));

    let offered = adapter.features() & experimental;
    if let Some(feature) = offered.iter().next() {
        let refused = open(feature, wgpu::Limits::default());
        assert!(matches!(refused, Err(HostError::Experimental(named)) if named == feature));
    }

    let offered = adapter.limits().max_bind_groups;
    let limits = wgpu::Limits {
        max_bind_groups: offered + 1,
        ..Default::default()
    };
    let refused = open(wgpu::Features::empty(), limits);
    let Err(HostError::Limit {
        name,
        required,
        allowed,
    }) = refused
    else {
        panic!("{refused:?}");
    };
    let expected = ("max_bind_groups", offered + 1, offered);
    assert_eq!((name, required as u32, allowed as u32), expected);
}
