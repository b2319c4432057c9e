use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::moment::{Moment, PlainMoment, Source, root_between};
use super::packed::{CompressionSettings, PackedClip, largest_errors};
use super::plain::PlainClip;
use super::{JointId, Pose, Skeleton, SkeletonError};
use crate::math::Isa;

/// Index of a clip in a set: the clips of a motion graph, or those of the animations of a crowd and then its layers.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct ClipId(pub u32);

impl ClipId {
    /// The index as a `usize`.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Kind of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EventKind {
    /// An attack, for example a punch or a kick.
    Attack,
    /// A movement that avoids an attack.
    Evasion,
}

/// A labelled time range of a clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Index of the clip in its set.
    pub clip: usize,
    /// Kind of the event.
    pub kind: EventKind,
    /// Start, in seconds from the clip's first frame.
    pub start: f64,
    /// End, in seconds from the clip's first frame.
    pub end: f64,
    /// Joints that take part, or empty for all joints.
    pub joints: Vec<JointId>,
}

/// An immutable motion of a [`Skeleton`]: poses at a constant frame rate. It is plain, or compressed
/// ([`Clip::compressed`]).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clip {
    pub(super) frames: Frames,
}

/// Frames of a clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Frames {
    Plain(PlainClip),
    Packed(PackedClip),
}

/// Data of a [`Clip`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClipDesc {
    /// Name, unique among the clips of a set. For a clip from a file, the file's name.
    pub name: String,
    /// Frame rate, in frames per second.
    pub frame_rate: f64,
    /// Position of the root in each frame, in metres.
    pub roots: Vec<Vec3>,
    /// Rotation of each joint relative to its parent, frame by frame, in the skeleton's joint
    /// order. End sites have the identity.
    pub rotations: Vec<Quat>,
    /// Position of each joint in its parent's frame, in the layout of `rotations`, in metres. It is
    /// empty if the joints keep the skeleton's offsets. Entries of the root are unused.
    pub translations: Vec<Vec3>,
}

/// Reason why a clip is invalid.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ClipError {
    /// The clip's skeleton is invalid.
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
    /// The clip has no frames.
    #[error("clip \"{0}\" has no frames")]
    Empty(String),
    /// The frame rate is zero, negative, NaN or infinite, or too high for the clip's length.
    #[error("clip \"{clip}\": a frame rate of {rate} is not possible")]
    FrameRate {
        /// Name of the clip.
        clip: String,
        /// Frame rate, in frames per second.
        rate: f64,
    },
    /// The length of an array is not frames × joints.
    #[error(
        "clip \"{clip}\": {found} {what} where {frames} frames of {joints} joints need {expected}"
    )]
    Length {
        /// Name of the clip.
        clip: String,
        /// Name of the array.
        what: &'static str,
        /// Length of the array.
        found: usize,
        /// Expected length.
        expected: usize,
        /// Number of frames of the clip.
        frames: usize,
        /// Number of joints of the skeleton.
        joints: usize,
    },
    /// A position is NaN or farther away than [`Skeleton::FURTHEST`], or a quaternion does not have
    /// unit length.
    #[error(
        "clip \"{clip}\", frame {frame}, joint \"{joint}\": not a place within {max} m and a unit rotation", max = Skeleton::FURTHEST
    )]
    NotFinite {
        /// Name of the clip.
        clip: String,
        /// Frame, counted from 0.
        frame: usize,
        /// Name of the joint.
        joint: String,
    },
}

impl Clip {
    /// Creates a plain clip after checking `desc` against `skeleton`.
    ///
    /// # Errors
    /// An array has the wrong length, or a frame of a joint is invalid.
    pub fn new(skeleton: &Skeleton, desc: ClipDesc) -> Result<Self, ClipError> {
        let joints = skeleton.len();
        let clip = PlainClip { desc, joints };
        clip.check(skeleton)?;
        Ok(Self::plain(clip))
    }

    fn plain(clip: PlainClip) -> Self {
        Self {
            frames: Frames::Plain(clip),
        }
    }

    /// Returns the clip in a form that takes about a quarter of the memory. It is sampled in its compressed form. A clip that is
    /// compressed already, or whose error cannot be held (bones of several metres, half a turn of a joint within one frame), is
    /// returned as it is.
    pub fn compressed(&self, skeleton: &Skeleton, settings: &CompressionSettings) -> Self {
        let Frames::Plain(plain) = &self.frames else {
            return self.clone();
        };
        let packed = (plain.joints == skeleton.len())
            .then(|| PackedClip::new(skeleton, self, &plain.desc, settings));
        let Some(mut packed) = packed.flatten() else {
            return self.clone();
        };
        let decoded = Self {
            frames: Frames::Packed(packed.clone()),
        };
        let errors = largest_errors(skeleton, self, &decoded);
        if !(errors[0] <= settings.joint_error && errors[1] <= settings.end_error) {
            return self.clone();
        }
        packed.stored.errors = errors;
        Self {
            frames: Frames::Packed(packed),
        }
    }

    /// Largest errors that compression has caused, in metres: at the joints, and at the ends ([`CompressionSettings`]). `None` for a
    /// plain clip.
    pub fn compression_errors(&self) -> Option<[f32; 2]> {
        match &self.frames {
            Frames::Plain(_) => None,
            Frames::Packed(packed) => Some(packed.stored.errors),
        }
    }

    /// Size of the frames in a file, in bytes: as they are, and as a plain clip.
    pub fn stored_bytes(&self) -> [usize; 2] {
        let place = size_of::<Vec3>();
        let joint = size_of::<Quat>() + if self.moves_joints() { place } else { 0 };
        let plain = self.frames() * (place + self.joints() * joint);
        match &self.frames {
            Frames::Plain(_) => [plain; 2],
            Frames::Packed(packed) => [packed.stored_bytes(), plain],
        }
    }

    /// Whether the clip is sound and of this skeleton: for clips from files.
    pub fn is_sound(&self, skeleton: &Skeleton) -> bool {
        match &self.frames {
            Frames::Plain(plain) => plain.joints == skeleton.len() && plain.check(skeleton).is_ok(),
            Frames::Packed(packed) => packed.fits(skeleton),
        }
    }

    /// Name, unique among the clips of a set.
    pub fn name(&self) -> &str {
        match &self.frames {
            Frames::Plain(plain) => &plain.desc.name,
            Frames::Packed(packed) => &packed.stored.name,
        }
    }

    /// Name for display: words separated by spaces, without the file extension.
    ///
    /// ```
    /// # use sabaki_motion::anim::Clip;
    /// assert_eq!(Clip::title("fist_left.bvh"), "fist left");
    /// assert_eq!(Clip::title("fox.glb:Walk"), "fox Walk");
    /// assert_eq!(Clip::title("v1.5_duck"), "v1.5 duck");
    /// ```
    pub fn title(name: &str) -> String {
        let (file, within) = name.split_once(':').unwrap_or((name, ""));
        let file = match file.rsplit_once('.') {
            Some((stem, "bvh" | "glb" | "gltf" | "amc")) => stem,
            _ => file,
        };
        format!("{file} {within}").trim_end().replace('_', " ")
    }

    /// Frame rate, in frames per second.
    pub fn frame_rate(&self) -> f64 {
        match &self.frames {
            Frames::Plain(plain) => plain.desc.frame_rate,
            Frames::Packed(packed) => packed.stored.frame_rate,
        }
    }

    /// Number of frames, at least 1.
    pub fn frames(&self) -> usize {
        match &self.frames {
            Frames::Plain(plain) => plain.desc.roots.len(),
            Frames::Packed(packed) => packed.frames(),
        }
    }

    /// Number of joints of the skeleton.
    pub fn joints(&self) -> usize {
        match &self.frames {
            Frames::Plain(plain) => plain.joints,
            Frames::Packed(packed) => packed.joints(),
        }
    }

    /// Whether the clip has positions for its joints. Otherwise they keep the skeleton's offsets.
    pub fn moves_joints(&self) -> bool {
        match &self.frames {
            Frames::Plain(plain) => !plain.desc.translations.is_empty(),
            Frames::Packed(packed) => packed.moves_joints(),
        }
    }

    /// Time from the first frame to the last, in seconds. It is 0 for one frame.
    pub fn duration(&self) -> f64 {
        (self.frames() - 1) as f64 / self.frame_rate()
    }

    /// Copies all frames. [`Clip::pose`] reads a single one.
    pub fn desc(&self) -> ClipDesc {
        if let Frames::Plain(plain) = &self.frames {
            return plain.desc.clone();
        }
        let (rate, frames) = (self.frame_rate(), self.frames());
        ClipDesc::of_poses(self.name(), rate, frames, |frame, pose| {
            self.pose(frame, pose);
        })
    }

    /// Writes the pose of one frame to `out`.
    pub fn pose(&self, frame: usize, out: &mut Pose) {
        self.moment(frame, 0.0).pose(Isa::best(), out);
    }

    /// Position of the root in one frame.
    pub fn root(&self, frame: usize) -> Vec3 {
        self.roots()[frame]
    }

    /// Position of the root in the pose of [`Clip::sample`].
    pub fn sample_root(&self, frame: f32) -> Vec3 {
        let (lower, weight) = self.place(frame);
        root_between(&self.roots()[lower..], weight)
    }

    fn roots(&self) -> &[Vec3] {
        match &self.frames {
            Frames::Plain(plain) => &plain.desc.roots,
            Frames::Packed(packed) => &packed.roots,
        }
    }

    /// Writes the pose at a fractional frame to `out`. The root is interpolated linearly, rotations
    /// along the shorter arc. Frames before the first and after the last are clamped.
    pub fn sample(&self, frame: f32, out: &mut Pose) {
        self.sample_on(Isa::best(), frame, out);
    }

    /// [`Clip::sample`] with an instruction set. All give the same bits.
    pub fn sample_on(&self, isa: Isa, frame: f32, out: &mut Pose) {
        self.at(frame).pose(isa, out);
    }

    /// Moment at a fractional frame, from which single joints can be read.
    pub fn at(&self, frame: f32) -> Moment<'_> {
        let (lower, weight) = self.place(frame);
        self.moment(lower, weight)
    }

    /// The frame before a fractional frame, and the weight of the next one.
    fn place(&self, frame: f32) -> (usize, f32) {
        let last = self.frames() - 1;
        let clamped = frame.clamp(0.0, last as f32);
        // The value is not negative, so truncation rounds down.
        let lower = (clamped as usize).min(last);
        let weight = if lower < last {
            clamped - lower as f32
        } else {
            0.0
        };
        (lower, weight)
    }

    pub(super) fn moment(&self, lower: usize, weight: f32) -> Moment<'_> {
        match &self.frames {
            Frames::Plain(plain) => Moment(Source::Plain(PlainMoment {
                clip: plain,
                lower,
                weight,
            })),
            Frames::Packed(packed) => Moment(Source::Packed(packed.at(lower, weight))),
        }
    }

    /// Returns the same motion at another frame rate. Frames are at multiples of the new frame
    /// time; the remainder of the last frame time is dropped.
    ///
    /// # Errors
    /// The frame rate is invalid, or the clip would have more than 2^30 rotations.
    pub fn resampled(&self, frame_rate: f64) -> Result<Self, ClipError> {
        const MOST_ROTATIONS: f64 = (1u64 << 30) as f64;
        // Files store frame times with few digits. The tolerance keeps a last frame that rounding
        // would lose.
        let frames = (self.duration() * frame_rate + 1e-3).floor() + 1.0;
        let is_possible = frame_rate.is_finite() && frame_rate > 0.0;
        if !is_possible || frames * self.joints() as f64 > MOST_ROTATIONS {
            return Err(ClipError::FrameRate {
                clip: self.name().to_owned(),
                rate: frame_rate,
            });
        }
        if (frame_rate / self.frame_rate() - 1.0).abs() < 1e-4 {
            let mut same = self.clone();
            match &mut same.frames {
                Frames::Plain(plain) => plain.desc.frame_rate = frame_rate,
                Frames::Packed(packed) => packed.stored.frame_rate = frame_rate,
            }
            return Ok(same);
        }
        let pose = |frame, pose: &mut Pose| {
            let source = frame as f64 / frame_rate * self.frame_rate();
            self.sample(source as f32, pose);
        };
        let desc = ClipDesc::of_poses(self.name(), frame_rate, frames as usize, pose);
        let joints = self.joints();
        Ok(Self::plain(PlainClip { desc, joints }))
    }
}

impl ClipDesc {
    /// The data of a motion whose frames are the poses that `pose` writes.
    #[must_use]
    pub fn of_poses(
        name: &str,
        frame_rate: f64,
        frames: usize,
        mut pose: impl FnMut(usize, &mut Pose),
    ) -> Self {
        let mut desc = Self {
            name: name.to_owned(),
            frame_rate,
            roots: Vec::with_capacity(frames),
            rotations: Vec::new(),
            translations: Vec::new(),
        };
        let mut out = Pose::default();
        for frame in 0..frames {
            pose(frame, &mut out);
            if frame == 0 {
                desc.rotations.reserve_exact(frames * out.rotations.len());
                let places = frames * out.translations.len();
                desc.translations.reserve_exact(places);
            }
            desc.roots.push(out.root);
            desc.rotations.extend_from_slice(&out.rotations);
            desc.translations.extend_from_slice(&out.translations);
        }
        desc
    }
}
