//! Share of attacks that is avoided, by direction, height and lead.
//!
//! Balls are thrown from all directions at all heights with all leads. Each cell uses its own moments of the graph, so that the
//! cells are independent samples and the intervals hold for sums of cells, too.

use std::f32::consts::TAU;

use super::by_time::AvoidedCount;
use sabaki::maps::BakedGraph;
use sabaki::query::AttackError;
use sabaki_fixtures::throw::{Aim, RandomDraw, Throw, aimed};

/// Parts of the body with their heights, as shares of the body's height.
pub const HEIGHTS: [(&str, f32); 5] = [
    ("ankle", 0.05),
    ("knee", 0.28),
    ("hip", 0.53),
    ("chest", 0.74),
    ("head", 0.94),
];

/// Times from the query to the throw, in seconds.
pub const LEADS: [f32; 7] = [0.2, 0.4, 0.6, 0.8, 1.0, 1.25, 1.5];

/// One kind of attack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell {
    /// Index of the direction.
    pub direction: usize,
    /// Index into [`HEIGHTS`].
    pub height: usize,
    /// Index into [`LEADS`].
    pub lead: usize,
}

/// Number of avoided attacks of each kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Coverage {
    directions: usize,
    /// Numbers of attacks by direction, height and lead.
    counts: Vec<AvoidedCount>,
}

/// The kind of attack that a new evasion should answer first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// The kind, with the lead at which it is furthest below the others.
    pub cell: Cell,
    /// Share of its attacks that is avoided, over all leads.
    pub any_lead: f64,
    /// Share that is avoided at that lead.
    pub share: f64,
    /// Share of all attacks with that lead that is avoided.
    pub others: f64,
    /// Whether less is avoided than of all attacks by more than chance: the 95% intervals do not touch.
    pub is_certain: bool,
}

impl Coverage {
    /// Creates an empty table for a number of directions, at least 1.
    #[must_use]
    pub fn new(directions: usize) -> Self {
        let directions = directions.max(1);
        Self {
            directions,
            counts: vec![AvoidedCount::default(); directions * HEIGHTS.len() * LEADS.len()],
        }
    }

    /// Number of directions.
    #[must_use]
    pub fn directions(&self) -> usize {
        self.directions
    }

    /// Number of cells.
    #[must_use]
    pub fn len(&self) -> usize {
        self.counts.len()
    }

    /// The cell with this index; the lead varies fastest, then the height, then the direction.
    #[must_use]
    pub fn cell(number: usize) -> Cell {
        Cell {
            lead: number % LEADS.len(),
            height: number / LEADS.len() % HEIGHTS.len(),
            direction: number / LEADS.len() / HEIGHTS.len(),
        }
    }

    /// All cells.
    pub fn cells(&self) -> impl Iterator<Item = Cell> + use<> {
        (0..self.counts.len()).map(Self::cell)
    }

    /// Angle of a direction, in radians to the left of where the character faces.
    #[must_use]
    pub fn from(&self, direction: usize) -> f32 {
        direction as f32 / self.directions as f32 * TAU
    }

    /// A random throw at the character of `baked`, of one cell. `speed` is that of the ball, in metres per second.
    ///
    /// # Errors
    /// The speed is not above 0.
    pub fn throw(
        &self,
        baked: &BakedGraph,
        cell: Cell,
        RandomDraw { seed, index }: RandomDraw,
        speed: f32,
    ) -> Result<Throw, AttackError> {
        let aim = Aim {
            from: self.from(cell.direction),
            height: HEIGHTS[cell.height].1,
            lead: LEADS[cell.lead],
            speed,
            radius: 0.1,
            distance: 2.0,
        };
        let moment = index * self.len() as u64 + self.number(cell) as u64;
        aimed(baked, &aim, seed, moment)
    }

    fn number(&self, cell: Cell) -> usize {
        (cell.direction * HEIGHTS.len() + cell.height) * LEADS.len() + cell.lead
    }

    /// Adds the outcome of a throw.
    pub fn add(&mut self, cell: Cell, avoided: bool) {
        let number = self.number(cell);
        self.counts[number].add(avoided);
    }

    /// Numbers of attacks in the cells that `of` selects.
    #[must_use]
    pub fn count(&self, of: impl Fn(Cell) -> bool) -> AvoidedCount {
        let cells = self.cells().zip(&self.counts);
        let chosen = cells.filter(|(cell, _)| of(*cell));
        let mut sum = AvoidedCount::default();
        chosen.for_each(|(_, &count)| sum += count);
        sum
    }

    /// Share of avoided attacks in the cells that `of` selects; 0 without attacks.
    #[must_use]
    pub fn share(&self, of: impl Fn(Cell) -> bool) -> f64 {
        self.count(of).value()
    }

    /// Directions and heights, the least avoided first. They are compared with all attacks of the same
    /// lead, since short leads are hard from everywhere.
    #[must_use]
    pub fn gaps(&self) -> Vec<Gap> {
        let places = (0..self.directions)
            .flat_map(|direction| (0..HEIGHTS.len()).map(move |height| (direction, height)));
        let mut gaps: Vec<Gap> = places.map(|place| self.gap(place.0, place.1)).collect();
        gaps.sort_by(|a, b| a.any_lead.total_cmp(&b.any_lead));
        gaps
    }

    fn gap(&self, direction: usize, height: usize) -> Gap {
        let is_here = |c: Cell| c.direction == direction && c.height == height;
        let is_certain = self.count(is_here).interval()[1] < self.count(|_| true).interval()[0];
        let at = |lead: usize| {
            let cell = Cell {
                direction,
                height,
                lead,
            };
            Gap {
                cell,
                any_lead: self.share(is_here),
                share: self.share(|c| c == cell),
                others: self.share(|c| c.lead == lead),
                is_certain,
            }
        };
        let behind = |gap: &Gap| gap.others - gap.share;
        let first = at(0);
        (1..LEADS.len()).map(at).fold(first, |worst, gap| {
            if behind(&gap) > behind(&worst) {
                gap
            } else {
                worst
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gap_is_where_less_is_avoided_than_elsewhere() {
        let mut coverage = Coverage::new(8);
        let missing = Cell {
            direction: 2,
            height: 0,
            lead: 3,
        };
        for cell in coverage.cells() {
            let too_soon = cell.lead == 0;
            (0..4).for_each(|_| coverage.add(cell, !too_soon && cell != missing));
        }
        assert_eq!(coverage.share(|cell| cell.lead == 0), 0.0);
        assert_eq!(coverage.share(|cell| cell == missing), 0.0);
        let worst = coverage.gaps()[0];
        assert_eq!((worst.cell, worst.share), (missing, 0.0));
        assert!(worst.others > 0.9);
        assert_eq!(coverage.gaps().len(), 40);
        let numbered: Vec<Cell> = (0..coverage.len()).map(Coverage::cell).collect();
        assert_eq!(numbered, coverage.cells().collect::<Vec<_>>());
    }
    #[test]
    fn a_gap_is_certain_where_chance_cannot_tell_it() {
        let mut coverage = Coverage::new(4);
        for cell in coverage.cells() {
            let dark = cell.direction == 1 && cell.height == 3;
            (0..4).for_each(|index| coverage.add(cell, !dark && index != 0));
        }
        let gaps = coverage.gaps();
        assert_eq!((gaps[0].cell.direction, gaps[0].cell.height), (1, 3));
        assert!(gaps[0].is_certain);
        assert!(gaps[1..].iter().all(|gap| !gap.is_certain));
    }
}
