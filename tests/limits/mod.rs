//! Promise: input that is absurd but valid ends in an answer or in an error that names the limit, and takes no more memory than
//! is said here.

mod attacks;
mod graphs;
mod settings;

/// Bytes.
const MB: usize = 1 << 20;
