//! Terms on which a device is used: the version of Vulkan, and what is done without.

use ash::vk;

use super::Features;

/// On which terms a device is used. A host does without something that its device has to try a fallback, or to get around a
/// driver's fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Terms {
    /// `VkApplicationInfo::apiVersion` of the instance: what is used of Vulkan, however much more the device knows.
    /// Default 1.3.
    pub api_version: u32,
    /// Whether `occlusionQueryPrecise` is not used. Default: no.
    pub without_precise_queries: bool,
    /// Whether `fragmentStoresAndAtomics` is not used. Default: no.
    pub without_fragment_atomics: bool,
    /// Whether stencil targets of S8_UINT are not used. Default: no.
    pub without_s8: bool,
    /// Whether stencil targets of D24_UNORM_S8_UINT are not used. Default: no.
    pub without_d24_s8: bool,
    /// Whether limits above the minima that Vulkan guarantees are not used. Default: no.
    pub without_generous_limits: bool,
}

impl Default for Terms {
    fn default() -> Self {
        Self::new(vk::API_VERSION_1_3)
    }
}

impl Terms {
    /// The terms of an instance of this version. Everything that its devices have is used.
    #[must_use]
    pub const fn new(api_version: u32) -> Self {
        Self {
            api_version,
            without_precise_queries: false,
            without_fragment_atomics: false,
            without_s8: false,
            without_d24_s8: false,
            without_generous_limits: false,
        }
    }

    /// What they leave of all features.
    pub(super) fn features(&self) -> Features {
        Features {
            precise_queries: !self.without_precise_queries,
            fragment_atomics: !self.without_fragment_atomics,
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
