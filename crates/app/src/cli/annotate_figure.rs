//! `sabaki annotate --plot`: the speeds of limbs and trunk, with the events.

use std::fmt::Write;

use plotters::prelude::*;
use sabaki::anim::EventKind;
use sabaki_import::EventEntry;
use sabaki_import::annotate::SpeedCurves;

use super::chart::COLOURS;
use super::picture::FONT;
use super::plot::{self, Area, Drawn, Format, INK, Paint, shade};

/// Pixels of a clip's panel, and of the legend above all.
const PANEL: (u32, u32) = (460, 210);
const HEAD: u32 = 64;
const COLUMNS: usize = 3;
/// The largest number of panels.
const MOST: usize = 45;
/// Letters of a clip's line.
const LETTERS: usize = 60;
/// Colours of the limbs' speed, the trunk's speed, attacks and evasions.
const LIMBS: [u8; 3] = [90, 90, 90];
const TRUNK: [u8; 3] = [0, 0, 0];
const ATTACK: [u8; 3] = COLOURS[0];
const EVASION: [u8; 3] = COLOURS[2];
/// Colour of the lines at contacts.
const CONTACT: [u8; 3] = [120, 20, 10];
/// Shares of a panel's height: top of the events made by hand, and bottom of the proposed ones.
const BY_HAND: f64 = 0.10;
const PROPOSED: f64 = 0.12;

/// One clip.
pub(crate) struct Panel {
    pub(crate) name: String,
    pub(crate) seconds: f64,
    /// Frames per second.
    pub(crate) frame_rate: f64,
    pub(crate) curves: SpeedCurves,
    pub(crate) proposed: Vec<EventEntry>,
    pub(crate) by_hand: Vec<EventEntry>,
}

/// The clips that have events.
pub(crate) struct Figure {
    panels: Vec<Panel>,
    /// Number of clips with events that are not drawn, and of clips without events.
    hidden: usize,
    without: usize,
    has_hand_made: bool,
}

impl Figure {
    pub(crate) fn new(mut panels: Vec<Panel>, without: &[Panel], has_hand_made: bool) -> Self {
        let hidden = panels.len().saturating_sub(MOST);
        panels.truncate(MOST);
        Self {
            panels,
            hidden,
            without: without.len(),
            has_hand_made,
        }
    }

    fn title(&self) -> String {
        let mut title = format!(
            "Proposed events; speeds in statures per second over seconds; {} clips without events",
            self.without
        );
        if self.hidden > 0 {
            let _ = write!(title, "; {} more with events", self.hidden);
        }
        title
    }

    fn legend<DB: DrawingBackend>(&self, area: &Area<DB>) -> Drawn<DB> {
        let style = (FONT, 16).into_font().color(&INK);
        let mut names = vec![
            ("hands and feet, against the root", LIMBS),
            ("head and root", TRUNK),
            ("attack", ATTACK),
            ("evasion", EVASION),
        ];
        let is_contact = |event: &EventEntry| event.contact.is_some();
        let all = |panel: &Panel| panel.proposed.iter().chain(&panel.by_hand).any(is_contact);
        if self.panels.iter().any(all) {
            names.push(("contact", CONTACT));
        }
        if self.has_hand_made {
            names.push(("above: proposed; in the bar below: by hand", [255; 3]));
        }
        area.draw(&Text::new(
            self.title(),
            (14, 8),
            (FONT, 20).into_font().color(&INK),
        ))?;
        let mut left = 14;
        for (name, colour) in names {
            let corners = match colour {
                CONTACT => [(left + 10, 37), (left + 12, 55)],
                _ => [(left, 42), (left + 22, 52)],
            };
            area.draw(&Rectangle::new(corners, rgb(colour).filled()))?;
            area.draw(&Text::new(name, (left + 28, 38), style.clone()))?;
            let (width, _) = area.estimate_text_size(name, &style)?;
            left += 28 + width as i32 + 24;
        }
        Ok(())
    }
}

impl plot::Figure for Figure {
    fn size(&self) -> (u32, u32) {
        let rows = self.panels.len().div_ceil(COLUMNS).max(1) as u32;
        (PANEL.0 * COLUMNS as u32, HEAD + rows * PANEL.1)
    }

    fn draw<DB: DrawingBackend>(&self, area: &Area<DB>, _: Format) -> Drawn<DB> {
        let (head, body) = area.split_vertically(HEAD);
        self.legend(&head)?;
        let rows = self.panels.len().div_ceil(COLUMNS).max(1);
        let areas = body.split_evenly((rows, COLUMNS));
        for (panel, area) in self.panels.iter().zip(&areas) {
            panel.draw(area)?;
        }
        Ok(())
    }

    fn letters(&self, paint: Paint) -> String {
        let mut text = format!("\n{}\n", self.title());
        for panel in &self.panels {
            text += &panel.letters(paint, self.has_hand_made);
        }
        text
    }
}

impl Panel {
    fn points(&self, speeds: &[f32]) -> Vec<(f64, f64)> {
        let point =
            |(frame, &speed): (usize, &f32)| (frame as f64 / self.frame_rate, f64::from(speed));
        speeds.iter().enumerate().map(point).collect()
    }

    fn top(&self) -> f64 {
        let most = self.curves.limbs.iter().copied().fold(1.0, f32::max);
        1.1 * f64::from(most)
    }

    fn draw<DB: DrawingBackend>(&self, area: &Area<DB>) -> Drawn<DB> {
        let top = self.top();
        let mut chart = ChartBuilder::on(area)
            .margin(8)
            .margin_top(26)
            .x_label_area_size(22)
            .y_label_area_size(30)
            .build_cartesian_2d(0.0..self.seconds.max(1e-3), 0.0..top)?;
        let name = plot::shortened(&self.name, 48);
        area.draw(&Text::new(
            name,
            (14, 4),
            (FONT, 16).into_font().color(&INK),
        ))?;
        let mut mesh = chart.configure_mesh();
        mesh.disable_mesh().x_labels(6).y_labels(5);
        mesh.label_style((FONT, 13).into_font().color(&INK))
            .draw()?;
        let range = |event: &EventEntry, low: f64, high: f64| {
            Rectangle::new(
                [(event.start, low), (event.end, high)],
                rgb(colour(event.kind)).mix(0.4).filled(),
            )
        };
        let proposed = self
            .proposed
            .iter()
            .map(|event| range(event, PROPOSED * top, top));
        chart.draw_series(proposed)?;
        chart.draw_series(
            self.by_hand
                .iter()
                .map(|event| range(event, 0.0, BY_HAND * top)),
        )?;
        let proposed = self.proposed.iter().map(|event| (event, [PROPOSED, 1.0]));
        let by_hand = self.by_hand.iter().map(|event| (event, [0.0, BY_HAND]));
        for (event, ends) in proposed.chain(by_hand) {
            let Some(time) = event.contact else {
                continue;
            };
            let line = ends.map(|share| (time, share * top));
            chart.draw_series(LineSeries::new(line, rgb(CONTACT).stroke_width(2)))?;
        }
        for (speeds, colour) in [(&self.curves.limbs, LIMBS), (&self.curves.trunk, TRUNK)] {
            chart.draw_series(LineSeries::new(
                self.points(speeds),
                rgb(colour).stroke_width(1),
            ))?;
        }
        Ok(())
    }

    /// The speed of the limbs as shades, in the colours of the events; below it the events as letters.
    fn letters(&self, paint: Paint, has_hand_made: bool) -> String {
        let mut speeds = String::new();
        for column in 0..LETTERS {
            let from = column * self.curves.limbs.len() / LETTERS;
            let to = (column + 1) * self.curves.limbs.len() / LETTERS;
            let own = &self.curves.limbs[from..to.max(from + 1).min(self.curves.limbs.len())];
            let most = own.iter().copied().fold(0.0, f32::max);
            speeds.push(shade(f64::from(most) / self.top()));
        }
        let name = plot::shortened(&self.name, 36);
        let mut text = format!(
            "{name:<36} {speeds}\n{:>36} {}\n",
            "proposed",
            self.row(&self.proposed, paint)
        );
        if has_hand_made {
            let _ = writeln!(text, "{:>36} {}", "by hand", self.row(&self.by_hand, paint));
        }
        text
    }

    fn row(&self, events: &[EventEntry], paint: Paint) -> String {
        let letter = |column: usize| {
            let time = (column as f64 + 0.5) / LETTERS as f64 * self.seconds;
            let event = events
                .iter()
                .find(|event| event.start <= time && time <= event.end);
            match event.map(|event| event.kind) {
                Some(EventKind::Attack) => paint.on(ATTACK, "A"),
                Some(EventKind::Evasion) => paint.on(EVASION, "E"),
                None => " ".to_owned(),
            }
        };
        let row: String = (0..LETTERS).map(letter).collect();
        row.trim_end().to_owned()
    }
}

fn colour(kind: EventKind) -> [u8; 3] {
    match kind {
        EventKind::Attack => ATTACK,
        EventKind::Evasion => EVASION,
    }
}

fn rgb([red, green, blue]: [u8; 3]) -> RGBColor {
    RGBColor(red, green, blue)
}
