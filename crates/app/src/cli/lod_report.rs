//! The report of `sabaki lod`.

use std::fmt::Write;

use indicatif::ProgressIterator;
use sabaki::anim::{Clip, Skeleton};
use sabaki::lod::{Level, Levels, LodError, Order, Rule, SwitchSettings, Switching};
use serde_json::{Value, json};

use super::output;

/// The skeleton and clips to analyse.
pub(crate) struct Source {
    pub(crate) skeleton: Skeleton,
    pub(crate) clips: Vec<Clip>,
    pub(crate) warnings: Vec<String>,
}

/// Levels of detail, with the distances at which they are drawn.
pub(crate) struct Report {
    pub(crate) source: Source,
    pub(crate) levels: Levels,
    /// Height of the character, in metres.
    pub(crate) stature: f32,
    pub(crate) order: Order,
    pub(crate) settings: SwitchSettings,
    pub(crate) bands: Switching,
    pub(crate) steps: Steps,
}

/// The largest step of a point on the screen when levels switch, in pixels.
#[derive(Clone, Copy, Default)]
pub(crate) struct Steps {
    blended: f32,
    at_once: f32,
}

/// Largest number of clips on which steps are measured; they are evenly spaced.
const MEASURED: usize = 12;

impl Report {
    /// Measures the steps at switches.
    pub(crate) fn measured(mut self) -> Result<Self, LodError> {
        let at_once = SwitchSettings {
            blend_step: None,
            ..self.settings
        };
        let every = self.source.clips.len().div_ceil(MEASURED);
        let clips: Vec<_> = self.source.clips.iter().step_by(every).collect();
        let bar = output::progress("switching", clips.len() as u64);
        for clip in clips.into_iter().progress_with(bar) {
            let skeleton = &self.source.skeleton;
            let blended = self.levels.largest_step(skeleton, clip, &self.settings)?;
            let jump = self.levels.largest_step(skeleton, clip, &at_once)?;
            self.steps.blended = self.steps.blended.max(blended);
            self.steps.at_once = self.steps.at_once.max(jump);
        }
        Ok(self)
    }

    pub(crate) fn name(&self, level: &Level) -> &str {
        let joint = level.removed.map(|id| self.source.skeleton.joint(id));
        joint.map_or("", |joint| joint.name.as_str())
    }

    /// The first clip as each level draws it.
    pub(crate) fn drawn(&self) -> Result<Vec<Clip>, LodError> {
        let (skeleton, clip) = (&self.source.skeleton, &self.source.clips[0]);
        let levels = self.levels.levels.iter().enumerate();
        levels
            .map(|(index, level)| {
                let mut desc = level.drawn(skeleton, clip)?.desc();
                desc.name = match level.removed {
                    Some(_) => format!("level {index}, without {}", self.name(level)),
                    None => "level 0".to_owned(),
                };
                Ok(Clip::new(skeleton, desc)?)
            })
            .collect()
    }

    fn seconds(&self) -> f64 {
        self.source.clips.iter().map(|clip| clip.duration()).sum()
    }

    /// The level's largest error at the distance where it is first drawn, in pixels, for the point of the body nearest to the camera.
    fn pixels(&self, index: usize) -> Option<f32> {
        let band = self.bands.bands().get(index.checked_sub(1)?)?;
        let near = band.full - self.levels.reach;
        let error = self.levels.levels[index].error.max;
        (near > 0.0).then(|| self.settings.view.pixels(error, near))
    }

    /// The report as JSON, with stable keys.
    pub(crate) fn to_json(&self) -> Value {
        let removed_at = |joint| {
            let mut levels = self.levels.levels.iter();
            levels.position(|level| level.removed == Some(joint))
        };
        let energies = self.source.skeleton.ids().zip(&self.levels.energies);
        let energies: Vec<Value> = energies
            .map(|(id, energy)| {
                let name = &self.source.skeleton.joint(id).name;
                json!({ "joint": name, "energy": energy, "removed_at_level": removed_at(id) })
            })
            .collect();
        let levels = self.levels.levels.iter().enumerate();
        let levels: Vec<Value> = levels
            .map(|(index, level)| {
                let removed = level.removed.map(|_| self.name(level));
                let band = index.checked_sub(1).map(|band| self.bands.bands()[band]);
                json!({
                    "level": index,
                    "joints": level.kept.len(),
                    "removed": removed,
                    "energy": level.energy,
                    "position_error_mean": level.error.mean,
                    "position_error_max": level.error.max,
                    "body_error_mean": level.error.body_mean,
                    "step": level.error.step,
                    "band": band,
                    "error_pixels": self.pixels(index),
                })
            })
            .collect();
        json!({
            "clips": self.source.clips.len(),
            "seconds": self.seconds(),
            "joints": self.source.skeleton.len(),
            "order": self.order,
            "switching": self.settings,
            "stature": self.stature,
            "reach": self.levels.reach,
            "furthest": self.bands.furthest(),
            "energies": energies,
            "levels": levels,
            "largest_step_pixels": { "blended": self.steps.blended, "at_once": self.steps.at_once },
            "warnings": self.source.warnings,
        })
    }

    /// The report as text.
    pub(crate) fn describe(&self) -> String {
        let mut text = format!(
            "{} clips, {:.1} s; {} joints, {:.2} m high\n",
            self.source.clips.len(),
            self.seconds(),
            self.source.skeleton.len(),
            self.stature
        );
        let head = [
            "level",
            "removed",
            "joints",
            "energy J",
            "error mean",
            "max",
            "step",
            "blended from",
            "drawn from",
            "error there",
        ];
        let mut table = output::table(&head, 2);
        for (index, level) in self.levels.levels.iter().enumerate() {
            let millimetres = |metres: f32| format!("{:.1} mm", metres * 1e3);
            let band = index.checked_sub(1).map(|band| self.bands.bands()[band]);
            let metres = |metres: f32| format!("{metres:.1} m");
            table.add_row([
                index.to_string(),
                self.name(level).to_owned(),
                level.kept.len().to_string(),
                if index > 0 {
                    format!("{:.4}", level.energy)
                } else {
                    String::new()
                },
                millimetres(level.error.mean),
                millimetres(level.error.max),
                millimetres(level.error.step),
                band.map_or(String::new(), |band| metres(band.start)),
                band.map_or(String::new(), |band| metres(band.end)),
                self.pixels(index)
                    .map_or(String::new(), |pixels| format!("{pixels:.1} px")),
            ]);
        }
        let _ = writeln!(text, "{table}");
        let rule = match self.settings.rule {
            Rule::Energy { furthest } => {
                format!("The distances are linear in the energy, up to L = {furthest:.1} m")
            }
            Rule::ScreenError { pixels, measure } => {
                let measure = format!("{measure:?}").to_lowercase();
                format!("The distances limit the {measure} error to {pixels} pixels")
            }
        };
        let _ = writeln!(
            text,
            "{rule}; bands that would overlap are moved outwards. The last level begins at {:.1} m.\n\
             error: distance of the removed joints' points from where they are with all joints. step: distance from the previous level.\n\
             error there: the largest error on the screen, for a point {:.2} m nearer to the camera than the root.\n\
             Largest step of a point on the screen at a switch of levels, with the camera at 5 m/s and 60 frames per second: {:.2} pixels;\n\
             without blending {:.1} pixels.",
            self.bands.furthest(),
            self.levels.reach,
            self.steps.blended,
            self.steps.at_once,
        );
        for warning in &self.source.warnings {
            let _ = writeln!(text, "note: {warning}");
        }
        text
    }
}
