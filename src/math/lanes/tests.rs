//! Every kind of lanes against the portable one, and that against plain arithmetic.

use super::*;

/// Some of everything, written over lanes: what it gives must be the same bits on all registers.
struct Everything<'a> {
    numbers: &'a [F32x16; 16],
    table: &'a [u32],
}

impl Kernel for Everything<'_> {
    type Out = Vec<F32x16>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<F32x16> {
        let mut out = Vec::new();
        let mut keep = |value: &dyn Fn(usize) -> L| {
            let mut stored = F32x16::ZERO;
            let mut streamed = F32x16::ZERO;
            for part in 0..L::PARTS {
                value(part).store(&mut stored, part);
                value(part).stream(&mut streamed, part);
            }
            L::fence();
            out.extend([stored, streamed]);
        };
        let a = |part| L::load(&self.numbers[0], part);
        let b = |part| L::load(&self.numbers[1], part);
        let words = |part| (a(part) * a(part) * L::splat(50.0)).truncated();
        let as_number = |words| L::dot_pairs(words, L::splat_words(1 << 16 | 3));
        keep(&|part| a(part) + b(part));
        keep(&|part| a(part) - b(part));
        keep(&|part| a(part) * b(part));
        keep(&|part| a(part) / b(part));
        keep(&|part| (a(part) * a(part)).sqrt());
        keep(&|part| a(part).floor());
        keep(&|part| a(part).max(b(part)));
        keep(&|part| b(part).max(L::splat(f32::NAN)).min(a(part)));
        keep(&|part| L::splat(f32::NAN).max(a(part)));
        keep(&|part| L::splat(f32::NAN).min(a(part)));
        keep(&|part| a(part).copy_sign(b(part)));
        keep(&|part| as_number(words(part)));
        keep(&|part| as_number(L::pair(words(part), L::splat_words(77))));
        // Below the fewest lanes that there are.
        let few = |part| (a(part) * a(part) * L::splat(0.25)).truncated();
        for window in 0..3 {
            let words = |part| L::windows::<3>(self.table, (5, 70), few(part))[window];
            keep(&|part| L::from_bits(words(part)));
        }
        keep(&|part| L::from_bits(L::load_words(&self.numbers[0], part)));
        let all_below = (0..L::PARTS).all(|part| a(part).all_below(4.0));
        let some_above = (0..L::PARTS).all(|part| a(part).all_below(3.0));
        keep(&|_| L::splat(f32::from(u8::from(all_below) + 2 * u8::from(some_above))));
        keep(&|_| L::splat(a(0).first()));
        for bound in [-1.0, 0.0, 2.5] {
            let mask = (0..L::PARTS).fold(0, |mask, part| {
                mask | a(part).mask_below(bound) << (part * L::COUNT)
            });
            keep(&|_| L::splat(mask as f32));
        }
        let least = (0..L::PARTS)
            .map(|part| a(part).least())
            .fold(f32::INFINITY, f32::min);
        keep(&|_| L::splat(least));
        out.extend(L::transpose(self.numbers.each_ref()));
        out
    }
}

fn numbers() -> [F32x16; 16] {
    std::array::from_fn(|row| {
        F32x16(std::array::from_fn(|lane| {
            ((row * 16 + lane) as f32 * 0.7).sin() * 3.7
        }))
    })
}

fn bits(lines: &[F32x16]) -> Vec<[u32; 16]> {
    lines.iter().map(|line| line.0.map(f32::to_bits)).collect()
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    // Small ones too, so that the numbers are not NaN.
    let table: Vec<u32> = (0..300)
        .map(|index| (index as f32 * 1.3).to_bits())
        .collect();
    let run = |isa: Isa| {
        isa.on_lanes(Everything {
            numbers: &numbers(),
            table: &table,
        })
    };
    let portable = run(Isa::Portable);
    for isa in Isa::available() {
        for (index, (found, expected)) in bits(&run(isa)).iter().zip(bits(&portable)).enumerate() {
            assert_eq!(*found, expected, "{isa:?}, line {index}");
        }
    }
}

#[test]
fn what_lanes_give_is_plain_arithmetic() {
    let (numbers, table) = (numbers(), [0u32; 161]);
    let out = Isa::Portable.on_lanes(Everything {
        numbers: &numbers,
        table: &table,
    });
    for lane in 0..16 {
        let (a, b) = (numbers[0].0[lane], numbers[1].0[lane]);
        let word = (a * a * 50.0) as u32;
        let expected = [
            a + b,
            a - b,
            a * b,
            a / b,
            (a * a).sqrt(),
            a.floor(),
            a.max(b),
            f32::NAN.min(a),
            a,
            a,
            a.copysign(b),
            (3 * (word & 0xffff)) as f32,
            (3 * word + 77) as f32,
        ];
        for (index, expected) in expected.into_iter().enumerate() {
            assert_eq!(out[2 * index].0[lane], expected, "number {index}");
            assert_eq!(
                out[2 * index + 1].0[lane],
                expected,
                "number {index}, streamed"
            );
        }
        for row in 0..16 {
            assert_eq!(out[out.len() - 16 + row].0[lane], numbers[lane].0[row]);
        }
    }
}

/// A product and a sum, fused and not.
struct Fused<'a>(&'a [F32x16; 3]);

impl Kernel for Fused<'_> {
    type Out = [F32x16; 2];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [F32x16; 2] {
        let mut out = [F32x16::ZERO; 2];
        for part in 0..L::PARTS {
            let [a, b, c] = self.0.each_ref().map(|line| L::load(line, part));
            a.mul_add(b, c).store(&mut out[0], part);
            a.neg_mul_add(b, c).store(&mut out[1], part);
        }
        out
    }
}

#[test]
fn products_are_fused_where_the_machine_can() {
    let [a, b, c, ..] = numbers();
    for isa in Isa::available().filter(|&isa| isa != Isa::Portable) {
        let out = isa.on_lanes(Fused(&[a, b, c]));
        for lane in 0..16 {
            let (a, b, c) = (a.0[lane], b.0[lane], c.0[lane]);
            assert_eq!(out[0].0[lane], a.mul_add(b, c), "{isa:?}");
            assert_eq!(out[1].0[lane], (-a).mul_add(b, c), "{isa:?}");
        }
    }
    let out = Isa::Portable.on_lanes(Fused(&[a, b, c]));
    for lane in 0..16 {
        let (a, b, c) = (a.0[lane], b.0[lane], c.0[lane]);
        assert!((out[0].0[lane] - (a * b + c)).abs() < 1e-5);
        assert!((out[1].0[lane] - (c - a * b)).abs() < 1e-5);
    }
}

/// The last of so many windows begins so late in a table of 100 words.
struct Late(usize);

impl Kernel for Late {
    type Out = usize;

    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        let (table, stride) = ([1; 100], self.0 / 2);
        let at = (self.0 - 2 * stride, stride);
        let found = L::windows::<3>(&table, at, L::splat_words(0));
        found.len() + 100 - L::REACH
    }
}

#[test]
fn windows_end_with_the_table() {
    for isa in Isa::available() {
        let reaches = |late| std::panic::catch_unwind(|| isa.on_lanes(Late(late))).ok();
        let last = reaches(10).unwrap() - 3;
        assert!(reaches(last).is_some(), "{isa:?}");
        for late in [last + 1, last + 2, 100, 101, usize::MAX] {
            assert!(reaches(late).is_none(), "{isa:?}, {late}");
        }
    }
}
