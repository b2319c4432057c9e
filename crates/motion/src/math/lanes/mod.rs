//! Explicit SIMD for kernels that compilers do not vectorise well: table lookups within a window, sums of 16-bit products, and
//! non-temporal stores of full cache lines.
//!
//! A [`Kernel`] is written once over [`Lanes`]. [`Isa::on_lanes`] runs it with the type for an instruction set that the machine has. Memory
//! is always in [`F32x16`]s; types with fewer lanes process them in parts.
//!
//! All types round in the same way, except in [`Lanes::mul_add`].
#![allow(
    clippy::needless_range_loop,
    reason = "the index is a lane or a part of the lanes"
)]

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

use std::ops::{Add, Div, Mul, Sub};

use bytemuck::{Pod, Zeroable};

use super::Isa;
use super::isa::on_isa;
pub(crate) use memory::{DistinctRows, KeyColumns, KeyPlace, KeyRows, KeyUnit, RowLines, RowSet};

/// Methods of [`Lanes`] that are one expression of instructions.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
macro_rules! instructions {
    ($(fn $name:ident($($arguments:tt)*) -> $result:ty = $value:expr;)*) => {
        $(
            #[inline(always)]
            fn $name($($arguments)*) -> $result {
                // SAFETY: registers of this kind are used only where the machine has their instructions. A part of an `F32x16` is as
                // long as a register and aligned as one; one that is streamed is not read by another thread before the fence.
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

/// A function that transposes four registers: in each 128 bits, blocks of 4 x 4 numbers.
#[cfg(target_arch = "x86_64")]
macro_rules! fours {
    ($register:ty, $low:ident, $high:ident, $shuffle:ident) => {
        /// # Safety
        /// The machine must have the instructions.
        #[inline(always)]
        unsafe fn fours([a, b, c, d]: [$register; 4]) -> [$register; 4] {
            // SAFETY: the caller promises it.
            unsafe {
                let (low, below) = ($low(a, b), $low(c, d));
                let (high, above) = ($high(a, b), $high(c, d));
                [
                    $shuffle::<0b01_00_01_00>(low, below),
                    $shuffle::<0b11_10_11_10>(low, below),
                    $shuffle::<0b01_00_01_00>(high, above),
                    $shuffle::<0b11_10_11_10>(high, above),
                ]
            }
        }
    };
}
#[cfg(target_arch = "x86_64")]
use fours;

/// Sixteen numbers, for example one of each of sixteen characters, in one aligned cache line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct F32x16(pub [f32; F32x16::LANES]);

impl F32x16 {
    /// Number of lanes.
    pub const LANES: usize = 16;
    /// All lanes 0.
    pub const ZERO: Self = Self([0.0; Self::LANES]);
    /// Largest number of registers that hold the lanes ([`Lanes::PARTS`]).
    pub(crate) const MOST_PARTS: usize = 4;

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

    /// Number of lanes, a divisor of [`F32x16::LANES`].
    const COUNT: usize;
    /// Number of places of a window of [`Lanes::window`].
    const REACH: usize;
    /// Number of places of a window of [`Lanes::wide_window`].
    const WIDE_REACH: usize;
    /// Number of registers that hold an [`F32x16`].
    const PARTS: usize = F32x16::LANES / Self::COUNT;

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
    /// A bit for each lane, the first lane's lowest: set if the number is below `bound`, clear for NaN.
    fn mask_below(self, bound: f32) -> u32;

    /// Whether all lanes are below `bound`; false if one is NaN.
    #[inline(always)]
    fn all_below(self, bound: f32) -> bool {
        self.mask_below(bound) == (1 << Self::COUNT) - 1
    }

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
    /// Converts whole numbers below [`Lanes::REACH`] to the places that [`Lanes::window`] reads, and those below
    /// [`Lanes::WIDE_REACH`] to the places that [`Lanes::wide_window`] reads.
    fn window_places(places: Self) -> Self::Words;
    /// Reads the key at each lane's place into the lower half of a word, and the next key into the upper half.
    fn window(keys: &[i16; KeyColumns::WINDOW], places: Self::Words) -> Self::Words;
    /// [`Lanes::window`] for a window that reaches further, which takes longer.
    fn wide_window(keys: &[i16; KeyColumns::WIDE_WINDOW], places: Self::Words) -> Self::Words;

    /// [`Lanes::window`] or, if `WIDE`, [`Lanes::wide_window`] of each of `N` columns.
    ///
    /// # Panics
    /// If the table ends before the last window does.
    #[inline(always)]
    fn windows<const WIDE: bool, const N: usize>(
        columns: KeyColumns<'_>,
        places: Self::Words,
    ) -> [Self::Words; N] {
        let mut found = [Self::splat_words(0); N];
        if WIDE {
            for (words, keys) in found.iter_mut().zip(columns.windows::<_, N>()) {
                *words = Self::wide_window(keys, places);
            }
        } else {
            for (words, keys) in found.iter_mut().zip(columns.windows::<_, N>()) {
                *words = Self::window(keys, places);
            }
        }
        found
    }

    /// Reads a unit of sixteen rows, and of the rows after them, as words like those of [`Lanes::window`]. `put` is called
    /// with an index (0 to 3 for the first quad's keys, 4 to 7 for the second's), a part, and that part's words. It is
    /// called only for wanted quads.
    fn unit_with(
        rows: &KeyRows<'_>,
        unit: usize,
        wanted: [bool; 2],
        put: impl FnMut(usize, usize, Self::Words),
    );
    /// The sum of the products of the lower halves and of the upper halves of the words, as signed 16-bit numbers. It is
    /// exact except for one rounding to a float.
    fn dot_pairs(a: Self::Words, b: Self::Words) -> Self;

    /// Transposes sixteen [`F32x16`]s: for each lane of a part, writes its sixteen numbers to the [`F32x16`] with the index
    /// `line` of that lane's row, by [`Lanes::stream`] if `is_streamed`.
    fn transpose(
        from: [&F32x16; F32x16::LANES],
        part: usize,
        to: &mut RowLines<'_>,
        line: usize,
        is_streamed: bool,
    );

    /// Runs `work` in a function of its own, which is compiled once and called wherever it is needed. The closure and the functions that it
    /// calls must be `#[inline(always)]`, or run by [`Lanes::apart`] themselves.
    fn apart(work: impl FnOnce());
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
