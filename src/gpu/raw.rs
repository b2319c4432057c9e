//! Functions that take the host's objects as raw handles.

use std::ffi::c_void;

use ash::vk::{self, Handle};

use super::{Context, ContextDesc, GpuError, RawContextDesc, Report, check, check_enabled};

/// Converts the 64 bits of a `VkCommandBuffer` to a handle, for hosts that do not use `ash` or use another version of it.
#[must_use]
pub fn command_buffer(raw: u64) -> vk::CommandBuffer {
    vk::CommandBuffer::from_raw(raw)
}

/// [`check_enabled`] with raw handles, or [`check`](super::check()) if [`RawContextDesc::device`] is 0.
///
/// # Errors
/// [`GpuError::Missing`] if another handle or the function is null.
///
/// # Safety
/// As for [`check`](super::check()), and `get_instance_proc_addr` is null or the function that the instance was created with.
pub unsafe fn check_raw(desc: &RawContextDesc) -> Result<Report, GpuError> {
    // SAFETY: the caller vouches for pointer and handles.
    unsafe {
        let instance = instance_of(desc)?;
        if desc.device == 0 {
            let physical_device = vk::PhysicalDevice::from_raw(desc.physical_device);
            return Ok(check(&instance, physical_device, &desc.terms));
        }
        Ok(check_enabled(&context_desc(
            desc,
            &instance,
            &device_of(desc, &instance),
        )))
    }
}

impl Context {
    /// Borrows the host's device by its raw handles.
    ///
    /// # Errors
    /// As for [`Context::new`], and [`GpuError::Missing`] if a handle or the function is null.
    ///
    /// # Safety
    /// As for [`Context::new`], and `get_instance_proc_addr` is null or the function that the instance was created with.
    pub unsafe fn from_raw(desc: &RawContextDesc) -> Result<Self, GpuError> {
        if desc.device == 0 {
            return Err(null());
        }
        // SAFETY: the caller vouches for pointer and handles.
        unsafe {
            let instance = instance_of(desc)?;
            let device = device_of(desc, &instance);
            Self::new(&context_desc(desc, &instance, &device))
        }
    }
}

fn null() -> GpuError {
    GpuError::Missing(vec!["a handle that is not null"])
}

fn context_desc<'a>(
    desc: &RawContextDesc,
    instance: &'a ash::Instance,
    device: &'a ash::Device,
) -> ContextDesc<'a> {
    ContextDesc {
        instance,
        physical_device: vk::PhysicalDevice::from_raw(desc.physical_device),
        device,
        queue_family: desc.queue_family,
        features: desc.features,
        debug_utils: desc.debug_utils,
        terms: desc.terms,
    }
}

/// # Safety
/// As for [`check_raw`].
unsafe fn instance_of(desc: &RawContextDesc) -> Result<ash::Instance, GpuError> {
    if desc.get_instance_proc_addr.is_null() || desc.instance == 0 || desc.physical_device == 0 {
        return Err(null());
    }
    // SAFETY: the caller vouches for pointer and handles.
    unsafe {
        let get_instance_proc_addr = std::mem::transmute::<
            *const c_void,
            vk::PFN_vkGetInstanceProcAddr,
        >(desc.get_instance_proc_addr);
        let loader = ash::StaticFn {
            get_instance_proc_addr,
        };
        let instance = vk::Instance::from_raw(desc.instance);
        Ok(ash::Instance::load(&loader, instance))
    }
}

/// # Safety
/// As for [`Context::from_raw`].
unsafe fn device_of(desc: &RawContextDesc, instance: &ash::Instance) -> ash::Device {
    let device = vk::Device::from_raw(desc.device);
    // SAFETY: the caller vouches for the handle.
    unsafe { ash::Device::load(instance.fp_v1_0(), device) }
}
