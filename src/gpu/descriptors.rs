//! Descriptor sets of one layout.
//!
//! Architecture invariant: nothing here is freed by `Drop`. A default value holds null handles, and destroying it does nothing.

use ash::vk;

use super::{Context, GpuError, error::Named};

/// Descriptor sets of one layout. By default the handles are null; destroying those does nothing.
#[derive(Debug, Default)]
pub struct DescriptorSets {
    /// The Vulkan object.
    pub layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
    kinds: Vec<vk::DescriptorType>,
}

impl DescriptorSets {
    /// Creates the layout of a default value: kind and stages of each binding, from 0 on.
    pub fn make_layout(
        &mut self,
        context: &Context,
        bindings: &[(vk::DescriptorType, vk::ShaderStageFlags)],
    ) -> Result<(), GpuError> {
        let all = bindings.iter().zip(0..).map(|(&(kind, stages), number)| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(number)
                .descriptor_type(kind)
                .descriptor_count(1)
                .stage_flags(stages)
        });
        let all: Vec<_> = all.collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&all);
        let (device, callbacks) = (context.device(), context.callbacks());
        // SAFETY: the context's device is valid.
        self.layout = unsafe { device.create_descriptor_set_layout(&info, callbacks) }
            .call("vkCreateDescriptorSetLayout")?;
        self.kinds = bindings.iter().map(|&(kind, _)| kind).collect();
        Ok(())
    }

    /// Allocates sets of the layout. Call it once.
    pub fn allocate(
        &mut self,
        context: &Context,
        count: usize,
    ) -> Result<Vec<vk::DescriptorSet>, GpuError> {
        if count == 0 {
            return Ok(Vec::new());
        }
        let (device, most) = (context.device(), count as u32);
        let kinds = self.kinds.iter();
        let sizes = kinds.map(|&ty| {
            vk::DescriptorPoolSize::default()
                .ty(ty)
                .descriptor_count(most)
        });
        let sizes: Vec<_> = sizes.collect();
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(most)
            .pool_sizes(&sizes);
        // SAFETY: the context's device is valid.
        self.pool = unsafe { device.create_descriptor_pool(&info, context.callbacks()) }
            .call("vkCreateDescriptorPool")?;
        let layouts = vec![self.layout; count];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(self.pool)
            .set_layouts(&layouts);
        // SAFETY: pool and layout are of this device, and the pool has room for all.
        unsafe { device.allocate_descriptor_sets(&info) }.call("vkAllocateDescriptorSets")
    }

    /// Writes a buffer for each binding to a set that no command uses yet.
    pub(super) fn write(
        &self,
        context: &Context,
        set: vk::DescriptorSet,
        buffers: &[vk::DescriptorBufferInfo],
    ) {
        let writes = self.kinds.iter().zip(buffers).zip(0..);
        let writes = writes.map(|((&kind, buffer), number)| {
            vk::WriteDescriptorSet::default()
                .dst_set(set)
                .dst_binding(number)
                .descriptor_type(kind)
                .buffer_info(std::slice::from_ref(buffer))
        });
        // SAFETY: set and buffers are alive, and no command uses the set yet.
        unsafe {
            let device = context.device();
            device.update_descriptor_sets(&writes.collect::<Vec<_>>(), &[]);
        }
    }

    /// Frees layout, pool and sets. The device must not use them any more.
    pub fn destroy(&mut self, context: &Context) {
        // SAFETY: the handles are null or were made from this device, and the caller knows that the device is done with them.
        unsafe {
            let device = context.device();
            device.destroy_descriptor_pool(self.pool, context.callbacks());
            device.destroy_descriptor_set_layout(self.layout, context.callbacks());
        }
        *self = Self::default();
    }
}
