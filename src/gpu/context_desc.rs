//! Description of the host's Vulkan objects.

use std::ffi::c_void;

use ash::vk;

use super::{Features, Terms};

/// The host's Vulkan objects, and the features that it enabled when it created them.
#[derive(Clone, Copy)]
pub struct ContextDesc<'a> {
    /// Instance, which was created with [`Terms::api_version`] as its `apiVersion`.
    pub instance: &'a ash::Instance,
    /// Physical device of `instance`.
    pub physical_device: vk::PhysicalDevice,
    /// Device of `physical_device`. Below Vulkan 1.3 it has the extensions of the enabled features.
    pub device: &'a ash::Device,
    /// Family of the queue that runs the recorded commands. The stencil path needs a graphics queue, the compute path a compute queue.
    pub queue_family: u32,
    /// Features that are enabled on `device`. A path that needs others does not run; see [`check_enabled`](super::check_enabled).
    pub features: Features,
    /// Whether `VK_EXT_debug_utils` is enabled on `instance`. If so, objects get names and passes get labels.
    pub debug_utils: bool,
    /// Version of the instance, and features that must not be used.
    pub terms: Terms,
}

/// [`ContextDesc`] with raw handles, for hosts that do not use `ash` or use another version of it.
///
/// A handle is given as 64 bits: of the pointer for `VkInstance`, `VkPhysicalDevice` and `VkDevice` (`Handle::as_raw` of any version
/// of `ash`).
#[derive(Clone, Copy, Debug)]
pub struct RawContextDesc {
    /// The `vkGetInstanceProcAddr` that the instance was created with.
    pub get_instance_proc_addr: *const c_void,
    /// `VkInstance`, as [`ContextDesc::instance`].
    pub instance: u64,
    /// `VkPhysicalDevice`.
    pub physical_device: u64,
    /// `VkDevice`, as [`ContextDesc::device`].
    pub device: u64,
    /// As [`ContextDesc::queue_family`].
    pub queue_family: u32,
    /// As [`ContextDesc::features`].
    pub features: Features,
    /// As [`ContextDesc::debug_utils`].
    pub debug_utils: bool,
    /// As [`ContextDesc::terms`].
    pub terms: Terms,
}
