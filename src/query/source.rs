use serde::{Deserialize, Serialize};

/// The set that the candidates of an answer come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The grid of the node.
    Grid,
    /// All paths, because the grid cells that the attack touches are empty.
    NothingFiled,
    /// All paths, because no candidate of the grid is clean.
    NothingClean,
    /// All paths, because the settings say so.
    #[default]
    Whole,
}
