//! What a device must offer, what is good to have, and what is done without it.

use std::ffi::CStr;

use ash::vk;

use super::{Terms, limits};

/// What sort of thing a [`Requirement`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RequirementKind {
    /// A version of Vulkan: of the physical device, and of `VkApplicationInfo::apiVersion`.
    Version,
    /// What a queue family can do.
    Queue,
    /// A feature, which the caller enables on its device.
    Feature,
    /// A format with its uses.
    Format,
    /// Values of `VkPhysicalDeviceLimits`.
    Limit,
}

/// One thing that a device offers or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Requirement {
    /// What sort of thing it is.
    pub kind: RequirementKind,
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

const VERSION: &str = "Vulkan 1.1";
const GRAPHICS: &str = "a queue family with graphics";
const RENDERING: &str = "dynamicRendering";
const SYNCHRONIZATION: &str = "synchronization2";
const DYNAMIC_STATE: &str = "extendedDynamicState";
const STENCIL: &str = "a stencil format that can be drawn to and copied from";
const LIMITS: &str = "the limits that Vulkan guarantees";
const CORE: &str = "Vulkan 1.3";
const S8: &str = "S8_UINT";
const PRECISE: &str = "occlusionQueryPrecise";
const ATOMICS: &str = "fragmentStoresAndAtomics";
const COMPUTE: &str = "a queue family with compute";

/// Stencil formats, the best one first.
const STENCIL_FORMATS: [vk::Format; 3] = [
    vk::Format::S8_UINT,
    vk::Format::D24_UNORM_S8_UINT,
    vk::Format::D32_SFLOAT_S8_UINT,
];

/// What stands in for Vulkan 1.3, with what it needs itself on 1.1.
const EXTENSIONS: [&CStr; 5] = [
    ash::khr::synchronization2::NAME,
    ash::khr::dynamic_rendering::NAME,
    ash::ext::extended_dynamic_state::NAME,
    ash::khr::depth_stencil_resolve::NAME,
    ash::khr::create_renderpass2::NAME,
];

/// Everything that is looked for, required things first.
///
/// Of limits, none is needed above the minimum that Vulkan guarantees. Where an input needs more than a device offers, the
/// work is cut up (targets by `maxImageDimension2D`, dispatches by `maxComputeWorkGroupCount`, maps of the compute path by
/// `maxStorageBufferRange`, queries by the size of our own pools), or refused by name
/// ([`GpuError::Limit`](super::GpuError::Limit): maps of the stencil path above `maxStorageBufferRange`).
#[must_use]
pub fn requirements() -> &'static [Requirement] {
    use RequirementKind::{Feature, Format, Limit, Queue, Version};
    const fn required(kind: RequirementKind, name: &'static str) -> Requirement {
        Requirement {
            kind,
            name,
            fallback: None,
        }
    }
    const fn optional(
        kind: RequirementKind,
        name: &'static str,
        fallback: &'static str,
    ) -> Requirement {
        Requirement {
            kind,
            name,
            fallback: Some(fallback),
        }
    }
    const {
        &[
            required(Version, VERSION),
            required(Queue, GRAPHICS),
            required(Feature, RENDERING),
            required(Feature, SYNCHRONIZATION),
            // Part of Vulkan 1.3, where no feature has to be enabled for it.
            required(Feature, DYNAMIC_STATE),
            required(Format, STENCIL),
            required(Limit, LIMITS),
            optional(
                Version,
                CORE,
                "VK_KHR_dynamic_rendering, VK_KHR_synchronization2 and VK_EXT_extended_dynamic_state",
            ),
            optional(Format, S8, "D24_UNORM_S8_UINT, else D32_SFLOAT_S8_UINT"),
            optional(
                Feature,
                PRECISE,
                "culling by any or none; evasion overlaps are counted by the cpu path",
            ),
            optional(
                Feature,
                ATOMICS,
                "the stencil path counts by occlusion queries",
            ),
            optional(Queue, COMPUTE, "the stencil path or the cpu path"),
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
    /// Device extensions that the caller enables, besides the features `dynamicRendering` and `synchronization2`. None on
    /// Vulkan 1.3; below it, with the feature `extendedDynamicState`.
    pub extensions: Vec<&'static CStr>,
    /// The stencil format that will be used.
    pub stencil_format: Option<vk::Format>,
    /// Whether occlusion queries can count samples.
    pub precise_queries: bool,
    /// Whether fragment shaders can count.
    pub fragment_atomics: bool,
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
/// `physical_device` belongs to `instance`, and both are valid; the instance was made with the version that `terms` has.
#[must_use]
pub unsafe fn check(
    instance: &ash::Instance,
    physical_device: vk::PhysicalDevice,
    terms: &Terms,
) -> Report {
    // SAFETY: the caller vouches for both handles.
    let offer = unsafe { Offer::of(instance, physical_device, terms) };
    let stencil_format = STENCIL_FORMATS.into_iter().find(|&format| {
        // SAFETY: as above.
        !terms.without.forbids(format) && unsafe { has_stencil(instance, physical_device, format) }
    });
    let offered = |name: &str| match name {
        VERSION => offer.version >= vk::API_VERSION_1_1,
        CORE => offer.version >= vk::API_VERSION_1_3,
        GRAPHICS => offer.queues.contains(vk::QueueFlags::GRAPHICS),
        COMPUTE => offer.queues.contains(vk::QueueFlags::COMPUTE),
        RENDERING => offer.dynamic_rendering,
        SYNCHRONIZATION => offer.synchronization2,
        DYNAMIC_STATE => offer.dynamic_state,
        STENCIL => stencil_format.is_some(),
        LIMITS => offer.has_limits,
        S8 => stencil_format == Some(vk::Format::S8_UINT),
        PRECISE => offer.precise_queries,
        ATOMICS => offer.fragment_atomics,
        _ => false,
    };
    let absent = || requirements().iter().filter(|one| !offered(one.name));
    Report {
        missing: absent()
            .filter(|one| one.is_required())
            .map(|one| one.name)
            .collect(),
        fallbacks: absent().filter(|one| !one.is_required()).copied().collect(),
        extensions: extensions(offer.version).to_vec(),
        stencil_format,
        precise_queries: offer.precise_queries,
        fragment_atomics: offer.fragment_atomics,
    }
}

/// The extensions that stand in for what a version lacks.
fn extensions(version: u32) -> &'static [&'static CStr] {
    match version {
        vk::API_VERSION_1_3.. => &[],
        // The other two are part of it.
        vk::API_VERSION_1_2.. => &EXTENSIONS[..3],
        _ => &EXTENSIONS,
    }
}

/// A device's answers.
#[derive(Default)]
struct Offer {
    /// Of device and instance, the lesser one.
    version: u32,
    /// Of all families.
    queues: vk::QueueFlags,
    dynamic_rendering: bool,
    synchronization2: bool,
    dynamic_state: bool,
    precise_queries: bool,
    fragment_atomics: bool,
    has_limits: bool,
}

impl Offer {
    /// # Safety
    /// As for [`check`].
    unsafe fn of(
        instance: &ash::Instance,
        physical_device: vk::PhysicalDevice,
        terms: &Terms,
    ) -> Self {
        // SAFETY: the caller vouches for both handles.
        let (properties, families) = unsafe {
            (
                instance.get_physical_device_properties(physical_device),
                instance.get_physical_device_queue_family_properties(physical_device),
            )
        };
        let mut offer = Self {
            version: properties.api_version.min(terms.api_version),
            queues: families
                .iter()
                .fold(vk::QueueFlags::empty(), |all, one| all | one.queue_flags),
            has_limits: limits::are_enough(&properties.limits),
            ..Self::default()
        };
        if offer.version >= vk::API_VERSION_1_1 {
            // SAFETY: as above; both sides know Vulkan 1.1.
            unsafe { offer.ask_features(instance, physical_device) };
            offer.precise_queries &= !terms.without.precise_queries;
            offer.fragment_atomics &= !terms.without.fragment_atomics;
        }
        offer
    }

    /// # Safety
    /// As for [`check`], with Vulkan 1.1.
    unsafe fn ask_features(
        &mut self,
        instance: &ash::Instance,
        physical_device: vk::PhysicalDevice,
    ) {
        // SAFETY: the caller vouches for both handles. Where the list cannot be had, it has no extension.
        let known = unsafe { instance.enumerate_device_extension_properties(physical_device) }
            .unwrap_or_default();
        let has = |name: &CStr| {
            let same = |one: &vk::ExtensionProperties| one.extension_name_as_c_str() == Ok(name);
            known.iter().any(same)
        };
        let askable = extensions(self.version).iter().all(|name| has(name));
        let mut rendering = vk::PhysicalDeviceDynamicRenderingFeatures::default();
        let mut synchronization = vk::PhysicalDeviceSynchronization2Features::default();
        let mut state = vk::PhysicalDeviceExtendedDynamicStateFeaturesEXT::default();
        let is_core = self.version >= vk::API_VERSION_1_3;
        let mut features = vk::PhysicalDeviceFeatures2::default();
        if !is_core && askable {
            features = features.push_next(&mut state);
        }
        if askable {
            features = features
                .push_next(&mut rendering)
                .push_next(&mut synchronization);
        }
        // SAFETY: as above; the chain is only given to devices that know its structures.
        unsafe { instance.get_physical_device_features2(physical_device, &mut features) };
        self.precise_queries = features.features.occlusion_query_precise == vk::TRUE;
        self.fragment_atomics = features.features.fragment_stores_and_atomics == vk::TRUE;
        self.dynamic_rendering = rendering.dynamic_rendering == vk::TRUE;
        self.synchronization2 = synchronization.synchronization2 == vk::TRUE;
        self.dynamic_state = is_core || state.extended_dynamic_state == vk::TRUE;
    }
}

/// Whether stencil targets can have this format.
///
/// # Safety
/// As for [`check`].
unsafe fn has_stencil(
    instance: &ash::Instance,
    physical_device: vk::PhysicalDevice,
    format: vk::Format,
) -> bool {
    let needed =
        vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT | vk::FormatFeatureFlags::TRANSFER_SRC;
    // SAFETY: the caller vouches for both handles.
    let properties =
        unsafe { instance.get_physical_device_format_properties(physical_device, format) };
    properties.optimal_tiling_features.contains(needed)
}
