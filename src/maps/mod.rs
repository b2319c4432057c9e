//! Everything that a query needs to know of a motion graph, computed once by a bake.
//!
//! A bake reads a [`MotionGraph`](crate::graph::MotionGraph) and answers, before the game runs, three questions. Where is the body during
//! each evasion, slab by slab and slice by slice of time (maps, [`RegionAtlas`])? Which evasions can the character reach from a node of the
//! graph, and which cells of space does it vacate when it takes one (paths and grids, [`PathTable`], [`Grid`])? From which moments can it
//! cut into an evasion without an edge (entries, [`EntryReport`])? The result is one immutable [`BakedGraph`].
//!
//! # Order of calls
//! 1. [`Baker::new`] checks the [`BakeSettings`] and prepares one drawing for each event, slab and slice.
//! 2. [`Baker::finish_on_cpu`] draws the maps and finishes the bake. To draw them with a rasterizer of your own, draw
//!    [`Baker::every_frame_drawings`] and [`Baker::any_frame_drawings`] as [`raster`] does, and call [`Baker::finish`].
//! 3. [`archive::write`](crate::archive::write) saves the baked graph, [`archive::read`](crate::archive::read) loads it.
//! 4. [`BakedGraph::prepare`] computes what queries otherwise compute on first use.
//! 5. [`Characters`](crate::character::Characters) or a [`Query`](crate::query::Query) borrow it. Any number of threads may.
//!
//! ```
//! use sabaki::maps::{BakeSettings, Baker, MapGrid};
//!
//! # fn bake(graph: sabaki::graph::MotionGraph) -> Result<(), Box<dyn std::error::Error>> {
//! let maps = MapGrid { texel: 0.015, ..MapGrid::default() };
//! let settings = BakeSettings { maps, ..BakeSettings::default() };
//! let baked = Baker::new(graph, settings)?.finish_on_cpu()?;
//! println!("{} evasions, {} bytes of maps", baked.evasions().len(), baked.atlas().bytes());
//! for edge in baked.graph().edge_ids().take(1) {
//!     let paths = baked.paths().from_node(baked.graph().edge(edge).to);
//!     println!("{} paths to evasions, the first after {:?} frames", paths.len(), paths.first().map(|path| path.frames));
//! }
//! sabaki::archive::write("fighter.sabaki".as_ref(), &baked)?;
//! # Ok(())
//! # }
//! ```
//!
//! # Layout
//! `regions` draws bodies and attacks, `grid` finds paths, `entries` finds cuts, `bake` puts them together. Each uses only those before it.
//!
//! Source: Masaoka & Oshita, sections 3.2 and 4.1 to 4.4. What differs stands at the head of each file.

mod bake;
pub(crate) mod entries;
mod grid;
mod regions;

pub use bake::{BakeError, BakeSettings, BakedGraph, Baker, DrawnMaps};
pub use entries::{EntryReport, EntryShare, MomentShare, Stretches};
pub(crate) use entries::{KnownEntry, Stance, head};
pub use grid::{
    CellColumn, Grid, NodePath, PathId, PathReport, PathSettings, PathTable, Retimable,
    RetimeSettings, TouchedCells,
};
pub use regions::{
    AttackMaps, AttackMove, BitMap, Body, BodySphere, BodyTrack, Disc, Drawing, Evasion,
    EvasionMaps, FixedTransform2, MapGrid, MapRect, MaskMap, MovingSphere, Prop, RegionAtlas,
    RegionId, RegionMaps, SUB_TEXELS, Section, Slab, SlabMaps, SphereKey, raster,
};
pub(crate) use regions::{
    BlockAxis, BoundingCylinder, CoarseMap, CoarseRegion, Cut, HALF_DIAGONAL, PART, ROUNDING,
    SphereRows, TIME_ERROR,
};
