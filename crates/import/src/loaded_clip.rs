use sabaki::anim::{Clip, Skeleton};

use super::events::EventEntry;
use super::units::Scale;

/// A motion from a file, in metres.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedClip {
    /// Skeleton, in metres.
    pub skeleton: Skeleton,
    /// Motion, named after the file without its folder.
    pub clip: Clip,
    /// Scale of the file.
    pub scale: Scale,
    /// Events in the file itself. Only glTF files can contain them, in their `extras`.
    pub events: Vec<EventEntry>,
    /// Names that several joints have in the file. The first joint keeps the name, the others have a number behind it.
    pub repeated_names: Vec<String>,
    /// Doubtful contents of the file, one line each.
    pub notes: Vec<String>,
}
