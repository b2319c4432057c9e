//! Selects the instruction set of hot loops at run time.
//!
//! A kernel is written once, in plain Rust over slices and arrays. [`Isa::run`] compiles it for each instruction set. The compiler does
//! not fuse or reassociate floating-point operations, so all instruction sets give the same bits.

use std::sync::OnceLock;

/// An instruction set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Isa {
    /// The instruction set that the program was built for.
    Portable,
    /// aarch64, all of which have NEON.
    Neon,
    /// x86-64 with AVX2, FMA, BMI1, BMI2 and POPCNT.
    Avx2,
    /// x86-64 with the AVX-512 of servers since 2017: F, BW, DQ, VL, CD.
    Avx512,
}

/// Evaluates the expression of an instruction set, compiled for it, or the last one if the machine does not have it.
macro_rules! on_isa {
    ($isa:expr, { Avx512 => $avx512:expr, Avx2 => $avx2:expr, Neon => $neon:expr, Portable => $portable:expr, }) => {
        match $isa {
            #[cfg(target_arch = "x86_64")]
            $crate::math::Isa::Avx512 if $isa <= $crate::math::Isa::best() => {
                // SAFETY: the machine has it.
                unsafe {
                    $crate::math::isa::run_avx512(
                        #[inline(always)]
                        || $avx512,
                    )
                }
            }
            #[cfg(target_arch = "x86_64")]
            $crate::math::Isa::Avx2 if $isa <= $crate::math::Isa::best() => {
                // SAFETY: the machine has it.
                unsafe {
                    $crate::math::isa::run_avx2(
                        #[inline(always)]
                        || $avx2,
                    )
                }
            }
            #[cfg(target_arch = "aarch64")]
            $crate::math::Isa::Neon => $neon,
            _ => $portable,
        }
    };
}
pub(super) use on_isa;

impl Isa {
    const ALL: [Self; 4] = [Self::Portable, Self::Neon, Self::Avx2, Self::Avx512];

    /// The widest instruction set of this machine.
    #[must_use]
    #[inline]
    pub fn best() -> Self {
        /// Cached, because kernels are short.
        static BEST: OnceLock<Isa> = OnceLock::new();
        *BEST.get_or_init(|| Self::available().last().unwrap_or(Self::Portable))
    }

    /// All instruction sets of this machine, narrow ones first.
    pub fn available() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(|isa| isa.is_available())
    }

    /// Whether this machine has the instruction set.
    #[inline]
    pub fn is_available(self) -> bool {
        match self {
            Self::Portable => true,
            Self::Neon => cfg!(target_arch = "aarch64"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => {
                std::is_x86_feature_detected!("avx2")
                    && std::is_x86_feature_detected!("fma")
                    && std::is_x86_feature_detected!("bmi1")
                    && std::is_x86_feature_detected!("bmi2")
                    && std::is_x86_feature_detected!("popcnt")
            }
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                Self::Avx2.is_available()
                    && std::is_x86_feature_detected!("avx512f")
                    && std::is_x86_feature_detected!("avx512bw")
                    && std::is_x86_feature_detected!("avx512cd")
                    && std::is_x86_feature_detected!("avx512dq")
                    && std::is_x86_feature_detected!("avx512vl")
            }
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// This instruction set, or the widest narrower one of this machine. The second case is logged as a warning.
    #[must_use]
    pub fn or_best(self) -> Self {
        let best = Self::available().filter(|&isa| isa <= self).last();
        let best = best.unwrap_or(Self::Portable);
        if best != self {
            tracing::warn!("this machine has no {self:?}: {best:?} is used");
        }
        best
    }

    /// Runs a kernel compiled for this instruction set, or for [`Isa::Portable`] if the machine does not have it. Functions that the kernel
    /// calls must be `#[inline(always)]`; others are not compiled again.
    #[inline(always)]
    pub fn run<R>(self, kernel: impl FnOnce() -> R) -> R {
        on_isa!(self, {
            Avx512 => kernel(),
            Avx2 => kernel(),
            Neon => kernel(),
            Portable => kernel(),
        })
    }
}

/// A kernel that looks up words in tables.
pub trait Lookup {
    /// Result of the kernel.
    type Out;

    /// Runs the kernel. Functions that it calls must be `#[inline(always)]`.
    fn run<W: Words>(self, words: W) -> Self::Out;
}

/// Looks up sixteen words of a table at once. Only [`Isa::look_up`] creates one, for an instruction set that the machine has.
pub trait Words: Copy {
    /// Words of the table at `places`, 0 for places beyond its end.
    fn at(self, table: &[u32], places: &[u32; 16]) -> [u32; 16];
}

impl Isa {
    /// Runs a kernel compiled for this instruction set, or for [`Isa::Portable`] if the machine does not have it, with its implementation
    /// of [`Words`].
    #[inline]
    pub fn look_up<K: Lookup>(self, kernel: K) -> K::Out {
        on_isa!(self, {
            Avx512 => kernel.run(WordsAvx2(())),
            Avx2 => kernel.run(WordsAvx2(())),
            // It reads words one by one.
            Neon => kernel.run(WordsPortable(())),
            Portable => kernel.run(WordsPortable(())),
        })
    }
}

#[derive(Clone, Copy)]
struct WordsPortable(());

#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
struct WordsAvx2(());

impl Words for WordsPortable {
    #[inline(never)]
    fn at(self, table: &[u32], places: &[u32; 16]) -> [u32; 16] {
        places.map(|place| table.get(place as usize).copied().unwrap_or(0))
    }
}

#[cfg(target_arch = "x86_64")]
impl Words for WordsAvx2 {
    #[inline(always)]
    fn at(self, table: &[u32], places: &[u32; 16]) -> [u32; 16] {
        let table = &table[..table.len().min(i32::MAX as usize)];
        let mut words = [0; 16];
        // SAFETY: one of these is made only where the machine has the features; the table was cut.
        unsafe { gather_avx2(table, places, &mut words) };
        words
    }
}

/// # Safety
/// The machine must have the features that are named. The table has at most 2^31 - 1 words.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt")]
#[inline]
unsafe fn gather_avx2(table: &[u32], places: &[u32; 16], words: &mut [u32; 16]) {
    use std::arch::x86_64::{
        _mm256_and_si256, _mm256_cmpgt_epi32, _mm256_loadu_si256, _mm256_mask_i32gather_epi32,
        _mm256_set1_epi32, _mm256_setzero_si256, _mm256_storeu_si256,
    };
    let none = _mm256_setzero_si256();
    let length = _mm256_set1_epi32(table.len() as i32);
    for (places, words) in places.chunks_exact(8).zip(words.chunks_exact_mut(8)) {
        // SAFETY: chunks of 8 words are read and written; of the table only those places are read
        // that are neither negative as signed numbers nor beyond its length.
        unsafe {
            let at = _mm256_loadu_si256(places.as_ptr().cast());
            let positive = _mm256_cmpgt_epi32(at, _mm256_set1_epi32(-1));
            let within = _mm256_and_si256(positive, _mm256_cmpgt_epi32(length, at));
            let found = _mm256_mask_i32gather_epi32::<4>(none, table.as_ptr().cast(), at, within);
            _mm256_storeu_si256(words.as_mut_ptr().cast(), found);
        }
    }
}

/// Runs a kernel that is written for AVX2, compiled for that alone.
///
/// # Safety
/// The machine must have the features that are named.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt")]
pub(super) unsafe fn run_avx2<R>(kernel: impl FnOnce() -> R) -> R {
    kernel()
}

/// Runs a kernel that is written for AVX-512, compiled for that alone.
///
/// # Safety
/// The machine must have the features that are named.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt,avx512f,avx512bw,avx512cd,avx512dq,avx512vl")]
pub(super) unsafe fn run_avx512<R>(kernel: impl FnOnce() -> R) -> R {
    kernel()
}

#[cfg(test)]
mod tests {
    use super::*;

    struct At<'a>(&'a [u32], &'a [u32; 16]);

    impl Lookup for At<'_> {
        type Out = [u32; 16];

        fn run<W: Words>(self, words: W) -> [u32; 16] {
            words.at(self.0, self.1)
        }
    }

    #[test]
    fn every_instruction_set_gathers_the_same_words() {
        let table: Vec<u32> = (0..100).map(|i| i * 0x0123_4567 + 1).collect();
        let ends = [
            0,
            1,
            99,
            100,
            101,
            1 << 30,
            1 << 31,
            (1 << 31) - 1,
            u32::MAX,
        ];
        for length in [0, 1, 7, 100] {
            let table = &table[..length];
            for shift in 0..60u32 {
                let places: [u32; 16] = std::array::from_fn(|lane| {
                    let lane = lane as u32;
                    match (lane + shift) % 3 {
                        0 => ends[(lane + shift) as usize % ends.len()],
                        _ => (lane * 37 + shift * 11) % 120,
                    }
                });
                let expected = places.map(|at| table.get(at as usize).copied().unwrap_or(0));
                for isa in Isa::available() {
                    let found = isa.look_up(At(table, &places));
                    assert_eq!(found, expected, "{isa:?}");
                }
            }
        }
    }
}
