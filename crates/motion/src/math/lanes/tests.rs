//! Compares every kind of lanes with the portable one, and that one with plain arithmetic.

use super::*;

/// Uses every operation of [`Lanes`]. The results must have the same bits for all registers.
struct Everything<'a> {
    numbers: &'a [F32x16; 16],
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
        for is_streamed in [false, true] {
            // Every second line.
            let (mut lines, mut rows) = ([F32x16::ZERO; 32], DistinctRows::default());
            rows.reset(F32x16::LANES);
            (0..F32x16::LANES).for_each(|row| rows.put(row, row as u32));
            for part in 0..L::PARTS {
                let (mut set, mut spare) = (RowSet::new(&mut lines, 2, &rows), [F32x16::ZERO; 2]);
                let to = &mut set.sixteen(0, &mut spare);
                L::transpose(self.numbers.each_ref(), part, to, 1, is_streamed);
            }
            L::fence();
            out.extend(lines);
        }
        out
    }
}

/// Reads units of sixteen rows.
struct Units<'a> {
    rows: KeyRows<'a>,
    unit: usize,
    wanted: [bool; 2],
}

impl Kernel for Units<'_> {
    /// Words of each key; -1 for those that were not handed out.
    type Out = [[u32; 16]; KeyUnit::KEYS];

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Out {
        let mut out = [F32x16([f32::from_bits(u32::MAX); 16]); KeyUnit::KEYS];
        L::unit_with(&self.rows, self.unit, self.wanted, |key, part, words| {
            L::from_bits(words).store(&mut out[key], part);
        });
        out.map(|line| line.0.map(f32::to_bits))
    }
}

#[test]
fn units_are_read_from_each_row_and_the_one_after_it() {
    let (length, count) = (5, 9);
    let table: Vec<KeyUnit> = (0..length * count)
        .map(|unit| KeyUnit(std::array::from_fn(|key| (unit * 1234 + key * 77) as i16)))
        .collect();
    let starts = std::array::from_fn(|lane| (lane * 3 % (count - 1) * length) as u32);
    for unit in 0..length {
        for wanted in [[true, true], [true, false], [false, true]] {
            for isa in Isa::available() {
                let rows = KeyRows::new(&table, starts, length);
                let found = isa.on_lanes(Units { rows, unit, wanted });
                for (key, line) in found.iter().enumerate() {
                    for (lane, &found) in line.iter().enumerate() {
                        let own = starts[lane] as usize + unit;
                        let [low, high] = [own, own + length].map(|unit| table[unit].0[key]);
                        let word = u32::from(high as u16) << 16 | u32::from(low as u16);
                        let expected = if wanted[key / 4] { word } else { u32::MAX };
                        assert_eq!(found, expected, "{isa:?}, key {key}, lane {lane}");
                    }
                }
            }
        }
    }
}

#[test]
fn rows_end_with_the_table() {
    let table = [KeyUnit::default(); 30];
    let rows = |start: u32, length| {
        let starts = std::array::from_fn(|lane| if lane == 7 { start } else { 0 });
        std::panic::catch_unwind(|| KeyRows::new(&table, starts, length)).is_ok()
    };
    assert!(rows(20, 5) && rows(0, 15) && rows(30, 0));
    assert!(!rows(21, 5) && !rows(0, 16) && !rows(u32::MAX, 1));
    for isa in Isa::available() {
        let beyond = std::panic::catch_unwind(|| {
            let rows = KeyRows::new(&table, [0; 16], 5);
            let (unit, wanted) = (5, [true; 2]);
            isa.on_lanes(Units { rows, unit, wanted })
        });
        assert!(beyond.is_err(), "{isa:?}");
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
    let numbers = &numbers();
    let run = |isa: Isa| isa.on_lanes(Everything { numbers });
    let portable = run(Isa::Portable);
    for isa in Isa::available() {
        for (index, (found, expected)) in bits(&run(isa)).iter().zip(bits(&portable)).enumerate() {
            assert_eq!(*found, expected, "{isa:?}, line {index}");
        }
    }
}

#[test]
fn what_lanes_give_is_plain_arithmetic() {
    let numbers = &numbers();
    let out = Isa::Portable.on_lanes(Everything { numbers });
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
        // Twice, stored and streamed: each row between lines that are not written.
        for transposed in out[out.len() - 64..].chunks_exact(32) {
            for row in 0..16 {
                assert_eq!(transposed[2 * row].0[lane], 0.0);
                assert_eq!(transposed[2 * row + 1].0[lane], numbers[lane].0[row]);
            }
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

/// Reads windows whose last one begins at `start` in a table of 100 keys.
struct Late {
    first: usize,
    is_wide: bool,
}

impl Kernel for Late {
    type Out = usize;

    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        let stride = self.first / 2;
        let first = self.first - 2 * stride;
        let [at, next] = [first, 0].map(|first| KeyPlace { first, stride });
        let table = &[1; 100];
        let columns = KeyColumns { table, at, next };
        let words = L::splat_words(0);
        if self.is_wide {
            let found = L::windows::<true, 3>(columns, words);
            return found.len() + 100 - KeyColumns::WIDE_WINDOW;
        }
        let found = L::windows::<false, 3>(columns, words);
        found.len() + 100 - KeyColumns::WINDOW
    }
}

#[test]
fn windows_end_with_the_table() {
    for isa in Isa::available() {
        for is_wide in [false, true] {
            let reaches =
                |first| std::panic::catch_unwind(|| isa.on_lanes(Late { first, is_wide })).ok();
            let last = reaches(10).unwrap() - 3;
            assert!(reaches(last).is_some(), "{isa:?}");
            for late in [last + 1, last + 2, 100, 101, usize::MAX] {
                assert!(reaches(late).is_none(), "{isa:?}, {late}");
            }
        }
    }
}

/// Reads windows at places that differ by lane.
struct Places<'a, const WIDE: bool> {
    table: &'a [i16],
    places: F32x16,
}

impl<const WIDE: bool> Kernel for Places<'_, WIDE> {
    /// The reach, and the words of four windows.
    type Out = (usize, [[u32; 16]; 4]);

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Out {
        let (first, stride) = (3, 101);
        let at = KeyPlace { first, stride };
        let (table, next) = (self.table, at);
        let columns = KeyColumns { table, at, next };
        let reach = if WIDE { L::WIDE_REACH } else { L::REACH };
        let mut out = [F32x16::ZERO; 4];
        for part in 0..L::PARTS {
            let places = L::load(&self.places, part).min(L::splat(reach as f32 - 1.0));
            let words = L::windows::<WIDE, 4>(columns, L::window_places(places));
            for (line, words) in out.iter_mut().zip(words) {
                L::from_bits(words).store(line, part);
            }
        }
        (reach, out.map(|line| line.0.map(f32::to_bits)))
    }
}

fn check_places<const WIDE: bool>() {
    let table: Vec<i16> = (0..500).map(|index| (index * 1237) as i16).collect();
    for isa in Isa::available() {
        for turn in 0..64 {
            let places = F32x16(std::array::from_fn(|lane| ((turn + 5 * lane) % 63) as f32));
            let table = &table[..];
            let (reach, found) = isa.on_lanes(Places::<WIDE> { table, places });
            for (window, line) in found.iter().enumerate() {
                for (lane, &word) in line.iter().enumerate() {
                    let place = (places.0[lane] as usize).min(reach - 1);
                    let at = 3 + 101 * window + place;
                    let [low, high] = [table[at], table[at + 1]].map(|key| u32::from(key as u16));
                    let expected = high << 16 | low;
                    assert_eq!(word, expected, "{isa:?}, lane {lane}, place {place}");
                }
            }
        }
    }
}

#[test]
fn windows_have_all_places() {
    check_places::<false>();
    check_places::<true>();
}
