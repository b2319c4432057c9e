//! From a motion graph to everything that a query needs.
//!
//! Source: Masaoka & Oshita, sections 4.2–4.4. The evasions' maps are drawn by whoever has a rasterizer: [`Baker::drawings`] says
//! what to draw, [`Baker::finish`] takes what was drawn.

use glam::Vec3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::raster::{self, EvasionMaps};
use super::retime::retimable_edges;
use super::{
    BakedGraph, Body, Disc, Drawing, Evasion, MapGrid, MapRect, RegionAtlas, RegionId, RegionMaps,
    RetimeSettings, Slab,
};
use crate::anim::{EventKind, Pose, forward_kinematics};
use crate::graph::{EdgeId, GraphEvent, MotionGraph};
use crate::math::Rigid2;

/// How a graph is baked.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BakeSettings {
    /// Texels and slabs of the maps.
    pub maps: MapGrid,
    /// Which edges may be retimed.
    pub retime: RetimeSettings,
    /// The body's spheres; from the bones where there are none.
    pub body: Option<Body>,
}

/// Why a graph cannot be baked.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum BakeError {
    /// Texels or slabs out of range.
    #[error(
        "texels must be 0.001 to 1 m and slabs 0.001 to 10 m; they are {texel} m and {slab_height} m"
    )]
    Grid {
        /// Metres.
        texel: f32,
        /// Metres.
        slab_height: f32,
    },
    /// The settings' body has no sphere, or one without a joint, a place or a size.
    #[error(
        "the body needs spheres, each on a joint of the skeleton, with a finite place and a radius above 0"
    )]
    Body,
    /// The body is higher above the ground, or further below it, than slabs are counted.
    #[error("the body in evasion {event} reaches from slab {low} to {high}; {max} above and below the ground are the most: choose higher slabs", max = MapGrid::HIGHEST_SLAB)]
    TooHigh {
        /// Its clip and seconds.
        event: String,
        /// Lowest slab.
        low: i32,
        /// Highest slab.
        high: i32,
    },
    /// A map with more texels a side than fixed-point products allow.
    #[error("the map of evasion {event} would be {width} x {height} texels; {max} a side is the most: choose larger texels", max = MapGrid::MAX_SIDE)]
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

/// A bake that waits for its maps.
#[derive(Clone, Debug)]
pub struct Baker {
    graph: MotionGraph,
    body: Body,
    settings: BakeSettings,
    evasions: Vec<EdgeId>,
    /// For each evasion its lowest slab and how many it has.
    slabs: Vec<(Slab, usize)>,
    drawings: Vec<Drawing>,
}

impl Baker {
    /// Prepares the drawings of all evasions of `graph`.
    ///
    /// # Errors
    /// Settings that make no maps.
    pub fn new(graph: MotionGraph, settings: BakeSettings) -> Result<Self, BakeError> {
        let MapGrid { texel, slab_height } = settings.maps;
        if !settings.maps.is_sound() {
            return Err(BakeError::Grid { texel, slab_height });
        }
        let body = settings
            .body
            .clone()
            .unwrap_or_else(|| Body::from_bones(graph.skeleton()));
        if !body.is_sound(graph.skeleton()) {
            return Err(BakeError::Body);
        }
        let evasions: Vec<(EdgeId, _)> = graph.edges_with(EventKind::Evasion).collect();
        let (mut slabs, mut drawings) = (Vec::new(), Vec::new());
        for &(_, event) in &evasions {
            let event = graph.event(event);
            let frames = body_frames(&graph, &body, event);
            let (low, high) = reached_slabs(&frames[0], &body, settings.maps);
            if low < -MapGrid::HIGHEST_SLAB || high >= MapGrid::HIGHEST_SLAB {
                let event = graph.describe_event(event);
                return Err(BakeError::TooHigh { event, low, high });
            }
            let drawn = evasion_drawings(&frames, &body, settings.maps, low..=high);
            if let Some(large) = drawn.iter().find(|drawing| !drawing.rect.fits()) {
                let MapRect { width, height, .. } = large.rect;
                return Err(BakeError::MapTooLarge {
                    event: graph.describe_event(event),
                    width,
                    height,
                });
            }
            slabs.push((Slab(low), drawn.len()));
            drawings.extend(drawn);
        }
        let evasions = evasions.into_iter().map(|(edge, _)| edge).collect();
        Ok(Self {
            graph,
            body,
            settings,
            evasions,
            slabs,
            drawings,
        })
    }

    /// What is to be drawn by "every frame" ([`raster::every_frame`] or its twin on the device), in this order.
    #[must_use]
    pub fn drawings(&self) -> &[Drawing] {
        &self.drawings
    }

    /// Draws on the CPU and finishes.
    ///
    /// # Errors
    /// None that [`Baker::finish`] would not have.
    pub fn finish_on_cpu(self) -> Result<BakedGraph, BakeError> {
        let maps = self.drawings.iter().map(raster::every_frame).collect();
        self.finish(maps)
    }

    /// Takes the maps, one for each drawing.
    ///
    /// # Errors
    /// Another number of maps than drawings, or maps of other rectangles.
    pub fn finish(self, maps: Vec<EvasionMaps>) -> Result<BakedGraph, BakeError> {
        let fitting = maps
            .iter()
            .zip(&self.drawings)
            .filter(|(map, drawing)| map.body.rect() == drawing.rect)
            .count();
        if fitting != self.drawings.len() || maps.len() != self.drawings.len() {
            return Err(BakeError::Maps {
                found: fitting,
                expected: self.drawings.len(),
            });
        }
        let mut maps = maps.into_iter();
        let regions = self
            .slabs
            .iter()
            .map(|&(first_slab, count)| RegionMaps {
                first_slab,
                slabs: maps.by_ref().take(count).collect(),
            })
            .collect();
        let evasions = self.evasions.iter().enumerate().map(|(index, &edge)| {
            let from = self.graph.node(self.graph.edge(edge).from);
            let placement = self.graph.placement(from.clip, from.frame);
            Evasion {
                edge,
                region: RegionId(index as u32),
                placement,
            }
        });
        Ok(BakedGraph::new(
            evasions.collect(),
            retimable_edges(&self.graph, &self.settings.retime),
            RegionAtlas {
                grid: self.settings.maps,
                regions,
            },
            self.body,
            self.graph,
        ))
    }
}

/// The body's sphere centres in each frame of an event, in the frame where it starts (root on the ground, facing +Z).
fn body_frames(graph: &MotionGraph, body: &Body, event: &GraphEvent) -> Vec<Vec<Vec3>> {
    let to_start: Rigid2 = graph.placement(event.clip, event.first).inverse();
    let (mut pose, mut joints) = (Pose::default(), Vec::new());
    (event.first..=event.last)
        .map(|frame| {
            graph.clip(event.clip).pose(frame as usize, &mut pose);
            pose.place(to_start);
            forward_kinematics(graph.skeleton(), &pose, &mut joints);
            let mut centres = Vec::new();
            body.centres(&joints, &mut centres);
            centres
        })
        .collect()
}

/// The lowest and the highest slab that the body reaches.
fn reached_slabs(centres: &[Vec3], body: &Body, grid: MapGrid) -> (i32, i32) {
    let reached = centres
        .iter()
        .zip(&body.spheres)
        .map(|(&c, s)| grid.slabs(c, s.radius));
    reached.fold((i32::MAX, i32::MIN), |(low, high), r| {
        (low.min(*r.start()), high.max(*r.end()))
    })
}

/// One drawing for each of the slabs.
fn evasion_drawings(
    frames: &[Vec<Vec3>],
    body: &Body,
    grid: MapGrid,
    slabs: std::ops::RangeInclusive<i32>,
) -> Vec<Drawing> {
    let discs = |centres: &[Vec3], slab| -> Vec<Disc> {
        centres
            .iter()
            .zip(&body.spheres)
            .filter_map(|(&c, s)| grid.disc(c, s.radius, slab))
            .collect()
    };
    let drawings = slabs.map(|number| {
        let slab = Slab(number);
        let rect = MapRect::around(&discs(&frames[0], slab));
        let mut drawing = Drawing {
            rect,
            ..Drawing::default()
        };
        for centres in frames {
            drawing.discs.extend(
                discs(centres, slab)
                    .iter()
                    .map(|disc| disc.relative_to(rect.u, rect.v)),
            );
            drawing.frame_ends.push(drawing.discs.len() as u32);
        }
        drawing
    });
    drawings.collect()
}
