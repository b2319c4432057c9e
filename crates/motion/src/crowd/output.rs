use crate::lod::LevelId;
use crate::math::F32x16;

/// The order of the values of a group of sixteen characters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// Joint by joint and value by value, each value an [`F32x16`] of sixteen characters: the order in which the kernels
    /// compute.
    #[default]
    Blocks,
    /// Character by character, in rows: the joints one after the other, each with 12 values. The row of
    /// character `i` starts at the `F32x16` with index `i` times [`Output::row_len`] of all joints, in every frame and on
    /// every level; what is behind its last joint is undefined. Instance `i` of a draw call therefore finds its joints
    /// without a table. If two buffers alternate, they have the poses of this frame and of the previous one at the same positions.
    Instances,
}

/// How output is written to memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WriteMode {
    /// Through the caches, for memory that is soon read again.
    #[default]
    Cached,
    /// Past the caches, whole cache lines at a time: for memory that is larger than the caches or mapped from a device.
    Streamed,
}

/// Layout and write mode of a crowd's output: for each joint a matrix of 3 rows and 4 columns, row by row, that transforms points
/// from the joint's frame to the world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Output {
    /// The order of the values. Default [`Layout::Blocks`].
    pub layout: Layout,
    /// How the values are written to memory. Default [`WriteMode::Cached`].
    pub write: WriteMode,
}

impl Output {
    /// Number of values of a joint.
    pub const NUMBERS: usize = 12;

    /// Length of a group of sixteen characters, in [`F32x16`]s.
    pub fn group_len(self, joints: usize) -> usize {
        match self.layout {
            Layout::Blocks => joints * Self::NUMBERS,
            Layout::Instances => F32x16::LANES * self.row_len(joints),
        }
    }

    /// Length of a character's row in [`Layout::Instances`], in [`F32x16`]s.
    pub fn row_len(self, joints: usize) -> usize {
        row_lines(joints)
    }
}

/// The smallest number of joints that fill whole `F32x16`s.
pub(super) const TURN_JOINTS: usize = 4;

/// Number of `F32x16`s that [`TURN_JOINTS`] joints fill.
pub(super) const TURN_LINES: usize = Output::NUMBERS * TURN_JOINTS / F32x16::LANES;

/// Length of a row of `joints` joints, in `F32x16`s.
pub(super) fn row_lines(joints: usize) -> usize {
    joints.div_ceil(TURN_JOINTS) * TURN_LINES
}

/// Position of a character's pose in the output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoseSlice {
    /// Position of the first joint's first value, counted in values from the start of the output.
    pub start: usize,
    /// Distance from one joint to the next, in values.
    pub joint_stride: usize,
    /// Distance from one value of a joint to the next, in values: 16 in [`Layout::Blocks`], otherwise 1.
    pub number_stride: usize,
    /// Number of joints, in the order of [`AnimationSet::joint_ids`](super::AnimationSet::joint_ids) of `level`: not in the
    /// order of the skeleton. See [`PoseSlice::copy_joints`].
    pub joints: usize,
    /// The level whose joints are written: the character's own or a finer one, on which it looks as on its own.
    pub level: LevelId,
}

impl PoseSlice {
    /// A slice in an output of the form and layout of `output`. `offset` is the start of the group or of the row, in [`F32x16`]s; `lane` is the
    /// lane in the group, or 0 if `offset` is the start of a row.
    pub(super) fn new(
        output: Output,
        level: LevelId,
        joints: usize,
        offset: usize,
        lane: usize,
    ) -> Self {
        let first = F32x16::LANES * offset;
        let (start, joint_stride, number_stride) = match output.layout {
            Layout::Blocks => (first + lane, F32x16::LANES * Output::NUMBERS, F32x16::LANES),
            Layout::Instances => {
                let row = F32x16::LANES * output.row_len(joints) * lane;
                (first + row, Output::NUMBERS, 1)
            }
        };
        Self {
            start,
            joint_stride,
            number_stride,
            joints,
            level,
        }
    }

    /// Position of a value of a joint, counted in values from the start of the output.
    #[inline]
    pub fn position(&self, joint: usize, number: usize) -> usize {
        self.start + joint * self.joint_stride + number * self.number_stride
    }

    /// A value of a joint.
    ///
    /// # Panics
    /// If it is not within `out`.
    #[inline]
    pub fn number(&self, out: &[F32x16], joint: usize, number: usize) -> f32 {
        bytemuck::cast_slice::<F32x16, f32>(out)[self.position(joint, number)]
    }

    /// All values of the character as one slice, [`PoseSlice::joint_stride`] for each joint; `None` in [`Layout::Blocks`],
    /// and if it is not within `out`.
    #[inline]
    pub fn row<'a>(&self, out: &'a [F32x16]) -> Option<&'a [f32]> {
        let row = self.start..self.start + self.joints * self.joint_stride;
        match self.number_stride {
            1 => bytemuck::cast_slice::<F32x16, f32>(out).get(row),
            _ => None,
        }
    }

    /// Copies the values of joints, 12 for each, in the order of `joints`: indices into the level's joints, such as
    /// [`AnimationSet::skeleton_order`](super::AnimationSet::skeleton_order) gives.
    ///
    /// # Panics
    /// If a joint is not within `out`, or `to` is too short.
    pub fn copy_joints(&self, out: &[F32x16], joints: &[u16], to: &mut [f32]) {
        let out = bytemuck::cast_slice::<F32x16, f32>(out);
        let to = &mut to[..joints.len() * Output::NUMBERS];
        for (&joint, to) in joints.iter().zip(to.chunks_exact_mut(Output::NUMBERS)) {
            let first = self.start + usize::from(joint) * self.joint_stride;
            if self.number_stride == 1 {
                to.copy_from_slice(&out[first..first + to.len()]);
            } else {
                let numbers = out[first..].iter().step_by(self.number_stride);
                for (to, number) in to.iter_mut().zip(numbers) {
                    *to = *number;
                }
            }
        }
    }

    /// Writes the values of a joint.
    pub(super) fn set(&self, out: &mut [F32x16], joint: usize, numbers: &[f32; Output::NUMBERS]) {
        for (number, &value) in numbers.iter().enumerate() {
            let position = self.position(joint, number);
            bytemuck::cast_slice_mut::<F32x16, f32>(out)[position] = value;
        }
    }
}
