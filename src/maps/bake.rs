//! Bakes a motion graph into the data that a query needs.
//!
//! Source: Masaoka & Oshita, sections 4.2–4.4. The caller may draw the maps with any rasterizer:
//! [`Baker::every_frame_drawings`] and [`Baker::any_frame_drawings`] list the drawings, and
//! [`Baker::finish`] takes the drawn maps.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::baked::BakedParts;
use super::collect::{DrawingOwner, DrawnMaps, Kind, MapCollector};
use super::drawings::{self, DrawingSource, EventDrawings, TooHigh};
use super::raster;
use super::retime::retimable_edges;
use super::{
    AttackMove, BakedGraph, BitMap, Body, Drawing, EntrySettings, EntryTable, Evasion,
    GridSettings, MapGrid, MapRect, PathSettings, Prop, RegionAtlas, RegionId, RetimeSettings,
};
use crate::anim::EventKind;
use crate::graph::{EdgeId, GraphEvent, MotionGraph};
use crate::math::{Rigid2, in_parallel};

/// Settings of a bake.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BakeSettings {
    /// Texel size, slab height and time slices of the maps.
    pub maps: MapGrid,
    /// Thresholds that decide which edges may be retimed.
    pub retime: RetimeSettings,
    /// Horizon of the path search, and limits on the paths that are kept.
    pub paths: PathSettings,
    /// Size of the cells that paths are filed in.
    pub grid: GridSettings,
    /// Settings of the jumps into evasions that need no edge.
    pub entries: EntrySettings,
    /// Spheres of the body. Default: spheres along the skeleton's bones ([`Body::from_bones`]).
    pub body: Option<Body>,
    /// Number of threads that draw the maps, or 0 for one thread per CPU core. The maps do not
    /// depend on it.
    pub threads: usize,
    /// Props that the joints hold, in addition to those of [`BakeSettings::body`].
    pub props: Vec<Prop>,
}

impl BakeSettings {
    fn check_numbers(&self) -> Result<(), BakeError> {
        let (retime, paths) = (&self.retime, &self.paths);
        let (entries, plausible) = (&self.entries, &self.entries.plausible);
        let percent = |value: f32| f64::from(value);
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
                "entries.lead_in",
                f64::from(entries.lead_in),
                0.0..=10.0,
                "0 to 10 s",
            ),
            (
                "entries.late",
                f64::from(entries.late),
                0.0..=60.0,
                "0 to 60 s",
            ),
            (
                "entries.plausible.joints",
                percent(plausible.joints),
                0.0..=100.0,
                "0 to 100",
            ),
            (
                "entries.plausible.departure",
                percent(plausible.departure),
                0.0..=100.0,
                "0 to 100",
            ),
            metres("entries.plausible.slide", plausible.slide),
            metres("entries.plausible.toe_speed", plausible.toe_speed),
            (
                "grid.cell",
                f64::from(self.grid.cell),
                0.05..=1.0,
                "0.05 to 1 m",
            ),
        ];
        let wrong = checks
            .into_iter()
            .find(|(_, value, range, _)| !range.contains(value));
        match wrong {
            Some((name, value, _, range)) => Err(BakeError::Setting { name, value, range }),
            None => Ok(()),
        }
    }
}

/// Reason why a graph cannot be baked.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum BakeError {
    /// Texel size, slab height or time slices are out of range.
    #[error(
        "texels must be 0.001 to 1 m and an attack's 1, 2 or 4 of them, slabs 0.001 to 10 m and slices 1 to {max} of 0.001 to 1 s; they are {texel} m and {attack_pitch}, {slab_height} m and {slices} of {slice_seconds} s",
        max = MapGrid::MAX_SLICES
    )]
    Grid {
        /// Side of a texel, in metres.
        texel: f32,
        /// Pitch of an attack's texels, in texels.
        attack_pitch: u32,
        /// Height of a slab, in metres.
        slab_height: f32,
        /// Number of time slices.
        slices: u32,
        /// Duration of a slice, in seconds.
        slice_seconds: f32,
    },
    /// Another setting is out of range.
    #[error("bake setting {name} is {value}; it must be {range}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Value of the setting.
        value: f64,
        /// Range of valid values.
        range: &'static str,
    },
    /// The body has no sphere, or a sphere has an unknown joint, a position that is not finite, or
    /// no radius.
    #[error(
        "the body needs spheres, each on a joint of the skeleton, with a finite place and a radius above 0"
    )]
    Body,
    /// A prop has no sphere, or a sphere with an unknown joint, a position that is not finite, or
    /// no radius. Props are counted from 0.
    #[error(
        "prop {0} needs spheres, and a joint of the skeleton, each with a finite place and a radius above 0"
    )]
    Prop(usize),
    /// The body is farther above or below the ground than slab numbers reach.
    #[error("the body in {event} reaches from slab {low} to {high}; {max} above and below the ground are the most: choose higher slabs", max = MapGrid::HIGHEST_SLAB)]
    TooHigh {
        /// Clip and time of the event.
        event: String,
        /// Lowest slab that the body reaches.
        low: i32,
        /// Highest slab that the body reaches.
        high: i32,
    },
    /// A map has more texels on a side than fixed-point products allow.
    #[error("the map of {event} would be {width} x {height} texels; {max} a side is the most: choose larger texels", max = MapGrid::MAX_SIDE)]
    MapTooLarge {
        /// Clip and time of the event.
        event: String,
        /// Width of the map, in texels.
        width: u32,
        /// Height of the map, in texels.
        height: u32,
    },
    /// The drawn maps do not match the requested drawings.
    #[error("{found} maps were drawn where {expected} were asked for")]
    Maps {
        /// Number of maps that match a drawing.
        found: usize,
        /// Number of drawings.
        expected: usize,
    },
}

/// A bake whose drawings are prepared and whose maps are not yet drawn.
#[derive(Clone, Debug)]
pub struct Baker {
    graph: MotionGraph,
    body: Body,
    settings: BakeSettings,
    /// Edges of all evasions.
    evasions: Vec<EdgeId>,
    attacks: Vec<EdgeId>,
    every_frame: Vec<Drawing>,
    any_frame: Vec<Drawing>,
    collector: MapCollector,
}

impl Baker {
    /// Prepares the drawings of all events of `graph`.
    ///
    /// # Errors
    /// A setting is out of range, or an event's maps would be too large.
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
            collector: MapCollector::new(maps),
            graph,
        };
        for (kind, drawings) in baker.events()? {
            let event = baker.collector.event(kind, &drawings);
            for (part, drawing) in drawings.every_frame {
                baker
                    .collector
                    .every_frame
                    .push(DrawingOwner { event, part });
                baker.every_frame.push(drawing);
            }
            for (part, drawing) in drawings.any_frame {
                baker.collector.any_frame.push(DrawingOwner { event, part });
                baker.any_frame.push(drawing);
            }
        }
        Ok(baker)
    }

    /// Prepares the drawings of all events, evasions first.
    fn events(&self) -> Result<Vec<(Kind, EventDrawings)>, BakeError> {
        let source = DrawingSource {
            graph: &self.graph,
            body: &self.body,
            grid: self.settings.maps,
        };
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
                Kind::Evasion => drawings::of_evasion(source, edge, event),
                Kind::Attack => drawings::of_attack(source, event),
            };
            Ok((kind, self.checked(event, drawings)?))
        });
        drawn.into_iter().collect()
    }

    /// Returns an error if the drawings do not fit fixed-point maps.
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
        let mut all = drawings.every_frame.iter().chain(&drawings.any_frame);
        if let Some((_, large)) = all.find(|(_, drawing)| !drawing.rect.fits()) {
            let MapRect { width, height, .. } = large.rect;
            return Err(BakeError::MapTooLarge {
                event: describe(),
                width,
                height,
            });
        }
        Ok(drawings)
    }

    /// Drawings for [`raster::every_frame`] or its GPU counterpart. Each evasion has, slab by slab,
    /// one drawing of the whole evasion and, if the maps are timed, one of each slice.
    #[must_use]
    pub fn every_frame_drawings(&self) -> &[Drawing] {
        &self.every_frame
    }

    /// Drawings for [`raster::any_frame`] or its GPU counterpart. They hold, slab by slab,
    /// everything that the body may touch in each slice of an evasion, and everything that an
    /// attack passes.
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

    /// Draws all maps on the CPU and finishes the bake.
    ///
    /// # Errors
    /// The errors of [`Baker::finish`].
    pub fn finish_on_cpu(self) -> Result<BakedGraph, BakeError> {
        let maps = self.draw_on_cpu();
        self.finish(maps)
    }

    /// Finishes the bake with one map for each drawing.
    ///
    /// # Errors
    /// The number of maps differs from the number of drawings, or a map's rectangle differs from
    /// its drawing's.
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
        let attack_moves = attacks
            .map(|&edge| AttackMove {
                edge,
                placement: placement(edge),
            })
            .collect();
        let retimable = retimable_edges(&self.graph, &self.settings.retime);
        let evasions: Vec<Evasion> = evasions;
        let how = (&self.settings.entries, self.settings.threads);
        let entries = EntryTable::find(&self.graph, &evasions, how);
        let parts = BakedParts {
            graph: self.graph,
            body: self.body,
            atlas,
            retimable,
            evasions,
            attack_moves,
            entries,
        };
        Ok(BakedGraph::new(
            parts,
            &self.settings.paths,
            self.settings.grid,
        ))
    }

    fn atlas(&self, maps: &DrawnMaps) -> Result<RegionAtlas, BakeError> {
        let every = maps.every_frame.iter().map(|maps| maps.body.rect());
        check(every, &self.every_frame)?;
        check(maps.any_frame.iter().map(BitMap::rect), &self.any_frame)?;
        let (regions, attacks) = self.collector.gather(maps);
        Ok(RegionAtlas::new(self.settings.maps, regions, attacks))
    }
}

impl BakedGraph {
    /// Returns the same graph and paths with maps of another grid, drawn on the CPU.
    ///
    /// # Errors
    /// The grid is out of range, or an event's maps would be too large.
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

/// Checks that the maps have the rectangles of the drawings.
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
