//! A pipeline cache that is kept as bytes between runs of the host's program.

use ash::vk;

use super::{Context, GpuError, error::Named};

/// Size of `VkPipelineCacheHeaderVersionOne`, in bytes.
const HEADER: usize = 16 + vk::UUID_SIZE;

/// A pipeline cache that is saved to bytes and loaded in a later run. A host with its own cache does not need it.
#[derive(Debug)]
pub struct PipelineCache {
    context: Context,
    handle: vk::PipelineCache,
    was_accepted: bool,
}

impl PipelineCache {
    /// Creates a cache from saved bytes. The cache is empty if they are damaged or of another device or driver.
    ///
    /// # Errors
    /// The error of `vkCreatePipelineCache`.
    pub fn new(context: &Context, bytes: &[u8]) -> Result<Self, GpuError> {
        // SAFETY: the context's handles are valid.
        let properties = unsafe {
            let instance = context.instance();
            instance.get_physical_device_properties(context.physical_device())
        };
        let was_accepted = is_of(bytes, &properties);
        let mut info = vk::PipelineCacheCreateInfo::default();
        if was_accepted {
            info = info.initial_data(bytes);
        }
        // SAFETY: as above; bytes of this device and driver came from a cache of theirs.
        let handle = unsafe { context.device().create_pipeline_cache(&info, None) }
            .call("vkCreatePipelineCache")?;
        context.name(handle, "sabaki pipeline cache");
        Ok(Self {
            context: context.clone(),
            handle,
            was_accepted,
        })
    }

    /// Handle of the cache, for [`CullerDesc::pipeline_cache`](super::CullerDesc::pipeline_cache) and for pipelines of the host.
    #[must_use]
    pub fn handle(&self) -> vk::PipelineCache {
        self.handle
    }

    /// Whether the cache was created from bytes of this device and driver.
    #[must_use]
    pub fn was_accepted(&self) -> bool {
        self.was_accepted
    }

    /// Bytes to save for the next run.
    ///
    /// # Errors
    /// The error of `vkGetPipelineCacheData`.
    pub fn bytes(&self) -> Result<Vec<u8>, GpuError> {
        let device = self.context.device();
        // SAFETY: the cache is of this device.
        unsafe { device.get_pipeline_cache_data(self.handle) }.call("vkGetPipelineCacheData")
    }

    /// Frees the cache. Pipelines that were created with it remain valid.
    pub fn destroy(self) {
        // SAFETY: the cache is of this device, and no pipeline is being created with it, because `self` is owned.
        unsafe {
            self.context
                .device()
                .destroy_pipeline_cache(self.handle, None);
        }
    }
}

/// Whether the header of a cache names this device and driver.
fn is_of(bytes: &[u8], properties: &vk::PhysicalDeviceProperties) -> bool {
    let Some(header) = bytes.first_chunk::<HEADER>() else {
        return false;
    };
    let word = |at: usize| {
        u32::from_le_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]])
    };
    let version = vk::PipelineCacheHeaderVersion::ONE.as_raw() as u32;
    word(0) as usize >= HEADER
        && word(4) == version
        && word(8) == properties.vendor_id
        && word(12) == properties.device_id
        && header[16..] == properties.pipeline_cache_uuid
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_of_another_device_or_driver_are_refused() {
        let mut properties = vk::PhysicalDeviceProperties {
            vendor_id: 7,
            device_id: 9,
            ..vk::PhysicalDeviceProperties::default()
        };
        properties.pipeline_cache_uuid = [3; vk::UUID_SIZE];
        let mut bytes = Vec::new();
        for word in [HEADER as u32, 1, 7, 9] {
            bytes.extend(word.to_le_bytes());
        }
        bytes.extend([3; vk::UUID_SIZE]);
        bytes.extend([1, 2, 3]);
        assert!(is_of(&bytes, &properties));
        assert!(!is_of(&bytes[..HEADER - 1], &properties));
        for at in [4, 8, 12, 16, HEADER - 1] {
            let mut other = bytes.clone();
            other[at] ^= 1;
            assert!(!is_of(&other, &properties), "{at}");
        }
    }
}
