//! Promise: query after query in flight over three slots, never waiting for one before the next is recorded, results stay those of the CPU
//! and memory stays flat.

use sabaki::gpu::ash::vk;
use sabaki::gpu::{Culler, Ticket};
use sabaki::maps::BakedGraph;
use sabaki::query::cull::{AttackDrawing, CullCandidate, CullInput, Overlap};
use sabaki::query::{Query, QueryContext, QuerySettings};
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::headless::{Headless, HeadlessDesc};
use sabaki_fixtures::throw::{Throw, throws};

use sabaki_fixtures::cull::counted;
use sabaki_fixtures::memory::{alone, status};
use sabaki_fixtures::{desc, finish};

const SLOTS: usize = 3;

/// A query's maps, and what the CPU counts of them.
type Case = (AttackDrawing, Vec<CullCandidate>, Vec<Overlap>);

fn cases(baked: &BakedGraph) -> Vec<Case> {
    let (settings, mut context) = (QuerySettings::default(), QueryContext::default());
    let query = Query::new(baked, &settings);
    let case = |throw: Throw| {
        let session = query.start(throw.request(), &mut context);
        let input = session.cull_input();
        let mut expected = counted(&input);
        // Few candidates: what is tried here is the number of culls.
        expected.truncate(12);
        let candidates = input.candidates[..expected.len()].to_vec();
        (input.attack.clone(), candidates, expected)
    };
    throws(baked, 5, 40).map(case).collect()
}

/// Asks `queries` times, half by the stencil path and half by the compute path, and holds each answer against the CPU. Returns the bytes of
/// this process and the blocks of device memory after a tenth of the queries, and at the end.
fn soak(baked: &BakedGraph, queries: usize, desc: &HeadlessDesc) -> [(f64, usize); 2] {
    let mut device = Headless::new(desc).unwrap();
    let cases = cases(baked);
    let mut cullers = super::each_culler(&mut device, baked.atlas(), SLOTS as u32);
    let (context, queue) = (device.context().unwrap().clone(), device.queue().unwrap());
    let gpu = context.device();
    let pool = vk::CommandPoolCreateInfo::default().queue_family_index(context.queue_family());
    let slots = [(); SLOTS].map(|()| {
        let buffer = vk::CommandBufferAllocateInfo::default().command_buffer_count(1);
        // SAFETY: the device lives until the end.
        unsafe {
            let pool = gpu.create_command_pool(&pool, None).unwrap();
            let fence = gpu.create_fence(&Default::default(), None).unwrap();
            let buffers = gpu.allocate_command_buffers(&buffer.command_pool(pool));
            (pool, buffers.unwrap()[0], fence)
        }
    });
    let held = |device: &mut Headless| (status("VmRSS:"), device.memory().unwrap().live_blocks());
    let (mut early, mut answered, mut overlaps) = ((0.0, 0), 0, Vec::new());
    let mut waiting: [Option<(&Case, [Ticket; 2])>; SLOTS] = Default::default();
    let rounds = queries / 2;
    for round in 0..rounds + SLOTS {
        let slot = round % SLOTS;
        let (pool, cmd, fence) = slots[slot];
        if let Some(((_, _, expected), tickets)) = waiting[slot].take() {
            for ((path, culler), ticket) in cullers.iter_mut().zip(tickets) {
                if !culler.poll(ticket, &mut overlaps).unwrap() {
                    // SAFETY: as above.
                    unsafe { gpu.wait_for_fences(&[fence], true, u64::MAX) }.unwrap();
                    assert!(culler.poll(ticket, &mut overlaps).unwrap());
                }
                assert_eq!(overlaps, *expected, "{path:?}, round {round}");
                answered += 1;
            }
        }
        if round == rounds / 10 {
            early = held(&mut device);
        }
        if round >= rounds {
            continue;
        }
        let case = &cases[round * 7 % cases.len()];
        let input = CullInput {
            atlas: baked.atlas(),
            attack: &case.0,
            candidates: &case.1,
        };
        let once = vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT;
        let begin = vk::CommandBufferBeginInfo::default().flags(once);
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(cmd)];
        let submit = [vk::SubmitInfo2::default().command_buffer_infos(&commands)];
        // SAFETY: the slot's last commands have finished; the device's only queue is used here alone.
        unsafe {
            if round >= SLOTS {
                gpu.wait_for_fences(&[fence], true, u64::MAX).unwrap();
                gpu.reset_fences(&[fence]).unwrap();
                let whole = vk::CommandPoolResetFlags::empty();
                gpu.reset_command_pool(pool, whole).unwrap();
            }
            gpu.begin_command_buffer(cmd, &begin).unwrap();
            let record =
                |(_, culler): &mut (_, Culler)| culler.record(cmd, slot as u32, &input).unwrap();
            waiting[slot] = Some((case, cullers.each_mut().map(record)));
            gpu.end_command_buffer(cmd).unwrap();
            gpu.queue_submit2(queue, &submit, fence).unwrap();
        }
    }
    assert_eq!(answered, queries);
    let late = held(&mut device);
    // SAFETY: the device is done once it idles.
    unsafe {
        gpu.device_wait_idle().unwrap();
        for (pool, _, fence) in slots {
            gpu.destroy_fence(fence, None);
            gpu.destroy_command_pool(pool, None);
        }
    }
    super::destroy(&mut device, cullers);
    finish(device);
    [early, late]
}

/// The pages of a process are those of all tests that run in it.
#[test]
fn memory_stays_flat() {
    alone(soak_alone);
}

fn soak_alone() {
    let mut silent = desc();
    silent.validation = false;
    let [early, late] = soak(embedded(), 1_500, &silent);
    println!("{early:?} {late:?}");
    assert!(early.1 == late.1 && late.1 > 0);
    // 1,350 queries that kept a single page each would be more.
    let most = early.0 + f64::from(4 << 20);
    assert!(late.0 < most, "{early:?} to {late:?} bytes");
}

#[test]
fn validation_is_silent_all_along() {
    soak(embedded(), 200, &desc());
}
