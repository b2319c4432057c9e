//! From a motion graph to everything that a query needs.
//!
//! Source: Masaoka & Oshita, sections 4.2–4.4. The maps are drawn by whoever has a rasterizer: [`Baker::evasion_drawings`]
//! and [`Baker::attack_drawings`] say what to draw, [`Baker::finish`] takes what was drawn.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::drawings::{self, SlabDrawings};
use super::raster::{self, EvasionMaps};
use super::retime::retimable_edges;
use super::{
    AttackMaps, BakedGraph, BitMap, Body, Drawing, Evasion, GridSettings, MapGrid, MapRect,
    PathSettings, Prop, RegionAtlas, RegionId, RegionMaps, RetimeSettings, Strike,
};
use crate::anim::EventKind;
use crate::graph::{EdgeId, GraphEvent, MotionGraph};
use crate::math::Rigid2;

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
    /// What the body's joints hold, beside what [`BakeSettings::body`] holds already.
    pub props: Vec<Prop>,
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
    /// Of [`Baker::evasion_drawings`], in order.
    pub evasions: Vec<EvasionMaps>,
    /// Of [`Baker::attack_drawings`], in order.
    pub attacks: Vec<BitMap>,
}

/// A bake that waits for its maps.
#[derive(Clone, Debug)]
pub struct Baker {
    graph: MotionGraph,
    body: Body,
    settings: BakeSettings,
    evasions: Prepared,
    attacks: Prepared,
}

/// The drawings of all events of a kind.
#[derive(Clone, Debug, Default)]
struct Prepared {
    edges: Vec<EdgeId>,
    /// For each edge its lowest slab and how many it has.
    slabs: Vec<(super::Slab, usize)>,
    /// Of all slabs of all edges.
    drawings: Vec<Drawing>,
}

impl Baker {
    /// Prepares the drawings of all events of `graph`.
    ///
    /// # Errors
    /// Settings that make no maps.
    pub fn new(graph: MotionGraph, settings: BakeSettings) -> Result<Self, BakeError> {
        let MapGrid { texel, slab_height } = settings.maps;
        if !settings.maps.is_sound() {
            return Err(BakeError::Grid { texel, slab_height });
        }
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
        let maps = settings.maps;
        let evasions = prepare(&graph, EventKind::Evasion, |event| {
            drawings::of_evasion(&graph, &body, event, maps)
        })?;
        let attacks = prepare(&graph, EventKind::Attack, |event| {
            drawings::of_attack(&graph, &body, event, maps)
        })?;
        Ok(Self {
            evasions,
            attacks,
            graph,
            body,
            settings,
        })
    }

    /// What is to be drawn by "every frame" ([`raster::every_frame`] or its twin on the device).
    #[must_use]
    pub fn evasion_drawings(&self) -> &[Drawing] {
        &self.evasions.drawings
    }

    /// What is to be drawn by "any frame" ([`raster::any_frame`] or its twin on the device).
    #[must_use]
    pub fn attack_drawings(&self) -> &[Drawing] {
        &self.attacks.drawings
    }

    /// Draws all maps on the CPU.
    #[must_use]
    pub fn draw_on_cpu(&self) -> DrawnMaps {
        DrawnMaps {
            evasions: self
                .evasion_drawings()
                .iter()
                .map(raster::every_frame)
                .collect(),
            attacks: self
                .attack_drawings()
                .iter()
                .map(raster::any_frame)
                .collect(),
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
        self.evasions
            .check(maps.evasions.iter().map(|maps| maps.body.rect()))?;
        self.attacks.check(maps.attacks.iter().map(BitMap::rect))?;
        let placement = |edge: EdgeId| -> Rigid2 {
            let from = self.graph.node(self.graph.edge(edge).from);
            self.graph.placement(from.clip, from.frame)
        };
        let regions = (0..).map(RegionId);
        let evasions = self.evasions.edges.iter().zip(regions);
        let evasions = evasions
            .map(|(&edge, region)| Evasion {
                edge,
                region,
                placement: placement(edge),
            })
            .collect();
        let strikes = self
            .attacks
            .edges
            .iter()
            .map(|&edge| Strike {
                edge,
                placement: placement(edge),
            })
            .collect();
        let atlas = RegionAtlas {
            grid: self.settings.maps,
            regions: self
                .evasions
                .distribute(maps.evasions)
                .map(|(first_slab, slabs)| RegionMaps { first_slab, slabs })
                .collect(),
            attacks: self
                .attacks
                .distribute(maps.attacks)
                .map(|(first_slab, slabs)| AttackMaps { first_slab, slabs })
                .collect(),
        };
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
}

/// The drawings of all events of a kind, in the order of their edges.
fn prepare(
    graph: &MotionGraph,
    kind: EventKind,
    draw: impl Fn(&GraphEvent) -> SlabDrawings,
) -> Result<Prepared, BakeError> {
    let mut prepared = Prepared::default();
    for (edge, event) in graph.edges_with(kind) {
        let event = graph.event(event);
        let describe = || graph.describe_event(event);
        let SlabDrawings {
            first_slab,
            drawings,
        } = draw(event);
        let (low, high) = (
            first_slab.0,
            first_slab.0.saturating_add(drawings.len() as i32),
        );
        if low < -MapGrid::HIGHEST_SLAB || high > MapGrid::HIGHEST_SLAB {
            return Err(BakeError::TooHigh {
                event: describe(),
                low,
                high,
            });
        }
        if let Some(large) = drawings.iter().find(|drawing| !drawing.rect.fits()) {
            let MapRect { width, height, .. } = large.rect;
            return Err(BakeError::MapTooLarge {
                event: describe(),
                width,
                height,
            });
        }
        prepared.edges.push(edge);
        prepared.slabs.push((first_slab, drawings.len()));
        prepared.drawings.extend(drawings);
    }
    Ok(prepared)
}

impl Prepared {
    /// Whether maps of these rectangles are those of the drawings.
    fn check(&self, rects: impl ExactSizeIterator<Item = MapRect>) -> Result<(), BakeError> {
        let (found, expected) = (rects.len(), self.drawings.len());
        let fitting = rects
            .zip(&self.drawings)
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

    /// Gives each edge its lowest slab and its maps.
    fn distribute<T>(&self, maps: Vec<T>) -> impl Iterator<Item = (super::Slab, Vec<T>)> {
        let mut maps = maps.into_iter();
        self.slabs
            .iter()
            .map(move |&(first, count)| (first, maps.by_ref().take(count).collect()))
    }
}
