//! The device, chosen by name or kind.

use std::ffi::CStr;

use ash::vk;

use super::desc::{DeviceChoice, HeadlessDesc};
use super::list::{self, DeviceKind};
use sabaki::gpu::{Features, GpuError, check, internal::Named};

/// The device, its only queue, and their properties.
pub(super) struct DevicePart {
    pub(super) physical: vk::PhysicalDevice,
    pub(super) name: String,
    pub(super) device: ash::Device,
    pub(super) queue_family: u32,
    pub(super) queue: vk::Queue,
    pub(super) features: Features,
}

impl DevicePart {
    pub(super) fn new(instance: &ash::Instance, desc: &HeadlessDesc) -> Result<Self, GpuError> {
        let (physical, name) = choose(instance, desc)?;
        // SAFETY: the physical device is of this instance.
        let report = unsafe { check(instance, physical, &desc.terms) };
        if !report.is_usable() {
            return Err(GpuError::Missing(report.missing()));
        }
        if !report.features.synchronization2 {
            return Err(GpuError::Missing(vec!["synchronization2"]));
        }
        // SAFETY: as above.
        let lacking = unsafe { lacking(instance, physical, &desc.device_extensions) }?;
        if !lacking.is_empty() {
            return Err(GpuError::Missing(lacking));
        }
        // SAFETY: as above.
        let families = unsafe { instance.get_physical_device_queue_family_properties(physical) };
        let with = |wanted| {
            families
                .iter()
                .position(|family| family.queue_flags.contains(wanted))
        };
        let both = with(vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE);
        let graphics = both.or_else(|| with(vk::QueueFlags::GRAPHICS));
        let family = graphics.or_else(|| with(vk::QueueFlags::COMPUTE));
        let queue_family = family.unwrap_or(0) as u32;
        let queues = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(queue_family)
            .queue_priorities(&[1.0])];
        let features = vk::PhysicalDeviceFeatures::default()
            .occlusion_query_precise(report.features.precise_queries)
            .fragment_stores_and_atomics(report.features.fragment_atomics);
        let mut rendering = vk::PhysicalDeviceDynamicRenderingFeatures::default()
            .dynamic_rendering(report.features.dynamic_rendering);
        let mut synchronization =
            vk::PhysicalDeviceSynchronization2Features::default().synchronization2(true);
        let mut state = vk::PhysicalDeviceExtendedDynamicStateFeaturesEXT::default()
            .extended_dynamic_state(report.features.extended_dynamic_state);
        let needed = report.extensions.iter().chain(&desc.device_extensions);
        let extensions: Vec<_> = needed.map(|name| name.as_ptr()).collect();
        let mut info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_features(&features)
            .enabled_extension_names(&extensions)
            .push_next(&mut rendering)
            .push_next(&mut synchronization);
        if !report.extensions.is_empty() {
            info = info.push_next(&mut state);
        }
        // SAFETY: the report says that the device offers all that is enabled here.
        let device =
            unsafe { instance.create_device(physical, &info, None) }.call("vkCreateDevice")?;
        // SAFETY: the queue was asked for when the device was made.
        let queue = unsafe { device.get_device_queue(queue_family, 0) };
        Ok(Self {
            physical,
            name,
            device,
            queue_family,
            queue,
            features: report.features,
        })
    }

    pub(super) fn destroy(&self) {
        // SAFETY: everything made from the device is gone, and its queue is idle (each `run` has waited).
        unsafe { self.device.destroy_device(None) };
    }
}

/// The extensions of these that a device does not have.
///
/// # Safety
/// The physical device is of this instance.
unsafe fn lacking(
    instance: &ash::Instance,
    physical: vk::PhysicalDevice,
    wanted: &[&'static CStr],
) -> Result<Vec<&'static str>, GpuError> {
    if wanted.is_empty() {
        return Ok(Vec::new());
    }
    // SAFETY: the caller vouches for both.
    let known = unsafe { instance.enumerate_device_extension_properties(physical) }
        .call("vkEnumerateDeviceExtensionProperties")?;
    let has = |name: &CStr| {
        let mut names = known.iter();
        names.any(|one| one.extension_name_as_c_str() == Ok(name))
    };
    let lacking = wanted.iter().filter(|name| !has(name));
    Ok(lacking.filter_map(|name| name.to_str().ok()).collect())
}

fn choose(
    instance: &ash::Instance,
    desc: &HeadlessDesc,
) -> Result<(vk::PhysicalDevice, String), GpuError> {
    let (known, choice) = (list::all(instance, &desc.terms)?, &desc.device);
    let software = |kind| kind == DeviceKind::Software;
    let found = known.iter().find(|(_, info)| match choice {
        DeviceChoice::Best => true,
        DeviceChoice::Named(part) => info.name.to_lowercase().contains(&part.to_lowercase()),
        DeviceChoice::Software => software(info.kind),
        DeviceChoice::Hardware => !software(info.kind),
    });
    found
        .map(|(device, info)| (*device, info.name.clone()))
        .ok_or_else(|| GpuError::NoDevice {
            wanted: match choice {
                DeviceChoice::Best => "present".to_owned(),
                DeviceChoice::Named(part) => format!("named {part:?}"),
                DeviceChoice::Software => "a software device".to_owned(),
                DeviceChoice::Hardware => "a hardware device".to_owned(),
            },
            found: known.into_iter().map(|(_, info)| info.name).collect(),
        })
}
