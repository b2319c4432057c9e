use serde::{Deserialize, Serialize};

/// Which candidates are tested exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Evaluation {
    /// Tests only the candidates that the choice depends on.
    ///
    /// Candidates that the maps remove are tested only if no other candidate is clean. A candidate that could not win even at
    /// distance 0 is not tested. With a negative weight of distance every candidate is tested. Evasions are tested on their baked body
    /// track, moves at every fourth sample first. The winner is tested once more, on its final motion.
    #[default]
    #[serde(rename = "needed")]
    Lazy,
    /// Tests every candidate, posed at every sample of the whole attack, and ignores the maps. The culling path `exact` does this. It is the
    /// reference for all other paths.
    #[serde(rename = "all")]
    Exhaustive,
}
