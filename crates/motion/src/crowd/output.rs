use crate::lod::LevelId;
use crate::math::F32x16;

/// The values that are written for each joint, in the space of the world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// A matrix of 3 rows and 4 columns, row by row: 12 numbers. It transforms points from the joint's frame to the world.
    #[default]
    Matrices,
    /// A unit quaternion (x, y, z, w) and the joint's position (x, y, z): 7 numbers.
    Rotations,
}

impl Form {
    /// Number of values of a joint: 12 or 7.
    #[must_use]
    pub fn numbers(self) -> usize {
        match self {
            Self::Matrices => 12,
            Self::Rotations => 7,
        }
    }

    /// Indices of a joint's values that are the coordinates of its position.
    #[must_use]
    pub fn position_numbers(self) -> [usize; 3] {
        match self {
            Self::Matrices => [3, 7, 11],
            Self::Rotations => [4, 5, 6],
        }
    }
}

/// The order of the values of a group of sixteen characters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// Joint by joint and value by value, each value an [`F32x16`] of sixteen characters: the order in which the kernels
    /// compute.
    #[default]
    Blocks,
    /// Character by character: the joints one after the other, each with 12 values, or with 7 and a 0. A row ends on a whole
    /// [`F32x16`]; the rest of that `F32x16` is undefined.
    Rows,
    /// Rows at fixed positions: the row of character `i` starts at the `F32x16` with index `i` times [`Output::row_len`] of
    /// all joints, in every frame and on every level. Instance `i` of a draw call therefore finds its joints without a
    /// table. If two buffers alternate, they have the poses of this frame and of the previous one at the same positions.
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

/// Form, layout and write mode of a crowd's output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Output {
    /// The values of each joint. Default [`Form::Matrices`].
    pub form: Form,
    /// The order of the values. Default [`Layout::Blocks`].
    pub layout: Layout,
    /// How the values are written to memory. Default [`WriteMode::Cached`].
    pub write: WriteMode,
}

impl Output {
    /// Length of a group of sixteen characters, in [`F32x16`]s.
    #[must_use]
    pub fn group_len(self, joints: usize) -> usize {
        match self.layout {
            Layout::Blocks => joints * self.numbers(),
            Layout::Rows | Layout::Instances => F32x16::LANES * self.row_len(joints),
        }
    }

    /// Number of values of a joint: 12 or 7.
    #[must_use]
    pub fn numbers(self) -> usize {
        self.form.numbers()
    }

    /// Number of values of a joint in a row: 12 or 8.
    pub(super) fn row_numbers(self) -> usize {
        match self.form {
            Form::Matrices => 12,
            Form::Rotations => 8,
        }
    }

    /// Length of a character's row in [`Layout::Rows`] and [`Layout::Instances`], in [`F32x16`]s.
    #[must_use]
    pub fn row_len(self, joints: usize) -> usize {
        row_lines(self.row_numbers(), joints)
    }
}

/// The smallest number of joints, each of `row` values, that fill whole `F32x16`s.
pub(super) const fn turn_joints(row: usize) -> usize {
    let mut joints = 1;
    while !(row * joints).is_multiple_of(F32x16::LANES) {
        joints += 1;
    }
    joints
}

/// Number of `F32x16`s that [`turn_joints`] joints fill.
pub(super) const fn turn_lines(row: usize) -> usize {
    row * turn_joints(row) / F32x16::LANES
}

/// Length of a row of `joints` joints of `row` values each, in `F32x16`s.
pub(super) fn row_lines(row: usize, joints: usize) -> usize {
    joints.div_ceil(turn_joints(row)) * turn_lines(row)
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
    pub(super) form: Form,
}

impl PoseSlice {
    /// The slice at `at` in an output of the form and layout of `output`.
    pub(super) fn new(output: Output, at: SlicePlace) -> Self {
        let SlicePlace {
            level,
            joints,
            offset,
            lane,
        } = at;
        let first = F32x16::LANES * offset;
        let numbers = output.numbers();
        let (start, joint_stride, number_stride) = match output.layout {
            Layout::Blocks => (first + lane, F32x16::LANES * numbers, F32x16::LANES),
            Layout::Rows | Layout::Instances => {
                let row = F32x16::LANES * output.row_len(joints) * lane;
                (first + row, output.row_numbers(), 1)
            }
        };
        Self {
            start,
            joint_stride,
            number_stride,
            joints,
            level,
            form: output.form,
        }
    }

    /// Position of a value of a joint, counted in values from the start of the output.
    #[must_use]
    #[inline]
    pub fn position(&self, joint: usize, number: usize) -> usize {
        self.start + joint * self.joint_stride + number * self.number_stride
    }

    /// A value of a joint.
    ///
    /// # Panics
    /// If it is not within `out`.
    #[must_use]
    #[inline]
    pub fn number(&self, out: &[F32x16], joint: usize, number: usize) -> f32 {
        bytemuck::cast_slice::<F32x16, f32>(out)[self.position(joint, number)]
    }

    /// All values of the character as one slice, [`PoseSlice::joint_stride`] for each joint; `None` in [`Layout::Blocks`],
    /// and if it is not within `out`.
    #[must_use]
    #[inline]
    pub fn row<'a>(&self, out: &'a [F32x16]) -> Option<&'a [f32]> {
        let row = self.start..self.start + self.joints * self.joint_stride;
        match self.number_stride {
            1 => bytemuck::cast_slice::<F32x16, f32>(out).get(row),
            _ => None,
        }
    }

    /// Copies the values of joints, 12 or 7 for each, in the order of `joints`: indices into the level's joints, such as
    /// [`AnimationSet::skeleton_order`](super::AnimationSet::skeleton_order) gives.
    ///
    /// # Panics
    /// If a joint is not within `out`, or `to` is too short.
    pub fn copy_joints(&self, out: &[F32x16], joints: &[u16], to: &mut [f32]) {
        let out = bytemuck::cast_slice::<F32x16, f32>(out);
        let to = &mut to[..joints.len() * self.form.numbers()];
        for (&joint, to) in joints.iter().zip(to.chunks_exact_mut(self.form.numbers())) {
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

    /// Writes consecutive values of a joint, starting with the value `first`.
    pub(super) fn set(&self, out: &mut [F32x16], first: JointNumber, numbers: &[f32]) {
        for (index, &value) in numbers.iter().enumerate() {
            let position = self.position(first.joint, first.number + index);
            bytemuck::cast_slice_mut::<F32x16, f32>(out)[position] = value;
        }
    }
}

/// Position of a pose in the groups or rows of the output.
#[derive(Clone, Copy, Debug)]
pub(super) struct SlicePlace {
    pub(super) level: LevelId,
    pub(super) joints: usize,
    /// Start of the group or of the row, in [`F32x16`]s.
    pub(super) offset: usize,
    /// Lane in the group; 0 if `offset` is the start of a row.
    pub(super) lane: usize,
}

/// One value of a joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointNumber {
    pub(super) joint: usize,
    pub(super) number: usize,
}
