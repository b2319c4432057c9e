//! `sabaki` without a subcommand: the demo.

use std::path::Path;

use sabaki::archive;
use sabaki::maps::BakedGraph;
use sabaki::query::{CullPath, Enumerate, QuerySettings};
use sabaki_fixtures::throw::Throw;
use sabaki_import::export::MotionFormat;
use serde_json::json;

use super::culling::{self, Culling, DeviceArgs};
use super::export::Export;
use super::queries::{Method, Pass, QueryRunner, Run, random_throws};
use super::{Done, Failure, bake, cancel, output, sheet, summary};

/// Number of balls, and number of balls that are listed one by one.
const ATTACKS: u64 = 100;
const LISTED: usize = 10;
const SEED: u64 = 1;
const FOLDER: &str = "out";

pub(crate) fn run(device: &DeviceArgs, as_json: bool) -> Result<Done, Failure> {
    // Fails before the work starts.
    let folder = Path::new(FOLDER);
    output::check_can_be_folder("the demo writes to the folder out", folder)?;
    cancel::listen();
    let baked = bake::embedded_anew()?;
    let graph = &baked.graph;
    graph.prepare();
    let export = Export::new(folder, MotionFormat::Bvh, graph)?;
    let throws = random_throws(graph, SEED, 0..ATTACKS)?;
    let mut culling = Culling::new(culling::open(device)?, graph.atlas());
    let passes = passes(graph, &throws, &mut culling)?;
    let shown = narrow_dodge(graph, &passes[0].runs);
    let files = write_files(
        graph,
        &export,
        &throws[shown],
        passes[0].method,
        &mut culling,
    )?;
    if as_json {
        let mut document = summary::document(&passes);
        document["graph"] = bake::bake_statistics(&baked);
        document["files"] = json!(files);
        return Ok(Done::ok(Done::json(&document)));
    }
    Ok(Done::ok(format!(
        "The embedded motions: {graph_line}{culling}\n\n\
         {ATTACKS} balls are thrown; each would hit if the motion went on. The first {LISTED}:\n{each}\n\
         by: the evasion and its times in the clip. rate p: playback rate of the path to it.\n\
         clearance: distance between ball and body; negative: depth of the hit.\n\n\
         All attacks, by culling path (exact: no culling; every path ends with the exact test):\n\
         {all}\nThe graph, and attack {shown}, a narrow dodge:\n{files}\n",
        graph_line = bake::headline(graph),
        culling = culling.describe(passes.iter().map(|pass| pass.method.cull)),
        each = summary::attack_table(graph, &passes[0].runs[..LISTED]),
        all = summary::tables(&passes),
        files = files.join(", "),
    )))
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
    paths.retain(|&path| path != CullPath::None);
    paths.sort_by_key(|&path| (path != best, path == CullPath::Exact));
    let grids = [Enumerate::default(), Enumerate::Whole];
    let methods = paths
        .into_iter()
        .flat_map(|cull| grids.map(|enumerate| Method::new(cull, cull.evaluation(), enumerate)));
    let one = |method: Method| {
        let settings = method.settings();
        Pass::new(baked, throws, method, &settings, 1, culling, |_, _| Ok(()))
    };
    methods.map(one).collect()
}

/// The clean answer by an evasion with the best score, preferably one in which a part of the body stays
/// where it is, because its maps show most. The first attack where no evasion answers any.
fn narrow_dodge(baked: &BakedGraph, runs: &[Run]) -> usize {
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

/// Writes the graph, the answer to an attack as BVH and JSON, and its maps as a picture. Returns the file names.
fn write_files(
    baked: &BakedGraph,
    export: &Export<'_>,
    throw: &Throw,
    method: Method,
    culling: &mut Culling,
) -> Result<Vec<String>, Failure> {
    let settings = QuerySettings {
        list_late: true,
        ..method.settings()
    };
    let mut runner = QueryRunner::new(baked);
    runner.ask(method, &settings, throw, culling)?;
    let answer = &runner.answer;
    let mut files = export
        .write("dodge", throw, &settings, method, answer)?
        .to_vec();
    let graph = Path::new(FOLDER).join("fighter.sabaki");
    archive::write(&graph, baked)?;
    files.push(graph);
    if let Some((sheet, _)) = sheet::draw_answer(baked, throw, answer, sheet::on_cpu)? {
        let path = Path::new(FOLDER).join("maps.png");
        sheet.write(&path)?;
        files.push(path);
    }
    Ok(files
        .iter()
        .map(|path| path.display().to_string())
        .collect())
}
