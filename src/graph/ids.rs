//! Indices of the parts of a motion graph.

use serde::{Deserialize, Serialize};

pub use crate::anim::ClipId;

macro_rules! index {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        pub struct $name(pub u32);

        impl $name {
            /// The index as a `usize`.
            #[must_use]
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    };
}

index!(
    /// Index of a node in [`MotionGraph::nodes`](super::MotionGraph::nodes).
    NodeId
);
index!(
    /// Index of an edge in [`MotionGraph::edges`](super::MotionGraph::edges).
    EdgeId
);
index!(
    /// Index of an event in [`MotionGraph::events`](super::MotionGraph::events).
    EventId
);
