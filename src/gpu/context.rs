//! A reference to the host's device.
//!
//! Architecture invariant: nothing here creates or destroys an instance, a device or a queue.

use std::ffi::{CStr, CString, c_void};

use ash::vk::{self, Handle};

use super::{ContextDesc, Features, GpuError, Report, check_enabled, drivers};
use crate::query::cull::CullPath;

/// The host's device.
///
/// The function tables are copied. The handles must outlive the context and everything that is created from it.
#[derive(Clone)]
pub struct Context {
    instance: ash::Instance,
    physical_device: vk::PhysicalDevice,
    device: ash::Device,
    queue_family: u32,
    report: Report,
    driver: vk::DriverId,
    limits: vk::PhysicalDeviceLimits,
    debug: Option<ash::ext::debug_utils::Device>,
    callbacks: Option<vk::AllocationCallbacks<'static>>,
}

impl std::fmt::Debug for Context {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Context")
            .field("device", &self.device.handle())
            .field("queue_family", &self.queue_family)
            .field("report", &self.report)
            .finish_non_exhaustive()
    }
}

impl Context {
    /// Borrows the host's device.
    ///
    /// # Errors
    /// [`GpuError::Missing`] if no path runs on the device. [`check_enabled`] tells this in advance.
    ///
    /// # Safety
    /// The handles are valid, belong together, and outlive the context and everything that is created from it. The features that
    /// [`ContextDesc`] names are enabled.
    pub unsafe fn new(desc: &ContextDesc<'_>) -> Result<Self, GpuError> {
        // SAFETY: the caller vouches for the handles.
        let (report, properties, families) = unsafe {
            let instance = desc.instance;
            (
                check_enabled(desc),
                instance.get_physical_device_properties(desc.physical_device),
                instance.get_physical_device_queue_family_properties(desc.physical_device),
            )
        };
        if desc.queue_family as usize >= families.len() {
            return Err(GpuError::Missing(vec!["the queue family"]));
        }
        if !report.is_usable() {
            return Err(GpuError::Missing(report.missing()));
        }
        // SAFETY: as above; the device has what the report says.
        let device = unsafe { functions(desc, properties.api_version) };
        let version = properties.api_version.min(desc.api_version);
        // SAFETY: as above; both know this version.
        let driver = unsafe { drivers::driver(desc.instance, desc.physical_device, version) };
        let debug = desc
            .debug_utils
            .then(|| ash::ext::debug_utils::Device::new(desc.instance, &device));
        Ok(Self {
            instance: desc.instance.clone(),
            physical_device: desc.physical_device,
            device,
            queue_family: desc.queue_family,
            report,
            driver,
            limits: properties.limits,
            debug,
            callbacks: None,
        })
    }

    /// Passes the host's callbacks to each call that creates or destroys an object. Default: none. Memory of the device has its own
    /// interface, [`Memory`](super::Memory).
    ///
    /// # Safety
    /// The callbacks are valid as Vulkan asks, and outlive the context and everything that is created from it.
    #[must_use]
    pub unsafe fn with_callbacks(self, callbacks: &vk::AllocationCallbacks<'_>) -> Self {
        Self {
            callbacks: Some(vk::AllocationCallbacks {
                _marker: std::marker::PhantomData,
                ..*callbacks
            }),
            ..self
        }
    }

    /// [`Context::with_callbacks`].
    pub fn callbacks(&self) -> Option<&vk::AllocationCallbacks<'_>> {
        self.callbacks.as_ref()
    }

    /// The host's instance.
    pub fn instance(&self) -> &ash::Instance {
        &self.instance
    }

    /// The host's device.
    pub fn device(&self) -> &ash::Device {
        &self.device
    }

    /// The host's physical device.
    pub fn physical_device(&self) -> vk::PhysicalDevice {
        self.physical_device
    }

    /// Family of the queue that runs the recorded commands.
    pub fn queue_family(&self) -> u32 {
        self.queue_family
    }

    /// Which paths run with what the host has enabled.
    pub fn report(&self) -> &Report {
        &self.report
    }

    /// Features that are used.
    pub fn features(&self) -> Features {
        self.report.features
    }

    /// Refuses a path that cannot run, with the names of what it lacks.
    pub(crate) fn runs(&self, path: CullPath) -> Result<(), GpuError> {
        match self.report.path(path) {
            Some(report) if !report.runs() => Err(GpuError::Missing(report.lacks.clone())),
            _ => Ok(()),
        }
    }

    /// Format of stencil targets; `UNDEFINED` if the device has none.
    pub fn stencil_format(&self) -> vk::Format {
        self.report.stencil_format.unwrap_or_default()
    }

    /// Limits of the device.
    pub fn limits(&self) -> &vk::PhysicalDeviceLimits {
        &self.limits
    }

    pub(crate) fn driver(&self) -> vk::DriverId {
        self.driver
    }

    /// Maximum side of a stencil target, in texels.
    pub fn max_target_side(&self) -> u32 {
        self.limits
            .max_image_dimension2_d
            .min(self.limits.max_framebuffer_width)
            .min(self.limits.max_framebuffer_height)
            .min(self.limits.max_viewport_dimensions[0])
            .min(self.limits.max_viewport_dimensions[1])
    }

    /// Names an object for debuggers and validation. A failure is not an error.
    #[doc(hidden)]
    pub fn name<T: Handle>(&self, handle: T, name: &str) {
        let (Some(names), Ok(name)) = (&self.debug, CString::new(name)) else {
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

impl Context {
    /// Begins a labelled pass, for frame debuggers.
    ///
    /// # Safety
    /// `cmd` is being recorded, and [`Context::end_label`] follows in it.
    #[doc(hidden)]
    pub unsafe fn begin_label(&self, cmd: vk::CommandBuffer, name: &CStr) {
        if let Some(debug) = &self.debug {
            let label = vk::DebugUtilsLabelEXT::default().label_name(name);
            // SAFETY: the caller vouches for `cmd`; the instance has the extension.
            unsafe { debug.cmd_begin_debug_utils_label(cmd, &label) };
        }
    }

    /// Ends a labelled pass.
    ///
    /// # Safety
    /// `cmd` is being recorded, with a label that has begun.
    #[doc(hidden)]
    pub unsafe fn end_label(&self, cmd: vk::CommandBuffer) {
        if let Some(debug) = &self.debug {
            // SAFETY: as above.
            unsafe { debug.cmd_end_debug_utils_label(cmd) };
        }
    }
}

/// The host's function table. Below Vulkan 1.3, the functions of Vulkan 1.3 in it are those of the extensions.
///
/// # Safety
/// As for [`Context::new`].
unsafe fn functions(desc: &ContextDesc<'_>, device_version: u32) -> ash::Device {
    if device_version.min(desc.api_version) >= vk::API_VERSION_1_3 {
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
    // SAFETY: Vulkan's lookup function returns functions of the requested names. Extensions that became part of Vulkan kept the signatures
    // of their functions.
    unsafe { ash::Device::load_with(lookup, device) }
}
