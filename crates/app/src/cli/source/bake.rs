//! Bakes of clips that were read from files, and of the embedded motions.

use std::path::Path;
use std::time::Instant;

use sabaki::graph::{ClipSource, GraphSettings};
use sabaki::internal::{GraphBuilder, SearchProgress, TransitionList};
use sabaki::maps::{BakeSettings, Baker};
use sabaki_app::demo;

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
    bake_clips(args, &find_here, earlier)
}

/// Bakes the clips of `args` with the transitions that `find` returns.
pub(crate) fn from_clips_with(
    args: &ClipArgs,
    find: impl Fn(&GraphBuilder<'_>) -> Result<TransitionList, Failure>,
) -> Result<Baked, Failure> {
    bake_clips(args, &find, BakeRecord::default())
}

fn bake_clips(args: &ClipArgs, find: &Find<'_>, earlier: BakeRecord) -> Result<Baked, Failure> {
    let started = Instant::now();
    let input = BakeInput::read(args)?;
    let settings = BakeSettings {
        body: input.figure.body.clone(),
        props: input.figure.props.clone(),
        maps: args.maps.grid(),
        ..BakeSettings::default()
    };
    let baked = Bake {
        source: input.source(),
        graph: args.graph_settings(),
        settings,
        earlier,
    }
    .run(find);
    // Not one of them is at fault, but the first says which of many runs it was.
    let mut baked = baked.map_err(|failure| match (failure, args.clips.as_slice()) {
        (failure @ Failure::Shards { .. }, _) | (failure, []) => failure,
        (failure, [only]) => failure.within(only),
        (failure, [first, more @ ..]) => failure.within(Path::new(&format!(
            "{} and {} more",
            first.display(),
            more.len()
        ))),
    })?;
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
        earlier: BakeRecord::default(),
    }
    .run(&find_here)
}

/// Input and settings of a bake.
struct Bake<'a> {
    source: ClipSource<'a>,
    graph: GraphSettings,
    settings: BakeSettings,
    earlier: BakeRecord,
}

impl Bake<'_> {
    fn run(self, find: &Find<'_>) -> Result<Baked, Failure> {
        cancel::listen();
        let started = Instant::now();
        let builder = GraphBuilder::onto(self.source, &self.graph, self.earlier.graph)?;
        let clips = builder.clips_taken_over().clone();
        let transitions = find(&builder)?;
        let bar = output::progress("adding links", 4);
        let done = |stage: &str, next: &'static str| {
            bar.inc(1);
            bar.set_message(next);
            let seconds = started.elapsed().as_secs_f64();
            tracing::info!("{stage} after {seconds:.3} s");
            cancel::check()
        };
        done("transitions found", "adding links")?;
        let (graph, report, of_graph) = builder.build_recorded(transitions)?;
        let feet = graph.foot_slide(MEASURED);
        done("links added and graph built", "drawing maps")?;
        let taken_over = clips.count();
        let baker = Baker::new(graph, self.settings)?.onto(self.earlier.entries, clips);
        let maps = baker.draw_on_cpu();
        done("maps drawn", "filing paths and entries")?;
        let (graph, entries) = baker.finish_recorded(maps)?;
        done("paths and grid made", "done")?;
        bar.finish_and_clear();
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
                seconds: started.elapsed().as_secs_f64(),
                warnings,
                figure: Figure::default(),
                left_out: Vec::new(),
                taken_over,
                record: BakeRecord {
                    graph: of_graph,
                    entries,
                },
            }),
        })
    }
}
