//! Differences between drivers. Each has an entry in `vendor-notes/`.

use ash::vk;

/// Maximum number of occlusion queries in one submission that a driver counts (`vendor-notes/moltenvk.md`). It is compared with the queries
/// of a batch. The host must know the other queries of a submission.
pub(crate) fn most_queries(driver: vk::DriverId) -> u64 {
    match driver {
        vk::DriverId::MOLTENVK => 256 * 1024 / 8,
        _ => u64::MAX,
    }
}

/// Driver of a device, as reported by Vulkan 1.2 or `VK_KHR_driver_properties`. The default value, which names no driver, without either.
///
/// # Safety
/// `physical_device` belongs to `instance`, both are valid, and both know `version`.
pub(crate) unsafe fn driver(
    instance: &ash::Instance,
    physical_device: vk::PhysicalDevice,
    version: u32,
) -> vk::DriverId {
    // SAFETY: the caller vouches for the handles.
    let tells = version >= vk::API_VERSION_1_2
        || version >= vk::API_VERSION_1_1 && unsafe { has_extension(instance, physical_device) };
    if !tells {
        return vk::DriverId::default();
    }
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
    // SAFETY: the caller vouches for the handles; the structure is part of Vulkan 1.2, or of an extension that the device has.
    unsafe { instance.get_physical_device_properties2(physical_device, &mut properties) };
    driver.driver_id
}

/// Whether a device has `VK_KHR_driver_properties`. The extension need not be enabled to query a property of a physical device.
///
/// # Safety
/// As for [`driver`].
unsafe fn has_extension(instance: &ash::Instance, physical_device: vk::PhysicalDevice) -> bool {
    // SAFETY: the caller vouches for both handles. Where the list cannot be had, it has no extension.
    let known = unsafe { instance.enumerate_device_extension_properties(physical_device) };
    let name = ash::khr::driver_properties::NAME;
    let mut known = known.unwrap_or_default().into_iter();
    known.any(|one| one.extension_name_as_c_str() == Ok(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_driver_that_counts_little_is_not_asked_for_more() {
        assert_eq!(most_queries(vk::DriverId::MOLTENVK), 32_768);
        assert_eq!(most_queries(vk::DriverId::MESA_LLVMPIPE), u64::MAX);
        assert_eq!(most_queries(vk::DriverId::default()), u64::MAX);
    }
}
