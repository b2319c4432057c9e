use serde::{Deserialize, Serialize};

/// How many candidates are tested exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Evaluation {
    /// Only the candidates that the choice depends on.
    ///
    /// Candidates that the maps remove are tested only if no other candidate is clean. A candidate whose score could not win even at
    /// distance 0 is not tested (with a negative weight of distance every candidate is). Evasions are tested on their baked body
    /// track, moves at every fourth sample first. The winner is tested once more, on its final motion.
    #[default]
    #[serde(rename = "needed")]
    Lazy,
    /// Every candidate, posed at every sample of the whole attack, whatever the maps say. The culling path `exact` does this; it is
    /// the reference for all others.
    #[serde(rename = "all")]
    Exhaustive,
}
