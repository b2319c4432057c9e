//! Features of a device that the culling paths use.

/// Vulkan features that the culling paths use, as offered by a device or enabled by its host.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features {
    /// `dynamicRendering`.
    pub dynamic_rendering: bool,
    /// `synchronization2`. No culling path needs it, but `sabaki-draw` does.
    pub synchronization2: bool,
    /// `extendedDynamicState`. On Vulkan 1.3 it is always there.
    pub extended_dynamic_state: bool,
    /// `occlusionQueryPrecise`.
    pub precise_queries: bool,
}

impl Features {
    /// All features.
    pub const ALL: Self = Self {
        dynamic_rendering: true,
        synchronization2: true,
        extended_dynamic_state: true,
        precise_queries: true,
    };

    /// Features that both sets have.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            dynamic_rendering: self.dynamic_rendering && other.dynamic_rendering,
            synchronization2: self.synchronization2 && other.synchronization2,
            extended_dynamic_state: self.extended_dynamic_state && other.extended_dynamic_state,
            precise_queries: self.precise_queries && other.precise_queries,
        }
    }
}
