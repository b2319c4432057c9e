use serde::{Deserialize, Serialize};

/// The set that candidates come from.
///
/// All sets except [`Enumerate::Whole`] come from the node's grid, from cells that the attack touches. If these have no path in time, or no
/// clean path, the candidates are those of [`Enumerate::Whole`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "Stored", into = "Stored")]
pub enum Enumerate {
    /// The touched cell nearest to the character's root, as in the paper.
    NearestCell,
    /// The nearest touched cell that has a path in time.
    NearestFiledCell,
    /// All touched cells.
    #[default]
    TouchedCells,
    /// All paths from the node to an evasion, and moves if those could be better.
    Whole,
}

impl Enumerate {
    /// Whether the set comes from the node's grid.
    #[must_use]
    pub fn uses_grid(self) -> bool {
        self != Self::Whole
    }
}

/// Serialized form, for example `{"grid":"union"}`.
#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Stored {
    Grid(StoredCells),
    Whole,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum StoredCells {
    Nearest,
    NearestFiled,
    Union,
}

impl From<Stored> for Enumerate {
    fn from(stored: Stored) -> Self {
        match stored {
            Stored::Grid(StoredCells::Nearest) => Self::NearestCell,
            Stored::Grid(StoredCells::NearestFiled) => Self::NearestFiledCell,
            Stored::Grid(StoredCells::Union) => Self::TouchedCells,
            Stored::Whole => Self::Whole,
        }
    }
}

impl From<Enumerate> for Stored {
    fn from(enumerate: Enumerate) -> Self {
        match enumerate {
            Enumerate::NearestCell => Self::Grid(StoredCells::Nearest),
            Enumerate::NearestFiledCell => Self::Grid(StoredCells::NearestFiled),
            Enumerate::TouchedCells => Self::Grid(StoredCells::Union),
            Enumerate::Whole => Self::Whole,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stored_form_is_that_of_a_grid_with_its_cells() {
        let forms: [(Enumerate, &[u8]); 4] = [
            (Enumerate::NearestCell, &[0, 0]),
            (Enumerate::NearestFiledCell, &[0, 1]),
            (Enumerate::TouchedCells, &[0, 2]),
            (Enumerate::Whole, &[1]),
        ];
        for (enumerate, bytes) in forms {
            assert_eq!(postcard::to_stdvec(&enumerate).unwrap(), bytes);
            assert_eq!(postcard::from_bytes::<Enumerate>(bytes), Ok(enumerate));
        }
    }
}
