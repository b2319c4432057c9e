//! Promise: input that is absurd but valid ends in an answer or in an error that names the limit, and takes no more memory than
//! is said here.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod attacks;
use sabaki_fixtures as common;
mod graphs;
use sabaki_fixtures::memory as peak;
mod settings;

/// Bytes.
const MB: usize = 1 << 20;
