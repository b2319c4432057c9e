//! # Concept
//! sabaki is a guest of your renderer: it culls the ways to dodge a ball on your device, inside a command buffer of yours. It owns no
//! device, submits nothing and never waits.
//!
//! # Usage
//! `cargo run --release --example own_device -- out/fighter.sabaki`
//!
//! `cargo run --release` writes that file.
//!
//! # How it works
//! 1. `check` says what the device offers; your renderer enables it, and `Context::new` takes the handles.
//! 2. `Culler::record` writes the commands into the frame that your renderer draws anyway.
//! 3. In a later frame `Culler::poll` returns the counts, or nothing; then the CPU counts the same.
//! 4. `Session::submit` takes the counts and gives the answer.
//!
//! `common/plain_memory.rs` is your renderer's allocator. What it draws is left out: the example in wgpu draws the same throw.

#[path = "common/baked.rs"]
mod common;
#[path = "common/plain_memory.rs"]
mod plain_memory;
#[path = "common/throw.rs"]
mod throw;

use std::error::Error;

use ash::vk;
use plain_memory::PlainMemory;
use sabaki::gpu::{Context, ContextDesc, Culler, CullerDesc, check};
use sabaki::query::{Answer, CullPath, Query, QueryContext, QuerySettings, Step, cull::cpu};
use throw::Throw;

fn main() -> Result<(), Box<dyn Error>> {
    // SAFETY: everything is made and used in order, and destroyed in the opposite one when the device has finished.
    unsafe {
        // The renderer's device, with what sabaki asks for switched on.
        let (entry, version) = (ash::Entry::load()?, vk::API_VERSION_1_3);
        let application = vk::ApplicationInfo::default().api_version(version);
        let info = vk::InstanceCreateInfo::default().application_info(&application);
        let instance = entry.create_instance(&info, None)?;
        let mut devices = instance.enumerate_physical_devices()?.into_iter();
        // Vulkan 1.3 with what is enabled below; sabaki itself asks for less.
        let usable = devices.find(|&device| {
            let (offered, report) = (
                instance.get_physical_device_properties(device).api_version,
                check(&instance, device, version),
            );
            offered >= version && report.stencil.runs() && report.features.synchronization2
        });
        let physical_device = usable.ok_or("no usable device with Vulkan 1.3")?;
        let offered = check(&instance, physical_device, version);
        let families = instance.get_physical_device_queue_family_properties(physical_device);
        let draws =
            |one: &vk::QueueFamilyProperties| one.queue_flags.contains(vk::QueueFlags::GRAPHICS);
        let queue_family = families.iter().position(draws).ok_or("no graphics")? as u32;
        let queues = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(queue_family)
            .queue_priorities(&[1.0])];
        let features = vk::PhysicalDeviceFeatures::default()
            .occlusion_query_precise(offered.features.precise_queries);
        let mut features13 = vk::PhysicalDeviceVulkan13Features::default()
            .dynamic_rendering(true)
            .synchronization2(true);
        let info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_features(&features)
            .push_next(&mut features13);
        let device = instance.create_device(physical_device, &info, None)?;

        // sabaki takes the handles and the renderer's own allocator.
        let context = Context::new(&ContextDesc {
            instance: &instance,
            physical_device,
            device: &device,
            queue_family,
            features: offered.features,
            debug_utils: false,
            api_version: version,
        })?;
        let mut memory = PlainMemory::new(&instance, physical_device, &device);
        let baked = &common::baked()?;
        let desc = CullerDesc::new(CullPath::Stencil, baked.atlas());
        let mut culler = Culler::new(&context, &mut memory, &desc)?;

        // Frame 0: a ball comes. The ways to dodge it are culled while the frame is drawn.
        let throw = Throw::new(baked)?;
        let settings = QuerySettings::default();
        let (mut context, mut answer) = (QueryContext::default(), Answer::default());
        let query = Query::new(baked, &settings);
        let mut session = query.start(throw.request(), &mut context);
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(queue_family);
        let pool = device.create_command_pool(&info, None)?;
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(pool)
            .command_buffer_count(1);
        let cmd = device.allocate_command_buffers(&info)?[0];
        device.begin_command_buffer(cmd, &vk::CommandBufferBeginInfo::default())?;
        let ticket = culler.record(cmd, 0, &session.cull_input())?;
        // Here the renderer draws.
        device.end_command_buffer(cmd)?;
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(cmd)];
        let submit = [vk::SubmitInfo2::default().command_buffer_infos(&commands)];
        let queue = device.get_device_queue(queue_family, 0);
        device.queue_submit2(queue, &submit, vk::Fence::null())?;
        device.queue_wait_idle(queue)?;

        // Later: the counts are there, or else the CPU counts the same.
        let mut overlaps = Vec::new();
        let there = culler.poll(ticket, &mut overlaps)? && culler.counts_exact();
        if !there {
            cpu::count(&session.cull_input(), &mut overlaps);
        }
        if session.submit(&overlaps, &mut answer) == Step::Recount {
            session.run_on_cpu(&mut cpu::Culler::default(), &mut answer);
        }
        throw::print(there, overlaps.len(), &answer);

        culler.destroy(&mut memory);
        device.destroy_command_pool(pool, None);
        println!("blocks of memory left: {}", memory.live_blocks());
        device.destroy_device(None);
        instance.destroy_instance(None);
    }
    Ok(())
}
