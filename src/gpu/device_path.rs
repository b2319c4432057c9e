//! The trait that a culling path of the device implements, and that [`Culler`](super::Culler) drives.

use std::fmt::Debug;

use ash::vk;

use super::{GpuError, Memory, counts::Counts, passes::Passes};
use crate::query::cull::{Counted, CullInput, Overlap};

/// An input, and what of it is counted.
#[derive(Clone, Copy)]
pub(super) struct CullRequest<'a> {
    pub(super) input: &'a CullInput<'a>,
    pub(super) counted: Counted,
}

/// A culling path of the device.
///
/// A cull takes these steps: [`gather`](Self::gather), [`write`](Self::write), [`record`](Self::record); when the device has
/// finished, [`add`](Self::add).
pub(super) trait DevicePath: Debug + Send + Sync {
    /// Lays out an input, which is the `entry`th of a batch. Fails without a change where it is beyond a limit.
    fn gather(&mut self, entry: usize, request: CullRequest<'_>) -> Result<(), GpuError>;

    /// Writes an entry of a batch into the memory of a slot, which no device uses any more.
    fn write(&mut self, entry: usize, slot: usize) -> Result<(), GpuError>;

    /// Records the culls of a batch, up to the numbers that say that their counts are there. `slots` has the slot of each entry.
    ///
    /// # Safety
    /// As for [`Culler::record_batch`](super::Culler::record_batch); [`Self::write`] has filled the slots.
    unsafe fn record(&self, passes: &mut Passes<'_>, slots: &[usize]);

    /// The counts of a slot.
    fn counts(&self, slot: usize) -> &Counts;

    /// As [`Self::counts`].
    fn counts_mut(&mut self, slot: usize) -> &mut Counts;

    /// Number of words that the cull of a slot counts into.
    fn words(&self, slot: usize) -> usize;

    /// Adds the counted words of a slot to the overlaps of its candidates.
    fn add(&self, slot: usize, words: &mut dyn Iterator<Item = u32>, overlaps: &mut [Overlap]);

    /// Records the upload of the maps.
    ///
    /// # Safety
    /// `cmd` is being recorded outside of rendering; the staging buffer has not been released.
    unsafe fn record_upload(&self, cmd: vk::CommandBuffer);

    /// Frees the staging buffer of the maps, which the device does not use any more.
    fn release_staging(&mut self, memory: &mut dyn Memory);

    /// Frees everything; the device must be done with it.
    fn destroy(&mut self, memory: &mut dyn Memory);
}
