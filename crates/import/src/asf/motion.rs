use std::collections::HashMap;

use glam::{DQuat, DVec3, Quat};

use super::lines::{Line, lines};
use super::skeleton::{Bone, Freedom, turn};
use super::{AsfError, AsfFile, AsfProblem};
use crate::bvh::MotionError;
use crate::options::MOST_ENTRIES;
use sabaki::anim::{Clip, ClipDesc, Pose, Skeleton};

/// An AMC file: a motion of the skeleton of an [`AsfFile`].
#[derive(Clone, Debug, PartialEq)]
pub struct AmcFile {
    degrees: bool,
    /// Number of values in a frame.
    channels: usize,
    /// Values, frame by frame and bone by bone.
    values: Vec<f64>,
}

impl AmcFile {
    /// Frame rate of CMU's captures, in frames per second. AMC files do not contain it.
    pub const USUAL_RATE: f64 = 120.0;

    /// Parses a motion of `skeleton`.
    ///
    /// # Errors
    /// The first error, with its line.
    pub fn parse(skeleton: &AsfFile, bytes: &[u8]) -> Result<Self, AsfError> {
        let mut firsts = HashMap::new();
        let mut channels = 0;
        for (index, bone) in skeleton.bones.iter().enumerate() {
            firsts.insert(bone.name.as_str(), (index, channels));
            channels += bone.freedoms.len();
        }
        let mut reader = Reader {
            bones: &skeleton.bones,
            firsts,
            file: Self {
                degrees: skeleton.degrees,
                channels,
                values: Vec::new(),
            },
            seen: Vec::new(),
            frames: 0,
        };
        let mut last = None;
        for line in lines(bytes)? {
            reader.line(line)?;
            last = Some(line);
        }
        let missing = AsfProblem::Missing("frames");
        let end = last.ok_or(AsfError {
            line: 1,
            problem: missing.clone(),
        })?;
        reader.check_whole(end)?;
        match reader.frames {
            0 => Err(end.error(missing)),
            _ => Ok(reader.file),
        }
    }

    /// Number of frames, at least 1.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.values.len() / self.channels
    }

    /// A frame, counted from 0.
    ///
    /// # Panics
    /// There is no such frame.
    #[must_use]
    pub fn frame(&self, index: usize) -> AmcFrame<'_> {
        AmcFrame {
            degrees: self.degrees,
            values: &self.values[index * self.channels..][..self.channels],
        }
    }

    /// Skeleton and motion, in metres.
    ///
    /// # Errors
    /// The scale makes a length too large, the frame rate is invalid, or there are more than [`MOST_ENTRIES`] frames times joints.
    pub fn motion(
        &self,
        file: &AsfFile,
        desc: &AmcClipDesc<'_>,
    ) -> Result<(Skeleton, Clip), MotionError> {
        let AmcClipDesc {
            name,
            metres_per_unit,
            frame_rate,
        } = *desc;
        let skeleton = file.skeleton(metres_per_unit)?;
        MotionError::check_entries(self.frames(), skeleton.len())?;
        let mut desc = ClipDesc {
            name: name.to_owned(),
            frame_rate,
            roots: Vec::with_capacity(self.frames()),
            rotations: Vec::with_capacity(self.frames() * skeleton.len()),
            translations: Vec::new(),
        };
        let mut pose = Pose::default();
        for frame in 0..self.frames() {
            self.frame(frame).pose(file, metres_per_unit, &mut pose);
            desc.roots.push(pose.root);
            // End sites come last.
            pose.rotations.resize(skeleton.len(), Quat::IDENTITY);
            desc.rotations.append(&mut pose.rotations);
        }
        let clip = Clip::new(&skeleton, desc)?;
        Ok((skeleton, clip))
    }
}

/// The data of a clip that an AMC file does not contain.
#[derive(Clone, Copy, Debug)]
pub struct AmcClipDesc<'a> {
    /// Name of the clip.
    pub name: &'a str,
    /// Length of the file's unit, in metres.
    pub metres_per_unit: f64,
    /// Frame rate, in frames per second; for CMU's captures [`AmcFile::USUAL_RATE`].
    pub frame_rate: f64,
}

/// One frame of an [`AmcFile`].
#[derive(Clone, Copy, Debug)]
pub struct AmcFrame<'a> {
    degrees: bool,
    /// Values, bone by bone.
    values: &'a [f64],
}

impl AmcFrame<'_> {
    /// Writes the frame to `out` as a pose of [`AsfFile::skeleton`], in metres.
    pub fn pose(&self, skeleton: &AsfFile, metres_per_unit: f64, out: &mut Pose) {
        out.rotations.clear();
        out.translations.clear();
        let mut values = self.values.iter();
        for (index, bone) in skeleton.bones.iter().enumerate() {
            let (mut rotation, mut place) = (DQuat::IDENTITY, DVec3::ZERO);
            for (freedom, &value) in bone.freedoms.iter().zip(&mut values) {
                match *freedom {
                    Freedom::Turn(axis) => rotation = turn(axis, value, self.degrees) * rotation,
                    Freedom::Way(axis) => place[axis] = value,
                }
            }
            let rotation = bone.axes * rotation * bone.axes.conjugate();
            out.rotations.push(rotation.normalize().as_quat());
            if index == 0 {
                out.root = ((place + skeleton.position) * metres_per_unit).as_vec3();
            }
        }
    }
}

/// State of the parser.
struct Reader<'a> {
    bones: &'a [Bone],
    /// For each bone, its index and its first value in a frame.
    firsts: HashMap<&'a str, (usize, usize)>,
    file: AmcFile,
    /// Bones that the current frame has values for.
    seen: Vec<bool>,
    frames: usize,
}

impl Reader<'_> {
    fn line(&mut self, line: Line<'_>) -> Result<(), AsfError> {
        let first = line.first();
        if let Some(keyword) = first.strip_prefix(':') {
            match keyword.to_ascii_lowercase().as_str() {
                "degrees" => self.file.degrees = true,
                "radians" => self.file.degrees = false,
                _ => {}
            }
            return Ok(());
        }
        if first.bytes().all(|byte| byte.is_ascii_digit()) {
            self.check_whole(line)?;
            self.frames += 1;
            if (self.frames as u64).saturating_mul(self.bones.len() as u64) > MOST_ENTRIES {
                let bones = self.bones.len();
                return Err(line.error(AsfProblem::TooManyFrames { bones }));
            }
            self.seen = vec![false; self.bones.len()];
            let length = self.file.values.len() + self.file.channels;
            self.file.values.resize(length, 0.0);
            return Ok(());
        }
        if self.frames == 0 {
            return Err(line.expected("the number of a frame", Some(first)));
        }
        self.values(line)
    }

    fn values(&mut self, line: Line<'_>) -> Result<(), AsfError> {
        let name = line.first();
        let Some(&(index, first)) = self.firsts.get(name) else {
            return Err(line.error(AsfProblem::NoBone(name.to_owned())));
        };
        if std::mem::replace(&mut self.seen[index], true) {
            return Err(line.error(AsfProblem::Twice(name.to_owned())));
        }
        let expected = self.bones[index].freedoms.len();
        let found = line.words().count() - 1;
        if found != expected {
            return Err(line.error(AsfProblem::Values {
                frame: self.frames,
                bone: name.to_owned(),
                found,
                expected,
            }));
        }
        let frame = self.file.values.len() - self.file.channels + first;
        for (value, word) in self.file.values[frame..]
            .iter_mut()
            .zip(line.words().skip(1))
        {
            *value = line.number(Some(word))?;
        }
        Ok(())
    }

    /// Checks that the previous frame has values for every moving bone.
    fn check_whole(&self, line: Line<'_>) -> Result<(), AsfError> {
        let mut pairs = self.seen.iter().zip(self.bones);
        match pairs.find(|(seen, bone)| !**seen && !bone.freedoms.is_empty()) {
            Some((_, bone)) => Err(line.error(AsfProblem::NoValues {
                frame: self.frames,
                bone: bone.name.clone(),
            })),
            None => Ok(()),
        }
    }
}
