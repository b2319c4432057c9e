//! What a device must offer, what is good to have, and what is done without it.

use ash::vk;

/// One thing that a device offers or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Requirement {
    /// As Vulkan names it.
    pub name: &'static str,
    /// What is done without it; `None` where nothing can be.
    pub fallback: Option<&'static str>,
}

impl Requirement {
    /// Whether it cannot be done without.
    #[must_use]
    pub fn is_required(&self) -> bool {
        self.fallback.is_none()
    }
}

const VERSION: &str = "Vulkan 1.3";
const GRAPHICS: &str = "a queue family with graphics";
const RENDERING: &str = "dynamicRendering";
const SYNCHRONIZATION: &str = "synchronization2";
const STENCIL: &str = "a stencil format that can be drawn to and copied from";
const S8: &str = "S8_UINT";
const PRECISE: &str = "occlusionQueryPrecise";

/// Stencil formats, the best one first.
const STENCIL_FORMATS: [vk::Format; 3] = [
    vk::Format::S8_UINT,
    vk::Format::D24_UNORM_S8_UINT,
    vk::Format::D32_SFLOAT_S8_UINT,
];

/// Everything that is looked for, required things first.
#[must_use]
pub fn requirements() -> &'static [Requirement] {
    const fn required(name: &'static str) -> Requirement {
        Requirement {
            name,
            fallback: None,
        }
    }
    const fn optional(name: &'static str, fallback: &'static str) -> Requirement {
        Requirement {
            name,
            fallback: Some(fallback),
        }
    }
    const {
        &[
            required(VERSION),
            required(GRAPHICS),
            required(RENDERING),
            required(SYNCHRONIZATION),
            required(STENCIL),
            optional(S8, "D24_UNORM_S8_UINT, else D32_SFLOAT_S8_UINT"),
            optional(
                PRECISE,
                "culling by any or none; evasion overlaps are counted by the cpu path",
            ),
        ]
    }
}

/// What a device offers of [`requirements`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// Required things that it lacks, by name. Empty: it can be used.
    pub missing: Vec<&'static str>,
    /// Optional things that it lacks, with what is done instead.
    pub fallbacks: Vec<Requirement>,
    /// The stencil format that will be used.
    pub stencil_format: Option<vk::Format>,
    /// Whether occlusion queries can count samples.
    pub precise_queries: bool,
}

impl Report {
    /// Whether the device can be used.
    #[must_use]
    pub fn is_usable(&self) -> bool {
        self.missing.is_empty()
    }
}

/// Asks a physical device for everything in [`requirements`].
///
/// # Safety
/// `physical_device` belongs to `instance`, and both are valid.
#[must_use]
pub unsafe fn check(instance: &ash::Instance, physical_device: vk::PhysicalDevice) -> Report {
    // SAFETY: the caller vouches for both handles.
    let (properties, families) = unsafe {
        (
            instance.get_physical_device_properties(physical_device),
            instance.get_physical_device_queue_family_properties(physical_device),
        )
    };
    let modern = properties.api_version >= vk::API_VERSION_1_3;
    let mut features13 = vk::PhysicalDeviceVulkan13Features::default();
    let mut features = vk::PhysicalDeviceFeatures2::default();
    if modern {
        features = features.push_next(&mut features13);
    }
    // SAFETY: as above; the chain is only given to devices that know its structures.
    unsafe { instance.get_physical_device_features2(physical_device, &mut features) };
    let precise_queries = features.features.occlusion_query_precise == vk::TRUE;
    let stencil_format = STENCIL_FORMATS.into_iter().find(|&format| {
        // SAFETY: as above.
        unsafe { has_stencil(instance, physical_device, format) }
    });

    let graphics = families
        .iter()
        .any(|family| family.queue_flags.contains(vk::QueueFlags::GRAPHICS));
    let offered = |name: &str| match name {
        VERSION => modern,
        GRAPHICS => graphics,
        RENDERING => features13.dynamic_rendering == vk::TRUE,
        SYNCHRONIZATION => features13.synchronization2 == vk::TRUE,
        STENCIL => stencil_format.is_some(),
        S8 => stencil_format == Some(vk::Format::S8_UINT),
        PRECISE => precise_queries,
        _ => false,
    };
    let absent = || requirements().iter().filter(|one| !offered(one.name));
    Report {
        missing: absent()
            .filter(|one| one.is_required())
            .map(|one| one.name)
            .collect(),
        fallbacks: absent().filter(|one| !one.is_required()).copied().collect(),
        stencil_format,
        precise_queries,
    }
}

/// Whether stencil targets can have this format.
///
/// # Safety
/// As for [`check`].
pub(super) unsafe fn has_stencil(
    instance: &ash::Instance,
    physical_device: vk::PhysicalDevice,
    format: vk::Format,
) -> bool {
    let needed =
        vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT | vk::FormatFeatureFlags::TRANSFER_SRC;
    // SAFETY: the caller vouches for both handles.
    let properties =
        unsafe { instance.get_physical_device_format_properties(physical_device, format) };
    STENCIL_FORMATS.contains(&format) && properties.optimal_tiling_features.contains(needed)
}
