//! Promise: query after query in flight over three slots, never waiting for one before the next is recorded, results stay those of the CPU
//! and memory stays flat.

use sabaki::gpu::ash::vk;
use sabaki::gpu::{Context, Culler, CullerDesc, Ticket};
use sabaki::maps::BakedGraph;
use sabaki::query::cull::{AttackDrawing, CullCandidate, CullInput, Overlap};
use sabaki::query::{Query, QueryContext, QuerySettings};
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::headless::{Headless, HeadlessDesc};
use sabaki_fixtures::throw::{Throw, throws};

use sabaki_fixtures::cull::{DEVICE_PATHS, counted};
use sabaki_fixtures::memory::{alone, status};
use sabaki_fixtures::{desc, finish};

const SLOTS: usize = 3;

/// A query's maps, and what the CPU counts of them.
struct Case {
    attack: AttackDrawing,
    candidates: Vec<CullCandidate>,
    expected: Vec<Overlap>,
}

fn cases(baked: &BakedGraph) -> Vec<Case> {
    let (settings, mut context) = (QuerySettings::default(), QueryContext::default());
    let query = Query::new(baked, &settings);
    let case = |throw: Throw| {
        let session = query.start(throw.request(), &mut context);
        let input = session.cull_input();
        let mut expected = counted(&input);
        // Few candidates: what is tried here is the number of culls.
        expected.truncate(12);
        Case {
            attack: input.attack.clone(),
            candidates: input.candidates[..expected.len()].to_vec(),
            expected,
        }
    };
    throws(baked, 5, 40).map(case).collect()
}

/// What one of the host's frames needs.
struct Frame {
    cmd: vk::CommandBuffer,
    pool: vk::CommandPool,
    fence: vk::Fence,
    waiting: Option<(usize, Ticket, Ticket)>,
}

impl Frame {
    /// # Safety
    /// The context's device is valid.
    unsafe fn new(context: &Context) -> Self {
        let device = context.device();
        // SAFETY: the caller vouches for the device.
        unsafe {
            let info =
                vk::CommandPoolCreateInfo::default().queue_family_index(context.queue_family());
            let pool = device.create_command_pool(&info, None).unwrap();
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(pool)
                .command_buffer_count(1);
            Self {
                cmd: device.allocate_command_buffers(&info).unwrap()[0],
                pool,
                fence: device.create_fence(&Default::default(), None).unwrap(),
                waiting: None,
            }
        }
    }
}

/// Asks `queries` times, half by the stencil path and half by the compute path, and holds each answer against the CPU. Returns the bytes of
/// this process and the blocks of device memory after a tenth of the queries, and at the end.
fn soak(baked: &BakedGraph, queries: u64, desc: &HeadlessDesc) -> [(f64, usize); 2] {
    let mut device = Headless::new(desc).unwrap();
    let cases = cases(baked);
    let [mut stencil, mut compute] = DEVICE_PATHS.map(|path| {
        let mut desc = CullerDesc::new(path, baked.atlas());
        desc.frames_in_flight = SLOTS as u32;
        let made = device.make(|context, memory| Culler::new(context, memory, &desc));
        made.unwrap()
    });
    let context = device.context().unwrap().clone();
    // SAFETY: the device lives until the end; its only queue is used here alone.
    let (queue, mut frames) = unsafe {
        let queue = context.device().get_device_queue(context.queue_family(), 0);
        (queue, [(); SLOTS].map(|()| Frame::new(&context)))
    };
    let held = |device: &mut Headless| {
        let blocks = device.memory().unwrap().live_blocks();
        (status("VmRSS:"), blocks)
    };
    let (mut early, mut answered) = ((0.0, 0), 0);
    let (mut overlaps, rounds) = (Vec::new(), queries / 2);
    for round in 0..rounds + SLOTS as u64 {
        let slot = (round % SLOTS as u64) as usize;
        let frame = &mut frames[slot];
        // SAFETY: everything is of this device, and the frame's last commands have finished before they are reset.
        unsafe {
            let gpu = context.device();
            if let Some((case, by_stencil, by_compute)) = frame.waiting.take() {
                if !stencil.poll(by_stencil, &mut overlaps).unwrap() {
                    gpu.wait_for_fences(&[frame.fence], true, u64::MAX).unwrap();
                    assert!(stencil.poll(by_stencil, &mut overlaps).unwrap());
                }
                assert_eq!(overlaps, cases[case].expected, "stencil, round {round}");
                gpu.wait_for_fences(&[frame.fence], true, u64::MAX).unwrap();
                assert!(compute.poll(by_compute, &mut overlaps).unwrap());
                assert_eq!(overlaps, cases[case].expected, "compute, round {round}");
                gpu.reset_fences(&[frame.fence]).unwrap();
                answered += 2;
            }
            if round >= rounds {
                continue;
            }
            if round == rounds / 10 {
                early = held(&mut device);
            }
            let case = (round * 7 % cases.len() as u64) as usize;
            let input = CullInput {
                atlas: baked.atlas(),
                attack: &cases[case].attack,
                candidates: &cases[case].candidates,
            };
            gpu.reset_command_pool(frame.pool, vk::CommandPoolResetFlags::empty())
                .unwrap();
            let once = vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT;
            let info = vk::CommandBufferBeginInfo::default().flags(once);
            gpu.begin_command_buffer(frame.cmd, &info).unwrap();
            let by_stencil = stencil.record(frame.cmd, slot as u32, &input).unwrap();
            let by_compute = compute.record(frame.cmd, slot as u32, &input).unwrap();
            gpu.end_command_buffer(frame.cmd).unwrap();
            let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(frame.cmd)];
            let submit = [vk::SubmitInfo2::default().command_buffer_infos(&commands)];
            gpu.queue_submit2(queue, &submit, frame.fence).unwrap();
            frame.waiting = Some((case, by_stencil, by_compute));
        }
    }
    assert_eq!(answered, queries);
    let late = held(&mut device);
    for frame in frames {
        // SAFETY: the device has finished: every frame's results have been read.
        unsafe {
            context.device().destroy_fence(frame.fence, None);
            context.device().destroy_command_pool(frame.pool, None);
        }
    }
    stencil.destroy(device.memory().unwrap());
    compute.destroy(device.memory().unwrap());
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
