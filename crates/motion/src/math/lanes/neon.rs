//! Lanes of NEON: an [`F32x16`] is four registers.
//!
//! Every aarch64 that Rust's standard library supports has NEON, with products that are fused: each `unsafe` block below relies on
//! this. Its rounding is therefore that of [`Portable`](super::portable::Portable) on the same machine.

use std::arch::aarch64::*;

use super::{F32x16, KeyColumns, KeyRows, KeyUnit, Lanes, RowLines, instructions, operators};

#[derive(Clone, Copy)]
pub(super) struct Neon(float32x4_t);

operators!(Neon, vaddq_f32, vsubq_f32, vmulq_f32, vdivq_f32);

impl Lanes for Neon {
    type Words = uint32x4_t;

    const COUNT: usize = 4;
    /// The places of the pairs in 16 keys, which are two registers of a table look-up.
    const REACH: usize = 15;
    /// The places of the pairs in 32 keys.
    const WIDE_REACH: usize = 31;

    instructions! {
        fn splat(value: f32) -> Self = Self(vdupq_n_f32(value));
        fn load(line: &F32x16, part: usize) -> Self = Self(vld1q_f32(line.part::<4>(part).as_ptr()));
        fn store(self, line: &mut F32x16, part: usize) -> () = vst1q_f32(line.part_mut::<4>(part).as_mut_ptr(), self.0);
        fn mul_add(self, factor: Self, sum: Self) -> Self = Self(vfmaq_f32(sum.0, self.0, factor.0));
        fn neg_mul_add(self, factor: Self, sum: Self) -> Self = Self(vfmsq_f32(sum.0, self.0, factor.0));
        fn sqrt(self) -> Self = Self(vsqrtq_f32(self.0));
        fn floor(self) -> Self = Self(vrndmq_f32(self.0));
        // NEON's own maximum and minimum are not `other` for NaN.
        fn max(self, other: Self) -> Self = Self(vbslq_f32(vcgtq_f32(self.0, other.0), self.0, other.0));
        fn min(self, other: Self) -> Self = Self(vbslq_f32(vcltq_f32(self.0, other.0), self.0, other.0));
        fn copy_sign(self, sign: Self) -> Self = Self(vbslq_f32(vdupq_n_u32(1 << 31), sign.0, self.0));
        fn first(self) -> f32 = vgetq_lane_f32::<0>(self.0);
        fn least(self) -> f32 = vminvq_f32(self.0);
        fn splat_words(word: u32) -> uint32x4_t = vdupq_n_u32(word);
        fn truncated(self) -> uint32x4_t = vreinterpretq_u32_s32(vcvtq_s32_f32(self.0));
        fn load_words(line: &F32x16, part: usize) -> uint32x4_t = vreinterpretq_u32_f32(Self::load(line, part).0);
        fn from_bits(words: uint32x4_t) -> Self = Self(vreinterpretq_f32_u32(words));
        fn pair(low: uint32x4_t, high: uint32x4_t) -> uint32x4_t = vsliq_n_u32::<16>(low, high);
    }

    /// A plain store: Rust has no intrinsic of NEON's store past the caches.
    #[inline(always)]
    fn stream(self, line: &mut F32x16, part: usize) {
        self.store(line, part);
    }

    #[inline(always)]
    fn fence() {}

    #[inline(always)]
    fn mask_below(self, bound: f32) -> u32 {
        // SAFETY: the machine has NEON; four words are read.
        unsafe {
            let bits = vld1q_u32([1, 2, 4, 8].as_ptr());
            let below = vcltq_f32(self.0, vdupq_n_f32(bound));
            vaddvq_u32(vandq_u32(below, bits))
        }
    }

    #[inline(always)]
    fn window_places(places: Self) -> uint32x4_t {
        // SAFETY: the machine has NEON.
        unsafe {
            // Two bytes of the key at the place, and two of the next key.
            let first = vdupq_n_u32(0x0302_0100);
            vmlaq_n_u32(first, places.truncated(), 0x0202_0202)
        }
    }

    #[inline(always)]
    fn window(keys: &[i16; KeyColumns::WINDOW], places: uint32x4_t) -> uint32x4_t {
        // SAFETY: the machine has NEON; 16 keys are read.
        unsafe {
            let from = keys.as_ptr().cast::<u8>();
            let keys = uint8x16x2_t(vld1q_u8(from), vld1q_u8(from.add(16)));
            vreinterpretq_u32_u8(vqtbl2q_u8(keys, vreinterpretq_u8_u32(places)))
        }
    }

    #[inline(always)]
    fn wide_window(keys: &[i16; KeyColumns::WIDE_WINDOW], places: uint32x4_t) -> uint32x4_t {
        // SAFETY: the machine has NEON; 32 keys are read.
        unsafe {
            let from = keys.as_ptr().cast::<u8>();
            let keys = uint8x16x4_t(
                vld1q_u8(from),
                vld1q_u8(from.add(16)),
                vld1q_u8(from.add(32)),
                vld1q_u8(from.add(48)),
            );
            vreinterpretq_u32_u8(vqtbl4q_u8(keys, vreinterpretq_u8_u32(places)))
        }
    }

    #[inline(always)]
    fn unit_with(
        rows: &KeyRows<'_>,
        unit: usize,
        wanted: [bool; 2],
        mut put: impl FnMut(usize, usize, uint32x4_t),
    ) {
        for part in 0..Self::PARTS {
            // SAFETY: the machine has NEON; units of eight keys are read.
            unsafe {
                let mut pairs = [[vdupq_n_u32(0); 4]; 2];
                for lane in 0..Self::COUNT {
                    let [own, next] = rows.units(part * Self::COUNT + lane, unit);
                    let own = vld1q_u16(own.0.as_ptr().cast());
                    let next = vld1q_u16(next.0.as_ptr().cast());
                    pairs[0][lane] = vreinterpretq_u32_u16(vzip1q_u16(own, next));
                    pairs[1][lane] = vreinterpretq_u32_u16(vzip2q_u16(own, next));
                }
                for half in 0..2 {
                    if wanted[half] {
                        for (key, words) in transposed(pairs[half]).into_iter().enumerate() {
                            put(KeyUnit::QUAD * half + key, part, words);
                        }
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn dot_pairs(a: uint32x4_t, b: uint32x4_t) -> Self {
        // SAFETY: the machine has NEON.
        Self(unsafe {
            let (a, b) = (vreinterpretq_s16_u32(a), vreinterpretq_s16_u32(b));
            let low = vmull_s16(vget_low_s16(a), vget_low_s16(b));
            vcvtq_f32_s32(vpaddq_s32(low, vmull_high_s16(a, b)))
        })
    }

    #[inline(never)]
    fn apart(work: impl FnOnce()) {
        work();
    }

    #[inline(always)]
    fn transpose(
        from: [&F32x16; F32x16::LANES],
        part: usize,
        to: &mut RowLines<'_>,
        line: usize,
        _is_streamed: bool,
    ) {
        for (numbers, from) in from.chunks_exact(Self::COUNT).enumerate() {
            let row = |index: usize| Self::load_words(from[index], part);
            let block = [row(0), row(1), row(2), row(3)];
            for (lane, words) in transposed(block).into_iter().enumerate() {
                let line = to.line(part * Self::COUNT + lane, line);
                Self::from_bits(words).store(line, numbers);
            }
        }
    }
}

/// Transposes a block of 4 x 4: pairs, then fours.
#[inline(always)]
fn transposed([a, b, c, d]: [uint32x4_t; 4]) -> [uint32x4_t; 4] {
    // SAFETY: the machine has NEON.
    unsafe {
        let [even, odd] = [vtrn1q_u32(a, b), vtrn2q_u32(a, b)];
        let [even_below, odd_below] = [vtrn1q_u32(c, d), vtrn2q_u32(c, d)];
        let pairs = |low, high| (vreinterpretq_u64_u32(low), vreinterpretq_u64_u32(high));
        let low = |(low, high)| vreinterpretq_u32_u64(vtrn1q_u64(low, high));
        let high = |(low, high)| vreinterpretq_u32_u64(vtrn2q_u64(low, high));
        [
            low(pairs(even, even_below)),
            low(pairs(odd, odd_below)),
            high(pairs(even, even_below)),
            high(pairs(odd, odd_below)),
        ]
    }
}
