//! A culler whose command buffers are wgpu's.

use std::mem::ManuallyDrop;
use std::sync::{Arc, Mutex, PoisonError};

use sabaki::gpu::ash::vk::Handle;
use sabaki::gpu::{
    BatchEntry, Context, Culler, CullerDesc, GpuAllocatorMemory, GpuError, Ticket, command_buffer,
};
use sabaki::query::cull::Overlap;
use wgpu::hal::api::Vulkan;

use super::HostError;

/// A culler on a wgpu device.
///
/// Dropping it waits for nothing. Its memory is freed when none of the command buffers that it has recorded is left: each has finished
/// (as the host's `Device::poll` and `Queue::submit` find out), or was dropped without being submitted.
#[derive(Debug)]
pub struct HostedCuller {
    /// Taken when this is dropped.
    parts: ManuallyDrop<Parts>,
    /// Shared with the recorded command buffers. Holds the parts once this is dropped; the last owner frees them.
    remains: Arc<Mutex<Option<Parts>>>,
}

/// The objects that command buffers use. They are dropped when no command buffer uses them any more.
#[derive(Debug)]
struct Parts {
    culler: ManuallyDrop<Culler>,
    memory: ManuallyDrop<GpuAllocatorMemory>,
    device: wgpu::Device,
}

impl HostedCuller {
    pub(super) fn new(
        device: wgpu::Device,
        context: &Context,
        desc: &CullerDesc<'_>,
    ) -> Result<Self, HostError> {
        let mut memory = GpuAllocatorMemory::new(context)?;
        let culler = match Culler::new(context, &mut memory, desc) {
            Ok(culler) => culler,
            Err(error) => {
                memory.destroy();
                return Err(error.into());
            }
        };
        Ok(Self {
            parts: ManuallyDrop::new(Parts {
                culler: ManuallyDrop::new(culler),
                memory: ManuallyDrop::new(memory),
                device,
            }),
            remains: Arc::default(),
        })
    }

    /// The culler, for its settings.
    pub fn get(&self) -> &Culler {
        &self.parts.culler
    }

    /// Records culls into a command buffer of their own, which the host submits. Each entry gets its ticket. The command buffer may be
    /// submitted after the culler was dropped.
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
        let Parts { culler, device, .. } = &mut *self.parts;
        // An encoder for itself, because wgpu tracks what is recorded through it.
        let mut encoder = device.create_command_encoder(&Default::default());
        // SAFETY: the command buffer is only recorded into; the caller vouches for slots and order.
        unsafe {
            encoder.as_hal_mut::<Vulkan, _, _>(|encoder| {
                let encoder = encoder.ok_or(HostError::NotVulkan)?;
                let cmd = command_buffer(encoder.raw_handle().as_raw());
                Ok::<_, HostError>(culler.record_batch(cmd, batch)?)
            })?;
        }
        let used = Arc::clone(&self.remains);
        encoder.on_submitted_work_done(move || drop(used));
        Ok(encoder.finish())
    }

    /// Writes the counts of a cull to `overlaps`, in the order of its candidates. Returns false while the device has not finished. Never
    /// waits. Vulkan's full guarantee holds once wgpu has seen the submission finish (`Queue::on_submitted_work_done`), as
    /// [`Culler::poll`] says.
    ///
    /// # Errors
    /// As for [`Culler::poll`].
    pub fn poll(&self, ticket: Ticket, overlaps: &mut Vec<Overlap>) -> Result<bool, GpuError> {
        self.parts.culler.poll(ticket, overlaps)
    }

    /// Frees the staging buffer of the maps, which is as large as they are, as [`Culler::release_staging`].
    ///
    /// # Safety
    /// As for [`Culler::release_staging`]: a recorded command buffer has finished, as [`HostedCuller::poll`] tells, and no other one
    /// is in flight or will be submitted.
    pub unsafe fn release_staging(&mut self) {
        let Parts { culler, memory, .. } = &mut *self.parts;
        // SAFETY: the caller vouches for the command buffers.
        unsafe { culler.release_staging(&mut **memory) };
    }
}

impl Drop for HostedCuller {
    fn drop(&mut self) {
        // SAFETY: nothing uses the field afterwards.
        let parts = unsafe { ManuallyDrop::take(&mut self.parts) };
        let mut remains = self.remains.lock().unwrap_or_else(PoisonError::into_inner);
        *remains = Some(parts);
    }
}

impl Drop for Parts {
    fn drop(&mut self) {
        // SAFETY: nothing uses either afterwards: each command buffer of the culler has finished or is gone.
        let (culler, mut memory) = unsafe {
            (
                ManuallyDrop::take(&mut self.culler),
                ManuallyDrop::take(&mut self.memory),
            )
        };
        culler.destroy(&mut memory);
        memory.destroy();
    }
}
