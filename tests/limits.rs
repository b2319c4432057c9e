//! Promise: input that is absurd but valid ends in an answer or in an error that names the limit, and takes no more memory than
//! is said here.
#![cfg(feature = "demo")]
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "limits/attacks.rs"]
mod attacks;
mod common;
#[path = "limits/graphs.rs"]
mod graphs;
#[path = "common/peak.rs"]
mod peak;
#[path = "limits/settings.rs"]
mod settings;

/// Bytes.
const MB: usize = 1 << 20;
