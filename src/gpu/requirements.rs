//! Requirements of each culling path, optional features, and the fallbacks without them.

use crate::query::cull::CullPath;

/// A feature, format, version or limit that a culling path uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Requirement {
    /// Name in Vulkan.
    pub name: &'static str,
    /// Paths that cannot run without it.
    pub needed_by: &'static [CullPath],
    /// Fallback without it; `None` if it is required.
    pub fallback: Option<&'static str>,
}

impl Requirement {
    /// Whether any path cannot run without it.
    #[must_use]
    pub fn is_required(&self) -> bool {
        !self.needed_by.is_empty()
    }
}

pub(super) const VERSION: &str = "Vulkan 1.1";
pub(super) const GRAPHICS: &str = "a queue family with graphics";
pub(super) const COMPUTE: &str = "a queue family with compute";
pub(super) const RENDERING: &str = "dynamicRendering";
pub(super) const DYNAMIC_STATE: &str = "extendedDynamicState";
pub(super) const STENCIL: &str = "a stencil format that can be drawn to and copied from";
pub(super) const LIMITS: &str = "the limits that Vulkan guarantees";
pub(super) const CORE: &str = "Vulkan 1.3";
pub(super) const S8: &str = "S8_UINT";
pub(super) const PRECISE: &str = "occlusionQueryPrecise";

/// All requirements, first those that are not optional.
///
/// No limit is needed above the minimum that Vulkan guarantees. Where an input needs more than a device offers, the work is
/// divided (targets by `maxImageDimension2D`, dispatches by `maxComputeWorkGroupCount`, maps of the compute path by
/// `maxStorageBufferRange`, queries by the size of the pool), or refused by name
/// ([`GpuError::Limit`](super::GpuError::Limit): maps of the stencil path above `maxStorageBufferRange`).
#[must_use]
pub fn requirements() -> &'static [Requirement] {
    const BOTH: &[CullPath] = &[CullPath::Stencil, CullPath::Compute];
    const FOR_STENCIL: &[CullPath] = &[CullPath::Stencil];
    const FOR_COMPUTE: &[CullPath] = &[CullPath::Compute];
    const fn required(name: &'static str, needed_by: &'static [CullPath]) -> Requirement {
        Requirement {
            name,
            needed_by,
            fallback: None,
        }
    }
    const fn optional(name: &'static str, fallback: &'static str) -> Requirement {
        Requirement {
            name,
            needed_by: &[],
            fallback: Some(fallback),
        }
    }
    const {
        &[
            required(VERSION, BOTH),
            required(GRAPHICS, FOR_STENCIL),
            required(COMPUTE, FOR_COMPUTE),
            required(RENDERING, FOR_STENCIL),
            // It is part of Vulkan 1.3, where it needs no enabled feature.
            required(DYNAMIC_STATE, FOR_STENCIL),
            required(STENCIL, FOR_STENCIL),
            required(LIMITS, BOTH),
            optional(
                CORE,
                "for the stencil path: VK_KHR_dynamic_rendering and VK_EXT_extended_dynamic_state",
            ),
            optional(S8, "D24_UNORM_S8_UINT, else D32_SFLOAT_S8_UINT"),
            optional(PRECISE, "the stencil path says any or none"),
        ]
    }
}
