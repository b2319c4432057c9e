//! `sabaki dodge`.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use sabaki::avoid::{Attack, QueryContext, QuerySettings};
use sabaki::demo::throw::{Throw, ThrowSettings, throw};
use sabaki::graph::{EdgeId, Playhead};
use sabaki::io;
use sabaki::math::Rigid2;
use sabaki::region::BakedGraph;
use serde_json::json;

use super::culling::{self, CullPath, Culling, DeviceArgs};
use super::source::{self, Baked, ClipArgs};
use super::stats::{self, Run, Summary};
use super::{Done, Failure, output};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// A graph that `bake` wrote; otherwise --clips, otherwise the embedded motions.
    baked: Option<PathBuf>,
    #[command(flatten)]
    clips: ClipArgs,
    /// How many random attacks: balls thrown at a part of the body, which would hit a character
    /// that does nothing.
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    attacks: u64,
    /// Where the random attacks begin; the same seed throws the same balls.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Attacks from a file (JSON) instead; the character stands at the graph's first posture.
    #[arg(long, value_name = "FILE")]
    attack: Option<PathBuf>,
    /// Who culls; several are run one after the other on the same attacks. Default: stencil where
    /// there is a Vulkan device, else cpu.
    #[arg(long, value_enum, value_delimiter = ',')]
    cull: Vec<CullPath>,
    /// Whether candidates come from per-node grids; this version has none.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "off")]
    grid: Vec<Grid>,
    /// Write each answer as BVH and JSON into this folder.
    #[arg(long, value_name = "DIR")]
    export: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Grid {
    Off,
}

/// Attacks in a table one by one up to this many.
const LISTED: usize = 20;

pub(crate) fn run(args: &Args, device: &DeviceArgs, as_json: bool) -> Result<Done, Failure> {
    let baked = load(args)?;
    let throws = throws(args, &baked.graph)?;
    if let Some(folder) = &args.export {
        std::fs::create_dir_all(folder).map_err(|source| Failure::Write {
            path: folder.clone(),
            source,
        })?;
    }
    let mut culling = Culling::new(culling::open(device), baked.graph.atlas());
    let paths = if args.cull.is_empty() {
        vec![culling.best()]
    } else {
        args.cull.clone()
    };
    let mut passes = Vec::new();
    for &path in &paths {
        // The first path's answers are the ones that are exported.
        let export = args.export.as_deref().filter(|_| passes.is_empty());
        passes.push((
            path,
            pass(&baked.graph, &throws, (&mut culling, path), export)?,
        ));
    }
    let no = args.attack.is_some() && passes[0].1.iter().any(|run| !run.answer.avoided);
    let text = if as_json {
        document(&baked, &passes)
    } else {
        tables(&baked, &passes, &culling)
    };
    Ok(Done { text, no })
}

fn load(args: &Args) -> Result<Baked, Failure> {
    match (&args.baked, args.clips.clips.is_empty()) {
        (_, true) if args.clips.events.is_some() => {
            Err(Failure::Usage("--events needs --clips".to_owned()))
        }
        (Some(_), false) => Err(Failure::Usage(
            "either a baked graph or --clips, not both".to_owned(),
        )),
        (Some(path), true) => source::from_file(path),
        (None, false) => source::from_clips(&args.clips),
        (None, true) => source::embedded(),
    }
}

fn throws(args: &Args, baked: &BakedGraph) -> Result<Vec<Throw>, Failure> {
    let Some(path) = &args.attack else {
        let settings = ThrowSettings::default();
        let random = |index| throw(baked, &settings, args.seed, index);
        let numbered = (0..args.attacks).map(|index| {
            random(index).map_err(|error| Failure::Attack {
                index: index as usize,
                error,
            })
        });
        return numbered.collect();
    };
    let playhead = Playhead::at(baked.graph(), EdgeId(0), 0.0, Rigid2::IDENTITY);
    let file = io::AttackFile::read(path)?;
    let attacks = file.attacks.into_iter().enumerate().map(|(index, entry)| {
        let attack = Attack::new(entry.spheres)
            .map_err(|error| Failure::Attack { index, error }.within(path))?;
        Ok(Throw { playhead, attack })
    });
    attacks.collect()
}

/// Answers all attacks with one culling path.
fn pass(
    baked: &BakedGraph,
    throws: &[Throw],
    (culling, path): (&mut Culling, CullPath),
    export: Option<&Path>,
) -> Result<Vec<Run>, Failure> {
    let settings = QuerySettings::default();
    let bar = output::progress(path.name(), throws.len() as u64);
    let mut runs = Vec::with_capacity(throws.len());
    let mut context = QueryContext::default();
    for (index, throw) in throws.iter().enumerate() {
        let run = stats::answer(baked, &settings, throw, (culling, path), &mut context)?;
        if let Some(folder) = export {
            let name = format!("attack_{index:04}");
            io::export::write_answer(folder, &name, baked, (&run.answer, &throw.attack)).map_err(
                |source| Failure::Write {
                    path: folder.join(name),
                    source,
                },
            )?;
        }
        runs.push(run);
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(runs)
}

fn document(baked: &Baked, passes: &[(CullPath, Vec<Run>)]) -> String {
    let (first, runs) = &passes[0];
    let mut document = Summary::of(runs).to_json(*first);
    let of_pass = |(path, runs): &(CullPath, Vec<Run>)| {
        runs.iter()
            .enumerate()
            .map(|(index, run)| run.to_json(&baked.graph, index, *path))
            .collect::<Vec<_>>()
    };
    document["rows"] = passes
        .iter()
        .map(|(path, runs)| Summary::of(runs).to_json(*path))
        .collect();
    document["results"] = passes.iter().flat_map(of_pass).collect();
    document["graph"] = source::statistics(baked);
    Done::json(&json!(document))
}

fn tables(baked: &Baked, passes: &[(CullPath, Vec<Run>)], culling: &Culling) -> String {
    let mut text = source::describe(baked);
    text.push_str(&culling.describe());
    text.push('\n');
    let (path, runs) = &passes[0];
    if runs.len() <= LISTED {
        let _ = writeln!(
            text,
            "\nEach attack, culled by {}:\n{}",
            path.name(),
            attack_table(&baked.graph, runs)
        );
    }
    let _ = writeln!(text, "\n{}", summary_table(passes));
    text
}

pub(super) fn attack_table(baked: &BakedGraph, runs: &[Run]) -> comfy_table::Table {
    let head = [
        "attack",
        "answer",
        "by",
        "rate p",
        "clearance cm",
        "candidates",
        "culled",
        "query ms",
    ];
    let mut table = output::table(&head, 3);
    for (index, run) in runs.iter().enumerate() {
        let counts = run.answer.counts;
        table.add_row(vec![
            index.to_string(),
            if run.answer.avoided { "avoided" } else { "HIT" }.to_owned(),
            run.evasion(baked).unwrap_or_else(|| "moving on".to_owned()),
            format!("{:.2}", run.rate()),
            format!("{:.1}", run.answer.clearance().metres * 100.0),
            counts.candidates.to_string(),
            counts.culled.to_string(),
            format!("{:.2}", run.query_ms()),
        ]);
    }
    table
}

pub(super) fn summary_table(passes: &[(CullPath, Vec<Run>)]) -> comfy_table::Table {
    let head = [
        "culled by",
        "attacks",
        "avoided",
        "by an evasion",
        "candidates, with evasion",
        "of these culled",
        "clearance cm, median",
        "query ms, median / p99",
        "culling ms, median / p99",
    ];
    let mut table = output::table(&head, 1);
    for (path, runs) in passes {
        let s = Summary::of(runs);
        let percent =
            |part: usize| format!("{:.1}%", 100.0 * part as f64 / s.attacks.max(1) as f64);
        table.add_row(vec![
            path.name().to_owned(),
            s.attacks.to_string(),
            percent(s.avoided),
            percent(s.evading),
            format!("{:.0}, {:.0}", s.candidates, s.with_evasion),
            format!("{:.0}%", 100.0 * s.culled_share),
            s.median_clearance
                .map_or("-".to_owned(), |metres| format!("{:.1}", 100.0 * metres)),
            format!("{:.2} / {:.2}", s.query_ms[0], s.query_ms[1]),
            format!("{:.3} / {:.3}", s.cull_ms[0], s.cull_ms[1]),
        ]);
    }
    table
}
