//! Culls the candidates of sabaki's queries on a `wgpu::Device`, inside the host's own submissions.
//!
//! A [`Host`] is a wgpu device with the features that it has. A [`HostedCuller`] records culls into command buffers of wgpu's, which the host
//! submits between its own; [`HostedCuller::poll`] reads the counts in a later frame. The host needs no `ash` and writes no allocator.
//!
//! Architecture invariant: nothing here submits or waits.
#![warn(unreachable_pub)]

mod culler;
mod host;

pub use culler::HostedCuller;
pub use host::{Host, HostError};
/// The version that signatures here speak of.
pub use wgpu;
