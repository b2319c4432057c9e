//! Culling: finds candidates that the attack certainly hits, and candidates that it certainly misses.
//!
//! Source: Masaoka & Oshita, section 5.3. A culling path ([`CullPath`]) takes a [`CullInput`] and returns an [`Overlap`] for each
//! candidate. The CPU ([`cpu`]) and the devices count the same texels.
//!
//! Differs: sections are planes, and maps have slices of time ([`MapGrid`](crate::maps::MapGrid)). Rounding ensures that one shared
//! texel of the inner maps proves a hit, and that no shared texel of the outer maps proves a miss.

pub mod cpu;
mod drawing;
mod path;
mod texels;

pub use drawing::{AttackDrawing, AttackLayer, CullCandidate, CullInput, TimedDisc};
pub(super) use drawing::{PlacedRegion, QueryMaps};
pub use path::{Counted, CullPath, Overlap};
