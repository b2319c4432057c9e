//! How the maps are drawn, from the command line.

use sabaki::maps::{MapGrid, Section};

/// Settings of the maps; `compare --settings` says what each is worth.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct MapArgs {
    /// Side of a texel of the maps, metres.
    #[arg(long, value_name = "METRES", requires = "clips", default_value_t = MapGrid::default().texel)]
    texel: f32,
    /// Side of a texel of an attack's maps, in texels of the others: 1, 2 or 4.
    #[arg(long, value_name = "TEXELS", requires = "clips", default_value_t = MapGrid::default().attack_pitch)]
    attack_pitch: u32,
    /// From one map to the next above it, metres.
    #[arg(long, value_name = "METRES", requires = "clips", default_value_t = MapGrid::default().slab_height)]
    slab: f32,
    /// Slices of time, 1 to 64, which last 1.07 s together; 1 for maps that know no time.
    #[arg(long, value_name = "N", requires = "clips", default_value_t = MapGrid::default().slices)]
    slices: u32,
    /// The paper's maps instead: slabs of 0.30 m, outlines, no time.
    #[arg(long, requires = "clips", conflicts_with_all = ["texel", "attack_pitch", "slab", "slices"])]
    paper_maps: bool,
}

impl MapArgs {
    pub(crate) fn grid(&self) -> MapGrid {
        match self.paper_maps {
            true => MapGrid::PAPER,
            false => planes(self.slices, self.slab, self.texel, self.attack_pitch),
        }
    }
}

/// Maps of planes, whose slices cover together what the default ones do.
pub(crate) fn planes(slices: u32, slab_height: f32, texel: f32, attack_pitch: u32) -> MapGrid {
    MapGrid {
        texel,
        attack_pitch,
        slab_height,
        section: Section::Plane,
        slices,
        // Without meaning where there is one only.
        slice_seconds: MapGrid::default().seconds() / slices.max(2) as f32,
    }
}
