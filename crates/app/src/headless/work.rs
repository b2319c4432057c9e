//! Runs a command buffer and waits for it.

use ash::vk;

use super::device::DevicePart;
use sabaki::gpu::{GpuError, internal::Named};

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
