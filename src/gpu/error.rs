use ash::vk;

use crate::query::cull::CullPath;

/// What can go wrong between the host and a device.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// A Vulkan call failed.
    #[error("{call} failed: {result}")]
    Call {
        /// Its name.
        call: &'static str,
        /// What it returned.
        result: vk::Result,
    },
    /// Something is larger than what was asked for when the component was made, or than the device allows.
    #[error("{limit}: {needed} needed, {most} is the most")]
    Limit {
        /// Which limit: a field of a `*Desc`, or a Vulkan limit.
        limit: &'static str,
        /// What the input needs.
        needed: u64,
        /// What there is.
        most: u64,
    },
    /// The device lacks things that cannot be done without.
    #[error("the device lacks {}", .0.join(", "))]
    Missing(
        /// Names of features, formats or versions, as in [`requirements`](super::requirements()).
        Vec<&'static str>,
    ),
    /// Memory could not be had.
    #[error("no memory for {name}: {reason}")]
    Memory {
        /// Name of the buffer or image.
        name: String,
        /// The allocator's words.
        reason: String,
    },
    /// Memory that must be mapped is not.
    #[error("the memory of {name} is not mapped, though the host reads or writes it")]
    NotMapped {
        /// Name of the buffer.
        name: String,
    },
    /// A candidate's region is not in the atlas that was uploaded.
    #[error("candidate {candidate} names region {region}, the uploaded atlas has {regions}")]
    NoSuchRegion {
        /// Position among the candidates.
        candidate: usize,
        /// What it names.
        region: u32,
        /// How many there are.
        regions: usize,
    },
    /// A culling path that does not run on a device.
    #[error("the {0} path does not run on a device")]
    NotADevicePath(
        /// Which.
        CullPath,
    ),
    /// A slot that does not exist.
    #[error("slot {slot} of {slots}")]
    NoSuchSlot {
        /// Which was named.
        slot: u32,
        /// How many there are.
        slots: u32,
    },
    /// A ticket of another culler, or one whose slot has been recorded anew.
    #[error("the ticket's slot has been recorded anew, or it is another culler's")]
    StaleTicket,
    /// A drawing whose frame ends do not divide its discs.
    #[error("drawing {drawing}: its frame ends do not divide its discs")]
    FrameEnds {
        /// Position among the drawings.
        drawing: usize,
    },
    /// No Vulkan loader on this machine.
    #[error("no Vulkan loader: {0}")]
    NoLoader(String),
    /// No device fits.
    #[error("no device is {wanted}; there is {}", if .found.is_empty() { "none".to_owned() } else { .found.join(", ") })]
    NoDevice {
        /// What was looked for.
        wanted: String,
        /// Names of the devices of this machine.
        found: Vec<String>,
    },
    /// A layer that was asked for is not installed.
    #[error("the layer {0} is not installed")]
    NoLayer(&'static str),
    /// The device says that it has finished, but results are not there.
    #[error("the device has finished without writing its results")]
    Unfinished,
    /// The device did not finish in time.
    #[error("the device did not finish within {seconds} s")]
    Timeout {
        /// How long was waited.
        seconds: u64,
    },
}

impl GpuError {
    /// Whether the caller's device is lost. Then everything on it is to be destroyed; after every other error the device,
    /// and the component that reports it, can go on.
    #[must_use]
    pub fn is_device_lost(&self) -> bool {
        let lost = vk::Result::ERROR_DEVICE_LOST;
        matches!(self, Self::Call { result, .. } if *result == lost)
    }
}

/// Names the call that a Vulkan error came from.
pub trait Named<T> {
    /// The result, with the name of the Vulkan function that gave it.
    fn call(self, call: &'static str) -> Result<T, GpuError>;
}

impl<T> Named<T> for Result<T, vk::Result> {
    /// The result, with the name of the Vulkan function that gave it.
    fn call(self, call: &'static str) -> Result<T, GpuError> {
        self.map_err(|result| GpuError::Call { call, result })
    }
}

/// Whether `needed` is within a limit.
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
