//! `sabaki dodge`.

use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Mutex;

use crate::measure::quality::{Quality, QualityMeter, SEEN_ON};
use sabaki::graph::{EdgeId, Playhead};
use sabaki::maps::BakedGraph;
use sabaki::math::Rigid2;
use sabaki::query::{Answer, Attack, QuerySettings};
use sabaki_fixtures::throw::{Throw, ThrowSettings, throw};
use sabaki_import::export::MotionFormat;
use serde_json::Value;

use super::answer_files::{AnswerFolder, ThrowQuery, graph_name};
use super::culling::{self, Culling, DeviceArgs};
use super::numbers::whole;
use super::passes::{Attacks, Method, MethodArgs, Pass, PassSettings};
use super::source::{self, Baked, GraphArgs};
use super::summary::{self, Summary};
use super::{Done, Failure, answer_folder, cancel, explain, output, quality, replay};

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    graph: GraphArgs,
    /// Number of random attacks: balls thrown at a part of the body, each of which would hit the
    /// continued motion [default: 20].
    #[arg(long, value_name = "N", value_parser = whole::<u64>(1..=1_000_000))]
    attacks: Option<u64>,
    /// Seed of the random attacks; the same seed throws the same balls.
    #[arg(long, value_name = "S", default_value_t = 1, value_parser = whole::<u64>(0..=u64::MAX))]
    seed: u64,
    /// Attack file (JSON) instead of random attacks; the character stands in the graph's first pose.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["attacks", "seed"])]
    attack: Option<PathBuf>,
    #[command(flatten)]
    methods: MethodArgs,
    /// Threads that share the attacks where no device culls; 0 for all of the machine [default: 1]. Each time is
    /// that of one query in its thread.
    #[arg(long, value_name = "N", value_parser = whole::<u64>(0..=1024))]
    threads: Option<u64>,
    /// Runs the exact whole search as well and checks every hit against it.
    #[arg(long)]
    check: bool,
    /// Measures how human the answers' transitions, entries and warps are, beside the clips.
    #[arg(long, conflicts_with = "explain")]
    quality: bool,
    /// Writes each answer as a motion and as JSON to this folder. A folder that holds the answers of an earlier run is refused.
    #[arg(long, value_name = "DIR")]
    export: Option<PathBuf>,
    /// With --export: removes the answers of an earlier run first.
    #[arg(long, requires = "export", conflicts_with = "explain")]
    force: bool,
    /// Format of the motions: BVH, or glTF with their events.
    #[arg(long, value_enum, requires = "export", default_value = "bvh")]
    format: FormatArg,
    /// Answers only the attack with this index and explains the outcome of each candidate.
    #[arg(long, value_name = "INDEX", value_parser = whole::<u64>(0..=1_000_000_000), conflicts_with_all = ["threads", "check"])]
    explain: Option<u64>,
    /// Lists all candidates with --explain.
    #[arg(long, requires = "explain")]
    all: bool,
    /// Repeats the query of an exported JSON and compares the answers: exit code 1 if they differ.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["attacks", "seed", "attack", "cull", "grid", "lookup", "threads", "check", "export", "explain"])]
    replay: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum FormatArg {
    Bvh,
    Glb,
}

impl FormatArg {
    fn format(self) -> MotionFormat {
        match self {
            Self::Bvh => MotionFormat::Bvh,
            Self::Glb => MotionFormat::Glb,
        }
    }
}

/// Number of random attacks where none is given.
const ATTACKS: u64 = 20;
/// Largest number of attacks that are listed one by one.
const LISTED: usize = 20;

pub(crate) fn run(args: &Args, device: &DeviceArgs, as_json: bool) -> Result<Done, Failure> {
    args.check()?;
    let earlier = match (&args.export, args.explain) {
        // One more answer goes beside those that are there.
        (Some(folder), None) => answer_folder::earlier(folder, args.force)?,
        _ => Vec::new(),
    };
    if let Some(path) = &args.replay {
        device.check_unused("dodge --replay")?;
        return replay::run(path, &args.graph.load()?.graph, as_json);
    }
    cancel::listen();
    let device = culling::open(device)?;
    let baked = args.graph.load()?;
    let throws = throws(args, &baked.graph)?;
    if let Some(folder) = &args.export {
        answer_folder::make(folder, &earlier)?;
    }
    let mut culling = Culling::new(device, baked.graph.atlas());
    let mut methods = args.methods.methods(&culling);
    if let Some(index) = args.explain {
        let case = explain::Case {
            baked: &baked.graph,
            throw: &throws[0],
            index,
            method: methods[0],
            all: args.all,
            export: args.export.as_deref().map(|path| AnswerFolder {
                path,
                format: args.format.format(),
                baked: &baked.graph,
            }),
        };
        let done = explain::run(&case, &mut culling, as_json)?;
        let no = done.no && args.attack.is_some();
        return Ok(Done { no, ..done });
    }
    if args.check && !methods.contains(&Method::EXACT) {
        methods.push(Method::EXACT);
    }
    let meter = args.quality.then(|| QualityMeter::new(&baked.graph));
    let composed = Mutex::new(Quality::default());
    let measure = |answer: &Answer, throw: &Throw| {
        if let (Some(meter), Ok(mut composed)) = (&meter, composed.lock()) {
            meter.add_answer(answer, throw.attack.end() + SEEN_ON, &mut composed);
        }
    };
    let all = AllPasses {
        args,
        attacks: Attacks {
            baked: &baked.graph,
            throws: &throws,
        },
        methods: &methods,
    };
    let passes = all.run(&mut culling, measure)?;
    let composed = composed.into_inner().unwrap_or_default();
    let measured = meter.map(|meter| (meter.clips(), composed));
    let no = args.attack.is_some() && passes[0].runs.iter().any(|run| !run.avoided);
    let text = match (as_json, &measured) {
        (true, _) => document(&baked, &passes, measured.as_ref()),
        (false, None) => tables(&baked, &passes, &culling),
        (false, Some((clips, composed))) => {
            let table = quality::text(clips, composed, "answers");
            format!("{}\n{table}", tables(&baked, &passes, &culling))
        }
    };
    Ok(Done::answer(text, !no))
}

impl Args {
    /// What can be refused before any work is done.
    fn check(&self) -> Result<(), Failure> {
        if self.threads.is_some() && self.methods.all_need_device() {
            let what = "--threads needs a path of --cull that uses no device: exact or cpu";
            return Err(Failure::Usage(what.to_owned()));
        }
        if let Some(folder) = &self.export {
            output::check_can_be_folder(&format!("--export {}", folder.display()), folder)?;
            let inputs = self.graph.files();
            answer_folder::check_holds_no_input(folder, self.attack.as_deref(), &inputs)?;
        }
        match (self.explain, self.attacks) {
            (Some(index), Some(count)) if self.attack.is_none() && index >= count => {
                Err(Failure::Usage(format!(
                    "--explain {index}: there is no such attack; --attacks {count} throws 0 to {}",
                    count - 1
                )))
            }
            _ => Ok(()),
        }
    }
}

/// All attacks and the methods that answer them.
struct AllPasses<'a> {
    args: &'a Args,
    attacks: Attacks<'a>,
    methods: &'a [Method],
}

impl AllPasses<'_> {
    /// Answers all attacks by each method. The answers of the first method are measured and exported.
    fn run(
        &self,
        culling: &mut Culling,
        measure: impl Fn(&Answer, &Throw) + Sync,
    ) -> Result<Vec<Pass>, Failure> {
        let (args, Attacks { baked, throws }) = (self.args, self.attacks);
        let folder = args.export.as_deref();
        let graph = folder.map(|_| graph_name(baked)).transpose()?;
        let mut passes = Vec::new();
        for &method in self.methods {
            let is_first = passes.is_empty();
            let folder = folder.filter(|_| is_first);
            let settings = PassSettings {
                method,
                threads: args.threads.unwrap_or(1) as usize,
                query_threads: args.methods.query_threads(),
                list_late: folder.is_some(),
            };
            let export = |index: usize, settings: &QuerySettings, answer: &Answer| {
                if is_first {
                    measure(answer, &throws[index]);
                }
                let (Some(folder), Some(graph)) = (folder, graph) else {
                    return Ok(());
                };
                let throw_query = ThrowQuery {
                    graph,
                    throw: &throws[index],
                    settings,
                    method,
                };
                let folder = AnswerFolder {
                    path: folder,
                    format: args.format.format(),
                    baked,
                };
                folder.write(index as u64, &throw_query.recorded(), answer)
            };
            passes.push(self.attacks.pass(&settings, culling, export)?);
        }
        Ok(passes)
    }
}

/// The attacks; with --explain only the explained one.
fn throws(args: &Args, baked: &BakedGraph) -> Result<Vec<Throw>, Failure> {
    let Some(path) = &args.attack else {
        let settings = ThrowSettings::default();
        let numbers = args
            .explain
            .map_or(0..args.attacks.unwrap_or(ATTACKS), |index| {
                index..index.saturating_add(1)
            });
        let random = |index| {
            cancel::check()?;
            let thrown = throw(baked, &settings, args.seed, index);
            thrown.map_err(|error| Failure::Attack {
                index: index as usize,
                error,
            })
        };
        return numbers.map(random).collect();
    };
    let playhead = Playhead::at(baked.graph(), EdgeId(0), 0.0, Rigid2::IDENTITY);
    let file = sabaki_import::AttackFile::read(path)?;
    let count = file.attacks.len();
    let explained = |index: usize| args.explain.is_none_or(|number| number == index as u64);
    let numbered = file.attacks.into_iter().enumerate();
    let throws = numbered.filter(|(index, _)| explained(*index));
    let throws = throws.map(|(index, entry)| {
        let attack = Attack::new(entry.spheres)
            .map_err(|error| Failure::Attack { index, error }.within(path))?;
        Ok(Throw { playhead, attack })
    });
    let throws: Vec<Throw> = throws.collect::<Result<_, Failure>>()?;
    match args.explain {
        Some(index) if throws.is_empty() => {
            let what = format!("there is no attack {index}: the file has {count}, from 0 on");
            Err(Failure::Usage(what).within(path))
        }
        _ => Ok(throws),
    }
}

fn document(baked: &Baked, passes: &[Pass], measured: Option<&(Quality, Quality)>) -> String {
    let exact = summary::exact(passes);
    let rows: Vec<Value> = passes
        .iter()
        .map(|pass| Summary::of(pass, exact).to_json())
        .collect();
    let results = passes.iter().flat_map(|pass| {
        let numbered = pass.runs.iter().enumerate();
        numbered.map(|(index, run)| run.to_json(&baked.graph, index, pass.method))
    });
    let mut document = rows[0].clone();
    document["results"] = results.collect();
    document["rows"] = Value::Array(rows);
    document["graph"] = source::statistics(baked);
    if let Some((clips, composed)) = measured {
        document["quality"] = quality::document(clips, composed);
    }
    Done::json(&document)
}

fn tables(baked: &Baked, passes: &[Pass], culling: &Culling) -> String {
    let mut text = source::describe(baked);
    text.push_str(&culling.describe(passes.iter().map(|pass| pass.method.cull)));
    text.push('\n');
    let first = &passes[0];
    if first.runs.len() <= LISTED {
        let _ = writeln!(
            text,
            "\nEach attack, culled by {}, grid {}:\n{}",
            first.method.cull.name(),
            first.method.grid_name(),
            attack_table(&baked.graph, &first.runs)
        );
    }
    let _ = writeln!(text, "\n{}", summary::table(passes));
    text
}

pub(super) fn attack_table(baked: &BakedGraph, runs: &[super::stats::Run]) -> comfy_table::Table {
    let head = [
        "attack",
        "answer",
        "by",
        "from",
        "rate p",
        "clearance cm",
        "candidates",
        "culled",
        "query ms",
    ];
    let mut table = output::table(&head, 4);
    for (index, run) in runs.iter().enumerate() {
        table.add_row(vec![
            index.to_string(),
            if run.avoided { "avoided" } else { "HIT" }.to_owned(),
            run.evasion(baked)
                .unwrap_or_else(|| "continued motion".to_owned()),
            explain::source_name(run.source).to_owned(),
            format!("{:.2}", run.rate),
            format!("{:.1}", run.clearance * 100.0),
            run.counts.candidates.to_string(),
            run.counts.culled.to_string(),
            format!("{:.2}", run.query_ms()),
        ]);
    }
    table
}
