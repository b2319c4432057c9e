//! Lanes of AVX2 and FMA: an [`F32x16`] is two registers.
//!
//! Only [`Isa::on_lanes`](crate::math::Isa::on_lanes) names [`Avx2`], and only if the machine has the features of
//! [`Isa::Avx2`](crate::math::Isa::Avx2): each `unsafe` block below relies on this.

use std::arch::x86_64::*;
use std::ptr::from_ref;

use super::{
    F32x16, KeyColumns, KeyRows, KeyUnit, Lanes, RowLines, fours, instructions, operators,
};

#[derive(Clone, Copy)]
pub(super) struct Avx2(__m256);

operators!(
    Avx2,
    _mm256_add_ps,
    _mm256_sub_ps,
    _mm256_mul_ps,
    _mm256_div_ps
);
fours!(
    __m256,
    _mm256_unpacklo_ps,
    _mm256_unpackhi_ps,
    _mm256_shuffle_ps
);

/// # Safety
/// The machine must have the features that are named.
#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt")]
#[inline(never)]
unsafe fn apart(work: impl FnOnce()) {
    work();
}

impl Lanes for Avx2 {
    type Words = __m256i;

    const COUNT: usize = 8;
    const REACH: usize = 7;
    const WIDE_REACH: usize = 14;

    instructions! {
        fn splat(value: f32) -> Self = Self(_mm256_set1_ps(value));
        fn load(line: &F32x16, part: usize) -> Self = Self(_mm256_load_ps(line.part::<8>(part).as_ptr()));
        fn store(self, line: &mut F32x16, part: usize) -> () = _mm256_store_ps(line.part_mut::<8>(part).as_mut_ptr(), self.0);
        fn stream(self, line: &mut F32x16, part: usize) -> () = _mm256_stream_ps(line.part_mut::<8>(part).as_mut_ptr(), self.0);
        fn fence() -> () = _mm_sfence();
        fn mul_add(self, factor: Self, sum: Self) -> Self = Self(_mm256_fmadd_ps(self.0, factor.0, sum.0));
        fn neg_mul_add(self, factor: Self, sum: Self) -> Self = Self(_mm256_fnmadd_ps(self.0, factor.0, sum.0));
        fn sqrt(self) -> Self = Self(_mm256_sqrt_ps(self.0));
        fn floor(self) -> Self = Self(_mm256_floor_ps(self.0));
        fn max(self, other: Self) -> Self = Self(_mm256_max_ps(self.0, other.0));
        fn min(self, other: Self) -> Self = Self(_mm256_min_ps(self.0, other.0));
        fn first(self) -> f32 = _mm256_cvtss_f32(self.0);
        fn splat_words(word: u32) -> __m256i = _mm256_set1_epi32(word as i32);
        fn truncated(self) -> __m256i = _mm256_cvttps_epi32(self.0);
        fn load_words(line: &F32x16, part: usize) -> __m256i = _mm256_castps_si256(Self::load(line, part).0);
        fn from_bits(words: __m256i) -> Self = Self(_mm256_castsi256_ps(words));
        fn pair(low: __m256i, high: __m256i) -> __m256i = _mm256_or_si256(_mm256_slli_epi32::<16>(high), low);
        fn dot_pairs(a: __m256i, b: __m256i) -> Self = Self(_mm256_cvtepi32_ps(_mm256_madd_epi16(a, b)));
    }

    #[inline(always)]
    fn copy_sign(self, sign: Self) -> Self {
        // SAFETY: the machine has AVX.
        Self(unsafe {
            let mask = _mm256_set1_ps(-0.0);
            _mm256_or_ps(_mm256_andnot_ps(mask, self.0), _mm256_and_ps(mask, sign.0))
        })
    }

    #[inline(always)]
    fn least(self) -> f32 {
        // SAFETY: the machine has AVX.
        unsafe {
            let high = _mm256_extractf128_ps::<1>(self.0);
            let four = _mm_min_ps(_mm256_castps256_ps128(self.0), high);
            let two = _mm_min_ps(four, _mm_movehl_ps(four, four));
            _mm_cvtss_f32(_mm_min_ss(two, _mm_movehdup_ps(two)))
        }
    }

    #[inline(always)]
    fn mask_below(self, bound: f32) -> u32 {
        // SAFETY: the machine has AVX.
        unsafe {
            let below = _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, _mm256_set1_ps(bound));
            _mm256_movemask_ps(below) as u32
        }
    }

    #[inline(always)]
    fn window_places(places: Self) -> __m256i {
        // SAFETY: the machine has AVX2.
        unsafe {
            // Two bytes of the key at the place, and two of the next key.
            let places = _mm256_cvttps_epi32(places.0);
            let first = _mm256_mullo_epi32(places, _mm256_set1_epi32(0x0202_0202));
            _mm256_add_epi32(first, _mm256_set1_epi32(0x0302_0100))
        }
    }

    #[inline(always)]
    fn window(keys: &[i16; KeyColumns::WINDOW], places: __m256i) -> __m256i {
        // SAFETY: the machine has AVX2; 8 keys are read.
        unsafe {
            let keys = _mm256_broadcastsi128_si256(_mm_loadu_si128(keys.as_ptr().cast()));
            _mm256_shuffle_epi8(keys, places)
        }
    }

    #[inline(always)]
    fn wide_window(keys: &[i16; KeyColumns::WIDE_WINDOW], places: __m256i) -> __m256i {
        // SAFETY: the machine has AVX2; 15 keys are read.
        unsafe {
            // A byte with its highest bit set takes a 0. Eight keys hold the pairs of seven places; the next seven places are
            // in the eight keys that begin at the last of those.
            let first = _mm256_and_si256(places, _mm256_set1_epi32(0xff));
            let is_high = _mm256_cmpgt_epi32(first, _mm256_set1_epi32(2 * Self::REACH as i32 - 1));
            let further = _mm256_sub_epi8(places, _mm256_set1_epi8(2 * Self::REACH as i8));
            let is_low = _mm256_andnot_si256(is_high, _mm256_set1_epi8(-1));
            let near = _mm256_broadcastsi128_si256(_mm_loadu_si128(keys.as_ptr().cast()));
            let far = _mm_loadu_si128(keys.as_ptr().add(Self::REACH).cast());
            let far = _mm256_broadcastsi128_si256(far);
            _mm256_or_si256(
                _mm256_shuffle_epi8(near, _mm256_or_si256(places, is_high)),
                _mm256_shuffle_epi8(far, _mm256_or_si256(further, is_low)),
            )
        }
    }

    #[inline(always)]
    fn unit_with(
        rows: &KeyRows<'_>,
        unit: usize,
        wanted: [bool; 2],
        mut put: impl FnMut(usize, usize, __m256i),
    ) {
        for part in 0..Self::PARTS {
            // SAFETY: the machine has AVX2.
            unsafe {
                // Two lanes a register, so that the transposed halves are in order.
                let mut pairs = [[_mm256_setzero_ps(); 4]; 2];
                for first in 0..4 {
                    let lane = part * Self::COUNT + first;
                    let low = rows.units(lane, unit);
                    let high = rows.units(lane + 4, unit);
                    let mut both = [_mm256_setzero_si256(); 2];
                    for row in 0..2 {
                        both[row] = _mm256_inserti128_si256::<1>(
                            _mm256_castsi128_si256(_mm_load_si128(from_ref(low[row]).cast())),
                            _mm_load_si128(from_ref(high[row]).cast()),
                        );
                    }
                    let [low, high] = [
                        _mm256_unpacklo_epi16(both[0], both[1]),
                        _mm256_unpackhi_epi16(both[0], both[1]),
                    ];
                    pairs[0][first] = _mm256_castsi256_ps(low);
                    pairs[1][first] = _mm256_castsi256_ps(high);
                }
                for half in 0..2 {
                    if wanted[half] {
                        for (key, words) in fours(pairs[half]).into_iter().enumerate() {
                            put(KeyUnit::QUAD * half + key, part, _mm256_castps_si256(words));
                        }
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn apart(work: impl FnOnce()) {
        // SAFETY: the machine has the features.
        unsafe { apart(work) }
    }

    /// Both halves of an [`F32x16`] are written close together, so that stores past the caches are combined.
    #[inline(always)]
    fn transpose(
        from: [&F32x16; F32x16::LANES],
        part: usize,
        to: &mut RowLines<'_>,
        line: usize,
        is_streamed: bool,
    ) {
        for (half, from) in from.chunks_exact(Self::COUNT).enumerate() {
            let mut block = [Self::splat(0.0); 8];
            for (row, line) in block.iter_mut().zip(from) {
                *row = Self::load(line, part);
            }
            for (lane, numbers) in transposed(block).into_iter().enumerate() {
                let line = to.line(part * Self::COUNT + lane, line);
                match is_streamed {
                    true => numbers.stream(line, half),
                    false => numbers.store(line, half),
                }
            }
        }
    }
}

/// Transposes a block of 8 x 8: fours, then the halves of the registers.
#[inline(always)]
fn transposed(rows: [Avx2; 8]) -> [Avx2; 8] {
    let [a, b, c, d, e, f, g, h] = rows;
    // SAFETY: the machine has AVX.
    unsafe {
        let (tops, bottoms) = (fours([a.0, b.0, c.0, d.0]), fours([e.0, f.0, g.0, h.0]));
        let mut columns = rows;
        for four in 0..4 {
            let (top, bottom) = (tops[four], bottoms[four]);
            columns[four] = Avx2(_mm256_permute2f128_ps::<0x20>(top, bottom));
            columns[4 + four] = Avx2(_mm256_permute2f128_ps::<0x31>(top, bottom));
        }
        columns
    }
}
