//! `sabaki` without a subcommand: the demo.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use sabaki::avoid::{Query, QuerySettings};
use sabaki::demo::throw::{Throw, ThrowSettings, throw};
use sabaki::io;
use sabaki::region::BakedGraph;
use serde_json::json;

use super::culling::{self, CullPath, Culling, DeviceArgs};
use super::stats::{self, Run, Summary};
use super::{Done, Failure, dodge, output, sheet, source};

/// Balls that are thrown.
const ATTACKS: u64 = 100;
/// Of these, how many are listed one by one.
const LISTED: usize = 10;
const SEED: u64 = 1;
const FOLDER: &str = "out";

pub(crate) fn run(device: &DeviceArgs, as_json: bool) -> Result<Done, Failure> {
    // Before the work, so that it is not done in vain.
    let folder = Path::new(FOLDER);
    std::fs::create_dir_all(folder).map_err(|source| Failure::Write { path: folder.to_owned(), source })?;
    let mut device = culling::open(device);
    let baked = source::embedded(&mut device)?;
    let mut culling = Culling::new(device, baked.graph.atlas())?;
    let paths = match culling.best() {
        CullPath::Stencil => vec![CullPath::Stencil, CullPath::Cpu, CullPath::Exact],
        _ => vec![CullPath::Cpu, CullPath::Exact],
    };
    let throws = throws(&baked.graph)?;
    let bar = output::progress("dodging", ATTACKS * paths.len() as u64);
    let mut passes = Vec::new();
    for &path in &paths {
        let mut runs = Vec::new();
        for throw in &throws {
            runs.push(stats::answer(&baked.graph, &QuerySettings::default(), throw, (&mut culling, path))?);
            bar.inc(1);
        }
        passes.push((path, runs));
    }
    bar.finish_and_clear();
    let shown = closest_shave(&passes[0].1);
    let files = write_files(&baked.graph, &throws[shown], &passes[0].1[shown])?;
    let text = if as_json {
        let mut document = Summary::of(&passes[0].1).to_json(passes[0].0);
        document["rows"] = passes.iter().map(|(path, runs)| Summary::of(runs).to_json(*path)).collect();
        document["graph"] = source::statistics(&baked);
        document["files"] = json!(files);
        Done::json(&document)
    } else {
        let mut text = String::from("The embedded motions:\n");
        text.push_str(&source::describe(&baked));
        let _ = writeln!(text, "{}\n", culling.describe());
        let _ = writeln!(text, "{ATTACKS} balls are thrown, each would hit a character that does nothing. The first {LISTED}:");
        let first = &passes[0].1[..LISTED.min(passes[0].1.len())];
        let _ = writeln!(text, "{}", dodge::attack_table(&baked.graph, first));
        let _ = writeln!(text, "\nAll of them, by who culls (the answers are tested exactly in every case):");
        let _ = writeln!(text, "{}", dodge::summary_table(&passes));
        let _ = writeln!(text, "\nAttack {shown}, the closest shave by an evasion, is in {}", files.join(", "));
        text
    };
    Ok(Done::ok(text))
}

fn throws(baked: &BakedGraph) -> Result<Vec<Throw>, Failure> {
    let random = |index| {
        let thrown = throw(baked, &ThrowSettings::default(), SEED, index);
        thrown.map_err(|error| Failure::Attack { index: index as usize, error })
    };
    (0..ATTACKS).map(random).collect()
}

/// The clean answer by an evasion with the best score; the first attack where there is none.
fn closest_shave(runs: &[Run]) -> usize {
    let score = |run: &Run| {
        let chosen = &run.answer.candidates[run.answer.chosen];
        chosen.evasion.and(chosen.score).map(|score| score.total)
    };
    let scored = runs.iter().enumerate().filter_map(|(index, run)| Some((index, score(run)?)));
    scored.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(index, _)| index)
}

/// Writes the answer as BVH and JSON, and its maps as a picture. Returns their names.
fn write_files(baked: &BakedGraph, throw: &Throw, run: &Run) -> Result<Vec<String>, Failure> {
    let folder = Path::new(FOLDER);
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| Failure::Write { path, source }
    };
    let answer = (&run.answer, &throw.attack);
    let mut files = io::export::write_answer(folder, "dodge", baked, answer).map_err(failed(folder))?.to_vec();
    let settings = QuerySettings::default();
    let prepared = Query::new(baked, &settings).prepare(throw.playhead, &throw.attack);
    let input = prepared.cull_input();
    // Candidates with an evasion come first, in the order of the culling input.
    if let Some(candidate) = input.candidates.get(run.answer.chosen) {
        let path = folder.join("maps.png");
        let bytes = sheet::png(&input, candidate).map_err(|error| failed(&path)(std::io::Error::other(error)))?;
        io::write_whole(&path, |file| file.write_all(&bytes)).map_err(failed(&path))?;
        files.push(path);
    }
    Ok(files.iter().map(|path| path.display().to_string()).collect())
}
