//! Restrictions on the use of a device: the version of Vulkan, and features that are not used.

use ash::vk;

use super::Features;

/// Restrictions on the use of a device. A host sets them to try a fallback or to work around a driver's fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Terms {
    /// `VkApplicationInfo::apiVersion` of the instance, the newest version of Vulkan that is used. Default 1.3.
    pub api_version: u32,
    /// Do not use `occlusionQueryPrecise`. Default false.
    pub without_precise_queries: bool,
    /// Do not use stencil targets of S8_UINT. Default false.
    pub without_s8: bool,
    /// Do not use stencil targets of D24_UNORM_S8_UINT. Default false.
    pub without_d24_s8: bool,
    /// Do not use limits above the minima that Vulkan guarantees. Default false.
    pub without_generous_limits: bool,
}

impl Default for Terms {
    fn default() -> Self {
        Self::new(vk::API_VERSION_1_3)
    }
}

impl Terms {
    /// No restrictions, for an instance of this version.
    #[must_use]
    pub const fn new(api_version: u32) -> Self {
        Self {
            api_version,
            without_precise_queries: false,
            without_s8: false,
            without_d24_s8: false,
            without_generous_limits: false,
        }
    }

    /// Features that the restrictions allow.
    pub(super) fn features(&self) -> Features {
        Features {
            precise_queries: !self.without_precise_queries,
            ..Features::ALL
        }
    }

    pub(super) fn forbid(&self, format: vk::Format) -> bool {
        match format {
            vk::Format::S8_UINT => self.without_s8,
            vk::Format::D24_UNORM_S8_UINT => self.without_d24_s8,
            _ => false,
        }
    }
}
