//! Lanes of AVX-512: an [`F32x16`] is one register.
//!
//! Only [`Isa::on_lanes`](crate::math::Isa::on_lanes) names [`Avx512`], and only if the machine has the features of
//! [`Isa::Avx512`](crate::math::Isa::Avx512): each `unsafe` block below relies on this.

use std::arch::x86_64::*;
use std::ptr::from_ref;

use super::{
    F32x16, KeyColumns, KeyRows, KeyUnit, Lanes, RowLines, fours, instructions, operators,
};

#[derive(Clone, Copy)]
pub(super) struct Avx512(__m512);

operators!(
    Avx512,
    _mm512_add_ps,
    _mm512_sub_ps,
    _mm512_mul_ps,
    _mm512_div_ps
);
fours!(
    __m512,
    _mm512_unpacklo_ps,
    _mm512_unpackhi_ps,
    _mm512_shuffle_ps
);

/// # Safety
/// The machine must have the features that are named.
#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt,avx512f,avx512bw,avx512cd,avx512dq,avx512vl")]
#[inline(never)]
unsafe fn apart(work: impl FnOnce()) {
    work();
}

impl Lanes for Avx512 {
    type Words = __m512i;

    const COUNT: usize = 16;
    const REACH: usize = 31;
    const WIDE_REACH: usize = 63;

    instructions! {
        fn splat(value: f32) -> Self = Self(_mm512_set1_ps(value));
        fn load(line: &F32x16, _part: usize) -> Self = Self(_mm512_load_ps(line.0.as_ptr()));
        fn store(self, line: &mut F32x16, _part: usize) -> () = _mm512_store_ps(line.0.as_mut_ptr(), self.0);
        fn stream(self, line: &mut F32x16, _part: usize) -> () = _mm512_stream_ps(line.0.as_mut_ptr(), self.0);
        fn fence() -> () = _mm_sfence();
        fn mul_add(self, factor: Self, sum: Self) -> Self = Self(_mm512_fmadd_ps(self.0, factor.0, sum.0));
        fn neg_mul_add(self, factor: Self, sum: Self) -> Self = Self(_mm512_fnmadd_ps(self.0, factor.0, sum.0));
        fn sqrt(self) -> Self = Self(_mm512_sqrt_ps(self.0));
        fn max(self, other: Self) -> Self = Self(_mm512_max_ps(self.0, other.0));
        fn min(self, other: Self) -> Self = Self(_mm512_min_ps(self.0, other.0));
        fn first(self) -> f32 = _mm512_cvtss_f32(self.0);
        fn least(self) -> f32 = _mm512_reduce_min_ps(self.0);
        fn mask_below(self, bound: f32) -> u32 = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, _mm512_set1_ps(bound)).into();
        fn splat_words(word: u32) -> __m512i = _mm512_set1_epi32(word as i32);
        fn truncated(self) -> __m512i = _mm512_cvttps_epi32(self.0);
        fn load_words(line: &F32x16, part: usize) -> __m512i = _mm512_castps_si512(Self::load(line, part).0);
        fn from_bits(words: __m512i) -> Self = Self(_mm512_castsi512_ps(words));
        fn pair(low: __m512i, high: __m512i) -> __m512i = _mm512_or_si512(_mm512_slli_epi32::<16>(high), low);
        fn dot_pairs(a: __m512i, b: __m512i) -> Self = Self(_mm512_cvtepi32_ps(_mm512_madd_epi16(a, b)));
    }

    #[inline(always)]
    fn floor(self) -> Self {
        const DOWN: i32 = _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC;
        // SAFETY: the machine has AVX-512F.
        Self(unsafe { _mm512_roundscale_ps::<DOWN>(self.0) })
    }

    #[inline(always)]
    fn copy_sign(self, sign: Self) -> Self {
        // SAFETY: the machine has AVX-512F.
        Self(unsafe {
            let mask = _mm512_set1_ps(-0.0);
            _mm512_or_ps(_mm512_andnot_ps(mask, self.0), _mm512_and_ps(mask, sign.0))
        })
    }

    #[inline(always)]
    fn window_places(places: Self) -> __m512i {
        // SAFETY: the machine has AVX-512F.
        unsafe {
            // The 16-bit indices of the key at the place, and of the next key.
            let low = _mm512_cvttps_epi32(places.0);
            let high = _mm512_slli_epi32::<16>(_mm512_add_epi32(low, _mm512_set1_epi32(1)));
            _mm512_or_si512(high, low)
        }
    }

    #[inline(always)]
    fn window(keys: &[i16; KeyColumns::WINDOW], places: __m512i) -> __m512i {
        // SAFETY: the machine has AVX-512F and BW; all keys are read.
        unsafe { _mm512_permutexvar_epi16(places, _mm512_loadu_si512(keys.as_ptr().cast())) }
    }

    #[inline(always)]
    fn wide_window(keys: &[i16; KeyColumns::WIDE_WINDOW], places: __m512i) -> __m512i {
        // SAFETY: the machine has AVX-512F and BW; all keys are read.
        unsafe {
            let low = _mm512_loadu_si512(keys.as_ptr().cast());
            let high = _mm512_loadu_si512(keys.as_ptr().add(KeyColumns::WINDOW).cast());
            _mm512_permutex2var_epi16(low, places, high)
        }
    }

    #[inline(always)]
    fn unit_with(
        rows: &KeyRows<'_>,
        unit: usize,
        wanted: [bool; 2],
        mut put: impl FnMut(usize, usize, __m512i),
    ) {
        // SAFETY: the machine has AVX-512F and BW.
        unsafe {
            // Four lanes a register, so that the transposed quarters are in order.
            let mut pairs = [[_mm512_setzero_ps(); 4]; 2];
            for first in 0..4 {
                let [mut own, mut next] = [_mm512_setzero_si512(); 2];
                let mut lanes = [[_mm_setzero_si128(); 2]; 4];
                for (quarter, keys) in lanes.iter_mut().enumerate() {
                    let [own, next] = rows.units(first + 4 * quarter, unit);
                    *keys = [
                        _mm_load_si128(from_ref(own).cast()),
                        _mm_load_si128(from_ref(next).cast()),
                    ];
                }
                for (row, register) in [&mut own, &mut next].into_iter().enumerate() {
                    *register = _mm512_castsi128_si512(lanes[0][row]);
                    *register = _mm512_inserti32x4::<1>(*register, lanes[1][row]);
                    *register = _mm512_inserti32x4::<2>(*register, lanes[2][row]);
                    *register = _mm512_inserti32x4::<3>(*register, lanes[3][row]);
                }
                pairs[0][first] = _mm512_castsi512_ps(_mm512_unpacklo_epi16(own, next));
                pairs[1][first] = _mm512_castsi512_ps(_mm512_unpackhi_epi16(own, next));
            }
            for half in 0..2 {
                if wanted[half] {
                    for (key, words) in fours(pairs[half]).into_iter().enumerate() {
                        put(KeyUnit::QUAD * half + key, 0, _mm512_castps_si512(words));
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

    /// Transposes eight lanes at a time. Loads combine the lanes of two [`F32x16`]s in a register; fours and quarters are then exchanged.
    #[inline(always)]
    fn transpose(
        from: [&F32x16; F32x16::LANES],
        _part: usize,
        to: &mut RowLines<'_>,
        line: usize,
        is_streamed: bool,
    ) {
        for first in [0, 8] {
            // SAFETY: the machine has AVX-512F and DQ.
            let lines = unsafe { turned(&from, first) };
            for (lane, numbers) in lines.into_iter().enumerate() {
                let line = to.line(first + lane, line);
                match is_streamed {
                    true => numbers.stream(line, 0),
                    false => numbers.store(line, 0),
                }
            }
        }
    }
}

/// Transposes eight lanes of sixteen [`F32x16`]s, from the lane `first` on, a multiple of eight. The result has sixteen
/// numbers for each lane.
///
/// # Safety
/// The machine must have AVX-512F.
#[inline(always)]
unsafe fn turned(from: &[&F32x16; F32x16::LANES], first: usize) -> [Avx512; 8] {
    // SAFETY: the machine has AVX-512F; half a line is 32 bytes and aligned so.
    unsafe {
        let mut rows = [[_mm512_setzero_ps(); 4]; 2];
        for (half, rows) in rows.iter_mut().enumerate() {
            for (index, row) in rows.iter_mut().enumerate() {
                let number = 4 * half + index;
                let low = _mm256_load_pd(from[number].0[first..first + 8].as_ptr().cast());
                let high = _mm256_load_pd(from[number + 8].0[first..first + 8].as_ptr().cast());
                let both = _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(low), high);
                *row = _mm512_castpd_ps(both);
            }
            *rows = fours(*rows);
        }
        // Quarters 0 and 2 of both, then 1 and 3, as pairs of 64 bits.
        let even = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
        let odd = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
        let mut lanes = [Avx512(_mm512_setzero_ps()); 8];
        for index in 0..4 {
            let top = _mm512_castps_pd(rows[0][index]);
            let bottom = _mm512_castps_pd(rows[1][index]);
            lanes[index] = Avx512(_mm512_castpd_ps(_mm512_permutex2var_pd(top, even, bottom)));
            lanes[index + 4] = Avx512(_mm512_castpd_ps(_mm512_permutex2var_pd(top, odd, bottom)));
        }
        lanes
    }
}
