//! Runs a command buffer and waits for it; the components' work in one call.

use ash::vk;

use super::{Headless, device::DevicePart};
use sabaki::{
    gpu::{Culler, GpuError, MapKind, Rasterizer, internal::Named},
    maps::{BitMap, Drawing, raster::EvasionMaps},
    query::cull::{CullInput, Overlap, cpu},
};

/// Longest time of a submission. Software devices are slow; only a hung device takes longer.
const PATIENCE_SECONDS: u64 = 120;

/// A command pool with one buffer, and a fence.
pub(super) struct WorkPart {
    pool: vk::CommandPool,
    cmd: vk::CommandBuffer,
    fence: vk::Fence,
    /// A run timed out: the device may still use its objects, so that they must not be touched.
    stuck: bool,
}

impl WorkPart {
    pub(super) fn new(device: &DevicePart) -> Result<Self, GpuError> {
        let mut work = Self {
            pool: vk::CommandPool::null(),
            cmd: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
            stuck: false,
        };
        match work.fill(device) {
            Ok(()) => Ok(work),
            Err(error) => {
                work.destroy(device);
                Err(error)
            }
        }
    }

    fn fill(&mut self, device: &DevicePart) -> Result<(), GpuError> {
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(device.queue_family);
        let device = &device.device;
        // SAFETY: the device is valid and has this queue family.
        self.pool =
            unsafe { device.create_command_pool(&info, None) }.call("vkCreateCommandPool")?;
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(self.pool)
            .level(vk::CommandBufferLevel::PRIMARY)
            .command_buffer_count(1);
        // SAFETY: the pool was just made.
        let buffers = unsafe { device.allocate_command_buffers(&info) };
        self.cmd = buffers.call("vkAllocateCommandBuffers")?[0];
        // SAFETY: the device is valid.
        self.fence = unsafe { device.create_fence(&vk::FenceCreateInfo::default(), None) }
            .call("vkCreateFence")?;
        Ok(())
    }

    pub(super) fn run<T>(
        &mut self,
        device: &DevicePart,
        record: impl FnOnce(vk::CommandBuffer) -> Result<T, GpuError>,
    ) -> Result<T, GpuError> {
        let timeout = || GpuError::Timeout {
            seconds: PATIENCE_SECONDS,
        };
        if self.stuck {
            return Err(timeout());
        }
        let (queue, device) = (device.queue, &device.device);
        let info = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: every run waits, so that the buffer is not in use; after one that did not see its end there is no other.
        unsafe {
            device
                .reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty())
                .call("vkResetCommandPool")?;
            device
                .begin_command_buffer(self.cmd, &info)
                .call("vkBeginCommandBuffer")?;
        }
        let recorded = record(self.cmd)?;
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(self.cmd)];
        let submit = [vk::SubmitInfo2::default().command_buffer_infos(&commands)];
        // SAFETY: the buffer is complete, and fence and queue belong to this thread of work alone. No submission that
        // signals the fence is in flight.
        unsafe {
            device
                .end_command_buffer(self.cmd)
                .call("vkEndCommandBuffer")?;
            device.reset_fences(&[self.fence]).call("vkResetFences")?;
            device
                .queue_submit2(queue, &submit, self.fence)
                .call("vkQueueSubmit2")?;
        }
        self.wait(device, queue).map(|()| recorded)
    }

    /// Waits for the submission.
    fn wait(&mut self, device: &ash::Device, queue: vk::Queue) -> Result<(), GpuError> {
        let nanoseconds = PATIENCE_SECONDS * 1_000_000_000;
        // SAFETY: the fence is of this device, and a submission signals it.
        let Err(result) = (unsafe { device.wait_for_fences(&[self.fence], true, nanoseconds) })
        else {
            return Ok(());
        };
        if result == vk::Result::TIMEOUT {
            self.stuck = true;
            return Err(GpuError::Timeout {
                seconds: PATIENCE_SECONDS,
            });
        }
        // The fence did not tell whether the device is done: waits for the queue. A lost device is done.
        // SAFETY: the queue is of this device, and used by this thread alone.
        let idle = unsafe { device.queue_wait_idle(queue) };
        self.stuck = idle.is_err_and(|result| result != vk::Result::ERROR_DEVICE_LOST);
        Err(result).call("vkWaitForFences")
    }

    /// Whether the device may still use its objects.
    pub(super) fn is_stuck(&self) -> bool {
        self.stuck
    }

    pub(super) fn destroy(self, device: &DevicePart) {
        // SAFETY: the handles are null or of this device, and every run has seen its end: a stuck one is not destroyed.
        unsafe {
            device.device.destroy_fence(self.fence, None);
            device.device.destroy_command_pool(self.pool, None);
        }
    }
}

impl Headless {
    /// Body and evasion maps of many drawings: [`raster::every_frame`](sabaki::maps::raster::every_frame) on the device.
    ///
    /// # Errors
    /// [`Rasterizer::plan`]'s, or those of [`Headless::run`].
    pub fn every_frame(
        &mut self,
        rasterizer: &mut Rasterizer,
        drawings: &[Drawing],
    ) -> Result<Vec<EvasionMaps>, GpuError> {
        let empty = |drawing: &Drawing| EvasionMaps {
            body: BitMap::new(drawing.rect),
            evasion: BitMap::new(drawing.rect),
        };
        let mut maps: Vec<_> = drawings.iter().map(empty).collect();
        for batch in &rasterizer.plan(drawings)? {
            // SAFETY: `run` gives a buffer that is being recorded, and has waited for the batch before.
            self.run(|cmd| unsafe {
                rasterizer.record(cmd, drawings, batch, MapKind::EveryFrame)
            })?;
            // SAFETY: `run` has waited.
            unsafe { rasterizer.read_every_frame(drawings, batch, &mut maps) }?;
        }
        Ok(maps)
    }

    /// Attack maps of many drawings: [`raster::any_frame`](sabaki::maps::raster::any_frame) on the device.
    ///
    /// # Errors
    /// [`Rasterizer::plan`]'s, or those of [`Headless::run`].
    pub fn any_frame(
        &mut self,
        rasterizer: &mut Rasterizer,
        drawings: &[Drawing],
    ) -> Result<Vec<BitMap>, GpuError> {
        let mut maps: Vec<_> = drawings
            .iter()
            .map(|drawing| BitMap::new(drawing.rect))
            .collect();
        for batch in &rasterizer.plan(drawings)? {
            // SAFETY: as in `every_frame`.
            self.run(|cmd| unsafe { rasterizer.record(cmd, drawings, batch, MapKind::AnyFrame) })?;
            // SAFETY: `run` has waited.
            unsafe { rasterizer.read_any_frame(drawings, batch, &mut maps) }?;
        }
        Ok(maps)
    }

    /// Overlaps of any number of candidates: [`cpu::count`](sabaki::query::cull::cpu::count) on the device, as far as
    /// the culler [counts](sabaki::query::cull::Counted) them.
    ///
    /// Without precise queries the device only says which candidates meet the attack: [`Overlap::body`] and
    /// [`Overlap::outer`] are 0 or not 0, and [`Overlap::evasion`] is counted on the CPU.
    ///
    /// # Errors
    /// [`Culler::record`]'s, or those of [`Headless::run`].
    pub fn cull(
        &mut self,
        culler: &mut Culler,
        input: &CullInput<'_>,
    ) -> Result<Vec<Overlap>, GpuError> {
        let mut all = Vec::with_capacity(input.candidates.len());
        let (mut some, mut exact) = (Vec::new(), Vec::new());
        let mut rest = input.candidates;
        let mut most = culler.max_candidates().max(1) as usize;
        while !rest.is_empty() {
            let (candidates, later) = rest.split_at(most.min(rest.len()));
            let part = CullInput {
                candidates,
                ..*input
            };
            // SAFETY: `run` gives a buffer that is being recorded, and has waited for the one before.
            let ticket = match self.run(|cmd| unsafe { culler.record(cmd, 0, &part) }) {
                Err(GpuError::Limit { limit, .. })
                    if limit == "StencilSettings::max_boxes" && candidates.len() > 1 =>
                {
                    most = candidates.len() / 2;
                    continue;
                }
                other => other?,
            };
            if !culler.poll(ticket, &mut some)? {
                return Err(GpuError::Unfinished);
            }
            if !culler.counts_exact() && culler.counted().evasion {
                cpu::count(&part, &mut exact);
                let pairs = some.iter_mut().zip(&exact);
                pairs.for_each(|(found, exact)| found.evasion = exact.evasion);
            }
            all.append(&mut some);
            rest = later;
        }
        Ok(all)
    }
}
