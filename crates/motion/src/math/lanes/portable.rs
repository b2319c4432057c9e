//! Lanes in plain Rust, for every machine. The compiler vectorises them for the target that the program is built for.

use std::array::from_fn;
use std::ops::{Add, Div, Mul, Sub};

use super::{F32x16, KeyColumns, KeyRows, KeyUnit, Lanes, RowLines};

const COUNT: usize = 4;

#[derive(Clone, Copy)]
pub(super) struct Portable([f32; COUNT]);

impl Portable {
    #[inline(always)]
    fn with(mut self, other: Self, both: impl Fn(f32, f32) -> f32) -> Self {
        for lane in 0..COUNT {
            self.0[lane] = both(self.0[lane], other.0[lane]);
        }
        self
    }
}

macro_rules! operator {
    ($name:ident, $function:ident) => {
        impl $name for Portable {
            type Output = Self;

            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                self.with(other, |a, b| a.$function(b))
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

/// Fused if the target that the program is built for has an instruction for it, otherwise rounded twice.
#[inline(always)]
fn mul_add(a: f32, b: f32, c: f32) -> f32 {
    if cfg!(any(target_feature = "fma", target_arch = "aarch64")) {
        a.mul_add(b, c)
    } else {
        a * b + c
    }
}

/// The keys at each lane's place, and the next ones.
#[inline(always)]
fn pairs<const KEYS: usize>(keys: &[i16; KEYS], places: [u32; COUNT]) -> [u32; COUNT] {
    from_fn(
        #[inline(always)]
        |lane| {
            let place = places[lane] as usize % (KEYS - 1);
            word(keys[place], keys[place + 1])
        },
    )
}

#[inline(always)]
fn word(low: i16, high: i16) -> u32 {
    u32::from(high as u16) << 16 | u32::from(low as u16)
}

impl Lanes for Portable {
    type Words = [u32; COUNT];

    const COUNT: usize = COUNT;
    /// Keys are loaded one by one, so any place of a window can be read.
    const REACH: usize = KeyColumns::WINDOW - 1;
    const WIDE_REACH: usize = KeyColumns::WIDE_WINDOW - 1;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self([value; COUNT])
    }

    #[inline(always)]
    fn load(line: &F32x16, part: usize) -> Self {
        let mut lanes = [0.0; COUNT];
        lanes.copy_from_slice(&line.0[part * COUNT..(part + 1) * COUNT]);
        Self(lanes)
    }

    #[inline(always)]
    fn store(self, line: &mut F32x16, part: usize) {
        line.0[part * COUNT..(part + 1) * COUNT].copy_from_slice(&self.0);
    }

    /// A plain store: Rust has no portable store past the caches.
    #[inline(always)]
    fn stream(self, line: &mut F32x16, part: usize) {
        self.store(line, part);
    }

    #[inline(always)]
    fn fence() {}

    #[inline(always)]
    fn mul_add(self, factor: Self, sum: Self) -> Self {
        let mut out = sum;
        for lane in 0..COUNT {
            out.0[lane] = mul_add(self.0[lane], factor.0[lane], sum.0[lane]);
        }
        out
    }

    #[inline(always)]
    fn neg_mul_add(self, factor: Self, sum: Self) -> Self {
        Self(self.0.map(|value| -value)).mul_add(factor, sum)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }

    #[inline(always)]
    fn floor(self) -> Self {
        /// Numbers from here on have no fraction.
        const WHOLE: f32 = 8_388_608.0;
        // Without an instruction for it, the standard library's is a call for each lane.
        Self(self.0.map(|value| {
            let cut = value as i32 as f32;
            let floor = (cut - f32::from(u8::from(cut > value))).copysign(value);
            if value.abs() < WHOLE { floor } else { value }
        }))
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.with(other, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.with(other, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    fn copy_sign(self, sign: Self) -> Self {
        self.with(sign, f32::copysign)
    }

    #[inline(always)]
    fn first(self) -> f32 {
        self.0[0]
    }

    #[inline(always)]
    fn least(self) -> f32 {
        self.0.iter().fold(
            self.0[0],
            |least, &value| if value < least { value } else { least },
        )
    }

    #[inline(always)]
    fn mask_below(self, bound: f32) -> u32 {
        let lanes = self.0.iter().enumerate();
        lanes.fold(0, |mask, (lane, &value)| {
            mask | u32::from(value < bound) << lane
        })
    }

    #[inline(always)]
    fn splat_words(word: u32) -> [u32; COUNT] {
        [word; COUNT]
    }

    #[inline(always)]
    fn truncated(self) -> [u32; COUNT] {
        self.0.map(|value| value as i32 as u32)
    }

    #[inline(always)]
    fn load_words(line: &F32x16, part: usize) -> [u32; COUNT] {
        Self::load(line, part).0.map(f32::to_bits)
    }

    #[inline(always)]
    fn from_bits(words: [u32; COUNT]) -> Self {
        Self(words.map(f32::from_bits))
    }

    #[inline(always)]
    fn pair(low: [u32; COUNT], high: [u32; COUNT]) -> [u32; COUNT] {
        from_fn(|lane| high[lane] << 16 | low[lane])
    }

    #[inline(always)]
    fn window_places(places: Self) -> [u32; COUNT] {
        places.truncated()
    }

    #[inline(always)]
    fn window(keys: &[i16; KeyColumns::WINDOW], places: [u32; COUNT]) -> [u32; COUNT] {
        pairs(keys, places)
    }

    #[inline(always)]
    fn wide_window(keys: &[i16; KeyColumns::WIDE_WINDOW], places: [u32; COUNT]) -> [u32; COUNT] {
        pairs(keys, places)
    }

    #[inline(always)]
    fn unit_with(
        rows: &KeyRows<'_>,
        unit: usize,
        wanted: [bool; 2],
        mut put: impl FnMut(usize, usize, [u32; COUNT]),
    ) {
        for part in 0..Self::PARTS {
            let pairs: [[&KeyUnit; 2]; COUNT] =
                from_fn(|lane| rows.units(part * COUNT + lane, unit));
            for key in 0..KeyUnit::KEYS {
                if wanted[key / KeyUnit::QUAD] {
                    let words = from_fn(|lane| {
                        let [before, after] = pairs[lane];
                        word(before.0[key], after.0[key])
                    });
                    put(key, part, words);
                }
            }
        }
    }

    #[inline(always)]
    fn dot_pairs(a: [u32; COUNT], b: [u32; COUNT]) -> Self {
        let low = |word: u32| i32::from(word as i16);
        let high = |word: u32| (word as i32) >> 16;
        Self(from_fn(|lane| {
            let (a, b) = (a[lane], b[lane]);
            (low(a) * low(b)).wrapping_add(high(a) * high(b)) as f32
        }))
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
        // Blocks of four lanes and four numbers, which compilers exchange in registers.
        for (numbers, from) in from.chunks_exact(COUNT).enumerate() {
            let row = |index: usize| Self::load(from[index], part).0;
            let [a, b, c, d] = [row(0), row(1), row(2), row(3)];
            for lane in 0..COUNT {
                let own = Self([a[lane], b[lane], c[lane], d[lane]]);
                own.store(to.line(part * COUNT + lane, line), numbers);
            }
        }
    }
}
