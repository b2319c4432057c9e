use std::fmt;

use serde::{Deserialize, Serialize};

use crate::query::evaluation::Evaluation;

/// The implementation that counts the overlaps of candidates and attack. All paths return the same counts, except [`CullPath::Exact`], which
/// counts nothing, and occlusion queries on a device without precise queries, which only distinguish zero from more.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CullPath {
    /// No culling: every candidate is tested exactly, over the whole attack.
    Exact,
    /// Counts maps on the CPU.
    #[default]
    Cpu,
    /// Counts maps on a Vulkan device with the stencil buffer, by atomic additions or occlusion queries.
    Stencil,
    /// Counts maps on a Vulkan device with a compute shader.
    Compute,
}

impl CullPath {
    /// All paths.
    pub const ALL: [Self; 4] = [Self::Exact, Self::Cpu, Self::Stencil, Self::Compute];

    /// Name of the path in arguments, tables and files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Cpu => "cpu",
            Self::Stencil => "stencil",
            Self::Compute => "compute",
        }
    }

    /// The path of a [`CullPath::name`]; `None` for any other text.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|path| path.name() == name)
    }

    /// Evaluation of queries with this path: exhaustive for the exact path, lazy for all others.
    #[must_use]
    pub fn evaluation(self) -> Evaluation {
        match self {
            Self::Exact => Evaluation::Exhaustive,
            Self::Cpu | Self::Stencil | Self::Compute => Evaluation::Lazy,
        }
    }

    /// Whether the path runs on a Vulkan device.
    #[must_use]
    pub fn needs_device(self) -> bool {
        matches!(self, Self::Stencil | Self::Compute)
    }
}

impl fmt::Display for CullPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_path_is_found_by_its_name_and_no_other() {
        for path in CullPath::ALL {
            assert_eq!(CullPath::from_name(&path.to_string()), Some(path));
        }
        assert_eq!(CullPath::from_name("CPU"), None);
    }
}
