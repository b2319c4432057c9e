//! Terms on which a device is used: the version of Vulkan, and what is done without.

use ash::vk;

use super::Features;

/// On which terms a device is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Terms {
    /// `VkApplicationInfo::apiVersion` of the instance: what is used of Vulkan, however much more the device knows.
    /// Default 1.3.
    pub api_version: u32,
    /// What is done without. Default: nothing.
    pub without: Without,
}

impl Default for Terms {
    fn default() -> Self {
        Self {
            api_version: vk::API_VERSION_1_3,
            without: Without::default(),
        }
    }
}

/// What is done without, even where the device has it: to try a fallback, or to get around a driver's fault.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Without {
    /// `occlusionQueryPrecise`.
    pub precise_queries: bool,
    /// `fragmentStoresAndAtomics`.
    pub fragment_atomics: bool,
    /// Stencil targets of S8_UINT.
    pub s8: bool,
    /// Stencil targets of D24_UNORM_S8_UINT.
    pub d24_s8: bool,
    /// Limits above the minima that Vulkan guarantees.
    pub generous_limits: bool,
}

impl Without {
    /// What it leaves of all features.
    pub(super) fn features(&self) -> Features {
        Features {
            precise_queries: !self.precise_queries,
            fragment_atomics: !self.fragment_atomics,
            ..Features::ALL
        }
    }

    pub(super) fn forbids(&self, format: vk::Format) -> bool {
        match format {
            vk::Format::S8_UINT => self.s8,
            vk::Format::D24_UNORM_S8_UINT => self.d24_s8,
            _ => false,
        }
    }
}
