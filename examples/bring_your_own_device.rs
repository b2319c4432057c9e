//! A renderer's side of culling: its own instance, device, queue, allocator and timeline semaphore; frames that never wait.
//!
//! `cargo run --example bring_your_own_device`
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::{
    error::Error,
    sync::{Arc, Mutex},
};

use ash::vk;
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use sabaki::{
    avoid::cull::{AttackDrawing, AttackLayer, CullCandidate, CullInput, TimedDisc, cpu},
    gpu::{
        Context, ContextDesc, GpuAllocatorMemory, Terms,
        stencil::{Culler, CullerDesc},
    },
    math::Rigid2,
    region::{
        BitMap, Disc, Drawing, MapGrid, MapRect, MapTurn, MaskMap, RegionAtlas, RegionId,
        RegionMaps, Slab, SlabMaps, raster,
    },
};

/// A square map with one disc in its middle; radius in texels.
fn drawing(radius: i32) -> Drawing {
    let disc = Disc::new(32 * 16, 32 * 16, (radius * 16) as f32);
    Drawing {
        rect: MapRect {
            u: -32,
            v: -32,
            width: 64,
            height: 64,
        },
        discs: vec![disc],
        frame_ends: vec![1],
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    // The renderer's own objects, as it has them anyway.
    // SAFETY: the system's loader; everything below is used in order, and destroyed in the opposite one.
    unsafe {
        let entry = ash::Entry::load()?;
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let info = vk::InstanceCreateInfo::default().application_info(&application);
        let instance = entry.create_instance(&info, None)?;
        let terms = Terms::default();
        let devices = instance.enumerate_physical_devices()?;
        let usable = |device: &vk::PhysicalDevice| {
            sabaki::gpu::check(&instance, *device, &terms).is_usable()
        };
        let physical_device = devices.into_iter().find(usable).ok_or("no usable device")?;
        let precise = sabaki::gpu::check(&instance, physical_device, &terms).precise_queries;
        let families = instance.get_physical_device_queue_family_properties(physical_device);
        let graphics = |family: &vk::QueueFamilyProperties| {
            family.queue_flags.contains(vk::QueueFlags::GRAPHICS)
        };
        let queue_family = families.iter().position(graphics).ok_or("no graphics")? as u32;
        let queues = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(queue_family)
            .queue_priorities(&[1.0])];
        let features = vk::PhysicalDeviceFeatures::default().occlusion_query_precise(precise);
        let mut features12 = vk::PhysicalDeviceVulkan12Features::default().timeline_semaphore(true);
        let mut features13 = vk::PhysicalDeviceVulkan13Features::default()
            .dynamic_rendering(true)
            .synchronization2(true);
        let info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_features(&features)
            .push_next(&mut features12)
            .push_next(&mut features13);
        let device = instance.create_device(physical_device, &info, None)?;
        let queue = device.get_device_queue(queue_family, 0);
        let allocator = Arc::new(Mutex::new(Allocator::new(&AllocatorCreateDesc {
            instance: instance.clone(),
            device: device.clone(),
            physical_device,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: Default::default(),
        })?));

        // sabaki borrows them.
        let context = Context::new(&ContextDesc {
            instance: &instance,
            physical_device,
            device: &device,
            queue_family,
            precise_queries: precise,
            debug_names: false,
            terms,
        })?;
        let mut memory = GpuAllocatorMemory::new(allocator.clone());
        frames(&context, &mut memory, &device, queue, queue_family)?;

        // Everything of sabaki's is gone; the renderer's own objects are as they were.
        drop((memory, context));
        drop(allocator);
        device.destroy_device(None);
        instance.destroy_instance(None);
    }
    Ok(())
}

/// # Safety
/// The handles are valid and belong together.
unsafe fn frames(
    context: &Context,
    memory: &mut GpuAllocatorMemory,
    device: &ash::Device,
    queue: vk::Queue,
    queue_family: u32,
) -> Result<(), Box<dyn Error>> {
    // One evasion with one map, in which the body stays where it is.
    let mut body = MaskMap::new(drawing(12).rect, 1);
    raster::any_frame(&drawing(12)).for_each(|column, row| body.set(column, row, 0));
    let region = RegionMaps {
        first_slab: Slab(4),
        slabs: vec![SlabMaps {
            outer: body.clone(),
            body,
            evasion: BitMap::default(),
        }],
        seconds: 1.0,
    };
    let atlas = RegionAtlas::new(MapGrid::PAPER, vec![region], Vec::new());
    let disc = TimedDisc {
        disc: drawing(6).discs[0],
        slice: 0,
    };
    let attack = AttackDrawing {
        rect: drawing(6).rect,
        layers: vec![AttackLayer {
            slab: Slab(4),
            clock: 0,
            inner: 0..1,
            outer: 0..1,
        }],
        discs: vec![disc],
    };
    // Ever further to the side: the last ones are out of reach.
    let candidates: Vec<_> = (0..10)
        .map(|step| CullCandidate {
            region: RegionId(0),
            clock: 0,
            open: false,
            turn: MapTurn::new(
                Rigid2::new(0.3, 0.06 * step as f32, 0.0),
                (-32, -32),
                atlas.grid().texel,
            ),
        })
        .collect();
    let input = CullInput {
        atlas: &atlas,
        attack: &attack,
        candidates: &candidates,
    };
    // SAFETY: the caller vouches for the handles; the semaphore orders the frame and what is destroyed after it.
    unsafe {
        let mut culler = Culler::new(context, memory, &CullerDesc::new("culler", &atlas))?;
        let mut kind = vk::SemaphoreTypeCreateInfo::default()
            .semaphore_type(vk::SemaphoreType::TIMELINE)
            .initial_value(0);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        let timeline = device.create_semaphore(&info, None)?;
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(queue_family);
        let pool = device.create_command_pool(&info, None)?;
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(pool)
            .command_buffer_count(1);
        let cmd = device.allocate_command_buffers(&info)?[0];

        device.begin_command_buffer(cmd, &vk::CommandBufferBeginInfo::default())?;
        let ticket = culler.record(cmd, 0, &input)?;
        device.end_command_buffer(cmd)?;
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(cmd)];
        let signals = [vk::SemaphoreSubmitInfo::default()
            .semaphore(timeline)
            .value(1)
            .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
        let submit = [vk::SubmitInfo2::default()
            .command_buffer_infos(&commands)
            .signal_semaphore_infos(&signals)];
        device.queue_submit2(queue, &submit, vk::Fence::null())?;

        // The renderer's loop: a frame in which the counts are not there yet culls on the CPU, or goes on without.
        let (mut overlaps, mut late) = (Vec::new(), 0);
        while device.get_semaphore_counter_value(timeline)? < 1
            || !culler.poll(ticket, &mut overlaps)?
        {
            late += 1;
            std::thread::yield_now();
        }
        let mut expected = Vec::new();
        cpu::count(&input, &mut expected);
        println!("polled {late} times before the counts were there");
        for (step, (found, expected)) in overlaps.iter().zip(&expected).enumerate() {
            let verdict = if found.body > 0 { "removed" } else { "kept" };
            println!(
                "candidate {step}: {:4} texels (cpu {:4}): {verdict}",
                found.body, expected.body
            );
        }
        culler.destroy(memory);
        device.destroy_command_pool(pool, None);
        device.destroy_semaphore(timeline, None);
    }
    Ok(())
}
