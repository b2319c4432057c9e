//! Settings of the maps on the command line.

use sabaki::maps::{MapGrid, Section};

use super::Failure;
use super::numbers::check_number;

/// Settings of the maps; `compare --settings` measures what each one changes.
#[derive(Clone, Copy, Debug, clap::Args)]
#[command(next_help_heading = "Maps")]
pub(crate) struct MapArgs {
    /// Side of a texel of the maps, in metres.
    #[arg(long, value_name = "METRES", requires = "clips", default_value_t = MapGrid::default().texel)]
    texel: f32,
    /// Side of a texel of attack maps, in texels of the body maps: 1, 2 or 4.
    #[arg(long, value_name = "TEXELS", requires = "clips", default_value_t = MapGrid::default().attack_pitch.into())]
    attack_pitch: i128,
    /// Height of a slab, which one map covers, in metres.
    #[arg(long, value_name = "METRES", requires = "clips", default_value_t = MapGrid::default().slab_height)]
    slab: f32,
    /// Number of time slices, 1 to 64, that cover 1.07 s together; 1 for maps without time.
    #[arg(long, value_name = "N", requires = "clips", default_value_t = MapGrid::default().slices.into())]
    slices: i128,
    /// Uses the paper's maps: slabs of 0.30 m, outlines, no time.
    #[arg(long, requires = "clips", conflicts_with_all = ["texel", "attack_pitch", "slab", "slices"])]
    paper_maps: bool,
}

impl MapArgs {
    /// What can be refused before the clips are read.
    pub(crate) fn check(&self) -> Result<(), Failure> {
        let (texel, slab, slices) = (self.texel, self.slab, self.slices);
        check_number((0.001..=1.0).contains(&texel), || {
            format!("--texel {texel}: must be 0.001 to 1 metres")
        })?;
        check_number([1, 2, 4].contains(&self.attack_pitch), || {
            format!("--attack-pitch {}: must be 1, 2 or 4", self.attack_pitch)
        })?;
        check_number((0.001..=10.0).contains(&slab), || {
            format!("--slab {slab}: must be 0.001 to 10 metres")
        })?;
        let most = MapGrid::MAX_SLICES.into();
        check_number((1..=most).contains(&slices), || {
            format!("--slices {slices}: must be 1 to {most}")
        })
    }

    pub(crate) fn grid(&self) -> MapGrid {
        match self.paper_maps {
            true => MapGrid::PAPER,
            false => MapGrid {
                texel: self.texel,
                attack_pitch: self.attack_pitch as u32,
                ..planes(self.slices as u32, self.slab)
            },
        }
    }
}

/// A grid whose slices cover the same time as the default ones.
pub(crate) fn planes(slices: u32, slab_height: f32) -> MapGrid {
    MapGrid {
        slab_height,
        section: Section::Plane,
        slices,
        // Ignored where there is one slice.
        slice_seconds: MapGrid::default().seconds() / slices.max(2) as f32,
        ..MapGrid::default()
    }
}
