//! The trait that a culling path of the device implements, and that [`Culler`](super::Culler) drives.

use std::fmt::Debug;

use ash::vk;

use super::{GpuError, Memory, counts::Counts};
use crate::query::cull::{Counted, CullInput, Overlap};

/// A culling path of the device.
///
/// A cull takes these steps: [`gather`](Self::gather), [`write`](Self::write), [`record`](Self::record); when the device has
/// finished, [`add`](Self::add).
pub(super) trait DevicePath: Debug + Send + Sync {
    /// Computes the layout of the input of entry `entry` of a batch. Changes nothing and fails if a limit is exceeded.
    fn gather(
        &mut self,
        entry: usize,
        input: &CullInput<'_>,
        counted: Counted,
    ) -> Result<(), GpuError>;

    /// Starts a new cull in a slot, and writes an entry of a batch to its memory. The device must no longer use the slot.
    fn write(&mut self, entry: usize, slot: usize) -> Result<(), GpuError>;

    /// Records the culls of a batch, and at their end the numbers that mark the counts as complete. `slots` holds the slot of each entry.
    ///
    /// # Safety
    /// As for [`Culler::record_batch`](super::Culler::record_batch); [`Self::write`] has filled the slots.
    unsafe fn record(&self, cmd: vk::CommandBuffer, slots: &[usize]);

    fn counts(&self, slot: usize) -> &Counts;

    /// Number of words that the cull of a slot counts into.
    fn words(&self, slot: usize) -> usize;

    /// Adds the counted words of a slot to the overlaps of its candidates.
    fn add(&self, slot: usize, words: &mut dyn Iterator<Item = u32>, overlaps: &mut [Overlap]);

    /// Records the upload of the maps.
    ///
    /// # Safety
    /// `cmd` is being recorded outside of rendering; the staging buffer has not been released.
    unsafe fn record_upload(&self, cmd: vk::CommandBuffer);

    /// Frees the staging buffer of the maps. The device must no longer use it.
    fn release_staging(&mut self, memory: &mut dyn Memory);

    /// Frees everything. The device must no longer use it.
    fn destroy(&mut self, memory: &mut dyn Memory);
}

/// The entry of a number, after as many new ones as are missing.
pub(super) fn entry<T: Default>(entries: &mut Vec<T>, number: usize) -> &mut T {
    if entries.len() <= number {
        entries.resize_with(number + 1, T::default);
    }
    &mut entries[number]
}
