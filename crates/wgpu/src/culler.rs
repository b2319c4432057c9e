//! A culler whose command buffers are wgpu's.

use std::mem::ManuallyDrop;

use sabaki::gpu::ash::vk::Handle;
use sabaki::gpu::{
    BatchEntry, Context, Culler, CullerDesc, GpuAllocatorMemory, GpuError, Ticket, command_buffer,
};
use sabaki::query::cull::Overlap;
use wgpu::hal::api::Vulkan;

use super::HostError;

/// A culler on a wgpu device. When it is dropped, it waits for the device and frees its memory.
#[derive(Debug)]
pub struct HostedCuller {
    /// Destroyed when this is dropped, before its memory and the device.
    culler: ManuallyDrop<Culler>,
    memory: GpuAllocatorMemory,
    device: wgpu::Device,
}

impl HostedCuller {
    pub(super) fn new(
        device: wgpu::Device,
        context: &Context,
        desc: &CullerDesc<'_>,
    ) -> Result<Self, HostError> {
        let mut memory = GpuAllocatorMemory::new(context)?;
        let culler = Culler::new(context, &mut memory, desc)?;
        Ok(Self {
            culler: ManuallyDrop::new(culler),
            memory,
            device,
        })
    }

    /// The culler, for its settings and its [times](Culler::pass_times).
    #[must_use]
    pub fn get(&self) -> &Culler {
        &self.culler
    }

    /// Records culls into a command buffer of their own, which the host submits. Each entry gets its ticket.
    ///
    /// # Errors
    /// As for [`Culler::record_batch`].
    ///
    /// # Safety
    /// As for [`Culler::record_batch`]: a slot is recorded again when [`HostedCuller::poll`] has returned its counts, or when its command buffer
    /// will never be submitted; command buffers are submitted in the order of recording.
    pub unsafe fn record(
        &mut self,
        batch: &mut [BatchEntry<'_>],
    ) -> Result<wgpu::CommandBuffer, HostError> {
        let culler = &mut self.culler;
        // An encoder for itself, because wgpu tracks what is recorded through it.
        let mut encoder = self.device.create_command_encoder(&Default::default());
        // SAFETY: the command buffer is only recorded into; the caller vouches for slots and order.
        unsafe {
            encoder.as_hal_mut::<Vulkan, _, _>(|encoder| {
                let encoder = encoder.ok_or(HostError::NotVulkan)?;
                let cmd = command_buffer(encoder.raw_handle().as_raw());
                Ok::<_, HostError>(culler.record_batch(cmd, batch)?)
            })?;
        }
        Ok(encoder.finish())
    }

    /// Writes the counts of a cull to `overlaps`, in the order of its candidates. Returns false while the device has not finished. Never
    /// waits.
    ///
    /// # Errors
    /// As for [`Culler::poll`].
    pub fn poll(&self, ticket: Ticket, overlaps: &mut Vec<Overlap>) -> Result<bool, GpuError> {
        self.culler.poll(ticket, overlaps)
    }
}

impl Drop for HostedCuller {
    fn drop(&mut self) {
        // A lost device has finished, too.
        let _ = self.device.poll(wgpu::PollType::wait_indefinitely());
        // SAFETY: nothing uses the culler afterwards.
        let culler = unsafe { ManuallyDrop::take(&mut self.culler) };
        culler.destroy(&mut self.memory);
    }
}
