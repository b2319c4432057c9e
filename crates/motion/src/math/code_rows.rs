//! Reads rows of eight unsigned codes of one width, packed without gaps, and adds a base to each.
//!
//! Source: D. Lemire & L. Boytsov, "Decoding billions of integers per second through vectorization" (2015), binary
//! packing; T. Willhalm et al., "SIMD-Scan" (2009), the shuffle of bytes. Differs: eight codes of `w` bits fill exactly `w` bytes, so that every row begins at a byte.

use super::Isa;
use super::isa::on_isa;

pub(crate) const CODES: usize = 8;

/// Maximum width of a code, in bits.
pub(crate) const MOST_BITS: u8 = 16;

/// Number of bytes that reading a row touches, whatever its width.
pub(crate) const ROW_BYTES: usize = 16;

/// Input of reading a row: its bytes, and the eight little-endian `i16` that are added to its codes.
#[derive(Clone, Copy)]
pub(crate) struct CodeRow<'a> {
    pub(crate) bytes: &'a [u8; ROW_BYTES],
    pub(crate) bases: &'a [u8; 2 * CODES],
    /// Width of a code, in bits. Values above [`MOST_BITS`] count as [`MOST_BITS`].
    pub(crate) width: u8,
}

/// Reads rows. Only [`Isa::read_rows`] creates one, for an instruction set that the machine has.
pub(crate) trait RowReader: Copy {
    /// The sum of each code and its base.
    fn read(self, row: CodeRow<'_>) -> [f32; CODES];

    /// Eight vectors at unit length. They must not be 0.
    #[inline(always)]
    fn unit(self, vectors: &Vectors<CODES>) -> Vectors<CODES> {
        unit(vectors)
    }

    /// Linear interpolation of eight vectors, at unit length. Weight 0 gives `a`.
    #[inline(always)]
    fn unit_lerp(self, a: &Vectors<CODES>, b: &Vectors<CODES>, weight: f32) -> Vectors<CODES> {
        unit_lerp(a, b, weight)
    }
}

/// Rows of x, y, z and w of `N` vectors.
pub(crate) type Vectors<const N: usize> = [[f32; N]; 4];

/// The vectors at unit length. They must not be 0.
#[inline(always)]
pub(crate) fn unit<const N: usize>(vectors: &Vectors<N>) -> Vectors<N> {
    let [x, y, z, w] = vectors;
    let mut out = *vectors;
    for lane in 0..N {
        let dot = (x[lane] * x[lane] + y[lane] * y[lane]) + (z[lane] * z[lane] + w[lane] * w[lane]);
        let scale = 1.0 / dot.sqrt();
        for row in &mut out {
            row[lane] *= scale;
        }
    }
    out
}

/// Linear interpolation of vectors, at unit length. Weight 0 gives `a`. No result may be 0 before it is scaled.
#[inline(always)]
pub(crate) fn unit_lerp<const N: usize>(a: &Vectors<N>, b: &Vectors<N>, weight: f32) -> Vectors<N> {
    let mut out = *a;
    for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
        for lane in 0..N {
            out[lane] = a[lane] * (1.0 - weight) + b[lane] * weight;
        }
    }
    unit(&out)
}

/// A kernel that reads rows of codes.
pub(crate) trait RowKernel {
    /// Result of the kernel.
    type Out;

    /// Runs the kernel. Functions that it calls must be `#[inline(always)]`.
    fn run<R: RowReader>(self, reader: R) -> Self::Out;
}

impl Isa {
    /// Runs a kernel compiled for this instruction set, or for [`Isa::Portable`] if the machine does not have it.
    #[inline]
    pub(crate) fn read_rows<K: RowKernel>(self, kernel: K) -> K::Out {
        on_isa!(self, {
            Avx512 => kernel.run(ShuffledRows(())),
            Avx2 => kernel.run(ShuffledRows(())),
            Neon => kernel.run(NeonRows(())),
            Portable => kernel.run(PortableRows(())),
        })
    }
}

#[derive(Clone, Copy)]
struct PortableRows(());

impl RowReader for PortableRows {
    #[inline(always)]
    fn read(self, row: CodeRow<'_>) -> [f32; CODES] {
        let width = u32::from(row.width.min(MOST_BITS));
        let mask = (1u64 << width) - 1;
        // Four codes have at most 64 bits. The fifth begins in the middle of a byte if the width is odd.
        let low = word(row.bytes, 0);
        let high = word(row.bytes, width as usize / 2) >> (4 * (width % 2));
        let mut out = [0.0; CODES];
        for (lane, out) in out.iter_mut().enumerate() {
            let word = if lane < CODES / 2 { low } else { high };
            let code = word >> ((lane % (CODES / 2)) as u32 * width) & mask;
            let base = i16::from_le_bytes([row.bases[2 * lane], row.bases[2 * lane + 1]]);
            *out = (code as i32 + i32::from(base)) as f32;
        }
        out
    }
}

#[inline(always)]
fn word(bytes: &[u8; ROW_BYTES], at: usize) -> u64 {
    let mut word = [0; 8];
    word.copy_from_slice(&bytes[at..at + 8]);
    u64::from_le_bytes(word)
}

#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
struct ShuffledRows(());

#[cfg(target_arch = "x86_64")]
impl RowReader for ShuffledRows {
    #[inline(always)]
    fn read(self, row: CodeRow<'_>) -> [f32; CODES] {
        let plan = &PLANS[usize::from(row.width.min(MOST_BITS))];
        let mut out = [0.0; CODES];
        // SAFETY: one of these is made only where the machine has the features.
        unsafe { read_avx2(row, plan, &mut out) };
        out
    }

    #[inline(always)]
    fn unit(self, vectors: &Vectors<CODES>) -> Vectors<CODES> {
        let mut out = *vectors;
        // SAFETY: one of these is made only where the machine has the features.
        unsafe { unit_avx2(&mut out) };
        out
    }

    #[inline(always)]
    fn unit_lerp(self, a: &Vectors<CODES>, b: &Vectors<CODES>, weight: f32) -> Vectors<CODES> {
        let mut out = *a;
        // SAFETY: one of these is made only where the machine has the features.
        unsafe {
            lerp_avx2(&mut out, b, weight);
            unit_avx2(&mut out);
        }
        out
    }
}

/// Shuffle and shifts that move the codes of one width to their lanes.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
#[repr(C, align(32))]
struct Plan {
    /// For each lane, the bytes in which its code lies. Bytes beyond the row are 0.
    bytes: [u8; 4 * CODES],
    /// Index of the code's first bit in these bytes.
    shifts: [u32; CODES],
    masks: [u32; CODES],
}

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
static PLANS: [Plan; MOST_BITS as usize + 1] = {
    let mut plans = [const {
        Plan {
            bytes: [0x80; 4 * CODES],
            shifts: [0; CODES],
            masks: [0; CODES],
        }
    }; MOST_BITS as usize + 1];
    let mut width = 0;
    while width < plans.len() {
        let mut lane = 0;
        while lane < CODES {
            let bit = lane * width;
            let mut byte = 0;
            while byte < 4 {
                if bit / 8 + byte < ROW_BYTES {
                    plans[width].bytes[4 * lane + byte] = (bit / 8 + byte) as u8;
                }
                byte += 1;
            }
            plans[width].shifts[lane] = (bit % 8) as u32;
            plans[width].masks[lane] = (1 << width) - 1;
            lane += 1;
        }
        width += 1;
    }
    plans
};

/// # Safety
/// The machine must have the features that are named.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt")]
#[inline]
unsafe fn read_avx2(row: CodeRow<'_>, plan: &Plan, out: &mut [f32; CODES]) {
    use std::arch::x86_64::{
        _mm_loadu_si128, _mm256_add_epi32, _mm256_and_si256, _mm256_broadcastsi128_si256,
        _mm256_cvtepi16_epi32, _mm256_cvtepi32_ps, _mm256_loadu_si256, _mm256_shuffle_epi8,
        _mm256_srlv_epi32, _mm256_storeu_ps,
    };
    // SAFETY: arrays of 16 and 32 bytes are read and written. The shuffle takes bytes of the 16 alone.
    unsafe {
        let bytes = _mm256_broadcastsi128_si256(_mm_loadu_si128(row.bytes.as_ptr().cast()));
        let own = _mm256_shuffle_epi8(bytes, _mm256_loadu_si256(plan.bytes.as_ptr().cast()));
        let shifted = _mm256_srlv_epi32(own, _mm256_loadu_si256(plan.shifts.as_ptr().cast()));
        let codes = _mm256_and_si256(shifted, _mm256_loadu_si256(plan.masks.as_ptr().cast()));
        let bases = _mm256_cvtepi16_epi32(_mm_loadu_si128(row.bases.as_ptr().cast()));
        let sums = _mm256_cvtepi32_ps(_mm256_add_epi32(codes, bases));
        _mm256_storeu_ps(out.as_mut_ptr(), sums);
    }
}

/// [`unit`] with explicit registers: the compiler vectorises the generic function by four lanes only.
///
/// # Safety
/// The machine must have the features that are named.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt")]
#[inline]
unsafe fn unit_avx2(vectors: &mut Vectors<CODES>) {
    use std::arch::x86_64::{
        _mm256_add_ps, _mm256_div_ps, _mm256_loadu_ps, _mm256_mul_ps, _mm256_set1_ps,
        _mm256_sqrt_ps, _mm256_storeu_ps,
    };
    // SAFETY: rows of eight numbers are read and written.
    unsafe {
        let rows = [0, 1, 2, 3].map(|row: usize| _mm256_loadu_ps(vectors[row].as_ptr()));
        let [x, y, z, w] = rows.map(|row| _mm256_mul_ps(row, row));
        let dot = _mm256_add_ps(_mm256_add_ps(x, y), _mm256_add_ps(z, w));
        let scale = _mm256_div_ps(_mm256_set1_ps(1.0), _mm256_sqrt_ps(dot));
        for (out, row) in vectors.iter_mut().zip(rows) {
            _mm256_storeu_ps(out.as_mut_ptr(), _mm256_mul_ps(row, scale));
        }
    }
}

/// Interpolates towards `b`.
///
/// # Safety
/// The machine must have the features that are named.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt")]
#[inline]
unsafe fn lerp_avx2(a: &mut Vectors<CODES>, b: &Vectors<CODES>, weight: f32) {
    use std::arch::x86_64::{
        _mm256_add_ps, _mm256_loadu_ps, _mm256_mul_ps, _mm256_set1_ps, _mm256_storeu_ps,
    };
    // SAFETY: rows of eight numbers are read and written.
    unsafe {
        let [rest, weight] = [1.0 - weight, weight].map(|weight| _mm256_set1_ps(weight));
        for (a, b) in a.iter_mut().zip(b) {
            let here = _mm256_mul_ps(_mm256_loadu_ps(a.as_ptr()), rest);
            let there = _mm256_mul_ps(_mm256_loadu_ps(b.as_ptr()), weight);
            _mm256_storeu_ps(a.as_mut_ptr(), _mm256_add_ps(here, there));
        }
    }
}

#[cfg(target_arch = "aarch64")]
#[derive(Clone, Copy)]
struct NeonRows(());

#[cfg(target_arch = "aarch64")]
impl RowReader for NeonRows {
    #[inline(always)]
    fn read(self, row: CodeRow<'_>) -> [f32; CODES] {
        use std::arch::aarch64::{
            vaddw_s16, vandq_u32, vcvtq_f32_s32, vdupq_n_u32, vld1_s16, vld1q_s32, vld1q_u8,
            vnegq_s32, vqtbl1q_u8, vreinterpretq_s32_u32, vreinterpretq_u32_u8, vshlq_u32,
            vst1q_f32,
        };
        let plan = &PLANS[usize::from(row.width.min(MOST_BITS))];
        let mut out = [0.0; CODES];
        // SAFETY: every aarch64 has NEON; arrays of 16 bytes, and halves of eight numbers, are read and written. The table's
        // look-up gives 0 beyond its 16 bytes.
        unsafe {
            let bytes = vld1q_u8(row.bytes.as_ptr());
            for half in [0, CODES / 2] {
                let own = vqtbl1q_u8(bytes, vld1q_u8(plan.bytes.as_ptr().add(4 * half)));
                let shifts = vld1q_s32(plan.shifts.as_ptr().add(half).cast());
                let shifted = vshlq_u32(vreinterpretq_u32_u8(own), vnegq_s32(shifts));
                let codes = vandq_u32(shifted, vdupq_n_u32(plan.masks[0]));
                let bases = vld1_s16(row.bases.as_ptr().add(2 * half).cast());
                let sums = vaddw_s16(vreinterpretq_s32_u32(codes), bases);
                vst1q_f32(out.as_mut_ptr().add(half), vcvtq_f32_s32(sums));
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    struct Read<'a>(CodeRow<'a>);

    impl RowKernel for Read<'_> {
        type Out = [f32; CODES];

        fn run<R: RowReader>(self, reader: R) -> [f32; CODES] {
            reader.read(self.0)
        }
    }

    struct Between<'a>(&'a [Vectors<CODES>; 2], f32);

    impl RowKernel for Between<'_> {
        type Out = [Vectors<CODES>; 2];

        fn run<R: RowReader>(self, reader: R) -> [Vectors<CODES>; 2] {
            let Self([a, b], weight) = self;
            [reader.unit(a), reader.unit_lerp(a, b, weight)]
        }
    }

    proptest! {
        #[test]
        fn every_instruction_set_gives_the_same_bits(
            ends in prop::array::uniform2(prop::array::uniform4(prop::array::uniform8(-9e4f32..9e4))),
            weight in 0f32..=1.0,
        ) {
            let expected = [unit(&ends[0]), unit_lerp(&ends[0], &ends[1], weight)];
            for isa in Isa::available() {
                let found = isa.read_rows(Between(&ends, weight));
                prop_assert_eq!(found, expected, "{:?}", isa);
            }
        }

        #[test]
        fn every_instruction_set_reads_the_bits(
            bytes in prop::array::uniform16(0u8..),
            bases in prop::array::uniform8(i16::MIN..),
        ) {
            let mut base_bytes = [0; 2 * CODES];
            for (bytes, base) in base_bytes.chunks_exact_mut(2).zip(bases) {
                bytes.copy_from_slice(&base.to_le_bytes());
            }
            for width in 0..=MOST_BITS {
                let row = CodeRow { bytes: &bytes, bases: &base_bytes, width };
                let expected: [f32; CODES] = std::array::from_fn(|lane| {
                    let bits = (0..usize::from(width)).map(|bit| {
                        let at = lane * usize::from(width) + bit;
                        i32::from(bytes[at / 8] >> (at % 8) & 1) << bit
                    });
                    (bits.sum::<i32>() + i32::from(bases[lane])) as f32
                });
                for isa in Isa::available() {
                    prop_assert_eq!(isa.read_rows(Read(row)), expected, "{:?}, {} bits", isa, width);
                }
            }
        }
    }
}
