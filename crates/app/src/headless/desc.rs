use std::ffi::CStr;

use sabaki::gpu::Terms;

/// Settings of a [`Headless`](super::Headless) device.
#[derive(Clone, Debug, Default)]
pub struct HeadlessDesc {
    /// The device to use.
    pub device: DeviceChoice,
    /// Enables core, synchronization and best-practices validation; an error if the layer is not installed.
    pub validation: bool,
    /// The version of Vulkan that is asked for, and what is done without even where the device has it.
    pub terms: Terms,
    /// Extensions of the instance beside those that are needed anyway: those of a window system, for instance.
    pub instance_extensions: Vec<&'static CStr>,
    /// Extensions of the device beside those that are needed anyway. A device without one of them is refused.
    pub device_extensions: Vec<&'static CStr>,
}

/// The device that a [`Headless`](super::Headless) uses.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum DeviceChoice {
    /// The first usable device; discrete before integrated before virtual before software.
    #[default]
    Best,
    /// The first device whose name contains this text, ignoring case.
    Named(String),
    /// The first software device (lavapipe, for instance).
    Software,
    /// The first device that is not a software device.
    Hardware,
}
