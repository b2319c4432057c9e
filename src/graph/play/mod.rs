//! Plays a graph: positions, motions, layers and cuts.

pub(crate) mod inertia;
pub(crate) mod motion;
pub(crate) mod motion_edit;
pub(crate) mod playhead;
pub(crate) mod sample;
