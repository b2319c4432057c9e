//! The swapchain: the images that a window shows in turn.

use ash::{khr, vk};

use super::surface::{Surface, SurfaceSupport};
use sabaki::gpu::internal::Named;
use sabaki::gpu::{Context, GpuError};

/// A swapchain. Default: null handles.
#[derive(Default)]
pub(super) struct Swapchain {
    functions: Option<khr::swapchain::Device>,
    handle: vk::SwapchainKHR,
    images: Vec<SwapImage>,
    pub(super) size: [u32; 2],
    /// Whether the images can be read back.
    pub(super) readable: bool,
}

/// Settings of a [`Swapchain`].
#[derive(Clone, Copy)]
pub(super) struct SwapchainDesc {
    /// Size in pixels, for window systems that leave it to the program.
    pub(super) size: [u32; 2],
    /// Waits for the screen (vertical synchronization).
    pub(super) in_step: bool,
}

/// An image of the swapchain.
#[derive(Clone, Copy)]
pub(super) struct SwapImage {
    pub(super) handle: vk::Image,
    pub(super) view: vk::ImageView,
    /// Signalled when the image is drawn.
    pub(super) drawn: vk::Semaphore,
}

/// The outcome of acquiring an image.
pub(super) enum Acquired {
    /// Index of the image.
    Image(u32),
    /// No image in time; the window may be hidden.
    None,
    /// The swapchain no longer fits the window.
    Stale,
}

/// Longest time to wait for an image, in nanoseconds; a hidden window may give none.
const PATIENCE: u64 = 100_000_000;

impl Swapchain {
    /// Recreates the swapchain for the surface. The device must be idle. Empty while the window has no size.
    pub(super) fn remake(
        &mut self,
        context: &Context,
        surface: &Surface,
        desc: SwapchainDesc,
    ) -> Result<(), GpuError> {
        let support = surface.support(context)?;
        let size = support.size(desc.size);
        let old = std::mem::take(self);
        if size.contains(&0) {
            old.destroy(context);
            return Ok(());
        }
        let functions = khr::swapchain::Device::new(context.instance(), context.device());
        let desc = SwapchainDesc { size, ..desc };
        let info = info(&support, desc)?
            .surface(surface.handle)
            .old_swapchain(old.handle);
        // SAFETY: surface and old swapchain are of this device's instance, and the device is idle.
        let made = unsafe { functions.create_swapchain(&info, None) };
        old.destroy(context);
        self.handle = made.call("vkCreateSwapchainKHR")?;
        self.functions = Some(functions);
        self.size = size;
        self.readable = is_readable(&support);
        self.fill(context, info.image_format)
    }

    fn fill(&mut self, context: &Context, format: vk::Format) -> Result<(), GpuError> {
        let (Some(functions), device) = (&self.functions, context.device()) else {
            return Ok(());
        };
        // SAFETY: the swapchain is of these functions' device.
        let images = unsafe { functions.get_swapchain_images(self.handle) };
        for handle in images.call("vkGetSwapchainImagesKHR")? {
            let range = vk::ImageSubresourceRange::default()
                .aspect_mask(vk::ImageAspectFlags::COLOR)
                .level_count(1)
                .layer_count(1);
            let info = vk::ImageViewCreateInfo::default()
                .image(handle)
                .view_type(vk::ImageViewType::TYPE_2D)
                .format(format)
                .subresource_range(range);
            // SAFETY: the device is valid, the image of its swapchain.
            let (view, drawn) = unsafe {
                (
                    device.create_image_view(&info, None),
                    device.create_semaphore(&vk::SemaphoreCreateInfo::default(), None),
                )
            };
            // Both are stored before errors are checked, so that neither leaks.
            self.images.push(SwapImage {
                handle,
                view: view.unwrap_or_default(),
                drawn: drawn.unwrap_or_default(),
            });
            view.call("vkCreateImageView")?;
            drawn.call("vkCreateSemaphore")?;
        }
        Ok(())
    }

    /// Acquires the next image; `free` is signalled when it may be drawn to.
    pub(super) fn acquire(&self, free: vk::Semaphore) -> Result<Acquired, GpuError> {
        let Some(functions) = &self.functions else {
            return Ok(Acquired::Stale);
        };
        let fence = vk::Fence::null();
        // SAFETY: all are of one device; the semaphore's last wait has finished.
        match unsafe { functions.acquire_next_image(self.handle, PATIENCE, free, fence) } {
            Ok((image, _)) => Ok(Acquired::Image(image)),
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => Ok(Acquired::None),
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => Ok(Acquired::Stale),
            Err(result) => Err(result).call("vkAcquireNextImageKHR"),
        }
    }

    pub(super) fn image(&self, number: u32) -> SwapImage {
        self.images[number as usize]
    }

    /// Presents an image once it is drawn. Returns whether the swapchain still fits the window.
    pub(super) fn present(&self, queue: vk::Queue, number: u32) -> Result<bool, GpuError> {
        let Some(functions) = &self.functions else {
            return Ok(false);
        };
        let (waits, chains, numbers) = (
            [self.image(number).drawn],
            [self.handle],
            std::slice::from_ref(&number),
        );
        let info = vk::PresentInfoKHR::default()
            .wait_semaphores(&waits)
            .swapchains(&chains)
            .image_indices(numbers);
        // SAFETY: the image was acquired, and a submission that signals the semaphore went before.
        match unsafe { functions.queue_present(queue, &info) } {
            Ok(suboptimal) => Ok(!suboptimal),
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => Ok(false),
            Err(result) => Err(result).call("vkQueuePresentKHR"),
        }
    }

    /// The device is idle.
    pub(super) fn destroy(self, context: &Context) {
        let device = context.device();
        // SAFETY: the handles are null or of this device, which is done with them.
        unsafe {
            for image in self.images {
                device.destroy_image_view(image.view, None);
                device.destroy_semaphore(image.drawn, None);
            }
            if let Some(functions) = self.functions {
                functions.destroy_swapchain(self.handle, None);
            }
        }
    }
}

/// Whether the images of a surface can be copied to the host.
fn is_readable(support: &SurfaceSupport) -> bool {
    let usages = support.now.supported_usage_flags;
    usages.contains(vk::ImageUsageFlags::TRANSFER_SRC)
}

/// Description of a swapchain, without surface and old swapchain.
fn info(
    support: &SurfaceSupport,
    desc: SwapchainDesc,
) -> Result<vk::SwapchainCreateInfoKHR<'static>, GpuError> {
    use vk::ImageUsageFlags as Usage;
    let (now, format) = (&support.now, support.format()?);
    let [width, height] = desc.size;
    let read = match is_readable(support) {
        true => Usage::TRANSFER_SRC,
        false => Usage::empty(),
    };
    // One image that is shown, one that waits, and one that is drawn to.
    let most = match now.max_image_count {
        0 => u32::MAX,
        most => most,
    };
    use vk::CompositeAlphaFlagsKHR as Alpha;
    let alphas = [Alpha::OPAQUE, Alpha::INHERIT, Alpha::PRE_MULTIPLIED];
    let mut offered = alphas.into_iter();
    let alpha = offered.find(|alpha| now.supported_composite_alpha.contains(*alpha));
    Ok(vk::SwapchainCreateInfoKHR::default()
        .min_image_count(3.max(now.min_image_count).min(most))
        .image_format(format.format)
        .image_color_space(format.color_space)
        .image_extent(vk::Extent2D { width, height })
        .image_array_layers(1)
        .image_usage(Usage::COLOR_ATTACHMENT | read)
        .image_sharing_mode(vk::SharingMode::EXCLUSIVE)
        .pre_transform(now.current_transform)
        .composite_alpha(alpha.unwrap_or(Alpha::OPAQUE))
        .present_mode(support.mode(desc.in_step))
        .clipped(true))
}
