//! Description of the host's Vulkan objects, and their handles where the host has no `ash` or another version of it.

use std::ffi::c_void;

use ash::vk::{self, Handle};

use super::GpuError;

/// The host's Vulkan objects, and the features that it enabled when it created them.
#[derive(Clone, Copy)]
pub struct ContextDesc<'a> {
    /// Instance, which was created with [`ContextDesc::api_version`] as its `apiVersion`. [`raw_instance`] makes it from a raw handle.
    pub instance: &'a ash::Instance,
    /// Physical device of `instance`.
    pub physical_device: vk::PhysicalDevice,
    /// Device of `physical_device`; [`raw_device`] makes it from a raw handle. Below Vulkan 1.3 it has the extensions of the enabled features.
    pub device: &'a ash::Device,
    /// Family of the queue that runs the recorded commands. The stencil path needs a graphics queue, the compute path a compute queue.
    pub queue_family: u32,
    /// Features that are enabled on `device`. A path that needs others does not run; see [`check_enabled`](super::check_enabled).
    pub features: Features,
    /// Whether `VK_EXT_debug_utils` is enabled on `instance`. If so, objects get names and passes get labels.
    pub debug_utils: bool,
    /// `VkApplicationInfo::apiVersion` of the instance, the newest version of Vulkan that is used.
    pub api_version: u32,
}

/// Vulkan features that the culling paths use, as offered by a device or enabled by its host.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features {
    /// `dynamicRendering`.
    pub dynamic_rendering: bool,
    /// `synchronization2`. No culling path needs it, but `sabaki-draw` does.
    pub synchronization2: bool,
    /// `extendedDynamicState`. On Vulkan 1.3 it is always there.
    pub extended_dynamic_state: bool,
    /// `occlusionQueryPrecise`.
    pub precise_queries: bool,
}

impl Features {
    /// All features.
    pub const ALL: Self = Self {
        dynamic_rendering: true,
        synchronization2: true,
        extended_dynamic_state: true,
        precise_queries: true,
    };

    /// Features that both sets have.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            dynamic_rendering: self.dynamic_rendering && other.dynamic_rendering,
            synchronization2: self.synchronization2 && other.synchronization2,
            extended_dynamic_state: self.extended_dynamic_state && other.extended_dynamic_state,
            precise_queries: self.precise_queries && other.precise_queries,
        }
    }
}

/// An instance from the 64 bits of a `VkInstance` (`Handle::as_raw` of any version of `ash`), and the `vkGetInstanceProcAddr` that it was
/// created with.
///
/// # Errors
/// [`GpuError::Missing`] if the handle or the function is null.
///
/// # Safety
/// Both are null or valid, and belong together.
pub unsafe fn raw_instance(
    get_instance_proc_addr: *const c_void,
    instance: u64,
) -> Result<ash::Instance, GpuError> {
    if get_instance_proc_addr.is_null() || instance == 0 {
        return Err(GpuError::Missing(vec!["an instance that is not null"]));
    }
    // SAFETY: the caller vouches for pointer and handle.
    unsafe {
        let get_instance_proc_addr = std::mem::transmute::<
            *const c_void,
            vk::PFN_vkGetInstanceProcAddr,
        >(get_instance_proc_addr);
        let loader = ash::StaticFn {
            get_instance_proc_addr,
        };
        let instance = vk::Instance::from_raw(instance);
        Ok(ash::Instance::load(&loader, instance))
    }
}

/// A device from the 64 bits of a `VkDevice`.
///
/// # Errors
/// [`GpuError::Missing`] if the handle is null.
///
/// # Safety
/// The handle is null or of a device of `instance`, which is valid.
pub unsafe fn raw_device(instance: &ash::Instance, device: u64) -> Result<ash::Device, GpuError> {
    if device == 0 {
        return Err(GpuError::Missing(vec!["a device that is not null"]));
    }
    let device = vk::Device::from_raw(device);
    // SAFETY: the caller vouches for the handles.
    Ok(unsafe { ash::Device::load(instance.fp_v1_0(), device) })
}

/// Converts the 64 bits of a `VkCommandBuffer` to a handle.
pub fn command_buffer(raw: u64) -> vk::CommandBuffer {
    vk::CommandBuffer::from_raw(raw)
}
