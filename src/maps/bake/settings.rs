//! Settings and errors of a bake.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::graph::watch::Stopped;
use crate::maps::grid::{PathSettings, RetimeSettings};
use crate::maps::regions::{Body, MapGrid, Prop};

/// Settings of a bake.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BakeSettings {
    /// Texel size, slab height and time slices of the maps.
    pub maps: MapGrid,
    /// Thresholds that decide which edges may be retimed.
    pub retime: RetimeSettings,
    /// Horizon of the path search, and limits on the paths that are kept.
    pub paths: PathSettings,
    /// Whether to leave out the jumps into evasions that need no edge, as in the paper. They take most of the time of a bake.
    pub without_entries: bool,
    /// Spheres of the body. Default: spheres along the skeleton's bones ([`Body::from_bones`]).
    pub body: Option<Body>,
    /// Number of threads that draw the maps, or 0 for one thread per CPU core. The maps do not
    /// depend on it.
    pub threads: usize,
    /// Props that the joints hold, in addition to those of [`BakeSettings::body`].
    pub props: Vec<Prop>,
}

impl BakeSettings {
    pub(super) fn check_numbers(&self) -> Result<(), BakeError> {
        let (retime, paths) = (&self.retime, &self.paths);
        let to_10_s = |name, seconds| (name, seconds, 0.0..=10.0, "0 to 10 s");
        let metres = |name, value: f32| (name, f64::from(value), 0.0..=1e6, "0 to 1000000 m");
        let cell = |name, value: f32| (name, f64::from(value), 0.001..=1e3, "0.001 to 1000");
        let checks = [
            to_10_s("retime.window", retime.window),
            metres("retime.slow", retime.slow),
            metres("retime.fast", retime.fast),
            metres("retime.still", retime.still),
            to_10_s("paths.horizon", f64::from(paths.horizon)),
            cell("paths.alike_distance", paths.alike_distance),
            cell("paths.alike_angle", paths.alike_angle),
            (
                "paths.most",
                f64::from(paths.most),
                1.0..=1e7,
                "1 to 10000000",
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
    /// The spheres that were made along the bones do not lie on them in the clips, because joints move far from their places at rest.
    #[error(
        "the body's spheres leave the bone that ends at joint \"{joint}\" bare by {:.1} cm in the clips: give a body (--body)", 100.0 * metres
    )]
    BareBone {
        /// Joint at the end of the bone.
        joint: String,
        /// Distance of a point of the bone from the nearest sphere, in metres.
        metres: f32,
    },
    /// Texel size, slab height or time slices are out of range.
    #[error(
        "texels must be 0.001 to 1 m, slabs 0.001 to 10 m and slices 1 to {max} of 0.001 to 1 s; they are {} m, {} m and {} of {} s",
        .0.texel, .0.slab_height, .0.slices, .0.slice_seconds,
        max = MapGrid::MAX_SLICES
    )]
    Grid(MapGrid),
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
    /// The entries that several processes found are not those of the graph.
    #[error("the entries are not those of the graph")]
    Entries,
    /// The watch of the bake stopped it.
    #[error("the bake was stopped")]
    Stopped,
}

impl From<Stopped> for BakeError {
    fn from(_: Stopped) -> Self {
        Self::Stopped
    }
}
