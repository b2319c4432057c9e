//! The Vulkan surface of a window.

use std::ffi::CStr;
use std::sync::Arc;

use ash::{khr, vk};
use raw_window_handle::{HandleError, HasDisplayHandle, HasWindowHandle};

use sabaki::gpu::internal::Named;
use sabaki::gpu::{Context, GpuError};
use sabaki_fixtures::headless::Headless;

/// A window of any library.
pub(crate) trait WindowSystem: HasDisplayHandle + HasWindowHandle {}

impl<W: HasDisplayHandle + HasWindowHandle> WindowSystem for W {}

/// The instance extensions that the window system needs.
pub(super) fn extensions(window: &dyn WindowSystem) -> Result<Vec<&'static CStr>, GpuError> {
    let display = window.display_handle().map_err(no_handle)?;
    let names = ash_window::enumerate_required_extensions(display.as_raw())
        .call("vkCreateInstance for this window system")?;
    // SAFETY: the names are constants that end with a zero byte.
    let name = |name: &*const std::ffi::c_char| unsafe { CStr::from_ptr(*name) };
    Ok(names.iter().map(name).collect())
}

fn no_handle(error: HandleError) -> GpuError {
    tracing::error!("the window has no handle: {error}");
    GpuError::Missing(vec!["a handle of the window"])
}

/// The surface of a window. It keeps the window alive.
pub(super) struct Surface {
    pub(super) handle: vk::SurfaceKHR,
    functions: khr::surface::Instance,
    _window: Arc<dyn WindowSystem>,
}

/// Current properties of the surface.
pub(super) struct SurfaceSupport {
    pub(super) now: vk::SurfaceCapabilitiesKHR,
    pub(super) formats: Vec<vk::SurfaceFormatKHR>,
    pub(super) modes: Vec<vk::PresentModeKHR>,
}

impl Surface {
    /// Creates the surface. The device must be created with [`extensions`]; an error if its queue cannot present.
    pub(super) fn new(device: &Headless, window: Arc<dyn WindowSystem>) -> Result<Self, GpuError> {
        let context = device.context()?;
        let functions = khr::surface::Instance::new(device.entry(), context.instance());
        let display = window.display_handle().map_err(no_handle)?.as_raw();
        let raw = window.window_handle().map_err(no_handle)?.as_raw();
        // SAFETY: the handles are those of a living window, which the surface keeps alive; the instance has the extensions.
        let handle = unsafe {
            ash_window::create_surface(device.entry(), context.instance(), display, raw, None)
        };
        let surface = Self {
            handle: handle.call("vkCreateSurfaceKHR")?,
            functions,
            _window: window,
        };
        let (physical, family) = (context.physical_device(), context.queue_family());
        // SAFETY: all are of one instance.
        let shows = unsafe {
            let functions = &surface.functions;
            functions.get_physical_device_surface_support(physical, family, surface.handle)
        };
        match shows.call("vkGetPhysicalDeviceSurfaceSupportKHR") {
            Ok(true) => Ok(surface),
            other => {
                surface.destroy();
                other?;
                Err(GpuError::Missing(vec![
                    "a queue that shows pictures in this window",
                ]))
            }
        }
    }

    pub(super) fn support(&self, context: &Context) -> Result<SurfaceSupport, GpuError> {
        let (physical, functions) = (context.physical_device(), &self.functions);
        // SAFETY: all are of one instance.
        unsafe {
            Ok(SurfaceSupport {
                now: functions
                    .get_physical_device_surface_capabilities(physical, self.handle)
                    .call("vkGetPhysicalDeviceSurfaceCapabilitiesKHR")?,
                formats: functions
                    .get_physical_device_surface_formats(physical, self.handle)
                    .call("vkGetPhysicalDeviceSurfaceFormatsKHR")?,
                modes: functions
                    .get_physical_device_surface_present_modes(physical, self.handle)
                    .call("vkGetPhysicalDeviceSurfacePresentModesKHR")?,
            })
        }
    }

    /// The swapchain must be destroyed before.
    pub(super) fn destroy(self) {
        // SAFETY: the handle is of the functions' instance, which still lives.
        unsafe { self.functions.destroy_surface(self.handle, None) };
    }
}

impl SurfaceSupport {
    /// Chooses an sRGB format, as offscreen pictures have; else any format of four bytes.
    pub(super) fn format(&self) -> Result<vk::SurfaceFormatKHR, GpuError> {
        use vk::Format as F;
        let wanted = [
            F::B8G8R8A8_SRGB,
            F::R8G8B8A8_SRGB,
            F::B8G8R8A8_UNORM,
            F::R8G8B8A8_UNORM,
        ];
        let offered = |format: &F| {
            let same = |one: &&vk::SurfaceFormatKHR| {
                one.format == *format && one.color_space == vk::ColorSpaceKHR::SRGB_NONLINEAR
            };
            self.formats.iter().find(same).copied()
        };
        let found = wanted.iter().find_map(offered);
        found.ok_or_else(|| GpuError::Missing(vec!["a surface of four bytes a pixel"]))
    }

    /// Chooses the present mode: with vertical synchronization, or without it if the surface offers that.
    pub(super) fn mode(&self, in_step: bool) -> vk::PresentModeKHR {
        use vk::PresentModeKHR as Mode;
        let fast = [Mode::IMMEDIATE, Mode::MAILBOX];
        let offered = fast.into_iter().find(|mode| self.modes.contains(mode));
        match in_step {
            true => Mode::FIFO,
            false => offered.unwrap_or(Mode::FIFO),
        }
    }

    /// Size of the images, in pixels; 0 while the window is minimised. `wished` is used if the window system leaves the
    /// size to the program.
    pub(super) fn size(&self, wished: [u32; 2]) -> [u32; 2] {
        let current = self.now.current_extent;
        if current.width != u32::MAX {
            return [current.width, current.height];
        }
        let (least, most) = (self.now.min_image_extent, self.now.max_image_extent);
        [
            wished[0].clamp(least.width, most.width.max(least.width)),
            wished[1].clamp(least.height, most.height.max(least.height)),
        ]
    }
}
