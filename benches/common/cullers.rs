//! The cullers that a bench compares, and the device's own clock.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a bench may")]

use ash::vk;
use sabaki::gpu::{Context, Culler, CullerDesc, GpuError};
use sabaki::query::cull::{Counted, CullInput, CullPath, Overlap, cpu};
use sabaki_fixtures::headless::Headless;

pub(crate) const COLUMNS: [&str; 3] = ["cpu", "compute", "stencil"];

/// One culler for each column.
pub(crate) struct Cullers {
    cpu: cpu::Culler,
    /// All columns but the first.
    device: [Culler; 2],
    /// Of the last input that was counted.
    overlaps: Vec<Overlap>,
}

impl Cullers {
    /// Cullers that count the same, with the settings that `desc` gives for a path.
    pub(crate) fn new<'a>(
        device: &mut Headless,
        counted: Counted,
        desc: impl Fn(CullPath) -> CullerDesc<'a>,
    ) -> Self {
        let make = |path| {
            let mut desc = desc(path);
            desc.counted = counted;
            let made = device.make(|context, memory| Culler::new(context, memory, &desc));
            made.unwrap()
        };
        Self {
            cpu: cpu::Culler::default().counting(counted),
            device: [CullPath::Compute, CullPath::Stencil].map(make),
            overlaps: Vec::new(),
        }
    }

    /// Counts each input by the culler of a column; on the device all in one submission.
    pub(crate) fn count(
        &mut self,
        device: &mut Headless,
        column: usize,
        inputs: &[CullInput<'_>],
    ) -> usize {
        self.count_each(device, (column, None), inputs, |_, overlaps| overlaps.len())
            .into_iter()
            .sum()
    }

    /// Milliseconds on the device of one submission.
    pub(crate) fn time_on_device(
        &mut self,
        device: &mut Headless,
        clock: &DeviceClock,
        column: usize,
        inputs: &[CullInput<'_>],
    ) -> f64 {
        self.count_each(device, (column, Some(clock)), inputs, |_, _| ());
        clock.milliseconds(device.context().unwrap())
    }

    /// Panics unless all columns count the same. Of a certain hit counting may end early.
    pub(crate) fn check(&mut self, device: &mut Headless, inputs: &[CullInput<'_>]) {
        let expected = self.count_each(device, (0, None), inputs, |_, overlaps| overlaps.to_vec());
        for (column, name) in COLUMNS.iter().enumerate().skip(1) {
            self.count_each(device, (column, None), inputs, |index, overlaps| {
                let mut pairs = expected[index].iter().zip(overlaps);
                let is_same = |(a, b): (&Overlap, &Overlap)| a == b || a.body.min(b.body) > 0;
                assert!(pairs.all(is_same), "{name}: not as the CPU");
            });
        }
    }

    /// Whether an input fits the slots of all cullers.
    pub(crate) fn take(&mut self, device: &mut Headless, input: &CullInput<'_>) -> bool {
        self.device.iter_mut().all(|culler| {
            // SAFETY: the buffer is being recorded, and `run` has waited for the one before.
            match device.run(|cmd| unsafe { culler.record(cmd, 0, input) }) {
                Ok(_) => true,
                Err(GpuError::Limit { .. }) => false,
                Err(other) => panic!("{other}"),
            }
        })
    }

    /// Counts each input and gives its number and its counts to `each`.
    fn count_each<T>(
        &mut self,
        device: &mut Headless,
        (column, clock): (usize, Option<&DeviceClock>),
        inputs: &[CullInput<'_>],
        mut each: impl FnMut(usize, &[Overlap]) -> T,
    ) -> Vec<T> {
        let overlaps = &mut self.overlaps;
        let Some(culler) = column.checked_sub(1).map(|index| &mut self.device[index]) else {
            let count = |(index, input)| {
                self.cpu.count(input, overlaps);
                each(index, overlaps)
            };
            return inputs.iter().enumerate().map(count).collect();
        };
        let context = device.context().unwrap().clone();
        let mark = |cmd, is_start| match clock {
            Some(clock) if is_start => clock.start(&context, cmd),
            Some(clock) => clock.end(&context, cmd),
            None => (),
        };
        let mut found = Vec::new();
        let counted = device.cull_batch(culler, inputs, mark, |index, overlaps| {
            found.push(each(index, overlaps));
        });
        counted.unwrap();
        found
    }

    pub(crate) fn destroy(self, device: &mut Headless) {
        let memory = device.memory().unwrap();
        for culler in self.device {
            culler.destroy(memory);
        }
    }
}

/// Two timestamps round what a command buffer does.
pub(crate) struct DeviceClock {
    pool: vk::QueryPool,
}

impl DeviceClock {
    pub(crate) fn new(device: &Headless) -> Result<Self, vk::Result> {
        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::TIMESTAMP)
            .query_count(2);
        let context = device.context().unwrap();
        // SAFETY: the device is valid.
        let pool = unsafe { context.device().create_query_pool(&info, None) }?;
        Ok(Self { pool })
    }

    fn start(&self, context: &Context, cmd: vk::CommandBuffer) {
        // SAFETY: the buffer is being recorded outside of rendering, and the submission before has finished.
        unsafe {
            let device = context.device();
            device.cmd_reset_query_pool(cmd, self.pool, 0, 2);
            device.cmd_write_timestamp(cmd, vk::PipelineStageFlags::TOP_OF_PIPE, self.pool, 0);
        }
    }

    fn end(&self, context: &Context, cmd: vk::CommandBuffer) {
        let stage = vk::PipelineStageFlags::BOTTOM_OF_PIPE;
        // SAFETY: as for the start.
        unsafe {
            context
                .device()
                .cmd_write_timestamp(cmd, stage, self.pool, 1)
        };
    }

    /// Between the timestamps of the submission that has finished last.
    fn milliseconds(&self, context: &Context) -> f64 {
        let mut stamps = [0u64; 2];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        // SAFETY: the pool has two timestamps, which were written.
        unsafe {
            let device = context.device();
            device.get_query_pool_results(self.pool, 0, &mut stamps, flags)
        }
        .unwrap();
        let steps = stamps[1].wrapping_sub(stamps[0]);
        steps as f64 * f64::from(context.limits().timestamp_period) * 1e-6
    }

    pub(crate) fn destroy(self, device: &Headless) {
        let context = device.context().unwrap();
        // SAFETY: the device is done with the pool.
        unsafe { context.device().destroy_query_pool(self.pool, None) };
    }
}
