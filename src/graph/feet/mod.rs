//! Feet that stand: where clips plant them, and how transitions keep them from sliding.
//!
//! Source: the task and its parts are those of Kovar, Schreiner & Gleicher, "Footskate Cleanup for
//! Motion Capture Editing" (2002), and of Ikemoto, Arikan & Forsyth, "Knowing When to Put Your Foot
//! Down" (2006). Differs: nothing is cleaned in the clips, whose feet stand as they were captured. A
//! transition only blends each foot with weights of its own ([`LegBlend`]): all source as long as the
//! source stands on it, all target from when the target does, and in between it is in the air. What a
//! foot slides is then what the captures slide.

mod keep;
mod plan;
mod plants;
mod slide;

use serde::{Deserialize, Serialize};

pub use plan::LegBlend;
pub use slide::FootSlide;

use super::{ClipId, EdgeId, MotionGraph};
use crate::anim::{Leg, Skeleton};

/// What counts as a foot that stands, and whether transitions keep it there. Lengths and speeds are
/// in legs (hip to ankle), so that they fit any body in any unit.
///
/// The defaults come from captures of fighting and walking at 30 frames a second. Of all frames of the
/// fighting, the steadier point of a foot is slower than 0.25 in 76%, slower than 0.55 in 82%, and
/// from there on the speeds of feet that swing spread out to 4 and more; feet slower than 0.2 stand
/// below 0.04 in 99% of the frames, and below 0.06 in 90% of those of a crouched sneaking.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FeetSettings {
    /// Whether transitions keep planted feet from sliding; where not, feet slide as root and joints
    /// blend (Kovar 2002). Plants are found and slides reported all the same. Default true.
    pub keep: bool,
    /// Slower than this a foot surely stands, legs per second. Default 0.25.
    pub still_speed: f32,
    /// Faster than this it surely does not; between the two it stands if it did. Default 0.55.
    pub moving_speed: f32,
    /// Lower than this above its clip's own ground a foot may come to stand, legs. Default 0.06.
    pub low: f32,
    /// Higher than this it does not stand; between the two it stands if it did. Default 0.11.
    pub high: f32,
    /// A foot that stands for less is not planted, seconds. Default 0.1.
    pub shortest: f64,
    /// Two plants that are nearer than this are one, seconds. Default 0.07: two frames at 30 a second.
    pub gap: f64,
}

impl Default for FeetSettings {
    fn default() -> Self {
        Self {
            keep: true,
            still_speed: 0.25,
            moving_speed: 0.55,
            low: 0.06,
            high: 0.11,
            shortest: 0.1,
            gap: 0.07,
        }
    }
}

impl FeetSettings {
    /// Each number with its name and its range.
    pub(super) fn ranges(
        &self,
    ) -> [(
        &'static str,
        f64,
        std::ops::RangeInclusive<f64>,
        &'static str,
    ); 6] {
        let legs = |name, value: f32| (name, f64::from(value), 0.0..=1e3, "0 to 1000 legs");
        let seconds = |name, value| (name, value, 0.0..=10.0, "0 to 10 s");
        [
            legs("feet.still_speed", self.still_speed),
            legs("feet.moving_speed", self.moving_speed),
            legs("feet.low", self.low),
            legs("feet.high", self.high),
            seconds("feet.shortest", self.shortest),
            seconds("feet.gap", self.gap),
        ]
    }
}

/// Frames of a clip, first and last included, all through which a foot stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Plant {
    /// First frame.
    pub first: u32,
    /// Last frame.
    pub last: u32,
}

impl Plant {
    fn holds(self, frame: u32) -> bool {
        (self.first..=self.last).contains(&frame)
    }
}

/// The legs of a graph's skeleton, their plants in its clips and their ways through its transitions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Feet {
    legs: Vec<Leg>,
    /// `[clip][leg]`, in order of time.
    plants: Vec<Vec<Plant>>,
    /// `[edge][leg]`; empty where feet are not kept.
    blends: Vec<Option<LegBlend>>,
    /// By edge: how far the root sinks at most so that legs reach; empty where feet are not kept.
    sinks: Vec<f32>,
}

impl Feet {
    /// The legs; none where the skeleton's names tell no feet.
    #[must_use]
    pub fn legs(&self) -> &[Leg] {
        &self.legs
    }

    /// When the foot of a leg stands in a clip.
    #[must_use]
    pub fn plants(&self, clip: ClipId, leg: usize) -> &[Plant] {
        &self.plants[clip.index() * self.legs.len() + leg]
    }

    /// How an edge leads the foot of a leg; `None` where it has no part in that: in clips, and where
    /// a foot stands neither before nor after a transition.
    #[must_use]
    pub fn blend(&self, edge: EdgeId, leg: usize) -> Option<LegBlend> {
        let legs = self.legs.len();
        *self.blends.get(edge.index() * legs + leg)?
    }

    /// How far the root sinks at most on an edge, metres.
    #[must_use]
    pub fn sink(&self, edge: EdgeId) -> f32 {
        self.sinks.get(edge.index()).copied().unwrap_or(0.0)
    }

    fn stands(&self, clip: ClipId, leg: usize, frame: u32) -> bool {
        let plants = self.plants(clip, leg);
        let next = plants.partition_point(|plant| plant.last < frame);
        plants.get(next).is_some_and(|plant| plant.holds(frame))
    }
}

impl MotionGraph {
    /// The feet: their plants, and what transitions do for them.
    #[must_use]
    pub fn feet(&self) -> &Feet {
        &self.feet
    }

    /// Finds plants and, where `settings` say so, plans transitions: the last step of building.
    pub(super) fn with_feet(mut self, settings: &FeetSettings) -> Self {
        let legs = Leg::all(&self.skeleton);
        let plants = plants::find_all(&self.skeleton, &self.clips, &legs, settings);
        self.feet = Feet {
            legs,
            plants,
            ..Feet::default()
        };
        if settings.keep && !self.feet.legs.is_empty() {
            (self.feet.blends, self.feet.sinks) = plan::all(&self);
        }
        self
    }

    /// Whether the tables of feet fit the graph: asked of what is read from a file, after clips and
    /// edges were found sound.
    pub(super) fn feet_fit(&self) -> bool {
        let Feet {
            legs,
            plants,
            blends,
            sinks,
        } = &self.feet;
        let frames = |table: usize| self.clips[table / legs.len()].frames() as u32;
        let ordered = |plants: &[Plant]| plants.windows(2).all(|pair| pair[0].last < pair[1].first);
        let plants_fit = plants.len() == self.clips.len() * legs.len()
            && plants.iter().enumerate().all(|(table, plants)| {
                let inside =
                    |plant: &Plant| plant.first <= plant.last && plant.last < frames(table);
                ordered(plants) && plants.iter().all(inside)
            });
        let edges = self.edges.len();
        let tables_fit = [[0, 0], [edges * legs.len(), edges]];
        let blend_fits = |(index, blend): (usize, &Option<LegBlend>)| {
            blend.is_none_or(|blend| {
                blend.is_sound(self.edges[index / legs.len()].frames, Skeleton::FURTHEST)
            })
        };
        legs.iter().all(|leg| leg.is_sound(&self.skeleton))
            && plants_fit
            && tables_fit.contains(&[blends.len(), sinks.len()])
            && blends.iter().enumerate().all(blend_fits)
            && sinks
                .iter()
                .all(|sink| (0.0..=Skeleton::FURTHEST).contains(sink))
    }
}
