//! `sabaki dodge`.

use std::fmt::Write;
use std::path::PathBuf;

use sabaki::maps::BakedGraph;
use sabaki::query::QuerySettings;
use sabaki_fixtures::throw::Throw;
use sabaki_import::export::MotionFormat;

use super::bake::{self, GraphArgs};
use super::culling::{self, Culling, DeviceArgs};
use super::export::{self, Export};
use super::numbers::whole;
use super::queries::{Method, MethodArgs, Pass, file_throw, file_throws, random_throws};
use super::{Done, Failure, cancel, explain, summary};

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    graph: GraphArgs,
    /// Number of random attacks: balls thrown at a part of the body, each of which would hit the
    /// continued motion.
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = whole::<u64>(1..=1_000_000))]
    attacks: u64,
    /// Seed of the random attacks. The same seed throws the same balls.
    #[arg(long, value_name = "S", default_value_t = 1, value_parser = whole::<u64>(0..=u64::MAX))]
    seed: u64,
    /// Attack file (JSON) instead of random attacks. The character stands in the graph's first pose.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["attacks", "seed"])]
    attack: Option<PathBuf>,
    #[command(flatten)]
    methods: MethodArgs,
    /// Threads that share the attacks where no device culls; 0: all of the machine.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u64>(0..=1024))]
    threads: u64,
    /// Also runs the exact search of the whole graph, and checks every hit against it.
    #[arg(long)]
    check: bool,
    /// Writes each answer as a motion and as JSON to this folder.
    #[arg(long, value_name = "DIR")]
    export: Option<PathBuf>,
    /// Format of the motions: BVH, or glTF with their events.
    #[arg(long, requires = "export", default_value = "bvh", value_parser = export::format_parser())]
    format: MotionFormat,
    /// Answers only the attack with this index, and explains the outcome of each candidate.
    #[arg(long, value_name = "INDEX", value_parser = whole::<u64>(0..=1_000_000_000), conflicts_with_all = ["attacks", "threads", "check"])]
    explain: Option<u64>,
    /// With --explain: lists all candidates.
    #[arg(long, requires = "explain")]
    all: bool,
    /// Repeats the query of an exported JSON and compares the answers. Exit code 1 if they differ.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["attacks", "seed", "attack", "cull", "grid", "threads", "check", "export", "explain", "device", "validation"])]
    replay: Option<PathBuf>,
    #[command(flatten)]
    device: DeviceArgs,
}

/// Largest number of attacks that are listed one by one.
const LISTED: usize = 20;

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    if let Some(folder) = &args.export {
        export::check(folder, args.explain.unwrap_or(0))?;
    }
    if let Some(path) = &args.replay {
        return export::replay(path, &args.graph.load()?, as_json);
    }
    cancel::listen();
    let baked = args.graph.load()?;
    let throws = args.throws(&baked)?;
    let folder = args.export.as_deref();
    let export = folder.map(|folder| Export::new(folder, args.format, &baked));
    let export = export.transpose()?;
    let mut culling = Culling::new(culling::open(&args.device)?, baked.atlas());
    let mut methods = args.methods.methods();
    if let Some(index) = args.explain {
        let explained = explain::ask(&baked, &throws[0], methods[0], &mut culling)?;
        if let Some(export) = &export {
            let (settings, answer) = (&explained.request.settings, explained.answer());
            let name = export::name(index);
            export.write(&name, &throws[0], settings, methods[0], answer)?;
        }
        let text = match as_json {
            true => Done::json(&explained.document(index)),
            false => explained.text(index, args.all),
        };
        let no = args.attack.is_some() && !explained.run.avoided;
        return Ok(Done::answer(text, !no));
    }
    if args.check && !methods.contains(&Method::EXACT) {
        methods.push(Method::EXACT);
    }
    let mut passes: Vec<Pass> = Vec::new();
    for method in methods {
        // The answers of the first method are exported.
        let export = export.as_ref().filter(|_| passes.is_empty());
        let settings = QuerySettings {
            list_late: export.is_some(),
            ..method.settings()
        };
        let threads = args.threads as usize;
        let pass = Pass::new(
            &baked,
            &throws,
            method,
            &settings,
            threads,
            &mut culling,
            |index, answer| match export {
                None => Ok(()),
                Some(export) => {
                    let name = export::name(index as u64);
                    let written = export.write(&name, &throws[index], &settings, method, answer);
                    written.map(drop)
                }
            },
        )?;
        passes.push(pass);
    }
    let no = args.attack.is_some() && passes[0].runs.iter().any(|run| !run.avoided);
    let text = match as_json {
        true => document(&baked, &passes),
        false => tables(&baked, &passes, &culling),
    };
    Ok(Done::answer(text, !no))
}

impl Args {
    /// The attacks; with --explain only the explained one.
    fn throws(&self, baked: &BakedGraph) -> Result<Vec<Throw>, Failure> {
        match (&self.attack, self.explain) {
            (None, None) => random_throws(baked, self.seed, 0..self.attacks),
            (None, Some(index)) => random_throws(baked, self.seed, index..index + 1),
            (Some(path), None) => file_throws(baked, path),
            (Some(path), Some(index)) => Ok(vec![file_throw(baked, path, index)?]),
        }
    }
}

fn document(baked: &BakedGraph, passes: &[Pass]) -> String {
    let results = passes.iter().flat_map(|pass| {
        let numbered = pass.runs.iter().enumerate();
        numbered.map(|(index, run)| run.to_json(baked, index, pass.method))
    });
    let mut document = summary::document(passes);
    document["results"] = results.collect();
    document["graph"] = bake::statistics(baked);
    Done::json(&document)
}

fn tables(baked: &BakedGraph, passes: &[Pass], culling: &Culling) -> String {
    let mut text = bake::headline(baked);
    text.push_str(&culling.describe(passes.iter().map(|pass| pass.method.cull)));
    text.push('\n');
    let first = &passes[0];
    if first.runs.len() <= LISTED {
        let _ = writeln!(
            text,
            "\nEach attack, culled by {}, grid {}:\n{}",
            first.method.cull.name(),
            first.method.grid_name(),
            summary::attack_table(baked, &first.runs)
        );
    }
    let _ = write!(text, "\n{}", summary::tables(passes));
    text
}
