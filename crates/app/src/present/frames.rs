//! Frames in flight, each with a command buffer and its synchronization objects.

use ash::vk;

use sabaki::gpu::internal::Named;
use sabaki::gpu::{Context, GpuError};

/// Longest time of a frame. Software devices are slow; only a hung device takes longer.
const PATIENCE_SECONDS: u64 = 120;

/// A frame in flight. Default: null handles.
#[derive(Default)]
pub(super) struct Frame {
    pool: vk::CommandPool,
    pub(super) cmd: vk::CommandBuffer,
    /// Signalled when the image may be drawn to.
    pub(super) free: vk::Semaphore,
    done: vk::Fence,
    in_flight: bool,
}

impl Frame {
    /// Creates the objects of a default frame. After an error, [`Frame::destroy`] frees those that exist.
    pub(super) fn fill(&mut self, context: &Context) -> Result<(), GpuError> {
        let device = context.device();
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(context.queue_family());
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
        unsafe {
            self.free = device
                .create_semaphore(&vk::SemaphoreCreateInfo::default(), None)
                .call("vkCreateSemaphore")?;
            self.done = device
                .create_fence(&vk::FenceCreateInfo::default(), None)
                .call("vkCreateFence")?;
        }
        Ok(())
    }

    /// Waits until the submitted commands are done, if there are any.
    pub(super) fn wait(&mut self, context: &Context) -> Result<(), GpuError> {
        if !self.in_flight {
            return Ok(());
        }
        let nanoseconds = PATIENCE_SECONDS * 1_000_000_000;
        // SAFETY: the fence is of this device, and a submission signals it.
        let waited = unsafe {
            context
                .device()
                .wait_for_fences(&[self.done], true, nanoseconds)
        };
        match waited {
            Err(vk::Result::TIMEOUT) => Err(GpuError::Timeout {
                seconds: PATIENCE_SECONDS,
            }),
            other => {
                self.in_flight = false;
                other.call("vkWaitForFences")
            }
        }
    }

    /// Begins the command buffer. [`Frame::wait`] must have returned.
    pub(super) fn begin(&self, context: &Context) -> Result<(), GpuError> {
        let device = context.device();
        let info = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the buffer is of this pool, and not in use.
        unsafe {
            device
                .reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty())
                .call("vkResetCommandPool")?;
            device
                .begin_command_buffer(self.cmd, &info)
                .call("vkBeginCommandBuffer")
        }
    }

    /// Ends and submits the commands; they signal `drawn`.
    pub(super) fn submit(
        &mut self,
        context: &Context,
        queue: vk::Queue,
        drawn: vk::Semaphore,
    ) -> Result<(), GpuError> {
        let device = context.device();
        let output = vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT;
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(self.cmd)];
        let free = [vk::SemaphoreSubmitInfo::default()
            .semaphore(self.free)
            .stage_mask(output)];
        let drawn = [vk::SemaphoreSubmitInfo::default()
            .semaphore(drawn)
            .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
        let submit = [vk::SubmitInfo2::default()
            .command_buffer_infos(&commands)
            .wait_semaphore_infos(&free)
            .signal_semaphore_infos(&drawn)];
        // SAFETY: the buffer is complete; queue, fence and semaphores are of this device, and used by this thread alone.
        unsafe {
            device
                .end_command_buffer(self.cmd)
                .call("vkEndCommandBuffer")?;
            device.reset_fences(&[self.done]).call("vkResetFences")?;
            device
                .queue_submit2(queue, &submit, self.done)
                .call("vkQueueSubmit2")?;
        }
        self.in_flight = true;
        Ok(())
    }

    /// The device is idle.
    pub(super) fn destroy(self, context: &Context) {
        let device = context.device();
        // SAFETY: the handles are null or of this device, which is done with them.
        unsafe {
            device.destroy_fence(self.done, None);
            device.destroy_semaphore(self.free, None);
            device.destroy_command_pool(self.pool, None);
        }
    }
}
