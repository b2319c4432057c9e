//! Culling: finds candidates that the attack certainly hits, and candidates that it certainly misses.
//!
//! Source: Masaoka & Oshita, section 5.3. A culling path ([`CullPath`]) takes a [`CullInput`] and returns an [`Overlap`] for each
//! candidate. The CPU ([`cpu`]) and the devices count the same texels.
//!
//! Differs: sections are planes, and maps have slices of time ([`MapGrid`](crate::maps::MapGrid)). Rounding ensures that one shared
//! texel of the inner maps proves a hit, and that no shared texel of the outer maps proves a miss.

pub mod cpu;
mod draw_input;
pub(crate) mod drawing;
mod groups;
pub(crate) mod input;
pub(crate) mod overlap;
mod path;
mod query_maps;
mod steps;
mod texels;

pub(super) use draw_input::{DrawInput, PlacedRegion};
#[cfg(feature = "vulkan")]
pub(crate) use drawing::{AttackDrawing, AttackLayer, TimedDisc};
#[cfg(feature = "vulkan")]
pub(crate) use input::CullCandidate;
pub use input::CullInput;
pub use overlap::{Counted, Overlap};
pub use path::CullPath;
pub(super) use query_maps::QueryMaps;
