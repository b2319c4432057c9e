//! Builds a graph: events, transitions, planted feet and links become a strongly connected graph.

pub(crate) mod align;
pub(crate) mod builder;
pub(crate) mod candidates;
pub(crate) mod choose;
pub(crate) mod darts;
pub(crate) mod events;
#[cfg(test)]
mod fixture;
pub(crate) mod foot_plans;
pub(crate) mod join;
pub(crate) mod links;
pub(crate) mod moments;
pub(crate) mod nearest;
pub(crate) mod plants;
pub(crate) mod prune;
pub(crate) mod report;
pub(crate) mod slide;
pub(crate) mod waits;
