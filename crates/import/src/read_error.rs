use std::path::PathBuf;

use thiserror::Error;

use super::{
    AttacksError, BodyFileError, EventsError, MassFileError, ObjError, RecordingError,
    asf::AsfError, bvh::BvhError, bvh::MotionError, gltf::GltfError,
};

/// Why files could not be read: always with the file.
#[derive(Debug, Error)]
pub enum ReadError {
    /// The system's own error.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is larger than [`sabaki::archive::LARGEST_FILE`].
    #[error("{}: larger than {} MB", path.display(), sabaki::archive::LARGEST_FILE / 1_000_000)]
    TooLarge {
        /// The file.
        path: PathBuf,
    },
    /// A BVH file is damaged.
    #[error("{}: {error}", path.display())]
    Bvh {
        /// The file.
        path: PathBuf,
        /// What, and where.
        error: BvhError,
    },
    /// A glTF file is damaged, or holds no skinned animation.
    #[error("{}: {error}", path.display())]
    Gltf {
        /// The file.
        path: PathBuf,
        /// What, and where.
        error: Box<GltfError>,
    },
    /// One motion was asked for, and a file holds several.
    #[error("{}: it holds several motions: {}", path.display(), shortened(clips))]
    Several {
        /// The file.
        path: PathBuf,
        /// Their names.
        clips: Vec<String>,
    },
    /// A scale that is no positive number was given.
    #[error("a scale of {0} metres per unit is not possible")]
    Scale(f64),
    /// A frame rate that is none was given.
    #[error("{0} frames a second are not possible")]
    Rate(f64),
    /// An ASF or AMC file is damaged.
    #[error("{}: {error}", path.display())]
    Asf {
        /// The file.
        path: PathBuf,
        /// What, and where.
        error: AsfError,
    },
    /// No ASF file belongs to an AMC file.
    #[error("{}: an AMC file needs its skeleton: {}, or the only *.asf file of its folder", path.display(), names.join(" or "))]
    NoSkeleton {
        /// The AMC file.
        path: PathBuf,
        /// What was looked for.
        names: Vec<String>,
    },
    /// The scale makes lengths infinite.
    #[error("{}: {error}", path.display())]
    Motion {
        /// The file.
        path: PathBuf,
        /// What.
        error: MotionError,
    },
    /// The motion lasts longer than [`super::LONGEST_CLIP`].
    #[error(
        "{}: the motion lasts {seconds} s; {} s is the most",
        path.display(),
        super::LONGEST_CLIP
    )]
    TooLong {
        /// The file.
        path: PathBuf,
        /// How long.
        seconds: f64,
    },
    /// No path was given.
    #[error("no clip was named")]
    NoPaths,
    /// A folder holds no motion file.
    #[error("{}: no *.bvh, *.amc, *.glb or *.gltf file there", path.display())]
    NoClips {
        /// The folder.
        path: PathBuf,
    },
    /// Two files of one set have the same name.
    #[error("{}: a second clip of that name; the first is {}", path.display(), first.display())]
    DuplicateClip {
        /// The second file.
        path: PathBuf,
        /// The first file.
        first: PathBuf,
    },
    /// A file's skeleton is not that of the set's first file.
    #[error(
        "{}: its skeleton differs from that of {} in {}",
        path.display(),
        first.display(),
        shortened(joints)
    )]
    SkeletonDiffers {
        /// The file.
        path: PathBuf,
        /// The set's first file.
        first: PathBuf,
        /// The joints that differ, by name.
        joints: Vec<String>,
    },
    /// An events file is damaged, or does not fit the clips.
    #[error("{}: {error}", path.display())]
    Events {
        /// The file.
        path: PathBuf,
        /// What, and where.
        error: EventsError,
    },
    /// An attack file is damaged.
    #[error("{}: {error}", path.display())]
    Attacks {
        /// The file.
        path: PathBuf,
        /// What, and where.
        error: AttacksError,
    },
    /// An exported answer is damaged, or not of the graph that it is held to.
    #[error("{}: {error}", path.display())]
    Recording {
        /// The file.
        path: PathBuf,
        /// What, and where.
        error: RecordingError,
    },
    /// A body file is damaged, or does not fit the skeleton.
    #[error("{}: {error}", path.display())]
    Body {
        /// The file.
        path: PathBuf,
        /// What, and where.
        error: BodyFileError,
    },
    /// A file of masses is damaged, or does not fit the skeleton.
    #[error("{}: {error}", path.display())]
    Masses {
        /// The file.
        path: PathBuf,
        /// What, and where.
        error: MassFileError,
    },
    /// An OBJ file is damaged, or holds no mesh.
    #[error("{}: {error}", path.display())]
    Obj {
        /// The file.
        path: PathBuf,
        /// What.
        error: ObjError,
    },
}

/// The first names of a list, quoted, and how many more there are.
pub(super) fn shortened(joints: &[String]) -> String {
    const MOST: usize = 8;
    let named: Vec<String> = joints
        .iter()
        .take(MOST)
        .map(|j| format!("\"{j}\""))
        .collect();
    let named = named.join(", ");
    match joints.len().saturating_sub(MOST) {
        0 => named,
        more => format!("{named} and {more} more"),
    }
}
