//! Explicit SIMD for kernels that compilers do not vectorise well: table lookups within a window, sums of 16-bit products, and
//! non-temporal stores of full cache lines.
//!
//! A [`Kernel`] is written once over [`Lanes`]. [`Isa::on_lanes`] runs it with the type for an instruction set that the machine has. Memory
//! is always in [`F32x16`]s; types with fewer lanes process them in parts.
//!
//! All types round in the same way, except in [`Lanes::mul_add`].

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod memory;
#[cfg(target_arch = "aarch64")]
mod neon;
mod portable;
#[cfg(test)]
mod tests;

use std::ops::{Add, Div, IndexMut, Mul, Sub};

use bytemuck::{Pod, Zeroable};

use super::Isa;
use super::isa::on_isa;
pub(crate) use memory::{DistinctRows, RowSet};
pub(crate) use memory::{KeyColumns, KeyRows, KeyUnit, NextColumns};
pub(crate) use memory::{RowLines, Sixteen};

/// Methods of [`Lanes`] that are one expression of instructions.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
macro_rules! instructions {
    ($(fn $name:ident($($arguments:tt)*) -> $result:ty = $value:expr;)*) => {
        $(
            #[inline(always)]
            fn $name($($arguments)*) -> $result {
                // SAFETY: registers of this kind are used only where the machine has their instructions.
                unsafe { $value }
            }
        )*
    };
}
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
use instructions;

/// The four operators of a kind of registers.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
macro_rules! operators {
    ($type:ident, $add:ident, $sub:ident, $mul:ident, $div:ident) => {
        operators!($type, Add, add, $add);
        operators!($type, Sub, sub, $sub);
        operators!($type, Mul, mul, $mul);
        operators!($type, Div, div, $div);
    };
    ($type:ident, $name:ident, $function:ident, $instruction:ident) => {
        impl std::ops::$name for $type {
            type Output = Self;

            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                // SAFETY: registers of this kind are used only where the machine has their instructions.
                Self(unsafe { $instruction(self.0, other.0) })
            }
        }
    };
}
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
use operators;

/// Sixteen numbers, for example one of each of sixteen characters, in one aligned cache line.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct F32x16(pub [f32; F32x16::LANES]);

impl F32x16 {
    /// Number of lanes.
    pub const LANES: usize = 16;
    /// All lanes 0.
    pub const ZERO: Self = Self([0.0; Self::LANES]);

    /// The lanes of one part, of `COUNT` lanes.
    #[inline(always)]
    #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
    fn part<const COUNT: usize>(&self, part: usize) -> &[f32] {
        &self.0[part * COUNT..][..COUNT]
    }

    #[inline(always)]
    #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
    fn part_mut<const COUNT: usize>(&mut self, part: usize) -> &mut [f32] {
        &mut self.0[part * COUNT..][..COUNT]
    }
}

/// A vector register of [`Lanes::COUNT`] numbers.
pub(crate) trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// A register with the same number of 32-bit words.
    type Words: Copy;
    /// An array of [`Lanes::PARTS`] items, one for each part of an [`F32x16`].
    type Parts<T: Copy>: Copy + IndexMut<usize, Output = T>;

    /// Number of lanes, a divisor of [`F32x16::LANES`].
    const COUNT: usize;
    /// Number of places of a window of [`Lanes::windows`].
    const REACH: usize;
    /// Maximum number of keys that a window of [`Lanes::windows`] reads.
    const WINDOW: usize = 2 * F32x16::LANES;
    /// Number of places of a window of [`Lanes::wide_windows`].
    const WIDE_REACH: usize;
    /// Maximum number of keys that a window of [`Lanes::wide_windows`] reads.
    const WIDE_WINDOW: usize = 2 * Self::WINDOW;
    /// Number of registers that hold an [`F32x16`].
    const PARTS: usize = F32x16::LANES / Self::COUNT;

    /// The same item for all parts.
    fn parts<T: Copy>(value: T) -> Self::Parts<T>;
    /// The same number in all lanes.
    fn splat(value: f32) -> Self;
    /// Loads a part of an [`F32x16`].
    fn load(line: &F32x16, part: usize) -> Self;
    /// Stores to a part of an [`F32x16`].
    fn store(self, line: &mut F32x16, part: usize);
    /// Stores to a part of an [`F32x16`] past the caches. [`Lanes::fence`] must follow before another thread reads it.
    fn stream(self, line: &mut F32x16, part: usize);
    /// Orders all previous [`Lanes::stream`] before later stores.
    fn fence();

    /// `self * factor + sum`, rounded once with FMA, otherwise twice.
    fn mul_add(self, factor: Self, sum: Self) -> Self;
    /// `sum - self * factor`, rounded like [`Lanes::mul_add`].
    fn neg_mul_add(self, factor: Self, sum: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Largest integer not above the number.
    fn floor(self) -> Self;
    /// Maximum; `other` if one is NaN.
    fn max(self, other: Self) -> Self;
    /// Minimum; `other` if one is NaN.
    fn min(self, other: Self) -> Self;
    /// The number with the sign of `sign`.
    fn copy_sign(self, sign: Self) -> Self;
    /// The number in the first lane.
    fn first(self) -> f32;
    /// Minimum of all lanes, none of which may be NaN.
    fn least(self) -> f32;
    /// Whether all lanes are below `bound`; false if one is NaN.
    fn all_below(self, bound: f32) -> bool;
    /// A bit for each lane, the first lane's lowest: set if the number is below `bound`, clear for NaN.
    fn mask_below(self, bound: f32) -> u32;

    /// The same word in all lanes.
    fn splat_words(word: u32) -> Self::Words;
    /// The numbers rounded towards zero, for numbers from 0 to 2^31 - 1.
    fn truncated(self) -> Self::Words;
    /// Loads the bits of a part of an [`F32x16`].
    fn load_words(line: &F32x16, part: usize) -> Self::Words;
    /// The numbers with the bits of `words`.
    fn from_bits(words: Self::Words) -> Self;
    /// Packs two 16-bit numbers below 2^15 into each word, `high` into its upper half.
    fn pair(low: Self::Words, high: Self::Words) -> Self::Words;
    /// Converts whole numbers below [`Lanes::REACH`] to the places that [`Lanes::windows`] reads, and those below
    /// [`Lanes::WIDE_REACH`] to the places that [`Lanes::wide_windows`] reads.
    fn window_places(places: Self) -> Self::Words;
    /// Reads, from each of `N` windows, the key at each lane's place into the lower half of a word, and the next key into
    /// the upper half. Prefetches the windows that are read next, which are too far apart for hardware to predict.
    ///
    /// # Panics
    /// If the table ends before [`Lanes::WINDOW`] keys of the last window.
    fn windows<const N: usize>(columns: KeyColumns<'_>, places: Self::Words) -> [Self::Words; N];
    /// [`Lanes::windows`] for windows that reach further, each of which takes longer.
    ///
    /// # Panics
    /// If the table ends before [`Lanes::WIDE_WINDOW`] keys of the last window.
    fn wide_windows<const N: usize>(
        columns: KeyColumns<'_>,
        places: Self::Words,
    ) -> [Self::Words; N];
    /// Reads a unit of sixteen rows, and of the rows after them, as words like those of [`Lanes::windows`]. `put` is called
    /// with an index (0 to 3 for the first quad's keys, 4 to 7 for the second's), a part, and that part's words. It is
    /// called only for wanted quads.
    fn unit_with(rows: &KeyRows<'_>, unit: UnitHalves, put: impl FnMut(usize, usize, Self::Words));
    /// The sum of the products of the lower halves and of the upper halves of the words, as signed 16-bit numbers. It is
    /// exact except for one rounding to a float.
    fn dot_pairs(a: Self::Words, b: Self::Words) -> Self;

    /// Transposes sixteen [`F32x16`]s: for each lane of a part, writes its sixteen numbers to that lane's [`F32x16`] of
    /// `to`. Streamed stores are those of [`Lanes::stream`].
    fn transpose(from: [&F32x16; F32x16::LANES], lanes: PartWrite, to: &mut impl Sixteen);

    /// Runs `work` in a function of its own.
    fn apart(work: impl Apart<Self>);
}

/// Work that is compiled once for each kind of registers, as a function of its own that is called wherever it is needed.
pub(crate) trait Apart<L: Lanes> {
    /// Runs the work. This function and those that it calls must be `#[inline(always)]`, or run by [`Lanes::apart`]
    /// themselves.
    fn run(self);
}

/// A unit of [`KeyRows`], and which of its two quads are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct UnitHalves {
    pub(crate) unit: usize,
    pub(crate) wanted: [bool; 2],
}

/// The part of the lanes to write, and whether stores go past the caches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PartWrite {
    pub(crate) part: usize,
    pub(crate) is_streamed: bool,
}

/// Work that is generic over [`Lanes`].
pub(crate) trait Kernel {
    /// Result of the kernel.
    type Out;

    /// Runs the kernel. This function and those that it calls must be `#[inline(always)]`.
    fn run<L: Lanes>(self) -> Self::Out;
}

impl Isa {
    /// Runs a kernel with the registers of this instruction set, or of [`Isa::Portable`] if the machine does not have it.
    #[inline]
    pub(crate) fn on_lanes<K: Kernel>(self, kernel: K) -> K::Out {
        on_isa!(self, {
            Avx512 => kernel.run::<avx512::Avx512>(),
            Avx2 => kernel.run::<avx2::Avx2>(),
            Neon => kernel.run::<neon::Neon>(),
            Portable => kernel.run::<portable::Portable>(),
        })
    }
}
