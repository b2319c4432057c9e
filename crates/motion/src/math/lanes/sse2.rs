//! Lanes of SSE2, which every x86-64 has: an [`F32x16`] is four registers. They are used for
//! [`Isa::Portable`](crate::math::Isa::Portable).

use std::arch::x86_64::*;

use super::{
    Apart, F32x16, KeyColumns, KeyRows, Lanes, PartWrite, Sixteen, UnitHalves, instructions,
    operators,
};

#[derive(Clone, Copy)]
pub(super) struct Sse2(__m128);

operators!(Sse2, _mm_add_ps, _mm_sub_ps, _mm_mul_ps, _mm_div_ps);

/// `then` where the mask is set, otherwise `other`.
#[inline(always)]
fn select(mask: __m128, then: __m128, other: __m128) -> __m128 {
    // SAFETY: every x86-64 has SSE2.
    unsafe { _mm_or_ps(_mm_and_ps(mask, then), _mm_andnot_ps(mask, other)) }
}

impl Sse2 {
    /// The key at each lane's place in a window, and the next key.
    #[inline(always)]
    fn windows_of<const N: usize>(
        columns: KeyColumns<'_>,
        places: __m128i,
        window: usize,
    ) -> [__m128i; N] {
        let (table, stride) = (columns.reaching::<N>(window), columns.stride);
        let mut lanes = [0u32; 4];
        // SAFETY: the array is as large as the register.
        unsafe { _mm_storeu_si128(lanes.as_mut_ptr().cast(), places) };
        let mut places = [0; 4];
        for lane in 0..4 {
            places[lane] = (lanes[lane] as usize).min(window - 2);
        }
        let mut found = [Self::splat_words(0); N];
        for (index, words) in found.iter_mut().enumerate() {
            columns.prefetch_next(index);
            // SAFETY: the table has `window` keys from here on, of which two are read from each place; every x86-64 has SSE2.
            *words = unsafe {
                let from = table.as_ptr().add(index * stride);
                let key = |place: usize| from.add(place).cast::<i32>().read_unaligned();
                let [a, b, c, d] = places;
                _mm_set_epi32(key(d), key(c), key(b), key(a))
            };
        }
        found
    }
}

impl Lanes for Sse2 {
    type Words = __m128i;
    type Parts<T: Copy> = [T; Self::PARTS];

    const COUNT: usize = 4;
    /// Keys are loaded one by one, so any place of a window can be read.
    const REACH: usize = Self::WINDOW - 1;
    const WIDE_REACH: usize = Self::WIDE_WINDOW - 1;

    instructions! {
        fn splat(value: f32) -> Self = Self(_mm_set1_ps(value));
        fn sqrt(self) -> Self = Self(_mm_sqrt_ps(self.0));
        fn max(self, other: Self) -> Self = Self(_mm_max_ps(self.0, other.0));
        fn min(self, other: Self) -> Self = Self(_mm_min_ps(self.0, other.0));
        fn first(self) -> f32 = _mm_cvtss_f32(self.0);
        fn mask_below(self, bound: f32) -> u32 = _mm_movemask_ps(_mm_cmplt_ps(self.0, _mm_set1_ps(bound))) as u32;
        fn splat_words(word: u32) -> __m128i = _mm_set1_epi32(word as i32);
        fn truncated(self) -> __m128i = _mm_cvttps_epi32(self.0);
        fn load_words(line: &F32x16, part: usize) -> __m128i = _mm_castps_si128(Self::load(line, part).0);
        fn from_bits(words: __m128i) -> Self = Self(_mm_castsi128_ps(words));
        fn pair(low: __m128i, high: __m128i) -> __m128i = _mm_or_si128(_mm_slli_epi32::<16>(high), low);
        fn dot_pairs(a: __m128i, b: __m128i) -> Self = Self(_mm_cvtepi32_ps(_mm_madd_epi16(a, b)));
    }

    #[inline(always)]
    fn parts<T: Copy>(value: T) -> [T; Self::PARTS] {
        [value; Self::PARTS]
    }

    #[inline(always)]
    fn load(line: &F32x16, part: usize) -> Self {
        // SAFETY: a quarter of a line is 16 bytes and aligned so.
        Self(unsafe { _mm_load_ps(line.part::<{ Self::COUNT }>(part).as_ptr()) })
    }

    #[inline(always)]
    fn store(self, line: &mut F32x16, part: usize) {
        // SAFETY: a quarter of a line is 16 bytes and aligned so.
        unsafe { _mm_store_ps(line.part_mut::<{ Self::COUNT }>(part).as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    fn stream(self, line: &mut F32x16, part: usize) {
        // SAFETY: a quarter of a line is 16 bytes and aligned so, and not read by another thread before the fence that the trait
        // asks for.
        unsafe { _mm_stream_ps(line.part_mut::<{ Self::COUNT }>(part).as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    fn fence() {
        // SAFETY: every x86-64 has SSE2.
        unsafe { _mm_sfence() }
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, sum: Self) -> Self {
        self * factor + sum
    }

    #[inline(always)]
    fn neg_mul_add(self, factor: Self, sum: Self) -> Self {
        sum - self * factor
    }

    #[inline(always)]
    fn floor(self) -> Self {
        /// Numbers from here on have no fraction.
        const WHOLE: f32 = 8_388_608.0;
        // SAFETY: every x86-64 has SSE2.
        let [signed, has_fraction] = unsafe {
            let sign = _mm_set1_ps(-0.0);
            let truncated = _mm_cvtepi32_ps(_mm_cvttps_epi32(self.0));
            let one = _mm_and_ps(_mm_cmpgt_ps(truncated, self.0), _mm_set1_ps(1.0));
            let floor = _mm_sub_ps(truncated, one);
            let size = _mm_andnot_ps(sign, self.0);
            [
                _mm_or_ps(floor, _mm_and_ps(sign, self.0)),
                _mm_cmplt_ps(size, _mm_set1_ps(WHOLE)),
            ]
        };
        Self(select(has_fraction, signed, self.0))
    }

    #[inline(always)]
    fn copy_sign(self, sign: Self) -> Self {
        Self(select(Self::splat(-0.0).0, sign.0, self.0))
    }

    #[inline(always)]
    fn least(self) -> f32 {
        // SAFETY: every x86-64 has SSE2.
        unsafe {
            let two = _mm_min_ps(self.0, _mm_movehl_ps(self.0, self.0));
            _mm_cvtss_f32(_mm_min_ss(two, _mm_shuffle_ps::<1>(two, two)))
        }
    }

    #[inline(always)]
    fn all_below(self, bound: f32) -> bool {
        self.mask_below(bound) == 0xf
    }

    #[inline(always)]
    fn window_places(places: Self) -> __m128i {
        places.truncated()
    }

    #[inline(always)]
    fn windows<const N: usize>(columns: KeyColumns<'_>, places: __m128i) -> [__m128i; N] {
        Self::windows_of(columns, places, Self::WINDOW)
    }

    #[inline(always)]
    fn wide_windows<const N: usize>(columns: KeyColumns<'_>, places: __m128i) -> [__m128i; N] {
        Self::windows_of(columns, places, Self::WIDE_WINDOW)
    }

    #[inline(always)]
    fn unit_with(
        rows: &KeyRows<'_>,
        UnitHalves { unit, wanted }: UnitHalves,
        mut put: impl FnMut(usize, usize, __m128i),
    ) {
        for part in 0..Self::PARTS {
            // SAFETY: every x86-64 has SSE2; rows hand out pointers into their table, whose units are aligned.
            unsafe {
                let mut pairs = [[_mm_setzero_si128(); 4]; 2];
                #[allow(
                    clippy::needless_range_loop,
                    reason = "the index is a lane of each half of a unit"
                )]
                for lane in 0..Self::COUNT {
                    let [own, next] = rows.pointers(part * Self::COUNT + lane, unit);
                    let (own, next) = (_mm_load_si128(own.cast()), _mm_load_si128(next.cast()));
                    pairs[0][lane] = _mm_unpacklo_epi16(own, next);
                    pairs[1][lane] = _mm_unpackhi_epi16(own, next);
                }
                for half in 0..2 {
                    if !wanted[half] {
                        continue;
                    }
                    let [a, b, c, d] = pairs[half];
                    let low = [_mm_unpacklo_epi32(a, b), _mm_unpacklo_epi32(c, d)];
                    let high = [_mm_unpackhi_epi32(a, b), _mm_unpackhi_epi32(c, d)];
                    let words = [
                        _mm_unpacklo_epi64(low[0], low[1]),
                        _mm_unpackhi_epi64(low[0], low[1]),
                        _mm_unpacklo_epi64(high[0], high[1]),
                        _mm_unpackhi_epi64(high[0], high[1]),
                    ];
                    for (key, words) in words.into_iter().enumerate() {
                        put(4 * half + key, part, words);
                    }
                }
            }
        }
    }

    /// The quarters of an [`F32x16`] are written one after the other, so that stores past the caches are combined.
    #[inline(never)]
    fn apart(work: impl Apart<Self>) {
        work.run();
    }

    #[inline(always)]
    fn transpose(from: [&F32x16; F32x16::LANES], lanes: PartWrite, to: &mut impl Sixteen) {
        let PartWrite { part, is_streamed } = lanes;
        let mut quarters = [[Self::splat(0.0); 4]; 4];
        for (quarter, from) in quarters.iter_mut().zip(from.chunks_exact(Self::COUNT)) {
            for (row, line) in quarter.iter_mut().zip(from) {
                *row = Self::load(line, part);
            }
            *quarter = transposed(*quarter);
        }
        for lane in 0..Self::COUNT {
            let line = to.line(part * Self::COUNT + lane);
            for (at, quarter) in quarters.iter().enumerate() {
                if is_streamed {
                    quarter[lane].stream(line, at);
                } else {
                    quarter[lane].store(line, at);
                }
            }
        }
    }
}

/// Transposes a block of 4 x 4: pairs, then fours.
#[inline(always)]
fn transposed([a, b, c, d]: [Sse2; 4]) -> [Sse2; 4] {
    // SAFETY: every x86-64 has SSE2.
    unsafe {
        let low = [_mm_unpacklo_ps(a.0, b.0), _mm_unpacklo_ps(c.0, d.0)];
        let high = [_mm_unpackhi_ps(a.0, b.0), _mm_unpackhi_ps(c.0, d.0)];
        [
            Sse2(_mm_movelh_ps(low[0], low[1])),
            Sse2(_mm_movehl_ps(low[1], low[0])),
            Sse2(_mm_movelh_ps(high[0], high[1])),
            Sse2(_mm_movehl_ps(high[1], high[0])),
        ]
    }
}
