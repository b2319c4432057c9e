//! Maps: spheres over time, drawn into one 2-D map for each height slab.
//!
//! Source: Masaoka & Oshita, sections 3.2 and 4.3. A sphere becomes one [`Disc`] in each [`Slab`]
//! that it reaches. Integer arithmetic decides whether a disc covers a texel, so that the GPU's
//! rasterizer and the CPU's `raster` produce identical maps.

pub(crate) mod attack_grid;
pub(crate) mod bake;
mod bake_settings;
mod baked;
mod collect;
mod drawings;
pub(crate) mod entries;
mod grid;
mod regions;

pub use attack_grid::{AttackGrid, AttackGridReport, AttackGridSettings, AttackOption, Contact};
pub use bake::Baker;
pub use bake_settings::{BakeError, BakeSettings};
pub use baked::BakedGraph;
pub use collect::DrawnMaps;
pub(crate) use drawings::{CLOCK_ERROR, HALF_DIAGONAL, ROUNDING};
pub use entries::{EntryReport, EntrySettings, PlausibilitySettings, Stretches};
pub(crate) use entries::{EntryTable, KnownEntry, Stance};
pub use grid::{
    CellColumn, Grid, GridSettings, NodePath, PathId, PathReport, PathSettings, PathTable,
    Retimable, RetimeSettings, TouchedCells,
};
pub use regions::{
    AttackMaps, AttackMove, BitMap, Body, BodySphere, BodyTrack, Disc, Drawing, Evasion,
    EvasionMaps, FixedTransform2, MapGrid, MapRect, MaskMap, MovingSphere, Prop, RegionAtlas,
    RegionId, RegionMaps, SUB_TEXELS, Section, Slab, SlabMaps, SphereKey, raster,
};
pub(crate) use regions::{
    BlockAxis, BodyRows, BoundingCylinder, CoarseMap, CoarseRegion, Cut, OnFirstUse, PART,
    SphereRows, bit_square,
};
