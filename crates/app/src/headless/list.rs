//! Lists the Vulkan devices of this machine.

use std::fmt;

use ash::vk;

use super::desc::HeadlessDesc;
use super::instance;
use sabaki::gpu::{GpuError, Report, Terms, check, internal::Named};

/// A Vulkan device of this machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceInfo {
    /// Name, as its driver gives it.
    pub name: String,
    /// Kind of the device.
    pub kind: DeviceKind,
    /// Vulkan version of the device, such as `1.3.230`.
    pub api: String,
    /// The [`requirements`](sabaki::gpu::requirements()) that the device meets.
    pub report: Report,
}

/// Kinds of devices, in order of preference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    /// A discrete graphics card.
    Discrete,
    /// A graphics unit integrated in the processor.
    Integrated,
    /// A virtual device of a virtual machine's host.
    Virtual,
    /// A software device that runs on the CPU.
    Software,
    /// Another kind.
    Other,
}

impl fmt::Display for DeviceKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Discrete => "discrete",
            Self::Integrated => "integrated",
            Self::Virtual => "virtual",
            Self::Software => "software",
            Self::Other => "other",
        })
    }
}

impl DeviceKind {
    fn of(kind: vk::PhysicalDeviceType) -> Self {
        match kind {
            vk::PhysicalDeviceType::DISCRETE_GPU => Self::Discrete,
            vk::PhysicalDeviceType::INTEGRATED_GPU => Self::Integrated,
            vk::PhysicalDeviceType::VIRTUAL_GPU => Self::Virtual,
            vk::PhysicalDeviceType::CPU => Self::Software,
            _ => Self::Other,
        }
    }
}

/// The devices of this machine: usable ones first, and among these the most capable.
///
/// # Errors
/// [`GpuError::NoLoader`], or a call's.
pub fn devices() -> Result<Vec<DeviceInfo>, GpuError> {
    // SAFETY: the library is the system's Vulkan loader, whose loading has no conditions.
    let entry =
        unsafe { ash::Entry::load() }.map_err(|error| GpuError::NoLoader(error.to_string()))?;
    let instance = instance::create(&entry, &HeadlessDesc::default())?;
    let known = all(&instance, &Terms::default());
    // SAFETY: nothing was made from the instance.
    unsafe { instance.destroy_instance(None) };
    Ok(known?.into_iter().map(|(_, info)| info).collect())
}

/// The devices in the order of [`devices`], with their handles.
pub(super) fn all(
    instance: &ash::Instance,
    terms: &Terms,
) -> Result<Vec<(vk::PhysicalDevice, DeviceInfo)>, GpuError> {
    // SAFETY: the instance is valid.
    let devices =
        unsafe { instance.enumerate_physical_devices() }.call("vkEnumeratePhysicalDevices")?;
    let mut known: Vec<_> = devices
        .into_iter()
        .map(|device| (device, info(instance, device, terms)))
        .collect();
    known.sort_by_key(|(_, info)| {
        let report = &info.report;
        (!report.stencil.runs(), !report.compute.runs(), info.kind)
    });
    Ok(known)
}

fn info(instance: &ash::Instance, device: vk::PhysicalDevice, terms: &Terms) -> DeviceInfo {
    // SAFETY: the device is of this instance.
    let properties = unsafe { instance.get_physical_device_properties(device) };
    // SAFETY: as above.
    let report = unsafe { check(instance, device, terms) };
    let name = properties
        .device_name_as_c_str()
        .map(|name| name.to_string_lossy().into_owned());
    let version = properties.api_version;
    let (major, minor) = (
        vk::api_version_major(version),
        vk::api_version_minor(version),
    );
    DeviceInfo {
        name: name.unwrap_or_default(),
        kind: DeviceKind::of(properties.device_type),
        api: format!("{major}.{minor}.{}", vk::api_version_patch(version)),
        report,
    }
}
