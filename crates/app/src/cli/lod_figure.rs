//! `sabaki lod --plot`: the joints' energies, the levels' errors, and the levels over the distance.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use sabaki::lod::{Level, SwitchSettings, Switching};

use super::chart::{COLOURS, Chart, Line, Scale};
use super::lod_report::Report;
use super::picture::FONT;
use super::plot::{Area, Bar, Drawn, Figure, Format, INK, Paint, bars, shortened};

/// Pixels of the figure.
const SIZE: (u32, u32) = (1240, 920);
/// Pixels of the left part, which shows the energies.
const LEFT: u32 = 520;
/// Pixels left of the bars for the joints' names, and right of them for the energies.
const NAMES: i32 = 190;
const VALUES: i32 = 96;
/// Pixels above the bars.
const HEAD: i32 = 76;
/// The largest number of bars.
const MOST_BARS: usize = 40;

impl Report {
    /// The joints with energy, the most energetic first.
    fn energies(&self) -> Vec<Bar> {
        let energies = self.source.skeleton.ids().zip(&self.levels.energies);
        let mut energies: Vec<Bar> = energies
            .map(|(id, &energy)| Bar {
                name: self.source.skeleton.joint(id).name.clone(),
                value: f64::from(energy),
                label: joules(energy),
            })
            .collect();
        energies.retain(|bar| bar.value > 0.0);
        energies.sort_by(|a, b| b.value.total_cmp(&a.value));
        energies
    }

    fn errors(&self) -> Chart<'static> {
        let of_levels = |name, value: &dyn Fn(&Level) -> f32| {
            let levels = self.levels.levels.iter().enumerate();
            let points = levels.map(|(index, level)| (index as f64, f64::from(value(level))));
            Line {
                name,
                points: points.collect(),
                marks: true,
            }
        };
        Chart {
            title: "Position error of each level",
            x: "level",
            y: "error, mm",
            scale: Scale::Linear,
            lines: vec![
                of_levels("greatest", &|level| level.error.max * 1e3),
                of_levels("mean of removed joints", &|level| level.error.mean * 1e3),
                of_levels("mean of the body", &|level| level.error.body_mean * 1e3),
            ],
        }
    }

    fn shown(&self) -> Chart<'static> {
        let far = f64::from(self.bands.furthest()).max(1.0) * 1.1;
        let line = |name, bands: &Switching| {
            let distances = (0..=2000).map(|step| far * f64::from(step) / 2000.0);
            let at = |distance: f64| {
                let choice = bands.choose(distance as f32, None);
                let level = f64::from(choice.level.0);
                (distance, level + f64::from(choice.blend))
            };
            Line {
                name,
                points: distances.map(at).collect(),
                marks: false,
            }
        };
        let at_once = SwitchSettings {
            blend_step: None,
            hysteresis: 0.0,
            ..self.settings
        };
        let mut lines = vec![line("blended", &self.bands)];
        if let Ok(at_once) = Switching::new(&self.levels, &at_once) {
            lines.push(line("at once", &at_once));
        }
        Chart {
            title: "Level that is drawn",
            x: "distance from the camera, m",
            y: "level",
            scale: Scale::Linear,
            lines,
        }
    }

    /// Bars from the top: the joint's name, its energy, and the level that removes it.
    fn draw_energies<DB: DrawingBackend>(&self, area: &Area<DB>) -> Drawn<DB> {
        let style = |size: u32| (FONT, size).into_font().color(&INK);
        let bars = self.energies();
        area.draw(&Text::new(
            "Mean energy of the joints, J",
            (14, 10),
            style(22),
        ))?;
        let (shown, hidden) = (
            bars.len().min(MOST_BARS),
            bars.len().saturating_sub(MOST_BARS),
        );
        let note = match hidden {
            0 => "in brackets: the level that removes the joint".to_owned(),
            _ => format!("in brackets: the level that removes the joint; {hidden} more have less"),
        };
        area.draw(&Text::new(note, (14, 41), style(17)))?;
        let most = bars.first().map_or(1.0, |bar| bar.value);
        let (width, height) = area.dim_in_pixel();
        let longest = f64::from(width as i32 - NAMES - VALUES);
        let row = ((height as i32 - HEAD - 12) / shown.max(1) as i32).min(26);
        let size = (row as u32 * 4 / 5).min(16);
        let [red, green, blue] = COLOURS[2];
        let centre = |at| style(size).pos(Pos::new(at, VPos::Center));
        for (place, bar) in (0..).zip(&bars[..shown]) {
            let middle = HEAD + place * row + row / 2;
            let name = shortened(&bar.name, 22);
            let name = format!("{name}{}", self.removal(&bar.name));
            area.draw(&Text::new(name, (NAMES - 8, middle), centre(HPos::Right)))?;
            let end = NAMES + (longest * bar.value / most).round() as i32;
            let corners = [
                (NAMES, middle - row * 2 / 5),
                (end.max(NAMES + 1), middle + row * 2 / 5),
            ];
            area.draw(&Rectangle::new(
                corners,
                RGBColor(red, green, blue).filled(),
            ))?;
            area.draw(&Text::new(
                bar.label.as_str(),
                (end + 8, middle),
                centre(HPos::Left),
            ))?;
        }
        Ok(())
    }

    /// The level that removes a joint, in brackets; nothing where it stays.
    fn removal(&self, joint: &str) -> String {
        let removes = |level: &Level| level.removed.is_some() && self.name(level) == joint;
        let level = self.levels.levels.iter().position(removes);
        level.map_or(String::new(), |level| format!(" ({level})"))
    }
}

/// An energy with three digits.
fn joules(energy: f32) -> String {
    match energy {
        100.0.. => format!("{energy:.0} J"),
        10.0.. => format!("{energy:.1} J"),
        1.0.. => format!("{energy:.2} J"),
        0.001.. => format!("{energy:.3} J"),
        _ => "under 0.001 J".to_owned(),
    }
}

impl Figure for Report {
    fn size(&self) -> (u32, u32) {
        SIZE
    }

    fn draw<DB: DrawingBackend>(&self, area: &Area<DB>, _: Format) -> Drawn<DB> {
        let (left, right) = area.split_horizontally(LEFT);
        let (above, below) = right.split_vertically(SIZE.1 / 2);
        self.draw_energies(&left)?;
        self.errors().draw(&above)?;
        self.shown().draw(&below)
    }

    fn letters(&self, paint: Paint) -> String {
        format!(
            "\nmean energy of the joints\n{}\n{}\n{}",
            bars(&self.energies(), COLOURS[2], paint),
            self.errors().text(paint),
            self.shown().text(paint)
        )
    }
}
