//! Bakes of clips that were read from files, and of the embedded motions.

use std::path::Path;
use std::time::Instant;

use indicatif::ProgressBar;
use sabaki::graph::{BuildReport, ClipSource, GraphSettings, MotionGraph};
use sabaki::internal::{
    ClipMatch, EarlierTables, EntryRecord, GraphBuilder, GraphRecord, SearchProgress,
    TransitionList,
};
use sabaki::maps::{BakeSettings, Baker};
use sabaki_app::demo;
use serde::{Deserialize, Serialize};

use super::super::bake::record::BakeRecord;
use super::super::figure::Figure;
use super::super::{Failure, cancel, output};
use super::{Baked, ClipArgs, Made};

/// Number of transitions on which foot sliding is measured; enough for three digits.
const MEASURED: usize = 2000;

/// Finds the transitions of a graph: in this process, or in the shards of a plan.
type Find<'f> = dyn Fn(&GraphBuilder<'_>) -> Result<TransitionList, Failure> + 'f;

/// Searches in this process. On a terminal a bar shows the share done, the pairs of windows a second, and the time left.
fn find_here(builder: &GraphBuilder<'_>) -> Result<TransitionList, Failure> {
    let bar = output::search_progress("searching transitions");
    let found = builder.find_transitions(|SearchProgress { done, all }| {
        bar.set_length(all);
        bar.set_position(done);
        cancel::check()
    });
    bar.finish_and_clear();
    found
}

/// Clips, body and props that were read from files.
pub(crate) struct BakeInput {
    set: sabaki_import::ClipSet,
    figure: Figure,
    settings: GraphSettings,
}

impl BakeInput {
    fn bake(&self, args: &ClipArgs) -> Bake<'_> {
        Bake {
            source: self.source(),
            graph: args.graph_settings(),
            settings: BakeSettings {
                body: self.figure.body.clone(),
                props: self.figure.props.clone(),
                maps: args.maps.grid(),
                ..BakeSettings::default()
            },
        }
    }

    pub(crate) fn read(args: &ClipArgs) -> Result<Self, Failure> {
        let options = sabaki_import::ReadOptions {
            keep_going: args.keep_going,
            retarget: args.retarget,
            ..args.read.options()
        };
        let mut set = sabaki_import::read_clips(&args.clips, args.events.as_deref(), &options)?;
        if args.mirror {
            set.add_mirrored()
                .map_err(|error| Failure::Usage(error.to_string()))?;
        }
        let figure = args.figure.read(&set)?;
        Ok(Self {
            set,
            figure,
            settings: args.graph_settings(),
        })
    }

    pub(crate) fn graph_settings(&self) -> GraphSettings {
        self.settings.clone()
    }

    pub(crate) fn builder<'a>(
        &'a self,
        settings: &'a GraphSettings,
    ) -> Result<GraphBuilder<'a>, Failure> {
        Ok(GraphBuilder::new(self.source(), settings)?)
    }

    fn source(&self) -> ClipSource<'_> {
        ClipSource {
            skeleton: &self.set.skeleton,
            clips: &self.set.clips,
            events: &self.set.events,
        }
    }
}

/// Bakes the clips of `args`.
pub(crate) fn from_clips(args: &ClipArgs) -> Result<Baked, Failure> {
    from_clips_onto(args, BakeRecord::default())
}

/// Bakes the clips of `args` and takes over the results of an earlier bake.
pub(crate) fn from_clips_onto(args: &ClipArgs, earlier: BakeRecord) -> Result<Baked, Failure> {
    bake_clips(args, |bake| bake.run(&find_here, earlier))
}

/// Bakes the clips of `args` with the transitions that `find` returns.
pub(crate) fn from_clips_with(
    args: &ClipArgs,
    find: impl Fn(&GraphBuilder<'_>) -> Result<TransitionList, Failure>,
) -> Result<Baked, Failure> {
    bake_clips(args, |bake| bake.run(&find, BakeRecord::default()))
}

/// Builds the graph of the clips of `args` with the transitions that `find` returns.
pub(crate) fn graph_of_clips(
    args: &ClipArgs,
    find: impl Fn(&GraphBuilder<'_>) -> Result<TransitionList, Failure>,
) -> Result<BuiltGraph, Failure> {
    let input = BakeInput::read(args)?;
    let found = input.bake(args).graph(&find, GraphRecord::default());
    let (built, ..) = found.map_err(|failure| within(args, failure))?;
    Ok(built)
}

/// Bakes the clips of `args`, whose graph is built and whose entries are tested.
pub(crate) fn from_graph(
    args: &ClipArgs,
    built: BuiltGraph,
    entries: EntryRecord,
) -> Result<Baked, Failure> {
    bake_clips(args, |bake| {
        let earlier = EarlierTables {
            clips: ClipMatch::same(built.graph.clips().len()),
            record: entries.into(),
        };
        bake.tables(built, earlier)
    })
}

fn bake_clips(
    args: &ClipArgs,
    bake: impl FnOnce(Bake<'_>) -> Result<Baked, Failure>,
) -> Result<Baked, Failure> {
    let started = Instant::now();
    let input = BakeInput::read(args)?;
    let mut baked = bake(input.bake(args)).map_err(|failure| within(args, failure))?;
    if let Some(made) = &mut baked.made {
        let of_figure = input.figure.warnings.iter().cloned();
        made.warnings
            .splice(..0, input.set.warnings.into_iter().chain(of_figure));
        made.figure = input.figure;
        made.left_out = input.set.left_out;
        made.seconds = started.elapsed().as_secs_f64();
    }
    Ok(baked)
}

/// Says of which clips a failure is. Not one of them is at fault, but the first says which of many runs it was.
fn within(args: &ClipArgs, failure: Failure) -> Failure {
    match (failure, args.clips.as_slice()) {
        (failure @ Failure::Shards { .. }, _) | (failure, []) => failure,
        (failure, [only]) => failure.within(only),
        (failure, [first, more @ ..]) => failure.within(Path::new(&format!(
            "{} and {} more",
            first.display(),
            more.len()
        ))),
    }
}

/// Bakes the embedded motions.
pub(crate) fn embedded() -> Result<Baked, Failure> {
    let motions = demo::motions().map_err(sabaki::graph::GraphError::from)?;
    Bake {
        source: ClipSource {
            skeleton: &motions.skeleton,
            clips: &motions.clips,
            events: &motions.events,
        },
        graph: GraphSettings::default(),
        settings: BakeSettings::default(),
    }
    .run(&find_here, BakeRecord::default())
}

/// A graph, and how it was built.
#[derive(Serialize, Deserialize)]
pub(crate) struct BuiltGraph {
    pub(crate) graph: MotionGraph,
    pub(crate) report: BuildReport,
}

/// Stages of a bake after the search, shown by a bar.
struct Stages {
    started: Instant,
    bar: ProgressBar,
}

impl Stages {
    /// So many stages are done; `next` follows.
    fn after(done: u64, next: &'static str) -> Self {
        let bar = output::progress(next, 4);
        bar.set_position(done);
        Self {
            started: Instant::now(),
            bar,
        }
    }

    /// Ends a stage.
    ///
    /// # Errors
    /// [`Failure::Cancelled`] after Ctrl-C.
    fn done(&self, stage: &str, next: &'static str) -> Result<(), Failure> {
        self.bar.inc(1);
        self.bar.set_message(next);
        let seconds = self.started.elapsed().as_secs_f64();
        tracing::info!("{stage} after {seconds:.3} s");
        cancel::check()
    }
}

/// Input and settings of a bake.
struct Bake<'a> {
    source: ClipSource<'a>,
    graph: GraphSettings,
    settings: BakeSettings,
}

impl Bake<'_> {
    fn run(self, find: &Find<'_>, earlier: BakeRecord) -> Result<Baked, Failure> {
        let started = Instant::now();
        let (built, of_graph, clips) = self.graph(find, earlier.graph)?;
        let taken_over = clips.count();
        let earlier = EarlierTables {
            record: earlier.tables,
            clips,
        };
        let mut baked = self.tables(built, earlier)?;
        if let Some(made) = &mut baked.made {
            made.record.graph = of_graph;
            made.taken_over = taken_over;
            made.seconds = started.elapsed().as_secs_f64();
        }
        Ok(baked)
    }

    /// Builds the graph. Returns a record of it, too, and the clips that `earlier` had.
    fn graph(
        &self,
        find: &Find<'_>,
        earlier: GraphRecord,
    ) -> Result<(BuiltGraph, GraphRecord, ClipMatch), Failure> {
        cancel::listen();
        let builder = GraphBuilder::onto(self.source, &self.graph, earlier)?;
        let clips = builder.clips_taken_over().clone();
        let transitions = find(&builder)?;
        let stages = Stages::after(1, "adding links");
        let (graph, report, record) = builder.build_recorded(transitions)?;
        stages.done("links added and graph built", "drawing maps")?;
        stages.bar.finish_and_clear();
        Ok((BuiltGraph { graph, report }, record, clips))
    }

    /// Computes maps, entries, paths and tables of a graph.
    fn tables(
        self,
        BuiltGraph { graph, report }: BuiltGraph,
        earlier: EarlierTables,
    ) -> Result<Baked, Failure> {
        cancel::listen();
        let stages = Stages::after(2, "drawing maps");
        let feet = graph.foot_slide(MEASURED);
        let baker = Baker::onto(graph, self.settings, earlier)?;
        let maps = baker.draw_on_cpu();
        stages.done("maps drawn", "filing paths and entries")?;
        let (graph, tables) = baker.finish_recorded(maps)?;
        stages.done("paths and grid made", "done")?;
        stages.bar.finish_and_clear();
        let mut warnings = Vec::new();
        if graph.evasions().is_empty() {
            let labelled = report.events.0;
            warnings.push(match labelled {
                0 => "no clip has an evasion: attacks are avoided by whatever motion there is".to_owned(),
                n => format!("none of the {n} evasions can be reached and left again: attacks are avoided by whatever motion there is"),
            });
        }
        Ok(Baked {
            graph,
            made: Some(Made {
                report,
                feet,
                seconds: stages.started.elapsed().as_secs_f64(),
                warnings,
                figure: Figure::default(),
                left_out: Vec::new(),
                taken_over: 0,
                record: BakeRecord {
                    graph: GraphRecord::default(),
                    tables,
                },
            }),
        })
    }
}
