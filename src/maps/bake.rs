//! From a motion graph to everything that a query needs.
//!
//! Source: Masaoka & Oshita, sections 4.2–4.4. The maps are drawn by whoever has a rasterizer:
//! [`Baker::every_frame_drawings`] and [`Baker::any_frame_drawings`] say what to draw,
//! [`Baker::finish`] takes what was drawn.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::drawings::{self, EventDrawings, TooHigh};
use super::gather::{Gathering, Kind, Member};
use super::raster::{self, EvasionMaps};
use super::retime::retimable_edges;
use super::{
    BakedGraph, BitMap, Body, Drawing, Evasion, GridSettings, MapGrid, MapRect, PathSettings, Prop,
    RegionAtlas, RegionId, RetimeSettings, Strike,
};
use crate::anim::EventKind;
use crate::graph::{EdgeId, GraphEvent, MotionGraph};
use crate::math::{Rigid2, in_parallel};

/// How a graph is baked.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BakeSettings {
    /// Texels and slabs of the maps.
    pub maps: MapGrid,
    /// Which edges may be retimed.
    pub retime: RetimeSettings,
    /// How far ways to evasions are followed.
    pub paths: PathSettings,
    /// The cells that those are filed in.
    pub grid: GridSettings,
    /// The body's spheres; from the bones where there are none.
    pub body: Option<Body>,
    /// Threads for the maps; 0 for as many as the machine has. The maps are the same for any number.
    pub threads: usize,
    /// What the body's joints hold, beside what [`BakeSettings::body`] holds already.
    pub props: Vec<Prop>,
}

impl BakeSettings {
    fn check_numbers(&self) -> Result<(), BakeError> {
        let (retime, paths) = (&self.retime, &self.paths);
        let metres = |name, value: f32| (name, f64::from(value), 0.0..=1e6, "0 to 1000000 m");
        let cell = |name, value: f32| (name, f64::from(value), 0.001..=1e3, "0.001 to 1000");
        let checks = [
            ("retime.window", retime.window, 0.0..=10.0, "0 to 10 s"),
            metres("retime.slow", retime.slow),
            metres("retime.fast", retime.fast),
            metres("retime.still", retime.still),
            (
                "paths.horizon",
                f64::from(paths.horizon),
                0.0..=10.0,
                "0 to 10 s",
            ),
            cell("paths.alike_distance", paths.alike_distance),
            cell("paths.alike_angle", paths.alike_angle),
            (
                "paths.most",
                f64::from(paths.most),
                1.0..=1e7,
                "1 to 10000000",
            ),
            (
                "grid.cell",
                f64::from(self.grid.cell),
                0.05..=1.0,
                "0.05 to 1 m",
            ),
        ];
        let wrong = { checks.into_iter() }.find(|(_, value, range, _)| !range.contains(value));
        match wrong {
            Some((name, value, _, range)) => Err(BakeError::Setting { name, value, range }),
            None => Ok(()),
        }
    }
}

/// Why a graph cannot be baked.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum BakeError {
    /// Texels, slabs or slices out of range.
    #[error(
        "texels must be 0.001 to 1 m and an attack's 1, 2 or 4 of them, slabs 0.001 to 10 m and slices 1 to {max} of 0.001 to 1 s; they are {texel} m and {attack_pitch}, {slab_height} m and {slices} of {slice_seconds} s",
        max = MapGrid::MAX_SLICES
    )]
    Grid {
        /// Metres.
        texel: f32,
        /// Texels.
        attack_pitch: u32,
        /// Metres.
        slab_height: f32,
        /// How many.
        slices: u32,
        /// Seconds.
        slice_seconds: f32,
    },
    /// Another setting is out of its range.
    #[error("bake setting {name} is {value}; it must be {range}")]
    Setting {
        /// Which.
        name: &'static str,
        /// What it is.
        value: f64,
        /// What it may be.
        range: &'static str,
    },
    /// The settings' body has no sphere, or one without a joint, a place or a size.
    #[error(
        "the body needs spheres, each on a joint of the skeleton, with a finite place and a radius above 0"
    )]
    Body,
    /// One of the settings' props, counted from 0, has no sphere, or one without a joint, a place or a size.
    #[error(
        "prop {0} needs spheres, and a joint of the skeleton, each with a finite place and a radius above 0"
    )]
    Prop(usize),
    /// The body is higher above the ground, or further below it, than slabs are counted.
    #[error("the body in {event} reaches from slab {low} to {high}; {max} above and below the ground are the most: choose higher slabs", max = MapGrid::HIGHEST_SLAB)]
    TooHigh {
        /// Its clip and seconds.
        event: String,
        /// Lowest slab.
        low: i32,
        /// Highest slab.
        high: i32,
    },
    /// A map with more texels a side than fixed-point products allow.
    #[error("the map of {event} would be {width} x {height} texels; {max} a side is the most: choose larger texels", max = MapGrid::MAX_SIDE)]
    MapTooLarge {
        /// Its clip and seconds.
        event: String,
        /// Texels.
        width: u32,
        /// Texels.
        height: u32,
    },
    /// A rasterizer returned maps that are not those that were asked for.
    #[error("{found} maps were drawn where {expected} were asked for")]
    Maps {
        /// How many came.
        found: usize,
        /// How many should.
        expected: usize,
    },
}

/// What a rasterizer has drawn for a [`Baker`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DrawnMaps {
    /// Of [`Baker::every_frame_drawings`], in order.
    pub every_frame: Vec<EvasionMaps>,
    /// Of [`Baker::any_frame_drawings`], in order.
    pub any_frame: Vec<BitMap>,
}

/// A bake that waits for its maps.
#[derive(Clone, Debug)]
pub struct Baker {
    graph: MotionGraph,
    body: Body,
    settings: BakeSettings,
    /// The edges of all evasions and of all attacks.
    evasions: Vec<EdgeId>,
    attacks: Vec<EdgeId>,
    every_frame: Vec<Drawing>,
    any_frame: Vec<Drawing>,
    gathering: Gathering,
}

impl Baker {
    /// Prepares the drawings of all events of `graph`.
    ///
    /// # Errors
    /// Settings that make no maps.
    pub fn new(graph: MotionGraph, settings: BakeSettings) -> Result<Self, BakeError> {
        let maps = settings.maps;
        if !maps.is_sound() {
            return Err(BakeError::Grid {
                texel: maps.texel,
                attack_pitch: maps.attack_pitch,
                slab_height: maps.slab_height,
                slices: maps.slices,
                slice_seconds: maps.slice_seconds,
            });
        }
        settings.check_numbers()?;
        let mut body = settings
            .body
            .clone()
            .unwrap_or_else(|| Body::from_bones(graph.skeleton()));
        for (index, prop) in settings.props.iter().enumerate() {
            if !prop.is_sound(graph.skeleton()) {
                return Err(BakeError::Prop(index));
            }
            body.hold(prop.clone());
        }
        if !body.is_sound(graph.skeleton()) {
            return Err(BakeError::Body);
        }
        let of_kind = |kind| graph.edges_with(kind).map(|(edge, _)| edge).collect();
        let mut baker = Self {
            evasions: of_kind(EventKind::Evasion),
            attacks: of_kind(EventKind::Attack),
            body,
            settings,
            every_frame: Vec::new(),
            any_frame: Vec::new(),
            gathering: Gathering::new(maps),
            graph,
        };
        for (kind, drawings) in baker.events()? {
            let event = baker.gathering.event(kind, &drawings);
            for (part, drawing) in drawings.every_frame {
                baker.gathering.every_frame.push(Member { event, part });
                baker.every_frame.push(drawing);
            }
            for (part, drawing) in drawings.any_frame {
                baker.gathering.any_frame.push(Member { event, part });
                baker.any_frame.push(drawing);
            }
        }
        Ok(baker)
    }

    /// The drawings of all events, evasions first.
    fn events(&self) -> Result<Vec<(Kind, EventDrawings)>, BakeError> {
        let maps = self.settings.maps;
        let evasions = self.evasions.len();
        let count = evasions + self.attacks.len();
        let drawn = in_parallel(self.settings.threads, count, |index| {
            let (kind, edge) = match index.checked_sub(evasions) {
                None => (Kind::Evasion, self.evasions[index]),
                Some(attack) => (Kind::Attack, self.attacks[attack]),
            };
            let Some(event) = self.graph.edge(edge).event else {
                return Ok((kind, EventDrawings::default()));
            };
            let event = self.graph.event(event);
            let drawings = match kind {
                Kind::Evasion => drawings::of_evasion(&self.graph, &self.body, (edge, event), maps),
                Kind::Attack => drawings::of_attack(&self.graph, &self.body, event, maps),
            };
            Ok((kind, self.checked(event, drawings)?))
        });
        drawn.into_iter().collect()
    }

    /// Refuses what fixed-point maps cannot hold.
    fn checked(
        &self,
        event: &GraphEvent,
        drawings: Result<EventDrawings, TooHigh>,
    ) -> Result<EventDrawings, BakeError> {
        let describe = || self.graph.describe_event(event);
        let drawings = drawings.map_err(|TooHigh { low, high }| BakeError::TooHigh {
            event: describe(),
            low,
            high,
        })?;
        let all = drawings.every_frame.iter().chain(&drawings.any_frame);
        if let Some((_, large)) = { all }.find(|(_, drawing)| !drawing.rect.fits()) {
            let MapRect { width, height, .. } = large.rect;
            return Err(BakeError::MapTooLarge {
                event: describe(),
                width,
                height,
            });
        }
        Ok(drawings)
    }

    /// What is to be drawn by "every frame" ([`raster::every_frame`] or its twin on the device):
    /// each evasion as a whole and, where maps are timed, in each slice, slab by slab.
    #[must_use]
    pub fn every_frame_drawings(&self) -> &[Drawing] {
        &self.every_frame
    }

    /// What is to be drawn by "any frame" ([`raster::any_frame`] or its twin on the device): all
    /// that a body may touch in each slice of its evasion, and where attacks pass, slab by slab.
    #[must_use]
    pub fn any_frame_drawings(&self) -> &[Drawing] {
        &self.any_frame
    }

    /// Draws all maps on the CPU.
    #[must_use]
    pub fn draw_on_cpu(&self) -> DrawnMaps {
        let threads = self.settings.threads;
        let (every, any) = (&self.every_frame, &self.any_frame);
        DrawnMaps {
            every_frame: in_parallel(threads, every.len(), |i| raster::every_frame(&every[i])),
            any_frame: in_parallel(threads, any.len(), |i| raster::any_frame(&any[i])),
        }
    }

    /// Draws on the CPU and finishes.
    ///
    /// # Errors
    /// None that [`Baker::finish`] would not have.
    pub fn finish_on_cpu(self) -> Result<BakedGraph, BakeError> {
        let maps = self.draw_on_cpu();
        self.finish(maps)
    }

    /// Takes the maps, one for each drawing.
    ///
    /// # Errors
    /// Another number of maps than drawings, or maps of other rectangles.
    pub fn finish(self, maps: DrawnMaps) -> Result<BakedGraph, BakeError> {
        let atlas = self.atlas(&maps)?;
        let placement = |edge: EdgeId| -> Rigid2 {
            let from = self.graph.node(self.graph.edge(edge).from);
            self.graph.placement(from.clip, from.frame)
        };
        let regions = (0..).map(RegionId);
        let evasions = self.evasions.iter().zip(regions);
        let evasions = evasions
            .map(|(&edge, region)| Evasion {
                edge,
                region,
                placement: placement(edge),
            })
            .collect();
        let attacks = self.attacks.iter();
        let strikes = attacks
            .map(|&edge| Strike {
                edge,
                placement: placement(edge),
            })
            .collect();
        let retimable = retimable_edges(&self.graph, &self.settings.retime);
        Ok(BakedGraph::new(
            self.graph,
            self.body,
            atlas,
            retimable,
            (evasions, strikes),
            (&self.settings.paths, self.settings.grid),
        ))
    }

    fn atlas(&self, maps: &DrawnMaps) -> Result<RegionAtlas, BakeError> {
        let every = maps.every_frame.iter().map(|maps| maps.body.rect());
        check(every, &self.every_frame)?;
        check(maps.any_frame.iter().map(BitMap::rect), &self.any_frame)?;
        let (regions, attacks) = self.gathering.gather(maps);
        Ok(RegionAtlas::new(self.settings.maps, regions, attacks))
    }
}

impl BakedGraph {
    /// The same graph and ways with other maps, drawn on the CPU.
    ///
    /// # Errors
    /// A grid that makes no maps, or none that can be held.
    pub fn with_maps(&self, maps: MapGrid) -> Result<Self, BakeError> {
        let settings = BakeSettings {
            maps,
            body: Some(self.body().clone()),
            ..BakeSettings::default()
        };
        let baker = Baker::new(self.graph().clone(), settings)?;
        Ok(self.with_atlas(baker.atlas(&baker.draw_on_cpu())?))
    }
}

/// Whether maps of these rectangles are those of the drawings.
fn check(
    rects: impl ExactSizeIterator<Item = MapRect>,
    drawings: &[Drawing],
) -> Result<(), BakeError> {
    let (found, expected) = (rects.len(), drawings.len());
    let fitting = rects
        .zip(drawings)
        .filter(|(rect, drawing)| *rect == drawing.rect)
        .count();
    if found == expected && fitting == expected {
        Ok(())
    } else {
        Err(BakeError::Maps {
            found: fitting,
            expected,
        })
    }
}
