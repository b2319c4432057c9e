//! What the command measures of answers: coverage, times of contact, quality, and why attacks hit.

pub(crate) mod by_time;
pub(crate) mod coverage;
pub(crate) mod interval;
mod limbs;
pub(crate) mod quality;
pub(crate) mod why_hit;
