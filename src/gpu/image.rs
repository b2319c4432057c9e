//! A two-dimensional image with its view and its memory, which are created and destroyed together.
//!
//! Architecture invariant: nothing here is freed by `Drop`. A default value holds null handles, and destroying it does nothing.

use ash::vk;

use super::{
    Block, Context, GpuError, Memory, MemoryUse, Resource, error::Named, resources::DeviceMemory,
};

/// Description of an image.
#[derive(Clone, Copy)]
pub struct ImageDesc<'a> {
    /// Name for debuggers and validation.
    pub name: &'a str,
    /// Number of columns and rows, in texels.
    pub side: [u32; 2],
    /// Format of the texels.
    pub format: vk::Format,
    /// Number of samples of a texel.
    pub samples: vk::SampleCountFlags,
    /// Usage by the device.
    pub usage: vk::ImageUsageFlags,
    /// Aspect of the view.
    pub aspect: vk::ImageAspectFlags,
}

/// An image with its view and memory. By default the handles are null; destroying those does nothing.
#[derive(Debug, Default)]
pub struct Image {
    /// The Vulkan object.
    pub handle: vk::Image,
    /// A view of the whole image.
    pub view: vk::ImageView,
    /// Number of columns and rows, in texels.
    pub side: [u32; 2],
    block: Option<Block>,
}

impl DeviceMemory<'_> {
    /// Creates an image. On failure everything is freed again.
    pub fn image(&mut self, desc: &ImageDesc<'_>) -> Result<Image, GpuError> {
        let mut image = Image {
            side: desc.side,
            ..Image::default()
        };
        match image.fill(self, desc) {
            Ok(()) => Ok(image),
            Err(error) => {
                image.destroy(self.context, self.memory);
                Err(error)
            }
        }
    }
}

impl Image {
    fn fill(
        &mut self,
        memory: &mut DeviceMemory<'_>,
        desc: &ImageDesc<'_>,
    ) -> Result<(), GpuError> {
        let context = memory.context;
        let device = context.device();
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(desc.format)
            .extent(vk::Extent3D {
                width: self.side[0],
                height: self.side[1],
                depth: 1,
            })
            .mip_levels(1)
            .array_layers(1)
            .samples(desc.samples)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(desc.usage);
        // SAFETY: the context's device is valid, and the caller describes an image that its format supports.
        self.handle =
            unsafe { device.create_image(&info, context.callbacks()) }.call("vkCreateImage")?;
        context.name(self.handle, desc.name);
        let info = vk::ImageMemoryRequirementsInfo2::default().image(self.handle);
        let resource = Resource::Image(self.handle);
        // SAFETY: the image was just made from this device, which has Vulkan 1.1.
        let block = memory.allocate(desc.name, MemoryUse::Device, resource, |wanted| unsafe {
            device.get_image_memory_requirements2(&info, wanted);
        })?;
        self.block = Some(block);
        // SAFETY: the image is not bound yet, and the block suits its requirements.
        unsafe { device.bind_image_memory(self.handle, block.memory, block.offset) }
            .call("vkBindImageMemory")?;
        let range = vk::ImageSubresourceRange::default()
            .aspect_mask(desc.aspect)
            .level_count(1)
            .layer_count(1);
        let info = vk::ImageViewCreateInfo::default()
            .image(self.handle)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(desc.format)
            .subresource_range(range);
        // SAFETY: the image is bound, and of this format.
        self.view = unsafe { device.create_image_view(&info, context.callbacks()) }
            .call("vkCreateImageView")?;
        context.name(self.view, desc.name);
        Ok(())
    }

    /// Frees image, view and memory. The device must not use them any more.
    pub fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        let (device, callbacks) = (context.device(), context.callbacks());
        // SAFETY: the handles are null or were made from this device, and the caller knows that the device is done with them.
        unsafe {
            device.destroy_image_view(self.view, callbacks);
            device.destroy_image(self.handle, callbacks);
        }
        (self.view, self.handle) = (vk::ImageView::null(), vk::Image::null());
        if let Some(block) = self.block.take() {
            memory.free(block);
        }
    }
}
