use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::pose::nlerp;
use super::rows::{self, Block, LANES, RotationRows};
use super::{JointId, Pose, Skeleton, SkeletonError};
use crate::math::Isa;

/// An immutable motion of a [`Skeleton`]: poses at a constant frame rate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "StoredClip")]
pub struct Clip {
    desc: ClipDesc,
    joints: usize,
    /// Copy of the rotations in the layout that sampling reads.
    #[serde(skip)]
    rows: RotationRows,
}

/// The part of a clip that files store.
#[derive(Deserialize)]
struct StoredClip {
    desc: ClipDesc,
    joints: usize,
}

impl From<StoredClip> for Clip {
    fn from(StoredClip { desc, joints }: StoredClip) -> Self {
        Self::of(desc, joints)
    }
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
    /// The frame rate is zero, negative, NaN or infinite.
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
    /// Creates a clip after checking `desc` against `skeleton`.
    ///
    /// # Errors
    /// An array has the wrong length, or a frame of a joint is invalid.
    pub fn new(skeleton: &Skeleton, desc: ClipDesc) -> Result<Self, ClipError> {
        let (frames, joints) = (desc.roots.len(), skeleton.len());
        if frames == 0 {
            return Err(ClipError::Empty(desc.name));
        }
        if !(desc.frame_rate.is_finite() && desc.frame_rate > 0.0) {
            return Err(ClipError::FrameRate {
                clip: desc.name,
                rate: desc.frame_rate,
            });
        }
        let expected = frames * joints;
        let lengths = [
            ("rotations", desc.rotations.len(), false),
            ("translations", desc.translations.len(), true),
        ];
        for (what, found, may_be_empty) in lengths {
            if found != expected && !(may_be_empty && found == 0) {
                return Err(ClipError::Length {
                    clip: desc.name,
                    what,
                    found,
                    expected,
                    frames,
                    joints,
                });
            }
        }
        let clip = Self::of(desc, joints);
        match clip.first_bad_value() {
            Some((frame, joint)) => {
                let joint = skeleton.joints()[joint].name.clone();
                Err(ClipError::NotFinite {
                    clip: clip.desc.name,
                    frame,
                    joint,
                })
            }
            None => Ok(clip),
        }
    }

    fn of(desc: ClipDesc, joints: usize) -> Self {
        let rows = RotationRows::new(&desc.rotations, joints);
        Self { desc, joints, rows }
    }

    fn first_bad_value(&self) -> Option<(usize, usize)> {
        let place = |index: usize| (index / self.joints, index % self.joints);
        let root = self
            .desc
            .roots
            .iter()
            .position(|&root| !Skeleton::is_near(root))
            .map(|frame| (frame, 0));
        // The comparison is false for NaN.
        let unit = |q: &Quat| (q.length_squared() - 1.0).abs() < 1e-3;
        let rotation = self.desc.rotations.iter().position(|q| !unit(q)).map(place);
        let translation = self
            .desc
            .translations
            .iter()
            .position(|&t| !Skeleton::is_near(t))
            .map(place);
        [root, rotation, translation].into_iter().flatten().min()
    }

    /// Name, unique among the clips of a set.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.desc.name
    }

    /// Name for display: words separated by spaces, without the file extension.
    ///
    /// ```
    /// # use sabaki::anim::Clip;
    /// assert_eq!(Clip::title("fist_left.bvh"), "fist left");
    /// assert_eq!(Clip::title("fox.glb:Walk"), "fox Walk");
    /// assert_eq!(Clip::title("v1.5_duck"), "v1.5 duck");
    /// ```
    #[must_use]
    pub fn title(name: &str) -> String {
        let (file, within) = name.split_once(':').unwrap_or((name, ""));
        let file = match file.rsplit_once('.') {
            Some((stem, "bvh" | "glb" | "gltf" | "amc")) => stem,
            _ => file,
        };
        format!("{file} {within}").trim_end().replace('_', " ")
    }

    /// Frame rate, in frames per second.
    #[must_use]
    pub fn frame_rate(&self) -> f64 {
        self.desc.frame_rate
    }

    /// Number of frames, at least 1.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.desc.roots.len()
    }

    /// Time from the first frame to the last, in seconds. It is 0 for one frame.
    #[must_use]
    pub fn duration(&self) -> f64 {
        (self.frames() - 1) as f64 / self.desc.frame_rate
    }

    /// Data of the clip.
    #[must_use]
    pub fn desc(&self) -> &ClipDesc {
        &self.desc
    }

    /// Writes the pose of one frame to `out`.
    pub fn pose(&self, frame: usize, out: &mut Pose) {
        let range = frame * self.joints..(frame + 1) * self.joints;
        out.root = self.desc.roots[frame];
        out.rotations.clear();
        out.rotations
            .extend_from_slice(&self.desc.rotations[range.clone()]);
        out.translations.clear();
        out.translations
            .extend_from_slice(self.desc.translations.get(range).unwrap_or(&[]));
    }

    /// Position of the root in one frame.
    #[must_use]
    pub fn root(&self, frame: usize) -> Vec3 {
        self.desc.roots[frame]
    }

    /// Position of the root in the pose of [`Clip::sample`].
    #[must_use]
    pub fn sample_root(&self, frame: f32) -> Vec3 {
        self.at(frame).root()
    }

    /// Writes the pose at a fractional frame to `out`. The root is interpolated linearly, rotations
    /// along the shorter arc. Frames before the first and after the last are clamped.
    pub fn sample(&self, frame: f32, out: &mut Pose) {
        let moment = self.at(frame);
        self.pose(moment.lower, out);
        if moment.weight > 0.0 {
            out.root = moment.root();
            Isa::best().run(
                #[inline(always)]
                || {
                    for (index, part) in out.rotations.chunks_mut(LANES).enumerate() {
                        rows::unpack(&moment.block(index), part);
                    }
                },
            );
            for (index, translation) in out.translations.iter_mut().enumerate() {
                *translation = moment.translation(index).unwrap_or(*translation);
            }
        }
    }

    /// Moment at a fractional frame, from which single joints can be read.
    pub(crate) fn at(&self, frame: f32) -> Moment<'_> {
        let last = self.frames() - 1;
        let clamped = frame.clamp(0.0, last as f32);
        // The value is not negative, so truncation rounds down.
        let lower = (clamped as usize).min(last);
        let weight = if lower < last {
            clamped - lower as f32
        } else {
            0.0
        };
        Moment {
            clip: self,
            lower,
            weight,
        }
    }

    /// Returns the same motion at another frame rate. Frames are at multiples of the new frame
    /// time; the remainder of the last frame time is dropped.
    ///
    /// # Errors
    /// The frame rate is invalid.
    pub fn resampled(&self, frame_rate: f64) -> Result<Self, ClipError> {
        if !(frame_rate.is_finite() && frame_rate > 0.0) {
            return Err(ClipError::FrameRate {
                clip: self.desc.name.clone(),
                rate: frame_rate,
            });
        }
        if (frame_rate / self.desc.frame_rate - 1.0).abs() < 1e-4 {
            let mut same = self.clone();
            same.desc.frame_rate = frame_rate;
            return Ok(same);
        }
        // Files store frame times with few digits. The tolerance keeps a last frame that rounding
        // would lose.
        let frames = (self.duration() * frame_rate + 1e-3).floor() as usize + 1;
        let mut desc = ClipDesc {
            name: self.desc.name.clone(),
            frame_rate,
            roots: Vec::with_capacity(frames),
            rotations: Vec::with_capacity(frames * self.joints),
            translations: Vec::new(),
        };
        let mut pose = Pose::default();
        for frame in 0..frames {
            let source = frame as f64 / frame_rate * self.desc.frame_rate;
            self.sample(source as f32, &mut pose);
            desc.roots.push(pose.root);
            desc.rotations.extend_from_slice(&pose.rotations);
            desc.translations.extend_from_slice(&pose.translations);
        }
        Ok(Self::of(desc, self.joints))
    }
}

/// A moment of a clip. It gives the values of [`Clip::sample`] joint by joint, without computing
/// the whole pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment<'a> {
    clip: &'a Clip,
    /// Frame at or before the moment.
    lower: usize,
    /// Weight of the next frame, 0 at the last frame.
    weight: f32,
}

impl Moment<'_> {
    #[inline]
    pub(crate) fn root(&self) -> Vec3 {
        let roots = &self.clip.desc.roots[self.lower..];
        match self.weight {
            0.0 => roots[0],
            weight => roots[0].lerp(roots[1], weight),
        }
    }

    #[inline]
    pub(crate) fn rotation(&self, joint: usize) -> Quat {
        let rotations = &self.clip.desc.rotations[self.lower * self.clip.joints + joint..];
        match self.weight {
            0.0 => rotations[0],
            weight => nlerp(rotations[0], rotations[self.clip.joints], weight),
        }
    }

    /// Rotations of 16 joints, from joint `16 * index` on.
    #[inline(always)]
    pub(crate) fn block(&self, index: usize) -> Block {
        let here = self.clip.rows.frame(self.lower)[index];
        match self.weight {
            0.0 => here,
            weight => rows::nlerp(&here, &self.clip.rows.frame(self.lower + 1)[index], weight),
        }
    }

    /// Position of a joint in its parent's frame, or `None` if the skeleton's offset applies.
    #[inline]
    pub(crate) fn translation(&self, joint: usize) -> Option<Vec3> {
        let translations = self
            .clip
            .desc
            .translations
            .get(self.lower * self.clip.joints + joint..)?;
        let here = *translations.first()?;
        Some(match self.weight {
            0.0 => here,
            weight => here.lerp(translations[self.clip.joints], weight),
        })
    }

    /// Rotation and position of a joint in its parent's frame. The root's are in the space of the
    /// clip.
    #[inline]
    pub(crate) fn local(&self, skeleton: &Skeleton, id: JointId) -> (Quat, Vec3) {
        let index = id.index();
        let place = match id {
            JointId::ROOT => self.root(),
            _ => self
                .translation(index)
                .unwrap_or_else(|| skeleton.joint(id).offset),
        };
        (self.rotation(index), place)
    }

    /// Whether the clip has translations for its joints.
    pub(crate) fn moves_joints(&self) -> bool {
        !self.clip.desc.translations.is_empty()
    }
}
