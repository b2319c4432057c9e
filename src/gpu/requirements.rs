//! What each path needs of a device, what is optional, and what happens without it.

use std::ffi::CStr;

use ash::vk;

use super::{ContextDesc, Features, Terms, limits};
use crate::query::cull::CullPath;

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
    /// Its name, as Vulkan has it.
    pub name: &'static str,
    /// Paths that cannot run without it.
    pub needed_by: &'static [CullPath],
    /// What happens without it, where something can.
    pub fallback: Option<&'static str>,
}

impl Requirement {
    /// Whether some path cannot run without it.
    #[must_use]
    pub fn is_required(&self) -> bool {
        !self.needed_by.is_empty()
    }
}

const VERSION: &str = "Vulkan 1.1";
const GRAPHICS: &str = "a queue family with graphics";
const COMPUTE: &str = "a queue family with compute";
const RENDERING: &str = "dynamicRendering";
const SYNCHRONIZATION: &str = "synchronization2";
const DYNAMIC_STATE: &str = "extendedDynamicState";
const STENCIL: &str = "a stencil format that can be drawn to and copied from";
const LIMITS: &str = "the limits that Vulkan guarantees";
const CORE: &str = "Vulkan 1.3";
const S8: &str = "S8_UINT";
const PRECISE: &str = "occlusionQueryPrecise";
const ATOMICS: &str = "fragmentStoresAndAtomics";

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
/// No limit is needed above the minimum that Vulkan guarantees. Where an input needs more than a device offers, the work is
/// divided (targets by `maxImageDimension2D`, dispatches by `maxComputeWorkGroupCount`, maps of the compute path by
/// `maxStorageBufferRange`, queries by the size of the pool), or refused by name
/// ([`GpuError::Limit`](super::GpuError::Limit): maps of the stencil path above `maxStorageBufferRange`).
#[must_use]
pub fn requirements() -> &'static [Requirement] {
    use RequirementKind::{Feature, Format, Limit, Queue, Version};
    const BOTH: &[CullPath] = &[CullPath::Stencil, CullPath::Compute];
    const FOR_STENCIL: &[CullPath] = &[CullPath::Stencil];
    const FOR_COMPUTE: &[CullPath] = &[CullPath::Compute];
    const fn required(
        kind: RequirementKind,
        name: &'static str,
        needed_by: &'static [CullPath],
    ) -> Requirement {
        Requirement {
            kind,
            name,
            needed_by,
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
            needed_by: &[],
            fallback: Some(fallback),
        }
    }
    const {
        &[
            required(Version, VERSION, BOTH),
            required(Queue, GRAPHICS, FOR_STENCIL),
            required(Queue, COMPUTE, FOR_COMPUTE),
            required(Feature, RENDERING, FOR_STENCIL),
            // Part of Vulkan 1.3, where no feature has to be enabled for it.
            required(Feature, DYNAMIC_STATE, FOR_STENCIL),
            required(Format, STENCIL, FOR_STENCIL),
            required(Limit, LIMITS, BOTH),
            optional(
                Version,
                CORE,
                "for the stencil path: VK_KHR_dynamic_rendering and VK_EXT_extended_dynamic_state",
            ),
            optional(Feature, SYNCHRONIZATION, "the barriers of Vulkan 1.0"),
            optional(Format, S8, "D24_UNORM_S8_UINT, else D32_SFLOAT_S8_UINT"),
            optional(
                Feature,
                PRECISE,
                "the stencil path counts by fragment atomics, else it says any or none",
            ),
            optional(
                Feature,
                ATOMICS,
                "the stencil path counts by occlusion queries",
            ),
        ]
    }
}

/// What a device offers of [`requirements`], or what its host has enabled of them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// Whether the stencil path runs.
    pub stencil: PathReport,
    /// Whether the compute path runs.
    pub compute: PathReport,
    /// Missing optional things, with what happens instead.
    pub fallbacks: Vec<Requirement>,
    /// Device extensions that the host enables for the stencil path, besides the features. None on Vulkan 1.3, and none on 1.0,
    /// where nothing runs.
    pub extensions: Vec<&'static CStr>,
    /// The stencil format that will be used.
    pub stencil_format: Option<vk::Format>,
    /// Features that are there. A host that creates a device enables these.
    pub features: Features,
}

/// Whether one path runs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PathReport {
    /// Missing things that the path cannot run without. Empty: it runs.
    pub lacks: Vec<&'static str>,
    /// Whether the path counts. Otherwise it says none (0) or some (not 0), which is enough to remove candidates, but not to score
    /// them.
    pub counts_exact: bool,
}

impl PathReport {
    /// Whether the path runs.
    #[must_use]
    pub fn runs(&self) -> bool {
        self.lacks.is_empty()
    }
}

impl Report {
    /// Whether some path runs.
    #[must_use]
    pub fn is_usable(&self) -> bool {
        self.stencil.runs() || self.compute.runs()
    }

    /// The report of a path; `None` for a path that needs no device.
    #[must_use]
    pub fn path(&self, path: CullPath) -> Option<&PathReport> {
        match path {
            CullPath::Stencil => Some(&self.stencil),
            CullPath::Compute => Some(&self.compute),
            CullPath::Exact | CullPath::Cpu => None,
        }
    }

    /// Everything that some path lacks, in the order of [`requirements`].
    #[must_use]
    pub fn missing(&self) -> Vec<&'static str> {
        let paths = [&self.stencil, &self.compute];
        let names = requirements().iter().map(|one| one.name);
        names
            .filter(|name| paths.iter().any(|path| path.lacks.contains(name)))
            .collect()
    }
}

/// Asks a physical device for everything in [`requirements`]. [`check_enabled`] says what of it the host has enabled.
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
    unsafe { Offer::of(instance, physical_device, terms) }.report()
}

/// The same for what the host has enabled on its device, and for its queue family.
///
/// # Safety
/// The instance and the physical device of `desc` are as [`check`] has them. Its device may be anything.
#[must_use]
pub unsafe fn check_enabled(desc: &ContextDesc<'_>) -> Report {
    let (instance, physical_device) = (desc.instance, desc.physical_device);
    // SAFETY: the caller vouches for both handles.
    let (mut offer, families) = unsafe {
        (
            Offer::of(instance, physical_device, &desc.terms),
            instance.get_physical_device_queue_family_properties(physical_device),
        )
    };
    let family = families.get(desc.queue_family as usize);
    offer.queues = family.map_or(vk::QueueFlags::empty(), |family| family.queue_flags);
    let is_core = offer.version >= vk::API_VERSION_1_3;
    let enabled = Features {
        extended_dynamic_state: is_core || desc.features.extended_dynamic_state,
        ..desc.features
    };
    offer.features = offer.features.and(enabled);
    offer.report()
}

/// The extensions that stand in for what a version lacks.
fn extensions(version: u32) -> &'static [&'static CStr] {
    match version {
        ..vk::API_VERSION_1_1 | vk::API_VERSION_1_3.. => &[],
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
    /// Of all families, or of the host's.
    queues: vk::QueueFlags,
    features: Features,
    stencil_format: Option<vk::Format>,
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
            offer.features = offer.features.and(terms.without.features());
        }
        offer.stencil_format = STENCIL_FORMATS.into_iter().find(|&format| {
            let allowed = !terms.without.forbids(format);
            // SAFETY: as above.
            allowed && unsafe { has_stencil(instance, physical_device, format) }
        });
        offer
    }

    fn has(&self, name: &str) -> bool {
        match name {
            VERSION => self.version >= vk::API_VERSION_1_1,
            CORE => self.version >= vk::API_VERSION_1_3,
            GRAPHICS => self.queues.contains(vk::QueueFlags::GRAPHICS),
            COMPUTE => self.queues.contains(vk::QueueFlags::COMPUTE),
            RENDERING => self.features.dynamic_rendering,
            SYNCHRONIZATION => self.features.synchronization2,
            DYNAMIC_STATE => self.features.extended_dynamic_state,
            STENCIL => self.stencil_format.is_some(),
            LIMITS => self.has_limits,
            S8 => self.stencil_format == Some(vk::Format::S8_UINT),
            PRECISE => self.features.precise_queries,
            ATOMICS => self.features.fragment_atomics,
            _ => false,
        }
    }

    fn report(&self) -> Report {
        let missing = || requirements().iter().filter(|one| !self.has(one.name));
        let path = |path: CullPath, counts_exact| PathReport {
            lacks: missing()
                .filter(|one| one.needed_by.contains(&path))
                .map(|one| one.name)
                .collect(),
            counts_exact,
        };
        let Features {
            precise_queries,
            fragment_atomics,
            ..
        } = self.features;
        Report {
            stencil: path(CullPath::Stencil, precise_queries || fragment_atomics),
            compute: path(CullPath::Compute, true),
            fallbacks: missing()
                .filter(|one| !one.is_required())
                .copied()
                .collect(),
            extensions: extensions(self.version).to_vec(),
            stencil_format: self.stencil_format,
            features: self.features,
        }
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
        let is_core = self.version >= vk::API_VERSION_1_3;
        let knows = |name: &CStr| is_core || has(name);
        let mut rendering = vk::PhysicalDeviceDynamicRenderingFeatures::default();
        let mut synchronization = vk::PhysicalDeviceSynchronization2Features::default();
        let mut state = vk::PhysicalDeviceExtendedDynamicStateFeaturesEXT::default();
        let mut features = vk::PhysicalDeviceFeatures2::default();
        if !is_core && knows(ash::ext::extended_dynamic_state::NAME) {
            features = features.push_next(&mut state);
        }
        // Below 1.3 it stands on other extensions, which are asked for with it.
        if extensions(self.version)
            .iter()
            .filter(|name| **name != ash::khr::synchronization2::NAME)
            .all(|name| knows(name))
        {
            features = features.push_next(&mut rendering);
        }
        if knows(ash::khr::synchronization2::NAME) {
            features = features.push_next(&mut synchronization);
        }
        // SAFETY: as above; the chain is only given to devices that know its structures.
        unsafe { instance.get_physical_device_features2(physical_device, &mut features) };
        let core = features.features;
        self.features = Features {
            dynamic_rendering: rendering.dynamic_rendering == vk::TRUE,
            synchronization2: synchronization.synchronization2 == vk::TRUE,
            extended_dynamic_state: is_core || state.extended_dynamic_state == vk::TRUE,
            precise_queries: core.occlusion_query_precise == vk::TRUE,
            fragment_atomics: core.fragment_stores_and_atomics == vk::TRUE,
        };
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
