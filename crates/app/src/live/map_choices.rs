//! The maps that queries may use: the baked ones, or others of the same graph, drawn when they are first needed.

use std::sync::OnceLock;

use sabaki::maps::{BakeError, BakedGraph, MapGrid};

/// Index into [`MapChoices`]; 0 is the baked maps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MapChoice(pub usize);

/// A graph with several sets of maps. Motions and paths are the same for all.
#[derive(Debug)]
pub struct MapChoices<'a> {
    baked: &'a BakedGraph,
    others: Vec<Other>,
}

#[derive(Debug)]
struct Other {
    grid: MapGrid,
    drawn: OnceLock<Result<BakedGraph, BakeError>>,
}

impl<'a> MapChoices<'a> {
    /// Heights of slabs that [`MapChoices::slabs`] offers, in metres.
    pub const HEIGHTS: [f32; 4] = [0.05, 0.10, 0.20, 0.30];

    /// The baked maps, and maps of other grids.
    #[must_use]
    pub fn new(baked: &'a BakedGraph, others: impl IntoIterator<Item = MapGrid>) -> Self {
        let own = baked.atlas().grid();
        let others = others.into_iter().filter(|grid| *grid != own);
        let other = |grid| Other {
            grid,
            drawn: OnceLock::new(),
        };
        Self {
            baked,
            others: others.map(other).collect(),
        }
    }

    /// The baked maps, the same with slabs of other heights, and the paper's.
    #[must_use]
    pub fn slabs(baked: &'a BakedGraph) -> Self {
        let own = baked.atlas().grid();
        let heights = Self::HEIGHTS.into_iter();
        let heights = heights.map(|slab_height| MapGrid { slab_height, ..own });
        Self::new(baked, heights.chain([MapGrid::PAPER]))
    }

    /// The graph with the baked maps.
    #[must_use]
    pub fn baked(&self) -> &'a BakedGraph {
        self.baked
    }

    /// All choices, the baked maps first.
    pub fn grids(&self) -> impl Iterator<Item = (MapChoice, MapGrid)> + '_ {
        let others = self.others.iter().map(|other| other.grid);
        let all = [self.baked.atlas().grid()].into_iter().chain(others);
        all.enumerate()
            .map(|(index, grid)| (MapChoice(index), grid))
    }

    /// The graph with these maps, which the first call draws on all threads. With the baked maps if the choice does not
    /// exist.
    ///
    /// # Errors
    /// These maps cannot be drawn.
    pub fn get(&self, choice: MapChoice) -> Result<&BakedGraph, &BakeError> {
        let other = choice
            .0
            .checked_sub(1)
            .and_then(|index| self.others.get(index));
        let Some(other) = other else {
            return Ok(self.baked);
        };
        let drawn = other.drawn.get_or_init(|| self.baked.with_maps(other.grid));
        drawn.as_ref()
    }
}

/// The name of a grid: the height of its slabs, or "paper".
#[must_use]
pub fn map_name(grid: MapGrid) -> String {
    match grid == MapGrid::PAPER {
        true => "paper".to_owned(),
        false => format!("{:.0} cm", 100.0 * grid.slab_height),
    }
}
