use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::query::evaluation::Evaluation;

/// The implementation that counts the overlaps of candidates and attack. All of them return the same counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CullPath {
    /// No culling: every candidate is tested exactly, over the whole attack.
    Exact,
    /// The maps on the CPU.
    #[default]
    Cpu,
    /// The maps on a Vulkan device, by stencil buffer and occlusion queries.
    Stencil,
    /// The maps on a Vulkan device, by a compute shader.
    Compute,
}

/// A name that is none of [`CullPath::ALL`].
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("no culling path is called {0:?}; there are exact, cpu, stencil and compute")]
pub struct UnknownCullPath(String);

impl CullPath {
    /// All paths.
    pub const ALL: [Self; 4] = [Self::Exact, Self::Cpu, Self::Stencil, Self::Compute];

    /// The name in arguments, tables and files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Cpu => "cpu",
            Self::Stencil => "stencil",
            Self::Compute => "compute",
        }
    }

    /// How queries of this path are evaluated: the exact path tests every candidate.
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

impl FromStr for CullPath {
    type Err = UnknownCullPath;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let named = Self::ALL.into_iter().find(|path| path.name() == name);
        named.ok_or_else(|| UnknownCullPath(name.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_path_is_found_by_its_name_and_no_other() {
        for path in CullPath::ALL {
            assert_eq!(path.to_string().parse(), Ok(path));
        }
        assert!("CPU".parse::<CullPath>().is_err());
    }
}
