//! Share of attacks that is avoided, by direction, height and lead.
//!
//! Balls are thrown from all directions at all heights with all leads. Each cell uses its own moments of the graph, so that the
//! cells are independent samples and the intervals hold for sums of cells, too.

use std::f32::consts::TAU;

use super::by_time::AvoidedCount;

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
    /// Number of directions.
    pub directions: usize,
    /// The lead varies fastest, then the height, then the direction.
    pub cells: Vec<(Cell, AvoidedCount)>,
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
    pub fn new(directions: usize) -> Self {
        let directions = directions.max(1);
        let mut cells = Vec::new();
        for direction in 0..directions {
            for height in 0..HEIGHTS.len() {
                for lead in 0..LEADS.len() {
                    let cell = Cell {
                        direction,
                        height,
                        lead,
                    };
                    cells.push((cell, AvoidedCount::default()));
                }
            }
        }
        Self { directions, cells }
    }

    /// Angle of a direction, in radians to the left of where the character faces.
    pub fn from(&self, direction: usize) -> f32 {
        direction as f32 / self.directions as f32 * TAU
    }

    /// Numbers of attacks in the cells that `of` selects.
    pub fn count(&self, of: impl Fn(Cell) -> bool) -> AvoidedCount {
        let chosen = self.cells.iter().filter(|(cell, _)| of(*cell));
        let mut sum = AvoidedCount::default();
        chosen.for_each(|&(_, count)| sum += count);
        sum
    }

    /// Share of avoided attacks in the cells that `of` selects; 0 without attacks.
    pub fn share(&self, of: impl Fn(Cell) -> bool) -> f64 {
        self.count(of).value()
    }

    /// Directions and heights, the least avoided first. They are compared with all attacks of the same
    /// lead, since short leads are hard from everywhere.
    pub fn gaps(&self) -> Vec<Gap> {
        let places = (0..self.directions)
            .flat_map(|direction| (0..HEIGHTS.len()).map(move |height| (direction, height)));
        let mut gaps: Vec<Gap> = places.filter_map(|place| self.gap(place)).collect();
        gaps.sort_by(|a, b| a.any_lead.total_cmp(&b.any_lead));
        gaps
    }

    fn gap(&self, (direction, height): (usize, usize)) -> Option<Gap> {
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
        let ahead = |gap: &Gap| gap.share - gap.others;
        let all = (0..LEADS.len()).map(at);
        all.min_by(|a, b| ahead(a).total_cmp(&ahead(b)))
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
        for (cell, count) in &mut coverage.cells {
            let too_soon = cell.lead == 0;
            (0..4).for_each(|_| count.add(!too_soon && *cell != missing));
        }
        assert_eq!(coverage.share(|cell| cell.lead == 0), 0.0);
        assert_eq!(coverage.share(|cell| cell == missing), 0.0);
        let worst = coverage.gaps()[0];
        assert_eq!((worst.cell, worst.share), (missing, 0.0));
        assert!(worst.others > 0.9);
        assert_eq!(coverage.gaps().len(), 40);
    }
    #[test]
    fn a_gap_is_certain_where_chance_cannot_tell_it() {
        let mut coverage = Coverage::new(4);
        for (cell, count) in &mut coverage.cells {
            let dark = cell.direction == 1 && cell.height == 3;
            (0..4).for_each(|index| count.add(!dark && index != 0));
        }
        let gaps = coverage.gaps();
        assert_eq!((gaps[0].cell.direction, gaps[0].cell.height), (1, 3));
        assert!(gaps[0].is_certain);
        assert!(gaps[1..].iter().all(|gap| !gap.is_certain));
    }
}
