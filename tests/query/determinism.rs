//! Promise: the same inputs give the same baked bytes and the same answers, on every run and for
//! any number of threads. (That every instruction set counts the same is held by `cull_cpu.rs`,
//! that it finds the same nearest sphere by the unit tests of `avoid::clearance`.)

use sabaki::archive::to_bytes;
use sabaki::graph::GraphSettings;
use sabaki::maps::{BakeSettings, Baker, PathSettings};
use sabaki::math::thread_count;
use sabaki::query::WarpSettings;
use sabaki::query::{Answer, EntryUse, Enumerate, Evaluation, Query, QuerySettings};
use sabaki_fixtures::answer::answer_throw;
use sabaki_fixtures::baked::{embedded, embedded_graph};
use sabaki_fixtures::throw::{ThrowSettings, throw};

#[test]
fn any_number_of_threads_bakes_the_same_bytes() {
    // The shared bake has a thread for each core.
    let threads = if thread_count(0) > 1 { 1 } else { 3 };
    let bytes = {
        let graph = embedded_graph(&GraphSettings {
            threads,
            ..GraphSettings::default()
        });
        let settings = BakeSettings {
            threads,
            paths: PathSettings {
                threads,
                ..PathSettings::default()
            },
            ..BakeSettings::default()
        };
        let baker = Baker::new(graph, settings).unwrap();
        to_bytes(&baker.finish_on_cpu().unwrap()).unwrap()
    };
    assert!(bytes == to_bytes(embedded()).unwrap());
}

/// Positions are rounded to texels, edges and paths are numbers: what is held here does not hang on the last bit of a sine.
#[test]
fn what_is_baked_is_that_of_the_last_version() {
    let (baked, mut digest) = (embedded(), Digest::default());
    for edge in baked.graph().edges() {
        digest.add(u64::from(edge.from.0) << 32 | u64::from(edge.to.0));
    }
    for region in baked.atlas().regions() {
        digest.add(region.first_slab.0 as u64);
        for slab in &region.slabs {
            let words = [slab.body.masks(), slab.outer.masks(), slab.evasion.words()];
            let words = words.into_iter().flatten();
            words.for_each(|&word| digest.add(u64::from(word)));
        }
    }
    // Changes whenever graphs or maps do: then it is written anew, and said why. Last: the default maps are eight
    // slices on slabs of 0.30 m.
    assert_eq!(format!("{:016x}", digest.0), "d4caa53cc97ee485");
}

fn answers(settings: &QuerySettings, evaluation: Evaluation) -> impl Iterator<Item = Answer> {
    let query = Query::new(embedded(), settings);
    (0..30).map(move |index| {
        let throw = throw(embedded(), &ThrowSettings::default(), 77, index).unwrap();
        answer_throw(&query, &throw, evaluation)
    })
}

#[test]
fn any_number_of_threads_gives_the_same_answers() {
    let mut hits = 0;
    // Without entries more answers are warped.
    let entries = [EntryUse::default(), EntryUse::none()];
    for (enumerate, entries) in [Enumerate::default(), Enumerate::Whole]
        .into_iter()
        .zip(entries)
    {
        let with = |threads| QuerySettings {
            enumerate,
            threads,
            entries,
            ..QuerySettings::default()
        };
        let (one, three) = (with(1), with(3));
        for evaluation in [Evaluation::Exhaustive, Evaluation::Lazy] {
            for (a, b) in answers(&one, evaluation).zip(answers(&three, evaluation)) {
                assert_eq!(a.candidates, b.candidates);
                let chosen = a.chosen();
                let is_hit = !a.avoided || chosen.warp.is_some() || chosen.entry.is_some();
                assert_eq!((a.chosen, a.motion), (b.chosen, b.motion));
                hits += usize::from(is_hit);
            }
        }
    }
    // Where nothing is clean threads have the most to do.
    assert!(hits > 8, "{hits}");
}

/// FNV-1a.
struct Digest(u64);

impl Default for Digest {
    fn default() -> Self {
        Self(0xCBF2_9CE4_8422_2325)
    }
}

impl Digest {
    fn add(&mut self, value: u64) {
        self.0 = (self.0 ^ value).wrapping_mul(0x100_0000_01B3);
    }
}

/// Over what was decided: no rounding of a library's sine changes it lightly.
fn digest(settings: &QuerySettings) -> u64 {
    let mut digest = Digest::default();
    let mut add = |value: u64| digest.add(value);
    for answer in answers(settings, Evaluation::Lazy) {
        add(u64::from(answer.avoided));
        add(answer.counts.candidates as u64);
        add(answer.counts.culled as u64);
        for edge in answer.path(embedded(), answer.chosen()) {
            add(u64::from(edge.0));
        }
    }
    digest.0
}

#[test]
fn the_answers_are_those_of_the_last_version() {
    let settings = QuerySettings {
        entries: EntryUse::none(),
        warp: WarpSettings::off(),
        ..QuerySettings::default()
    };
    assert_eq!(digest(&settings), digest(&settings));
    // Changes whenever queries or the thrown balls do: then it is written anew, and said why. Last: a body may always push as its
    // clips do.
    assert_eq!(format!("{:016x}", digest(&settings)), "773ae9c561f01c1b");
}
