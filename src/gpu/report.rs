//! What a device offers to the culling paths, or what its host has enabled.

use std::ffi::CStr;

use ash::vk;

use super::{Features, Requirement, requirements};
use crate::query::cull::CullPath;

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
