//! Promise: the same inputs give the same baked bytes and the same answers, on every run and for
//! any number of threads. (That every instruction set counts the same is held by `cull_cpu.rs`,
//! that it finds the same nearest sphere by the unit tests of `avoid::clearance`.)

use sabaki::archive::to_bytes;
use sabaki::graph::{Edge, GraphSettings};
use sabaki::maps::BakeSettings;
use sabaki::math::thread_count;
use sabaki::query::{Answer, EntryUse, Enumerate, Evaluation, Query, QuerySettings};
use sabaki_fixtures::answer::answer_throw;
use sabaki_fixtures::baked::{bake, embedded, embedded_graph};
use sabaki_fixtures::throw::throws;
use sabaki_fixtures::with;

use super::of_edges;

#[test]
fn any_number_of_threads_bakes_the_same_bytes() {
    // The shared bake has a thread for each core.
    let threads = if thread_count(0) > 1 { 1 } else { 3 };
    let graph = embedded_graph(&with(|s: &mut GraphSettings| s.threads = threads));
    let mut settings = BakeSettings::default();
    (settings.threads, settings.paths.threads) = (threads, threads);
    let bytes = to_bytes(&bake(graph, settings)).unwrap();
    assert!(bytes == to_bytes(embedded()).unwrap());
}

/// Positions are rounded to texels, edges and paths are numbers: what is held here does not hang on the last bit of a sine.
#[test]
fn what_is_baked_is_that_of_the_last_version() {
    let (graph, atlas) = (embedded().graph(), embedded().atlas());
    let ends = |edge: &Edge| u64::from(edge.from.0) << 32 | u64::from(edge.to.0);
    let mut values: Vec<u64> = graph.edges().iter().map(ends).collect();
    for region in atlas.regions() {
        values.push(region.first_slab.0 as u64);
        for slab in &region.slabs {
            let words = [slab.body.masks(), slab.outer.masks(), slab.evasion.words()];
            values.extend(words.concat().into_iter().map(u64::from));
        }
    }
    // Changes whenever graphs or maps do: then it is written anew, and said why. Last: the default maps are eight
    // slices on slabs of 0.30 m.
    assert_eq!(digest(values), "ca6d3b73983dbec2");
}

fn answers(settings: &QuerySettings, evaluation: Evaluation) -> impl Iterator<Item = Answer> {
    let query = Query::new(embedded(), settings);
    throws(embedded(), 77, 30).map(move |throw| answer_throw(&query, &throw, evaluation))
}

#[test]
fn any_number_of_threads_gives_the_same_answers() {
    let mut hits = 0;
    // Without entries more answers are warped.
    let entries = [EntryUse::default(), EntryUse::none()];
    let enumerates = [Enumerate::default(), Enumerate::Whole];
    for (enumerate, entries) in enumerates.into_iter().zip(entries) {
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
fn digest(values: impl IntoIterator<Item = u64>) -> String {
    let add = |hash: u64, value: u64| (hash ^ value).wrapping_mul(0x100_0000_01B3);
    let hash = values.into_iter().fold(0xCBF2_9CE4_8422_2325, add);
    format!("{hash:016x}")
}

#[test]
fn the_answers_are_those_of_the_last_version() {
    let settings = of_edges();
    // Over what was decided: no rounding of a library's sine changes it lightly.
    let decided = |answer: Answer| {
        let path = answer.path(embedded(), answer.chosen());
        let counts = [answer.counts.candidates, answer.counts.culled];
        let mut values: Vec<u64> = vec![u64::from(answer.avoided)];
        values.extend(counts.map(|count| count as u64));
        values.extend(path.map(|edge| u64::from(edge.0)));
        values
    };
    let digests = [(); 2].map(|()| digest(answers(&settings, Evaluation::Lazy).flat_map(decided)));
    assert_eq!(digests[0], digests[1]);
    // Changes whenever queries or the thrown balls do: then it is written anew, and said why. Last: a body may always push as its
    // clips do.
    assert_eq!(digests[0], "1812bf802483fe74");
}
