//! Promise: a guest keeps the house's rules. Recording and polling submit nothing, wait for nothing and make nothing; each
//! barrier is needed, and validation would say so; who forgets to destroy is told.

use sabaki_fixtures::shim::{self, Heard, HostStep};

use sabaki::gpu::ash::vk::{self, Handle};
use sabaki::gpu::{
    Context, Culler, CullerDesc, GpuAllocatorMemory, GpuError, Memory, MemoryDesc, MemoryUse,
    Rasterizer, RasterizerDesc, Resource, Ticket,
};
use sabaki::maps::{MapGrid, RegionAtlas};
use sabaki::query::cull::CullPath;
use sabaki_fixtures::cull::{CullCase, DEVICE_PATHS, atlas, culler, drifting, map_rect, sliced};
use sabaki_fixtures::finish;
use sabaki_fixtures::headless::Message;
use sabaki_fixtures::random::Random;
use sabaki_fixtures::spans::Spans;

use super::{destroy, each_culler, shimmed_device};

#[test]
fn recording_and_polling_only_record_and_look() {
    let atlas = atlas(&mut Random::new(1), sliced(8), 8);
    let mut device = shimmed_device();
    let mut cullers = each_culler(&mut device, &atlas, 1);
    let (mut overlaps, mut random) = (Vec::new(), Random::new(2));
    for _ in 0..3 {
        let case = CullCase::any(&mut random, &atlas, 40);
        let input = case.input(&atlas);
        let tickets = device.run(|cmd| {
            let before = shim::calls();
            let tickets = cullers.each_mut().map(|(_, culler)| {
                // SAFETY: `run` gives a buffer that is being recorded, and has waited for the one before.
                unsafe { culler.record(cmd, 0, &input) }.unwrap()
            });
            for ((_, culler), ticket) in cullers.iter_mut().zip(tickets) {
                assert!(!culler.poll(ticket, &mut overlaps)?);
            }
            assert_eq!(shim::calls(), before);
            Ok(tickets)
        });
        let before = shim::calls();
        for ((_, culler), ticket) in cullers.iter_mut().zip(tickets.unwrap()) {
            assert!(culler.poll(ticket, &mut overlaps).unwrap());
        }
        assert_eq!(shim::calls(), before);
    }
    destroy(&mut device, cullers);
    finish(device);
}

/// What a frame debugger shows round the commands.
#[test]
fn passes_have_labels() {
    let atlas = atlas(&mut Random::new(1), sliced(8), 8);
    let case = CullCase::that_hits(&mut Random::new(2), &atlas, 40);
    let of_paths = [
        ["sabaki: attack", "sabaki: candidates"],
        ["sabaki: input", "sabaki: count"],
    ];
    for (path, labels) in DEVICE_PATHS.into_iter().zip(of_paths) {
        let mut device = shimmed_device();
        let mut culler = culler(&mut device, &CullerDesc::new(path, &atlas));
        shim::heard();
        device.cull(&mut culler, &case.input(&atlas)).unwrap();
        let mut found = shim::heard().labels;
        found.dedup();
        let [first, second] = labels;
        let last = "sabaki: counts to the host";
        assert_eq!(found, ["sabaki: upload of the maps", first, second, last]);
        culler.destroy(device.memory().unwrap());
        finish(device);
    }
    let mut device = shimmed_device();
    let rect = map_rect(0, 0, 40, 30);
    let drawings = [drifting(&mut Random::new(5), rect, 3, 4)];
    shim::heard();
    let drawn =
        device.with_rasterizer(|device, rasterizer| device.any_frame(rasterizer, &drawings));
    assert_eq!(drawn.unwrap().len(), 1);
    assert_eq!(
        shim::heard().labels,
        ["sabaki: maps", "sabaki: maps to the host"]
    );
    finish(device);
}

#[test]
fn pipelines_are_created_with_the_cache_of_the_host() {
    let atlas = atlas(&mut Random::new(1), sliced(8), 8);
    let mut device = shimmed_device();
    let context = device.context().unwrap().clone();
    let info = vk::PipelineCacheCreateInfo::default();
    // SAFETY: the device is valid.
    let cache = unsafe { context.device().create_pipeline_cache(&info, None) }.unwrap();
    shim::heard();
    for path in DEVICE_PATHS {
        let mut desc = CullerDesc::new(path, &atlas);
        desc.pipeline_cache = cache;
        culler(&mut device, &desc).destroy(device.memory().unwrap());
    }
    let desc = RasterizerDesc {
        pipeline_cache: cache,
        ..RasterizerDesc::default()
    };
    let rasterizer = device.make(|context, memory| Rasterizer::new(context, memory, &desc));
    rasterizer.unwrap().destroy(device.memory().unwrap());
    let caches = shim::heard().caches;
    assert!(caches.len() >= 2 * DEVICE_PATHS.len() + 2, "{caches:?}");
    assert!(caches.iter().all(|&one| one == cache.as_raw()));
    // SAFETY: nothing is created with it any more.
    unsafe { context.device().destroy_pipeline_cache(cache, None) };
    finish(device);
}

/// Each of them costs much on some drivers: `vendor-notes/nvidia.md`.
#[test]
fn counts_come_by_few_copies() {
    let atlas = atlas(&mut Random::new(5), MapGrid::PAPER, 8);
    let mut device = shimmed_device();
    let mut culler = culler(&mut device, &CullerDesc::new(CullPath::Stencil, &atlas));
    let (mut random, mut counted) = (Random::new(6), 0);
    shim::heard();
    for _ in 0..40 {
        let case = CullCase::any(&mut random, &atlas, 100);
        let input = case.input(&atlas);
        let counts = device.cull(&mut culler, &input).unwrap();
        counted += counts.iter().filter(|one| one.outer > 0).count();
    }
    let copies = shim::heard().copies;
    assert!(
        copies <= 40 && counted > 2 * copies as usize,
        "{copies} {counted}"
    );
    culler.destroy(device.memory().unwrap());
    finish(device);
}

/// The counts are made available to the host first, then their number.
#[test]
fn counts_reach_the_host_before_their_number_and_a_missing_barrier_is_detected() {
    let atlas = atlas(&mut Random::new(5), MapGrid::PAPER, 8);
    for path in DEVICE_PATHS {
        let (heard, messages) = without_barrier(&atlas, path, None);
        assert_eq!(messages, []);
        let (barriers, steps) = (heard.barriers, heard.for_host);
        let writer = match path {
            CullPath::Compute => vk::PipelineStageFlags::COMPUTE_SHADER,
            // Query results are copied.
            _ => vk::PipelineStageFlags::TRANSFER,
        };
        let culls: Vec<_> = steps.chunks(3).collect();
        assert_eq!(culls.len(), 2, "{path:?}: {steps:?}");
        for cull in culls {
            let [
                HostStep::Barrier(first),
                HostStep::Number,
                HostStep::Barrier(last),
            ] = cull
            else {
                panic!("{path:?}: {cull:?}");
            };
            assert!(first.contains(writer), "{path:?}: {first:?}");
            let fill = vk::PipelineStageFlags::TRANSFER;
            assert!(last.contains(fill), "{path:?}: {last:?}");
        }
        let is_detected = |nth: &u64| {
            let (_, messages) = without_barrier(&atlas, path, Some(*nth));
            let mut ids = messages.iter().map(|one| &one.id);
            ids.any(|id| id.starts_with("SYNC-HAZARD") || id.contains("Layout"))
        };
        let detected: Vec<u64> = (0..barriers).filter(is_detected).collect();
        println!("{path:?}: of {barriers} barriers are missed: {detected:?}");
        assert!(detected.len() >= 2, "{path:?}: {detected:?}");
    }
}

/// Two culls with one barrier left out: what the shim hears and validation says of them.
fn without_barrier(atlas: &RegionAtlas, path: CullPath, nth: Option<u64>) -> (Heard, Vec<Message>) {
    let mut device = shimmed_device();
    let mut culler = culler(&mut device, &CullerDesc::new(path, atlas));
    let case = CullCase::that_hits(&mut Random::new(6), atlas, 40);
    let input = case.input(atlas);
    shim::heard();
    shim::swallow_barrier(nth);
    device
        .run(|cmd| {
            for slot in 0..2 {
                // SAFETY: `run` gives a buffer that is being recorded.
                unsafe { culler.record(cmd, slot, &input) }?;
            }
            Ok(())
        })
        .unwrap();
    shim::swallow_barrier(None);
    let heard = shim::heard();
    culler.destroy(device.memory().unwrap());
    (heard, device.destroy())
}

#[test]
fn what_is_dropped_is_reported_and_left_as_it_is() {
    let atlas = atlas(&mut Random::new(1), MapGrid::PAPER, 4);
    let mut device = shimmed_device();
    let cullers = each_culler(&mut device, &atlas, 1);
    let spans = Spans::default();
    let alive = shim::live();
    tracing::subscriber::with_default(spans.clone(), || {
        drop(cullers);
        // Nothing was freed under the device's hands.
        assert_eq!(shim::live(), alive);
        drop(device);
    });
    assert_eq!(shim::live(), alive);
    let heard = spans.errors();
    let says = |word: &str| heard.iter().any(|one| one.contains(word));
    assert_eq!(heard.len(), 3, "{heard:?}");
    assert!(says("Culler was dropped without destroy") && says("Headless was dropped"));
}

#[test]
fn what_crosses_threads_may() {
    fn anywhere<T: Send + Sync>() {}
    anywhere::<Context>();
    anywhere::<Culler>();
    anywhere::<Rasterizer>();
    anywhere::<Ticket>();
    anywhere::<GpuAllocatorMemory>();
    anywhere::<GpuError>();
}

fn block(usage: MemoryUse) -> MemoryDesc<'static> {
    MemoryDesc {
        name: "block",
        requirements: vk::MemoryRequirements {
            size: 256,
            alignment: 256,
            memory_type_bits: u32::MAX,
        },
        usage,
        resource: Resource::Buffer(vk::Buffer::null()),
        prefers_dedicated: false,
    }
}

/// The built-in allocator frees memory when it is destroyed, and never when it is dropped.
#[test]
fn only_destroy_frees_memory() {
    let device = shimmed_device();
    let context = device.context().unwrap().clone();
    let alive = shim::live();

    let mut memory = GpuAllocatorMemory::new(&context).unwrap();
    let block_of = memory.allocate(&block(MemoryUse::Upload)).unwrap();
    memory.free(block_of);
    assert_eq!(memory.live_blocks(), 0);
    memory.destroy();
    assert_eq!(shim::live(), alive);

    let mut memory = GpuAllocatorMemory::new(&context).unwrap();
    memory.allocate(&block(MemoryUse::Device)).unwrap();
    let used = shim::live();
    assert_ne!(used, alive);
    let spans = Spans::default();
    tracing::subscriber::with_default(spans.clone(), || drop(memory));
    // The device may be gone.
    assert_eq!(shim::live(), used);
    let heard = spans.errors();
    assert_eq!(heard.len(), 1, "{heard:?}");
    assert!(heard[0].contains("GpuAllocatorMemory was dropped without destroy"));
    // With memory that leaks, validation would complain of the device's end.
    std::mem::forget(device);
}
