//! Bakes of clips that were read from files, and of the embedded motions.

use std::path::Path;
use std::time::Instant;

use sabaki::graph::{BuildReport, ClipSource, GraphError, GraphSettings, MotionGraph};
use sabaki::internal::{EntryShare, GraphBuilder, TransitionList};
use sabaki::maps::{BakeSettings, Baker, MapGrid};
use sabaki_fixtures::demo;
use sabaki_import::EventsFile;
use serde::{Deserialize, Serialize};

use super::super::Failure;
use super::super::figure::Figure;
use super::args::MotionPaths;
use super::bake_bar::BakeBar;
use super::{Baked, BuildSummary, ClipArgs};

/// Number of transitions on which foot sliding is measured; enough for three digits.
const MEASURED: usize = 2000;

/// Finds the transitions of a graph: in this process, or in the shards of a plan.
type FindTransitions<'f> = dyn Fn(&GraphBuilder<'_>) -> Result<TransitionList, Failure> + 'f;

/// Searches in this process.
fn find_here(builder: &GraphBuilder<'_>) -> Result<TransitionList, Failure> {
    Ok(builder.find_transitions()?)
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
                maps: match args.paper_maps {
                    true => MapGrid::PAPER,
                    false => MapGrid::default(),
                },
                ..BakeSettings::default()
            },
        }
    }

    pub(crate) fn read(args: &ClipArgs) -> Result<Self, Failure> {
        args.check()?;
        let MotionPaths { read, left_out } = args.motion_paths()?;
        let options = sabaki_import::ReadOptions {
            keep_going: args.keep_going,
            retarget: args.retarget,
            ..args.read.options()
        };
        let mut set = sabaki_import::read_clips(&read, args.events.as_deref(), &options)?;
        set.left_out.splice(..0, left_out);
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

    /// Files that were left out, with the reasons.
    pub(crate) fn left_out(&self) -> &[String] {
        &self.set.left_out
    }

    /// What is doubtful in the clips, the body and the props.
    pub(crate) fn notes(&self) -> Vec<String> {
        let of_clips = self.set.warnings.iter();
        of_clips.chain(&self.figure.warnings).cloned().collect()
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
    from_clips_with(args, find_here)
}

/// Bakes the clips of `args` with the transitions that `find` returns.
pub(crate) fn from_clips_with(
    args: &ClipArgs,
    find: impl Fn(&GraphBuilder<'_>) -> Result<TransitionList, Failure>,
) -> Result<Baked, Failure> {
    bake_clips(args, |bake| bake.run(&find))
}

/// Builds the graph of the clips of `args` with the transitions that `find` returns.
pub(crate) fn graph_of_clips(
    args: &ClipArgs,
    find: impl Fn(&GraphBuilder<'_>) -> Result<TransitionList, Failure>,
) -> Result<BuiltGraph, Failure> {
    let input = BakeInput::read(args)?;
    let watch = BakeBar::new();
    let found = input.bake(args).graph(&watch, &find);
    found.map_err(|failure| within(args, failure))
}

/// Bakes the clips of `args`, whose graph is built and whose entries are tested.
pub(crate) fn from_graph(
    args: &ClipArgs,
    built: BuiltGraph,
    entries: Vec<EntryShare>,
) -> Result<Baked, Failure> {
    bake_clips(args, |bake| bake.tables(&BakeBar::new(), built, entries))
}

fn bake_clips(
    args: &ClipArgs,
    bake: impl FnOnce(Bake<'_>) -> Result<Baked, Failure>,
) -> Result<Baked, Failure> {
    let started = Instant::now();
    let input = BakeInput::read(args)?;
    let mut baked = bake(input.bake(args)).map_err(|failure| within(args, failure))?;
    if let Some(made) = &mut baked.made {
        made.warnings.splice(..0, input.notes());
        made.figure = input.figure;
        made.left_out = input.set.left_out;
        made.seconds = started.elapsed().as_secs_f64();
    }
    Ok(baked)
}

/// Says of which clips a failure is. Not one of them is at fault, but the first says which of many runs it was. A wrong event
/// is the fault of the events file, if that names its clip.
fn within(args: &ClipArgs, failure: Failure) -> Failure {
    let of_clip = match &failure {
        Failure::Graph(
            GraphError::EventTwice { clip, .. }
            | GraphError::Event {
                clip: Some(clip), ..
            }
            | GraphError::EventTooLong {
                clip: Some(clip), ..
            },
        ) => Some(clip),
        _ => None,
    };
    if let (Some(clip), Some(path)) = (of_clip, &args.events)
        && EventsFile::read(path).is_ok_and(|file| !file.events_of(clip).is_empty())
    {
        return failure.within(path);
    }
    match (failure, args.clips.as_slice()) {
        (failure @ (Failure::Shards { .. } | Failure::Cancelled), _) | (failure, []) => failure,
        (failure, [only]) => failure.within(only),
        (failure, [first, more @ ..]) => failure.within(Path::new(&format!(
            "{} and {} more",
            first.display(),
            more.len()
        ))),
    }
}

/// Bakes the embedded motions.
pub(super) fn bake_embedded() -> Result<Baked, Failure> {
    let motions = demo::motions().map_err(GraphError::from)?;
    Bake {
        source: ClipSource {
            skeleton: &motions.skeleton,
            clips: &motions.clips,
            events: &motions.events,
        },
        graph: GraphSettings::default(),
        settings: BakeSettings::default(),
    }
    .run(&find_here)
}

/// A graph, and how it was built.
#[derive(Serialize, Deserialize)]
pub(crate) struct BuiltGraph {
    pub(crate) graph: MotionGraph,
    pub(crate) report: BuildReport,
}

/// Input and settings of a bake.
struct Bake<'a> {
    source: ClipSource<'a>,
    graph: GraphSettings,
    settings: BakeSettings,
}

impl Bake<'_> {
    fn run(self, find: &FindTransitions<'_>) -> Result<Baked, Failure> {
        let started = Instant::now();
        let watch = BakeBar::new();
        let built = self.graph(&watch, find)?;
        let mut baked = self.tables(&watch, built, Vec::new())?;
        if let Some(made) = &mut baked.made {
            made.seconds = started.elapsed().as_secs_f64();
        }
        Ok(baked)
    }

    /// Builds the graph.
    fn graph(&self, watch: &BakeBar, find: &FindTransitions<'_>) -> Result<BuiltGraph, Failure> {
        watch.short("preparing clips");
        let builder = GraphBuilder::new(self.source, &self.graph)?.watched(watch);
        let transitions = find(&builder)?;
        let (graph, report) = builder.build(transitions)?;
        Ok(BuiltGraph { graph, report })
    }

    /// Computes maps, entries, paths and tables of a graph.
    fn tables(
        self,
        watch: &BakeBar,
        BuiltGraph { graph, report }: BuiltGraph,
        entries: Vec<EntryShare>,
    ) -> Result<Baked, Failure> {
        let started = Instant::now();
        watch.short("drawing maps");
        let feet = graph.foot_slide(MEASURED);
        let baker = Baker::new(graph, self.settings)?;
        let maps = baker.draw_on_cpu();
        let graph = baker.finish_watched(maps, entries, watch)?;
        let mut warnings = Vec::new();
        if graph.evasions().is_empty() {
            let labelled = report.events.evasions;
            warnings.push(match labelled {
                    0 => "no clip has an evasion: attacks are avoided by whatever motion there is".to_owned(),
                    n => format!("none of the {n} evasions can be reached and left again: attacks are avoided by whatever motion there is"),
                });
        }
        Ok(Baked {
            graph,
            made: Some(BuildSummary {
                report,
                feet,
                seconds: started.elapsed().as_secs_f64(),
                warnings,
                figure: Figure::default(),
                left_out: Vec::new(),
            }),
        })
    }
}
