//! Builds a graph: events, transitions, planted feet and links become a strongly connected graph.

pub(crate) mod builder;
pub(crate) mod candidates;
pub(crate) mod events;
pub(crate) mod foot_plans;
pub(crate) mod input;
pub(crate) mod islands;
pub(crate) mod links;
pub(crate) mod moments;
pub(crate) mod nearest;
pub(crate) mod plants;
pub(crate) mod prune;
pub(crate) mod report;
pub(crate) mod slide;
pub(crate) mod transition_test;
pub(crate) mod waits;
