//! Which maps does a query use? The baked ones, or others of the same graph, drawn when they are first asked for.

use std::sync::OnceLock;

use sabaki::maps::{BakeError, BakedGraph, MapGrid};

/// One of [`MapChoices`]; 0 are the baked ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MapChoice(pub usize);

/// A graph with maps of several kinds. Its motions and the ways through it are the same for all.
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
    /// Heights of slabs, metres, that [`MapChoices::slabs`] offers.
    pub const HEIGHTS: [f32; 4] = [0.05, 0.10, 0.20, 0.30];

    /// The baked maps, and those of other grids.
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

    /// With the baked maps.
    #[must_use]
    pub fn baked(&self) -> &'a BakedGraph {
        self.baked
    }

    /// Every choice, the baked one first.
    pub fn grids(&self) -> impl Iterator<Item = (MapChoice, MapGrid)> + '_ {
        let others = self.others.iter().map(|other| other.grid);
        let all = [self.baked.atlas().grid()].into_iter().chain(others);
        all.enumerate()
            .map(|(index, grid)| (MapChoice(index), grid))
    }

    /// The graph with these maps, drawn now if nobody has asked for them before, on all threads; with the baked ones where the
    /// choice is none.
    ///
    /// # Errors
    /// Why these maps cannot be drawn.
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

/// A grid in a word or two: its slabs' height, or "paper".
#[must_use]
pub fn map_name(grid: MapGrid) -> String {
    match grid == MapGrid::PAPER {
        true => "paper".to_owned(),
        false => format!("{:.0} cm", 100.0 * grid.slab_height),
    }
}
