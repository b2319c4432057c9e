//! The report on which culling paths run on a device.

use std::ffi::CStr;

use ash::vk;

use super::{Features, Requirement, requirements};
use crate::query::cull::CullPath;

/// Which culling paths run on a device, by what it offers or by what its host has enabled.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// Report of the stencil path.
    pub stencil: PathReport,
    /// Report of the compute path.
    pub compute: PathReport,
    /// Optional requirements that are missing, with their fallbacks.
    pub fallbacks: Vec<Requirement>,
    /// Device extensions that the host must enable for the stencil path, besides the features. Empty on Vulkan 1.3, and on 1.0, where no
    /// path runs.
    pub extensions: Vec<&'static CStr>,
    /// Stencil format that is used.
    pub stencil_format: Option<vk::Format>,
    /// Available features. A host that creates a device should enable these.
    pub features: Features,
}

/// Whether one path runs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PathReport {
    /// Names of missing requirements of the path. The path runs if this is empty.
    pub lacks: Vec<&'static str>,
    /// Whether counts are exact. Otherwise a count is 0 for no overlap and not 0 for some overlap, which is enough to remove candidates but
    /// not to score them.
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
    /// Whether any path runs.
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

    /// Names of all missing requirements of both paths, in the order of [`requirements`].
    #[must_use]
    pub fn missing(&self) -> Vec<&'static str> {
        let paths = [&self.stencil, &self.compute];
        let names = requirements().iter().map(|one| one.name);
        names
            .filter(|name| paths.iter().any(|path| path.lacks.contains(name)))
            .collect()
    }
}
