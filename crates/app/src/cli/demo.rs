//! `sabaki` without a subcommand: the demo.

use std::path::Path;

use sabaki::maps::BakedGraph;
use sabaki::query::{Answer, CullPath, Enumerate, Query, QueryContext, QuerySettings, Source};
use sabaki_fixtures::throw::{Throw, ThrowSettings, throw};
use sabaki_import::export;
use serde_json::json;

use super::answer_files::{ThrowQuery, graph_name};
use super::culling::{self, Culling, DeviceArgs};
use super::passes::{Attacks, Method, Pass, PassSettings};
use super::source::Baked;
use super::stats::{QueryRunner, Run};
use super::summary::{self, Summary};
use super::{Done, Failure, cancel, dodge, output, sheet, source};

/// Number of balls.
const ATTACKS: u64 = 100;
/// Number of balls that are listed one by one.
const LISTED: usize = 10;
const SEED: u64 = 1;
const FOLDER: &str = "out";

/// The results of the demo.
struct DemoResults {
    baked: Baked,
    culling: String,
    passes: Vec<Pass>,
    /// Index of the attack whose answer was written to files.
    written: usize,
    files: Vec<String>,
}

pub(crate) fn run(device: &DeviceArgs, as_json: bool) -> Result<Done, Failure> {
    // Fails before the work starts.
    let folder = Path::new(FOLDER);
    output::check_can_be_folder("the demo writes to the folder out", folder)?;
    std::fs::create_dir_all(folder).map_err(|source| Failure::Write {
        path: folder.to_owned(),
        source,
    })?;
    cancel::listen();
    let device = culling::open(device)?;
    let baked = source::embedded_anew()?;
    baked.graph.prepare();
    let mut culling = Culling::new(device, baked.graph.atlas());
    let throws = throws(&baked.graph)?;
    let passes = passes(&baked.graph, &throws, &mut culling)?;
    let written = closest_shave(&baked.graph, &passes[0].runs);
    let method = passes[0].method;
    let settings = QuerySettings {
        list_late: true,
        ..method.settings()
    };
    let mut runner = QueryRunner::new(&baked.graph);
    runner.ask(&settings, &throws[written], culling.on(method.cull))?;
    let throw_query = ThrowQuery {
        graph: graph_name(&baked.graph)?,
        throw: &throws[written],
        settings: &settings,
        method,
    };
    let files = write_files(&baked.graph, &throw_query, &runner.answer)?;
    let shown = DemoResults {
        baked,
        culling: culling.describe(passes.iter().map(|pass| pass.method.cull)),
        passes,
        written,
        files,
    };
    Ok(Done::ok(if as_json {
        shown.document()
    } else {
        shown.tables()
    }))
}

/// Answers all attacks with each culling path that this machine supports, with and without the grid;
/// the best path first.
fn passes(
    baked: &BakedGraph,
    throws: &[Throw],
    culling: &mut Culling,
) -> Result<Vec<Pass>, Failure> {
    let best = culling.best();
    let mut paths = culling.paths();
    paths.sort_by_key(|&path| (path != best, path == CullPath::Exact));
    let grids = [Enumerate::default(), Enumerate::Whole];
    let methods = paths
        .into_iter()
        .flat_map(|cull| grids.map(|enumerate| Method { cull, enumerate }));
    let one = |method: Method| {
        let settings = PassSettings {
            method,
            threads: 1,
            query_threads: 1,
            list_late: false,
        };
        Attacks { baked, throws }.pass(&settings, culling, |_, _, _| Ok(()))
    };
    methods.map(one).collect()
}

impl DemoResults {
    fn document(&self) -> String {
        let exact = summary::exact(&self.passes);
        let summary = |pass: &Pass| Summary::of(pass, exact).to_json();
        let mut document = summary(&self.passes[0]);
        document["rows"] = self.passes.iter().map(summary).collect();
        document["graph"] = source::statistics(&self.baked);
        document["files"] = json!(self.files);
        Done::json(&document)
    }

    fn tables(&self) -> String {
        let runs = &self.passes[0].runs;
        let first = &runs[..LISTED.min(runs.len())];
        format!(
            "The embedded motions:\n{graph}{culling}\n\n\
             {ATTACKS} balls are thrown; each would hit the continued motion. The first {LISTED}:\n{each}\n\
             by: the evasion and its times in the clip, or the other motion that avoids the ball. rate p: playback rate of the path\n\
             to the evasion. clearance: distance between ball and body; negative: depth of the hit.\n\n\
             All attacks by culling path (exact: no culling; every path ends with the exact test):\n\
             {all}\n\nAttack {written}, a narrow dodge, is in {files}\n",
            graph = source::describe(&self.baked),
            culling = self.culling,
            each = dodge::attack_table(&self.baked.graph, first),
            all = summary::table(&self.passes),
            written = self.written,
            files = self.files.join(", "),
        )
    }
}

fn throws(baked: &BakedGraph) -> Result<Vec<Throw>, Failure> {
    let random = |index| {
        cancel::check()?;
        let thrown = throw(baked, &ThrowSettings::default(), SEED, index);
        thrown.map_err(|error| Failure::Attack {
            index: index as usize,
            error,
        })
    };
    (0..ATTACKS).map(random).collect()
}

/// The clean answer by an evasion with the best score, before all by one in which a part of the
/// body stays where it is: of that the pictures show most. The first attack where no evasion
/// answers any.
fn closest_shave(baked: &BakedGraph, runs: &[Run]) -> usize {
    let rank = |run: &Run| {
        let score = run.score?;
        let region = baked.evasion(run.evasion?)?.region;
        let stays = baked
            .atlas()
            .region(region)
            .slabs
            .iter()
            .any(|maps| maps.body.count() > 0);
        Some((!stays, score))
    };
    let ranked = runs
        .iter()
        .enumerate()
        .filter_map(|(index, run)| Some((index, rank(run)?)));
    ranked
        .min_by(|a, b| a.1.0.cmp(&b.1.0).then(a.1.1.total_cmp(&b.1.1)))
        .map_or(0, |(index, _)| index)
}

/// Writes the answer as BVH and JSON, and its maps as a picture. Returns the file names.
fn write_files(
    baked: &BakedGraph,
    throw_query: &ThrowQuery<'_>,
    answer: &Answer,
) -> Result<Vec<String>, Failure> {
    let folder = Path::new(FOLDER);
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| Failure::Write { path, source }
    };
    let request = throw_query.recorded();
    let target = export::Target {
        folder,
        name: "dodge",
        format: export::MotionFormat::Bvh,
    };
    let exported = export::ExportedAnswer {
        baked,
        request: &request,
        answer,
    };
    let mut files = export::write_answer(target, exported)
        .map_err(failed(folder))?
        .to_vec();
    let chosen = answer.chosen;
    // The same source of candidates as the answer's.
    let settings = match answer.source {
        Source::Grid => *throw_query.settings,
        _ => Method::EXACT.settings(),
    };
    let mut context = QueryContext::default();
    let query = Query::new(baked, &settings);
    let session = query.start(throw_query.throw.request(), &mut context);
    let input = session.cull_input();
    // Candidates with an evasion come first, in the order of the culling input.
    if let Some(candidate) = input.candidates.get(chosen) {
        let path = folder.join("maps.png");
        let sheet = sheet::draw(&input, candidate);
        sheet.write(&path).map_err(|source| Failure::Write {
            path: path.clone(),
            source,
        })?;
        files.push(path);
    }
    Ok(files
        .iter()
        .map(|path| path.display().to_string())
        .collect())
}
