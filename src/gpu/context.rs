//! The caller's Vulkan objects, borrowed.
//!
//! Architecture invariant: nothing here creates or destroys an instance, a device or a queue.

use std::ffi::{CStr, CString, c_void};

use ash::vk::{self, Handle};

use super::{GpuError, Report, Terms, check, drivers, limits};

/// The caller's objects, and what it switched on when it made them.
#[derive(Clone, Copy)]
pub struct ContextDesc<'a> {
    /// Made with [`Terms::api_version`] as its `apiVersion`.
    pub instance: &'a ash::Instance,
    /// Of `instance`.
    pub physical_device: vk::PhysicalDevice,
    /// Of `physical_device`, with `dynamicRendering` and `synchronization2` enabled; below Vulkan 1.3 also
    /// `extendedDynamicState` and the extensions that [`Report::extensions`] names.
    pub device: &'a ash::Device,
    /// The family of the queue that the recorded commands will run on. The `stencil` path needs graphics there, the
    /// `compute` path compute.
    pub queue_family: u32,
    /// Whether `occlusionQueryPrecise` is enabled on `device`.
    pub precise_queries: bool,
    /// Whether `fragmentStoresAndAtomics` is enabled on `device`.
    pub fragment_atomics: bool,
    /// Whether `VK_EXT_debug_utils` is enabled on `instance`: objects then get names.
    pub debug_names: bool,
    /// The version of the instance, and what is done without.
    pub terms: Terms,
}

/// The same by raw handles, for a caller that does not use `ash`, or another version of it.
///
/// A handle is its 64 bits: a pointer's for `VkInstance`, `VkPhysicalDevice` and `VkDevice` (`Handle::as_raw` of any `ash`).
#[derive(Clone, Copy, Debug)]
pub struct RawContextDesc {
    /// The `vkGetInstanceProcAddr` that the instance was made with.
    pub get_instance_proc_addr: *const c_void,
    /// `VkInstance`, as [`ContextDesc::instance`].
    pub instance: u64,
    /// `VkPhysicalDevice`.
    pub physical_device: u64,
    /// `VkDevice`, as [`ContextDesc::device`].
    pub device: u64,
    /// As [`ContextDesc::queue_family`].
    pub queue_family: u32,
    /// As [`ContextDesc::precise_queries`].
    pub precise_queries: bool,
    /// As [`ContextDesc::fragment_atomics`].
    pub fragment_atomics: bool,
    /// As [`ContextDesc::debug_names`].
    pub debug_names: bool,
    /// As [`ContextDesc::terms`].
    pub terms: Terms,
}

/// `VkCommandBuffer` by its pointer's 64 bits, for `record`: for callers that use another `ash`, or none.
#[must_use]
pub fn command_buffer(raw: u64) -> vk::CommandBuffer {
    vk::CommandBuffer::from_raw(raw)
}

/// [`check`] by raw handles; [`RawContextDesc::device`] may be 0, and the queue family anything.
///
/// # Errors
/// [`GpuError::Missing`] where another handle or the function is null.
///
/// # Safety
/// As for [`check`], and `get_instance_proc_addr` is null or the function that the instance was made with.
pub unsafe fn check_raw(desc: &RawContextDesc) -> Result<Report, GpuError> {
    // SAFETY: the caller vouches for pointer and handles.
    unsafe {
        let instance = instance_of(desc)?;
        let physical_device = vk::PhysicalDevice::from_raw(desc.physical_device);
        Ok(check(&instance, physical_device, &desc.terms))
    }
}

/// # Safety
/// As for [`check_raw`].
unsafe fn instance_of(desc: &RawContextDesc) -> Result<ash::Instance, GpuError> {
    if desc.get_instance_proc_addr.is_null() || desc.instance == 0 || desc.physical_device == 0 {
        return Err(GpuError::Missing(vec!["a handle that is not null"]));
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

/// A device that belongs to somebody else.
///
/// Its function tables are copies; the handles must outlive it and everything that is made from it.
#[derive(Clone)]
pub struct Context {
    instance: ash::Instance,
    physical_device: vk::PhysicalDevice,
    device: ash::Device,
    queue_family: u32,
    queue_flags: vk::QueueFlags,
    precise_queries: bool,
    fragment_atomics: bool,
    stencil_format: vk::Format,
    limits: vk::PhysicalDeviceLimits,
    most_queries: u64,
    names: Option<ash::ext::debug_utils::Device>,
}

impl std::fmt::Debug for Context {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Context")
            .field("device", &self.device.handle())
            .field("queue_family", &self.queue_family)
            .field("precise_queries", &self.precise_queries)
            .field("fragment_atomics", &self.fragment_atomics)
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
        let report = unsafe { check(desc.instance, desc.physical_device, &desc.terms) };
        let Report {
            missing,
            stencil_format: Some(stencil_format),
            ..
        } = report
        else {
            return Err(GpuError::Missing(report.missing));
        };
        if !missing.is_empty() {
            return Err(GpuError::Missing(missing));
        }
        // SAFETY: as above.
        let (properties, families) = unsafe {
            let instance = desc.instance;
            (
                instance.get_physical_device_properties(desc.physical_device),
                instance.get_physical_device_queue_family_properties(desc.physical_device),
            )
        };
        let Some(family) = families.get(desc.queue_family as usize) else {
            return Err(GpuError::Missing(vec!["the queue family"]));
        };
        // SAFETY: as above; the device has what the report asks for.
        let device = unsafe { functions(desc, properties.api_version) };
        let version = properties.api_version.min(desc.terms.api_version);
        // SAFETY: as above; both know this version.
        let driver = unsafe { drivers::driver(desc.instance, desc.physical_device, version) };
        let names = desc
            .debug_names
            .then(|| ash::ext::debug_utils::Device::new(desc.instance, &device));
        Ok(Self {
            instance: desc.instance.clone(),
            physical_device: desc.physical_device,
            device,
            queue_family: desc.queue_family,
            queue_flags: family.queue_flags,
            precise_queries: desc.precise_queries && report.precise_queries,
            fragment_atomics: desc.fragment_atomics && report.fragment_atomics,
            stencil_format,
            limits: limits::allowed(&properties.limits, &desc.terms.without),
            most_queries: drivers::most_queries(driver),
            names,
        })
    }

    /// Borrows a device by its raw handles.
    ///
    /// # Errors
    /// As for [`Context::new`]; [`GpuError::Missing`] too where a handle or the function is null.
    ///
    /// # Safety
    /// As for [`Context::new`], and `get_instance_proc_addr` is null or the function that the instance was made with.
    pub unsafe fn from_raw(desc: &RawContextDesc) -> Result<Self, GpuError> {
        if desc.device == 0 {
            return Err(GpuError::Missing(vec!["a handle that is not null"]));
        }
        // SAFETY: the caller vouches for pointer and handles.
        unsafe {
            let instance = instance_of(desc)?;
            let device = vk::Device::from_raw(desc.device);
            Self::new(&ContextDesc {
                instance: &instance,
                physical_device: vk::PhysicalDevice::from_raw(desc.physical_device),
                device: &ash::Device::load(instance.fp_v1_0(), device),
                queue_family: desc.queue_family,
                precise_queries: desc.precise_queries,
                fragment_atomics: desc.fragment_atomics,
                debug_names: desc.debug_names,
                terms: desc.terms,
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

    /// Whether that family can do something.
    #[doc(hidden)]
    pub fn queue_has(&self, flags: vk::QueueFlags) -> bool {
        self.queue_flags.contains(flags)
    }

    /// Whether occlusion queries count samples, rather than only say whether there was one.
    #[must_use]
    pub fn precise_queries(&self) -> bool {
        self.precise_queries
    }

    /// Whether fragment shaders can count, for [`Counting::Atomics`](super::Counting::Atomics).
    #[must_use]
    pub fn fragment_atomics(&self) -> bool {
        self.fragment_atomics
    }

    /// The format of the stencil targets.
    #[must_use]
    pub fn stencil_format(&self) -> vk::Format {
        self.stencil_format
    }

    /// The device's limits, as far as [`Terms::without`] leaves them.
    pub fn limits(&self) -> &vk::PhysicalDeviceLimits {
        &self.limits
    }

    /// Occlusion queries in one submission at most.
    pub(crate) fn most_queries(&self) -> u64 {
        self.most_queries
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
    #[doc(hidden)]
    pub fn name<T: Handle>(&self, handle: T, name: &str) {
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

/// The caller's function table; below Vulkan 1.3 one in which the extensions' functions have their later names.
///
/// # Safety
/// As for [`Context::new`].
unsafe fn functions(desc: &ContextDesc<'_>, device_version: u32) -> ash::Device {
    if device_version.min(desc.terms.api_version) >= vk::API_VERSION_1_3 {
        return desc.device.clone();
    }
    let (find, device) = (
        desc.instance.fp_v1_0().get_device_proc_addr,
        desc.device.handle(),
    );
    let lookup = |name: &CStr| -> *const c_void {
        let with = |suffix: &[u8]| CString::new([name.to_bytes(), suffix].concat());
        let (khr, ext) = (with(b"KHR"), with(b"EXT"));
        let names = [&khr, &ext].map(|one| one.as_deref().unwrap_or(name));
        let names = [names[0], names[1], name];
        // SAFETY: the caller vouches for the device; all names end with a zero byte.
        let found = names.map(|name| unsafe { find(device, name.as_ptr()) });
        found
            .into_iter()
            .flatten()
            .next()
            .map_or(std::ptr::null(), |function| function as *const c_void)
    };
    // SAFETY: Vulkan's own lookup function knows what is asked for, and extensions that became part of Vulkan kept their
    // functions' signatures.
    unsafe { ash::Device::load_with(lookup, device) }
}
