use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::pose::nlerp;
use super::rows::{self, Block, LANES, RotationRows};
use super::{JointId, Pose, Skeleton, SkeletonError};
use crate::math::Isa;

/// One motion of a [`Skeleton`]: poses at a constant frame rate. Immutable once made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "StoredClip")]
pub struct Clip {
    desc: ClipDesc,
    joints: usize,
    /// The rotations once more, in the layout in which they are sampled.
    #[serde(skip)]
    rows: RotationRows,
}

/// What a file holds of a clip.
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

/// What a [`Clip`] is made of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClipDesc {
    /// Unique among the clips of a set; of a file, its name.
    pub name: String,
    /// Frames per second.
    pub frame_rate: f64,
    /// The root's place in each frame, metres.
    pub roots: Vec<Vec3>,
    /// The joints' rotations from their parents, frame by frame, in the skeleton's order; identity at end sites.
    pub rotations: Vec<Quat>,
    /// The joints' places in their parents' frames, in the layout of `rotations`, where the motion moves joints; else
    /// empty: then the skeleton's offsets hold. The root's entries are not used.
    pub translations: Vec<Vec3>,
}

/// Why data are no clip.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ClipError {
    /// The clip's skeleton is none.
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
    /// There is no frame.
    #[error("clip \"{0}\" has no frames")]
    Empty(String),
    /// The frame rate is zero, negative, NaN or infinite.
    #[error("clip \"{clip}\": a frame rate of {rate} is not possible")]
    FrameRate {
        /// Name of the clip.
        clip: String,
        /// Frames per second.
        rate: f64,
    },
    /// An array's length is not frames × joints.
    #[error(
        "clip \"{clip}\": {found} {what} where {frames} frames of {joints} joints need {expected}"
    )]
    Length {
        /// Name of the clip.
        clip: String,
        /// Which array.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length that fits.
        expected: usize,
        /// Frames of the clip.
        frames: usize,
        /// Joints of the skeleton.
        joints: usize,
    },
    /// A place is NaN or further away than [`Skeleton::FURTHEST`], or a quaternion is not of unit length.
    #[error(
        "clip \"{clip}\", frame {frame}, joint \"{joint}\": not a place within {max} m and a unit rotation", max = Skeleton::FURTHEST
    )]
    NotFinite {
        /// Name of the clip.
        clip: String,
        /// Zero-based.
        frame: usize,
        /// Name of the joint.
        joint: String,
    },
}

impl Clip {
    /// Checks `desc` against `skeleton`.
    ///
    /// # Errors
    /// What does not fit, with the frame and the joint.
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
        // A NaN is not normalised.
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

    /// Unique among the clips of a set.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.desc.name
    }

    /// The name as people say it: words, without the ending of a file's name.
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

    /// Frames per second.
    #[must_use]
    pub fn frame_rate(&self) -> f64 {
        self.desc.frame_rate
    }

    /// How many frames, at least one.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.desc.roots.len()
    }

    /// From the first frame to the last, seconds; 0 for one frame.
    #[must_use]
    pub fn duration(&self) -> f64 {
        (self.frames() - 1) as f64 / self.desc.frame_rate
    }

    /// The data as they were given.
    #[must_use]
    pub fn desc(&self) -> &ClipDesc {
        &self.desc
    }

    /// The pose of one frame into `out`.
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

    /// The root's place in one frame.
    #[must_use]
    pub fn root(&self, frame: usize) -> Vec3 {
        self.desc.roots[frame]
    }

    /// The root's place in the pose that [`Clip::sample`] gives.
    #[must_use]
    pub fn sample_root(&self, frame: f32) -> Vec3 {
        self.at(frame).root()
    }

    /// The pose at a frame that need not be whole, into `out`: the root goes in a straight line between frames, the
    /// rotations along the shorter arc. Before the first and after the last frame those hold.
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

    /// A frame that need not be whole, to read single joints of.
    pub(crate) fn at(&self, frame: f32) -> Moment<'_> {
        let last = self.frames() - 1;
        let clamped = frame.clamp(0.0, last as f32);
        // Not below 0, so that cutting off is rounding down.
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

    /// The same motion at another frame rate. Frames stand at whole multiples of the new frame time; what is left of the
    /// last frame time is dropped.
    ///
    /// # Errors
    /// A frame rate that is not possible.
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
        // A capture's frame time is written with few digits: a last frame that is missed by rounding counts.
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

/// A moment of a clip, read joint by joint: what [`Clip::sample`] gives, without the whole pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment<'a> {
    clip: &'a Clip,
    /// The frame at or before it.
    lower: usize,
    /// The share of the way to the next one; 0 where there is none.
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

    /// The rotations of sixteen joints, from joint `16 index` on.
    #[inline(always)]
    pub(crate) fn block(&self, index: usize) -> Block {
        let here = self.clip.rows.frame(self.lower)[index];
        match self.weight {
            0.0 => here,
            weight => rows::nlerp(&here, &self.clip.rows.frame(self.lower + 1)[index], weight),
        }
    }

    /// `None` where the skeleton's offset holds.
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

    /// A joint's rotation and place in its parent's frame; the root's in the space of the clip.
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

    /// Whether it has translations of its own.
    pub(crate) fn moves_joints(&self) -> bool {
        !self.clip.desc.translations.is_empty()
    }
}
