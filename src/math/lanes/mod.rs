//! Numbers in the lanes of a machine's vector registers, for kernels that compilers do not find by
//! themselves: words picked from a window of a table, sums of 16-bit products, full-line stores past
//! the caches.
//!
//! A [`Kernel`] is written once over [`Lanes`] and run by [`Isa::on_lanes`], which alone names the
//! types behind it, and only where the machine has what they are made of. Memory is always in
//! [`F32x16`]s of sixteen; a type of fewer lanes takes a line in parts.
//!
//! Every type rounds alike, but for [`Lanes::mul_add`]: see there.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod keys;
mod lines;
mod portable;
#[cfg(test)]
mod tests;

use std::ops::{Add, Div, IndexMut, Mul, Sub};

use bytemuck::{Pod, Zeroable};

use super::Isa;
pub(crate) use keys::{KeyColumns, KeyRows, KeyUnit};
use lines::prefetch;
pub(crate) use lines::{StridedLines, prefetch_for_write};

/// One number of each of sixteen characters, points or whatever is computed side by side; as long as
/// a line of the cache, and aligned to it.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct F32x16(pub [f32; F32x16::LANES]);

impl F32x16 {
    /// Numbers in a line.
    pub const LANES: usize = 16;
    /// All zero.
    pub const ZERO: Self = Self([0.0; Self::LANES]);
}

/// As many numbers as a register holds, [`Lanes::COUNT`], worked on at once.
pub(crate) trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// As many 32-bit words.
    type Words: Copy;
    /// One of something for each part of a line: an array of [`Lanes::PARTS`].
    type Parts<T: Copy>: Copy + IndexMut<usize, Output = T>;

    /// How many; a divisor of [`F32x16::LANES`].
    const COUNT: usize;
    /// How many places each of [`Lanes::windows`] has.
    const REACH: usize;
    /// How many keys each of [`Lanes::windows`] reads at most.
    const WINDOW: usize = 2 * F32x16::LANES;
    /// How many of these make a line.
    const PARTS: usize = F32x16::LANES / Self::COUNT;

    /// The same for all parts.
    fn parts<T: Copy>(value: T) -> Self::Parts<T>;
    /// The same number in all lanes.
    fn splat(value: f32) -> Self;
    /// Part `part` of a line.
    fn load(line: &F32x16, part: usize) -> Self;
    /// Into part `part` of a line.
    fn store(self, line: &mut F32x16, part: usize);
    /// Into part `part` of a line, past the caches; [`Lanes::fence`] must follow the last of them
    /// before another thread reads.
    fn stream(self, line: &mut F32x16, part: usize);
    /// Orders all [`Lanes::stream`] before what comes after.
    fn fence();

    /// `self * factor + sum`, rounded once where the machine can do so, else twice.
    fn mul_add(self, factor: Self, sum: Self) -> Self;
    /// `sum - self * factor`, rounded as [`Lanes::mul_add`].
    fn neg_mul_add(self, factor: Self, sum: Self) -> Self;
    /// The square root.
    fn sqrt(self) -> Self;
    /// The next whole number below.
    fn floor(self) -> Self;
    /// The larger one; `other` where one is NaN.
    fn max(self, other: Self) -> Self;
    /// The smaller one; `other` where one is NaN.
    fn min(self, other: Self) -> Self;
    /// With the sign of `sign`.
    fn copy_sign(self, sign: Self) -> Self;
    /// The number in the first lane.
    fn first(self) -> f32;
    /// The least number of all lanes; none may be NaN.
    fn least(self) -> f32;
    /// Whether every lane is below `bound`; false where one is NaN.
    fn all_below(self, bound: f32) -> bool;
    /// A bit for each lane, the first lane's lowest: set where the number is below `bound`, clear for NaN.
    fn mask_below(self, bound: f32) -> u32;

    /// The same word in all lanes.
    fn splat_words(word: u32) -> Self::Words;
    /// Rounded towards zero; for numbers from 0 to 2^31 - 1.
    fn truncated(self) -> Self::Words;
    /// Part `part` of a line, as the bits that it has.
    fn load_words(line: &F32x16, part: usize) -> Self::Words;
    /// The number that has these bits.
    fn from_bits(words: Self::Words) -> Self;
    /// Two 16-bit numbers, both below 2^15, in one word; `high` in its upper half.
    fn pair(low: Self::Words, high: Self::Words) -> Self::Words;
    /// For whole numbers from 0 to below [`Lanes::REACH`], what [`Lanes::windows`] takes.
    fn window_places(places: Self) -> Self::Words;
    /// From each of `N` windows, the key at each lane's place in the lower half of a word, and the next key in the upper
    /// half. Asks for the keys that windows a little further on would need: they are too far apart for the machine to
    /// foresee.
    ///
    /// # Panics
    /// Where the table ends before [`Lanes::WINDOW`] keys of the last window.
    fn windows<const N: usize>(columns: KeyColumns<'_>, places: Self::Words) -> [Self::Words; N];
    /// Reads a unit of sixteen rows, and of the rows after them, as words like those of [`Lanes::windows`]. `put` is given
    /// an index from 0 to 3 for the first quad's keys and from 4 to 7 for the second one's, a part, and that part's
    /// words. Only the quads that are wanted are handed out.
    fn unit_with(rows: &KeyRows<'_>, unit: UnitHalves, put: impl FnMut(usize, usize, Self::Words));
    /// Both halves of the words as signed 16-bit numbers: low times low plus high times high. Exact
    /// but for the one rounding to a float.
    fn dot_pairs(a: Self::Words, b: Self::Words) -> Self;

    /// Hands out the columns of sixteen rows: `put` is given the column's index, a part of it, and that part's numbers.
    fn transpose_with(lines: [&F32x16; F32x16::LANES], put: impl FnMut(usize, usize, Self));
}

/// A unit of [`KeyRows`], and which of its quads are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct UnitHalves {
    pub(crate) unit: usize,
    pub(crate) wanted: [bool; 2],
}

/// How far beyond a window's first key others are asked for: the second line from there, which is needed when windows
/// have gone on.
#[cfg(target_arch = "x86_64")]
const FURTHER: usize = 4 * F32x16::LANES;

/// Work that is written over [`Lanes`].
pub(crate) trait Kernel {
    /// What it returns.
    type Out;

    /// Does it. This, and what it calls, must be `#[inline(always)]`.
    fn run<L: Lanes>(self) -> Self::Out;
}

impl Isa {
    /// Runs a kernel on the registers of this instruction set; on those of [`Isa::Portable`] where
    /// the machine has it not.
    #[inline]
    pub(crate) fn on_lanes<K: Kernel>(self, kernel: K) -> K::Out {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 if self.is_available() => self.run(
                #[inline(always)]
                || kernel.run::<avx512::Avx512>(),
            ),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 if self.is_available() => self.run(
                #[inline(always)]
                || kernel.run::<avx2::Avx2>(),
            ),
            _ => kernel.run::<portable::Portable>(),
        }
    }
}
