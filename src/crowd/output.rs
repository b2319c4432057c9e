use super::joint_math::{JointMath, Matrices, Rotations};
use crate::lod::LevelId;
use crate::math::F32x16;

/// What is written of each joint, in the space of the world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// A matrix of 3 rows and 4 columns, row by row: 12 numbers. It takes a point of the joint's own
    /// frame into the world.
    #[default]
    Matrices,
    /// A unit quaternion (x, y, z, w) and the joint's place (x, y, z): 7 numbers.
    Rotations,
}

/// How the numbers of a group of sixteen characters stand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// As they are computed: joint by joint and number by number, a line of sixteen characters each.
    #[default]
    Blocks,
    /// Character by character: the joints one after the other, each with its 12 numbers, or its 7
    /// and a 0; a row ends on a whole line, and what is left there is undefined.
    Rows,
}

/// What the memory is that is written to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WriteMode {
    /// It is read again soon or fits the cache.
    #[default]
    Cached,
    /// It is larger than the cache or mapped from a device: it is only written, whole lines at a
    /// time, past the cache.
    Streamed,
}

/// What a crowd writes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Output {
    /// What of each joint.
    pub form: Form,
    /// In which order.
    pub layout: Layout,
    /// Where to.
    pub write: WriteMode,
}

impl Output {
    /// Lines that a group of sixteen characters takes.
    #[must_use]
    pub fn group_len(self, joints: usize) -> usize {
        match self.layout {
            Layout::Blocks => joints * self.numbers(),
            Layout::Rows => F32x16::LANES * self.row_lines(joints),
        }
    }

    /// Numbers of a joint: 12 or 7.
    #[must_use]
    pub fn numbers(self) -> usize {
        match self.form {
            Form::Matrices => Matrices::NUMBERS,
            Form::Rotations => Rotations::NUMBERS,
        }
    }

    /// Lines of a character's row.
    pub(super) fn row_lines(self, joints: usize) -> usize {
        match self.form {
            Form::Matrices => row_lines::<Matrices>(joints),
            Form::Rotations => row_lines::<Rotations>(joints),
        }
    }
}

/// Lines that as many joints fill as end on a whole line together.
pub(super) const fn turn_lines<P: JointMath>() -> usize {
    P::ROW * turn_joints::<P>() / F32x16::LANES
}

/// How many joints end on a whole line together.
pub(super) const fn turn_joints<P: JointMath>() -> usize {
    let mut joints = 1;
    while P::ROW * joints % F32x16::LANES != 0 {
        joints += 1;
    }
    joints
}

pub(super) fn row_lines<P: JointMath>(joints: usize) -> usize {
    joints.div_ceil(turn_joints::<P>()) * turn_lines::<P>()
}

/// Where the pose of a character is in the output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoseSlice {
    /// The first line of its group of sixteen.
    pub offset: usize,
    /// Which one of them it is.
    pub lane: usize,
    /// The level whose joints it is posed with: the one that it was given, or a finer one, on which
    /// it looks as on its own.
    pub level: LevelId,
    /// How many joints it is posed with.
    pub joints: usize,
    pub(super) output: Output,
}

impl PoseSlice {
    /// Where a number of a joint stands, counted in numbers from the start of the output.
    #[must_use]
    pub fn position(&self, joint: usize, number: usize) -> usize {
        let lines = F32x16::LANES * self.offset;
        match self.output.layout {
            Layout::Blocks => {
                lines + F32x16::LANES * (joint * self.output.numbers() + number) + self.lane
            }
            Layout::Rows => {
                let row = match self.output.form {
                    Form::Matrices => Matrices::ROW,
                    Form::Rotations => Rotations::ROW,
                };
                let rows = F32x16::LANES * self.output.row_lines(self.joints) * self.lane;
                lines + rows + joint * row + number
            }
        }
    }

    /// A number of a joint.
    #[must_use]
    pub fn number(&self, out: &[F32x16], joint: usize, number: usize) -> f32 {
        let position = self.position(joint, number);
        out[position / F32x16::LANES].0[position % F32x16::LANES]
    }

    /// Writes numbers of a joint, the first of them at `number`.
    pub(super) fn set(&self, out: &mut [F32x16], (joint, number): (usize, usize), numbers: &[f32]) {
        for (index, &value) in numbers.iter().enumerate() {
            let position = self.position(joint, number + index);
            out[position / F32x16::LANES].0[position % F32x16::LANES] = value;
        }
    }
}
