//! The caller's Vulkan objects, borrowed.
//!
//! Architecture invariant: nothing here creates or destroys an instance, a device or a queue.

use std::ffi::CString;

use ash::vk::{self, Handle};

use super::{
    GpuError,
    requirements::{self, Report},
};

/// The caller's objects, and what it switched on when it made them.
#[derive(Clone, Copy)]
pub struct ContextDesc<'a> {
    /// Made with `apiVersion` 1.3 or later.
    pub instance: &'a ash::Instance,
    /// Of `instance`.
    pub physical_device: vk::PhysicalDevice,
    /// Of `physical_device`, with `dynamicRendering` and `synchronization2` enabled.
    pub device: &'a ash::Device,
    /// The family of the queue that the recorded commands will run on; it must offer graphics.
    pub queue_family: u32,
    /// Whether `occlusionQueryPrecise` is enabled on `device`.
    pub precise_queries: bool,
    /// Whether `VK_EXT_debug_utils` is enabled on `instance`: objects then get names.
    pub debug_names: bool,
    /// The format of stencil targets; `None` for the best that the device has, as in [`Report::stencil_format`].
    pub stencil_format: Option<vk::Format>,
}

/// The same, for a caller that does not use `ash`.
#[derive(Clone, Copy)]
pub struct RawContextDesc {
    /// The loader's `vkGetInstanceProcAddr`.
    pub get_instance_proc_addr: vk::PFN_vkGetInstanceProcAddr,
    /// `VkInstance`, made with `apiVersion` 1.3 or later.
    pub instance: vk::Instance,
    /// `VkPhysicalDevice`.
    pub physical_device: vk::PhysicalDevice,
    /// `VkDevice`, with `dynamicRendering` and `synchronization2` enabled.
    pub device: vk::Device,
    /// As [`ContextDesc::queue_family`].
    pub queue_family: u32,
    /// As [`ContextDesc::precise_queries`].
    pub precise_queries: bool,
    /// As [`ContextDesc::debug_names`].
    pub debug_names: bool,
    /// As [`ContextDesc::stencil_format`].
    pub stencil_format: Option<vk::Format>,
}

/// A device that belongs to somebody else.
///
/// Its function tables are copies; the handles must outlive it and everything that is made from it.
#[derive(Clone)]
pub struct Context {
    instance: ash::Instance,
    physical_device: vk::PhysicalDevice,
    device: ash::Device,
    queue_family: u32,
    precise_queries: bool,
    stencil_format: vk::Format,
    limits: vk::PhysicalDeviceLimits,
    names: Option<ash::ext::debug_utils::Device>,
}

impl std::fmt::Debug for Context {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Context")
            .field("device", &self.device.handle())
            .field("queue_family", &self.queue_family)
            .field("precise_queries", &self.precise_queries)
            .field("stencil_format", &self.stencil_format)
            .finish_non_exhaustive()
    }
}

impl Context {
    /// Borrows the caller's device.
    ///
    /// # Errors
    /// [`GpuError::Missing`] when the device cannot do what is needed; [`check`](super::check()) says the same beforehand.
    ///
    /// # Safety
    /// The handles are valid, belong together, and outlive the context and everything made from it; the features that
    /// [`ContextDesc`] names are enabled as it says.
    pub unsafe fn new(desc: &ContextDesc<'_>) -> Result<Self, GpuError> {
        // SAFETY: the caller vouches for the handles.
        let report = unsafe { requirements::check(desc.instance, desc.physical_device) };
        let Report {
            missing,
            stencil_format: Some(best),
            ..
        } = report
        else {
            return Err(GpuError::Missing(report.missing));
        };
        if !missing.is_empty() {
            return Err(GpuError::Missing(missing));
        }
        let stencil_format = desc.stencil_format.unwrap_or(best);
        // SAFETY: as above.
        if !unsafe {
            requirements::has_stencil(desc.instance, desc.physical_device, stencil_format)
        } {
            return Err(GpuError::Missing(vec![
                "the stencil format that was asked for",
            ]));
        }
        // SAFETY: as above.
        let properties = unsafe {
            desc.instance
                .get_physical_device_properties(desc.physical_device)
        };
        let names = desc
            .debug_names
            .then(|| ash::ext::debug_utils::Device::new(desc.instance, desc.device));
        Ok(Self {
            instance: desc.instance.clone(),
            physical_device: desc.physical_device,
            device: desc.device.clone(),
            queue_family: desc.queue_family,
            precise_queries: desc.precise_queries && report.precise_queries,
            stencil_format,
            limits: properties.limits,
            names,
        })
    }

    /// Borrows a device by its raw handles: [`Handle::from_raw`] makes them from any binding's.
    ///
    /// # Errors
    /// As for [`Context::new`].
    ///
    /// # Safety
    /// As for [`Context::new`], and the function pointer is the one that the instance was made with.
    pub unsafe fn from_raw(desc: &RawContextDesc) -> Result<Self, GpuError> {
        let loader = ash::StaticFn {
            get_instance_proc_addr: desc.get_instance_proc_addr,
        };
        // SAFETY: the caller vouches for pointer and handles.
        unsafe {
            let instance = ash::Instance::load(&loader, desc.instance);
            let device = ash::Device::load(instance.fp_v1_0(), desc.device);
            Self::new(&ContextDesc {
                instance: &instance,
                physical_device: desc.physical_device,
                device: &device,
                queue_family: desc.queue_family,
                precise_queries: desc.precise_queries,
                debug_names: desc.debug_names,
                stencil_format: desc.stencil_format,
            })
        }
    }

    /// The caller's instance.
    #[must_use]
    pub fn instance(&self) -> &ash::Instance {
        &self.instance
    }

    /// The caller's device.
    #[must_use]
    pub fn device(&self) -> &ash::Device {
        &self.device
    }

    /// The caller's physical device.
    #[must_use]
    pub fn physical_device(&self) -> vk::PhysicalDevice {
        self.physical_device
    }

    /// The family of the queue that will run what is recorded.
    #[must_use]
    pub fn queue_family(&self) -> u32 {
        self.queue_family
    }

    /// Whether occlusion queries count samples, rather than only say whether there was one.
    #[must_use]
    pub fn precise_queries(&self) -> bool {
        self.precise_queries
    }

    /// The format of the stencil targets.
    #[must_use]
    pub fn stencil_format(&self) -> vk::Format {
        self.stencil_format
    }

    /// The device's limits.
    pub fn limits(&self) -> &vk::PhysicalDeviceLimits {
        &self.limits
    }

    /// The largest side of a stencil target, texels.
    #[must_use]
    pub fn max_target_side(&self) -> u32 {
        self.limits
            .max_image_dimension2_d
            .min(self.limits.max_framebuffer_width)
            .min(self.limits.max_framebuffer_height)
            .min(self.limits.max_viewport_dimensions[0])
            .min(self.limits.max_viewport_dimensions[1])
    }

    /// Gives an object a name that debuggers and validation show. A name that cannot be given is no error.
    pub(crate) fn name<T: Handle>(&self, handle: T, name: &str) {
        let (Some(names), Ok(name)) = (&self.names, CString::new(name)) else {
            return;
        };
        let info = vk::DebugUtilsObjectNameInfoEXT::default()
            .object_handle(handle)
            .object_name(&name);
        // SAFETY: the object was just made from this device, and nothing else uses it yet.
        if let Err(result) = unsafe { names.set_debug_utils_object_name(&info) } {
            tracing::debug!("vkSetDebugUtilsObjectNameEXT failed: {result}");
        }
    }
}
