//! The figure of `sabaki coverage`: shares of avoided attacks as a heat map.

use std::fmt::Write;

use crate::measure::coverage::{Cell, Coverage, HEIGHTS, LEADS};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::picture::FONT;
use super::plot::{Area, Drawn, Figure, Format, INK, Paint, shade};

/// The shares as a heat map: a block for each height from the head down, rows are directions, columns leads.
pub(super) struct HeatMap<'a> {
    pub(super) coverage: &'a Coverage,
}

/// Pixels of a cell.
const CELL: (i32, i32) = (64, 26);
/// Pixels left of the cells for the names of heights and directions, and above them for title and leads.
const NAMES: i32 = 190;
const HEAD: i32 = 96;
/// Pixels between the blocks, and around the figure.
const GAP: i32 = 12;

impl HeatMap<'_> {
    /// Pixels of a block and the gap below it.
    fn block(&self) -> i32 {
        self.coverage.directions() as i32 * CELL.1 + GAP
    }

    fn share(&self, cell: Cell) -> f64 {
        self.coverage.share(|other| other == cell)
    }

    /// Number of attacks of each cell; all have as many.
    fn attacks(&self) -> String {
        let first = Coverage::cell(0);
        match self.coverage.counts(|cell| cell == first) {
            [1, _] => "1 attack a cell".to_owned(),
            [thrown, _] => format!("{thrown} attacks a cell"),
        }
    }
}

impl Figure for HeatMap<'_> {
    fn size(&self) -> (u32, u32) {
        let width = NAMES + LEADS.len() as i32 * CELL.0 + GAP;
        let height = HEAD + HEIGHTS.len() as i32 * self.block();
        (width.max(560) as u32, height as u32)
    }

    fn draw<DB: DrawingBackend>(&self, area: &Area<DB>, _: Format) -> Drawn<DB> {
        let style = |size: u32, colour: &RGBColor| (FONT, size).into_font().color(colour);
        let centred = |size, colour| style(size, colour).pos(Pos::new(HPos::Center, VPos::Center));
        let title = format!("Share of attacks avoided, in percent; {}", self.attacks());
        area.draw(&Text::new(title, (GAP, 10), style(22, &INK)))?;
        let leads = "lead: seconds from the query to the throw";
        area.draw(&Text::new(leads, (NAMES, 44), style(17, &INK)))?;
        for (column, lead) in (0..).zip(LEADS) {
            let middle = (NAMES + column * CELL.0 + CELL.0 / 2, HEAD - 14);
            area.draw(&Text::new(
                format!("{lead:.2} s"),
                middle,
                centred(16, &INK),
            ))?;
        }
        for (place, height) in (0..).zip((0..HEIGHTS.len()).rev()) {
            let top = HEAD + place * self.block();
            area.draw(&Text::new(
                HEIGHTS[height].0,
                (GAP, top + 4),
                style(18, &INK),
            ))?;
            for direction in 0..self.coverage.directions() {
                let y = top + direction as i32 * CELL.1;
                let right = Pos::new(HPos::Right, VPos::Center);
                let name = direction_name(self.coverage, direction);
                let at = (NAMES - 10, y + CELL.1 / 2);
                area.draw(&Text::new(name, at, style(16, &INK).pos(right)))?;
                for (column, lead) in (0..).zip(0..LEADS.len()) {
                    let share = self.share(Cell {
                        direction,
                        height,
                        lead,
                    });
                    let x = NAMES + column * CELL.0;
                    let [red, green, blue] = heat(share);
                    let fill = RGBColor(red, green, blue).filled();
                    let corners = [(x, y), (x + CELL.0 - 2, y + CELL.1 - 2)];
                    area.draw(&Rectangle::new(corners, fill))?;
                    let middle = (x + CELL.0 / 2 - 1, y + CELL.1 / 2 - 1);
                    let text = format!("{:.0}", 100.0 * share);
                    area.draw(&Text::new(text, middle, centred(16, &WHITE)))?;
                }
            }
        }
        Ok(())
    }

    fn letters(&self, paint: Paint) -> String {
        let mut letters = format!(
            "\nshare of attacks avoided, · none, █ all; columns: lead; {}\n",
            self.attacks()
        );
        for height in (0..HEIGHTS.len()).rev() {
            let _ = writeln!(letters, "{}", HEIGHTS[height].0);
            for direction in 0..self.coverage.directions() {
                let name = direction_name(self.coverage, direction);
                let _ = write!(letters, "  {name:<12}");
                for lead in 0..LEADS.len() {
                    let share = self.share(Cell {
                        direction,
                        height,
                        lead,
                    });
                    let cell = shade(share).to_string().repeat(4);
                    letters.push_str(&paint.on(heat(share), &cell));
                    letters.push(' ');
                }
                letters.push('\n');
            }
        }
        letters
    }
}

/// From red over brown to green.
fn heat(share: f64) -> [u8; 3] {
    const NONE: [f64; 3] = [170.0, 30.0, 30.0];
    const ALL: [f64; 3] = [30.0, 120.0, 60.0];
    let mix = |axis: usize| NONE[axis] + (ALL[axis] - NONE[axis]) * share;
    [0, 1, 2].map(|axis| mix(axis) as u8)
}

/// The name of a direction, or its angle where it has no name.
pub(super) fn direction_name(coverage: &Coverage, direction: usize) -> String {
    const NAMES: [&str; 8] = [
        "front",
        "front left",
        "left",
        "back left",
        "back",
        "back right",
        "right",
        "front right",
    ];
    let eighths = 8 * direction;
    if eighths.is_multiple_of(coverage.directions()) {
        return NAMES[eighths / coverage.directions()].to_owned();
    }
    format!("{:.0}° left", coverage.from(direction).to_degrees())
}
