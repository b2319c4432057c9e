//! Shows a fighter in the window.

use egui::{CollapsingHeader, Color32, RichText, Slider, Stroke};
use glam::Vec3;

use super::gui::{Label, bars};
use super::panels::candidates::{Listed, candidates};
use super::panels::maps::Thumbnails;
use super::{Projection, View, WindowError};
use crate::live::{Clock, Event, Fighter, MapChoice, map_name};
use sabaki::maps::MapGrid;
use sabaki::math::F32x16;
use sabaki::query::{CullPath, Enumerate, Source};
use sabaki_draw::StageDesc;
use sabaki_draw::scene::{Camera, CrowdShot, MapStyle, Shot};

/// A fighter with the state of its panels.
pub struct FighterView<'a> {
    fighter: Fighter<'a>,
    listed: Listed,
    thumbnails: Thumbnails,
}

const KEYS: [(&str, &str); 4] = [
    ("r", "replay of the last throw"),
    ("b", "slabs of the next height"),
    ("m", "maps: at their heights, on the ground, none"),
    ("g", "ghost of who did nothing"),
];

impl<'a> FighterView<'a> {
    /// Shows a fighter.
    #[must_use]
    pub fn new(fighter: Fighter<'a>) -> Self {
        Self {
            fighter,
            listed: Listed::default(),
            thumbnails: Thumbnails::default(),
        }
    }
}

impl View for FighterView<'_> {
    fn stage(&self) -> StageDesc<'_> {
        StageDesc {
            meshes: self.fighter.meshes(),
            ..StageDesc::default()
        }
    }

    fn advance(&mut self, seconds: f32) {
        self.fighter.advance(seconds);
    }

    fn focus(&self) -> Vec3 {
        self.fighter.focus()
    }

    fn distance(&self) -> f32 {
        4.6
    }

    fn draw(
        &mut self,
        camera: Camera,
        _: [u32; 2],
        _: &mut [F32x16],
    ) -> Result<(Shot, Option<CrowdShot>), WindowError> {
        Ok((self.fighter.shot(camera), None))
    }

    fn click(&mut self, camera: &Camera, ray: Vec3) -> Result<(), WindowError> {
        Ok(self.fighter.throw(camera, ray)?)
    }

    fn key(&mut self, key: &str) {
        let settings = &mut self.fighter.settings;
        match key {
            "r" => self.fighter.replay(),
            "b" => {
                let count = self.fighter.map_choices().grids().count();
                let next = (self.fighter.maps().0 + 1) % count;
                self.fighter.choose_maps(MapChoice(next));
            }
            "g" => settings.ghost = !settings.ghost,
            "m" => {
                settings.maps = match settings.maps {
                    None => Some(MapStyle::Heights),
                    Some(MapStyle::Heights) => Some(MapStyle::Ground),
                    Some(MapStyle::Ground) => None,
                }
            }
            _ => {}
        }
    }

    fn keys(&self) -> &'static [(&'static str, &'static str)] {
        &KEYS
    }

    fn panel(&mut self, ui: &mut egui::Ui, _: &mut Clock) {
        self.state(ui);
        section("Last query").show(ui, |ui| self.last(ui));
        section("Candidates").show(ui, |ui| {
            candidates(ui, &mut self.fighter, &mut self.listed);
        });
        section("Throw").show(ui, |ui| self.throw(ui));
        section("Query").show(ui, |ui| self.query(ui));
        let maps = section("Maps").default_open(false);
        maps.show(ui, |ui| self.maps(ui));
    }

    fn label(&self, painter: &egui::Painter, seen: &Projection) {
        let Some(nearest) = self.fighter.nearest().filter(|one| one.metres < 0.6) else {
            return;
        };
        let (Some(body), Some(ball)) = (seen.point(nearest.body), seen.point(nearest.attack))
        else {
            return;
        };
        let colour = match nearest.metres {
            hit if hit < 0.0 => Color32::from_rgb(170, 0, 0),
            near if near < 0.1 => Color32::from_rgb(150, 45, 0),
            _ => Color32::from_rgb(30, 36, 48),
        };
        painter.line_segment([body, ball], Stroke::new(2.0, colour));
        let text = match nearest.metres {
            hit if hit < 0.0 => format!("hit, {:.1} cm deep", -hit * 100.0),
            clear => format!("{:.1} cm", clear * 100.0),
        };
        let at = ball + egui::vec2(26.0, -34.0);
        Label { text, colour }.paint(painter, at);
    }

    fn take_events(&mut self) -> Vec<Event> {
        self.fighter.take_events()
    }

    fn is_waiting(&self) -> bool {
        self.fighter.is_waiting()
    }
}

/// A collapsible part of the panel.
fn section(name: &str) -> CollapsingHeader {
    CollapsingHeader::new(RichText::new(name).strong()).default_open(true)
}

impl FighterView<'_> {
    fn state(&mut self, ui: &mut egui::Ui) {
        let fighter = &mut self.fighter;
        let text = match (fighter.moment(), fighter.is_replaying()) {
            (Some(t), true) => format!("replay {t:+.2} s"),
            (Some(t), false) => format!("dodging {t:+.2} s"),
            _ if fighter.is_waiting() => "asking".to_owned(),
            _ => "walking: click at it".to_owned(),
        };
        ui.horizontal(|ui| {
            ui.label(text);
            let word = if fighter.is_replaying() {
                "end"
            } else {
                "replay"
            };
            let button = egui::Button::new(word);
            if ui.add_enabled(fighter.last().is_some(), button).clicked() {
                fighter.pick(None);
                match word {
                    "end" => {}
                    _ => fighter.replay(),
                }
            }
        });
    }

    fn throw(&mut self, ui: &mut egui::Ui) {
        let settings = &mut self.fighter.settings;
        let ball = &mut settings.ball;
        let mut slide = |value: &mut f32, (low, high): (f32, f32), text: &str| {
            ui.add(Slider::new(value, low..=high).text(text).max_decimals(2));
        };
        slide(&mut ball.speed, (2.0, 20.0), "speed, m/s");
        slide(&mut ball.radius, (0.03, 0.25), "radius, m");
        slide(&mut ball.lead, (0.0, 2.0), "lead, s");
        slide(&mut ball.distance, (1.0, 6.0), "distance, m");
        slide(&mut settings.near_speed, (0.05, 1.0), "time near it");
        ui.checkbox(&mut ball.ahead, "aim at where the body will be");
        ui.checkbox(&mut settings.ghost, "ghost of who does nothing");
    }

    fn query(&mut self, ui: &mut egui::Ui) {
        self.choose_maps(ui);
        let settings = &mut self.fighter.settings;
        ui.horizontal(|ui| {
            for culling in CullPath::ALL {
                ui.selectable_value(&mut settings.culling, culling, culling.name());
            }
        });
        let enumerate = &mut settings.query.enumerate;
        let mut grid = enumerate.uses_grid();
        ui.horizontal(|ui| {
            ui.checkbox(&mut grid, "grid");
            if !grid {
                *enumerate = Enumerate::Whole;
                return;
            }
            if !enumerate.uses_grid() {
                *enumerate = Enumerate::default();
            }
            ui.selectable_value(enumerate, Enumerate::TouchedCells, "all cells");
            ui.selectable_value(enumerate, Enumerate::NearestFiledCell, "nearest filed");
            ui.selectable_value(enumerate, Enumerate::NearestCell, "nearest");
        });
        let weights = &mut settings.query.weights;
        let mut slide = |value: &mut f32, text: &str| {
            ui.add(Slider::new(value, 0.0..=8.0).text(text).max_decimals(1));
        };
        slide(&mut weights.avoid, "w_a, region");
        slide(&mut weights.distance, "w_d, clearance");
        slide(&mut weights.time, "w_t, rate");
    }

    /// Selects the maps of the next query.
    fn choose_maps(&mut self, ui: &mut egui::Ui) {
        let (mut chosen, before) = (self.fighter.maps(), self.fighter.maps());
        let mut grid = MapGrid::default();
        ui.horizontal(|ui| {
            ui.label("slabs");
            for (choice, one) in self.fighter.map_choices().grids() {
                ui.selectable_value(&mut chosen, choice, map_name(one));
                if chosen == choice {
                    grid = one;
                }
            }
        });
        if chosen != before {
            self.fighter.choose_maps(chosen);
        }
        let words = format!(
            "{} of time, texels of {:.1} cm",
            match grid.slices {
                1 => "1 slice".to_owned(),
                slices => format!("{slices} slices"),
            },
            100.0 * grid.texel
        );
        ui.label(RichText::new(words).small().weak());
    }

    fn last(&mut self, ui: &mut egui::Ui) {
        let Some(last) = self.fighter.last() else {
            ui.label(RichText::new("nothing was thrown yet").weak());
            return;
        };
        let (answer, counts) = (last.answer(), last.answer().counts);
        let (word, colour) = match answer.avoided {
            true => ("avoided", Color32::from_rgb(120, 215, 130)),
            false => ("hit", Color32::from_rgb(245, 110, 90)),
        };
        ui.horizontal(|ui| {
            ui.label(RichText::new(word).strong().color(colour));
            let clearance = answer.clearance();
            ui.label(format!(
                "{:.1} cm at {:+.2} s",
                100.0 * clearance.metres,
                clearance.time
            ));
        });
        let from = match answer.source {
            Source::Grid => "the node's grid",
            Source::NothingFiled => "whole graph: the grid has no candidate",
            Source::NothingClean => "whole graph: no candidate of the grid is clean",
            Source::Whole => "whole graph",
        };
        ui.label(format!("candidates from {from}"));
        ui.label(format!(
            "{} candidates: {} culled, {} hit, {} clean",
            counts.candidates, counts.culled, counts.hits, counts.clean
        ));
        ui.label(format!(
            "{:.2} ms by {}",
            1e3 * last.response.seconds,
            last.response.culling.name()
        ));
        if let Some(why) = &last.response.trouble {
            ui.label(
                RichText::new(why)
                    .small()
                    .color(Color32::from_rgb(245, 170, 90)),
            );
        }
        bars(ui, self.fighter.query_times(), "ms");
    }

    fn maps(&mut self, ui: &mut egui::Ui) {
        let style = &mut self.fighter.settings.maps;
        ui.horizontal(|ui| {
            ui.selectable_value(style, None, "none");
            ui.selectable_value(style, Some(MapStyle::Heights), "at heights");
            ui.selectable_value(style, Some(MapStyle::Ground), "on the ground");
        });
        let words = "body green, attack red, where the body was blue";
        ui.label(RichText::new(words).small().weak());
        self.thumbnails.show(ui, self.fighter.last());
    }
}
