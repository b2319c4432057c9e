use ash::vk;

use crate::query::cull::CullPath;

/// An error of a Vulkan component.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// A Vulkan call failed.
    #[error("{call} failed: {result}")]
    Call {
        /// Name of the function.
        call: &'static str,
        /// Result of the call.
        result: vk::Result,
    },
    /// An input exceeds a maximum of the component's description or a limit of the device.
    #[error("{limit}: {needed} needed, {most} is the most")]
    Limit {
        /// The limit: a field of a `*Desc`, or a Vulkan limit.
        limit: &'static str,
        /// Value that the input needs.
        needed: u64,
        /// Value of the limit.
        most: u64,
    },
    /// The device lacks required features.
    #[error("the device lacks {}", .0.join(", "))]
    Missing(
        /// Names of features, formats or versions, as in [`requirements`](super::requirements()).
        Vec<&'static str>,
    ),
    /// Memory could not be allocated.
    #[error("no memory for {name}: {reason}")]
    Memory {
        /// Name of the buffer or image.
        name: String,
        /// Message of the allocator.
        reason: String,
    },
    /// Memory that must be mapped is not mapped.
    #[error("the memory of {name} is not mapped, though the host reads or writes it")]
    NotMapped {
        /// Name of the buffer.
        name: String,
    },
    /// A candidate's region is not in the atlas that was uploaded.
    #[error("candidate {candidate} names region {region}, the uploaded atlas has {regions}")]
    NoSuchRegion {
        /// Index of the candidate.
        candidate: usize,
        /// Index of the region.
        region: u32,
        /// Number of regions of the atlas.
        regions: usize,
    },
    /// The culling path does not run on a device.
    #[error("the {0} path does not run on a device")]
    NotADevicePath(
        /// The path.
        CullPath,
    ),
    /// The slot does not exist, or a batch has it twice.
    #[error("slot {slot} of {slots}")]
    NoSuchSlot {
        /// Index of the slot.
        slot: u32,
        /// Number of slots.
        slots: u32,
    },
    /// The ticket is of another culler, or its slot has been recorded again since.
    #[error("the ticket's slot has been recorded anew, or it is another culler's")]
    StaleTicket,
    /// The frame ends of a drawing do not divide its discs.
    #[error("drawing {drawing}: its frame ends do not divide its discs")]
    FrameEnds {
        /// Index of the drawing.
        drawing: usize,
    },
    /// There is no Vulkan loader on this machine.
    #[error("no Vulkan loader: {0}")]
    NoLoader(String),
    /// No device matches.
    #[error("no device is {wanted}; {}", if .found.is_empty() { "the Vulkan loader could load no driver".to_owned() } else { format!("there is {}", .found.join(", ")) })]
    NoDevice {
        /// Name or kind that was searched for.
        wanted: String,
        /// Names of the devices of this machine.
        found: Vec<String>,
    },
    /// A requested layer is not installed.
    #[error("the layer {0} is not installed")]
    NoLayer(&'static str),
    /// The device reports that it has finished, but there are no results.
    #[error("the device has finished without writing its results")]
    Unfinished,
    /// The device did not finish in time.
    #[error("the device did not finish within {seconds} s")]
    Timeout {
        /// Waiting time, in seconds.
        seconds: u64,
    },
}

impl GpuError {
    /// Whether the host's device is lost, so that everything on it must be destroyed. After any other error, device and component remain
    /// usable.
    pub fn is_device_lost(&self) -> bool {
        let lost = vk::Result::ERROR_DEVICE_LOST;
        matches!(self, Self::Call { result, .. } if *result == lost)
    }
}

/// Adds the name of the failed call to a Vulkan error.
pub trait Named<T> {
    /// Adds the name of the Vulkan function to its error.
    fn call(self, call: &'static str) -> Result<T, GpuError>;
}

impl<T> Named<T> for Result<T, vk::Result> {
    fn call(self, call: &'static str) -> Result<T, GpuError> {
        self.map_err(|result| GpuError::Call { call, result })
    }
}

/// Returns an error if `needed` exceeds a limit.
pub fn within(limit: &'static str, needed: u64, most: u64) -> Result<(), GpuError> {
    if needed > most {
        return Err(GpuError::Limit {
            limit,
            needed,
            most,
        });
    }
    Ok(())
}
