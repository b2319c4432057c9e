//! Where a graph comes from: a baked file, clips, or the embedded motions.

use std::path::{Path, PathBuf};
use std::time::Instant;

use sabaki::anim::{CompressionSettings, EventKind};
use sabaki::archive;
use sabaki::graph::{BuildReport, ClipSource, GraphSettings, MotionGraph};
use sabaki::internal::{FootSlide, GraphBuilder, SearchProgress, TransitionList};
use sabaki::maps::{BakeSettings, BakedGraph, Baker};
use sabaki_app::demo;
use serde_json::{Value, json};

use super::bake::record::BakeRecord;
use super::clip_sizes::ClipSizes;
use super::figure::{Figure, FigureArgs};
use super::maps::MapArgs;
use super::{Failure, cancel, output};

/// What motion files do not contain.
#[derive(Clone, Copy, Debug, clap::Args)]
#[command(next_help_heading = "Clips")]
pub(crate) struct ReadArgs {
    /// Metres per unit of the files. Default: derived from the skeleton's height (glTF: 1).
    #[arg(long, value_name = "METRES")]
    scale: Option<f64>,
    /// Up axis of the files: x, y or z.
    #[arg(long, value_name = "AXIS", default_value = "y")]
    up: sabaki_import::Up,
    /// Frame rate of AMC files, which do not contain it, in frames per second.
    #[arg(long, value_name = "HZ", default_value_t = sabaki_import::asf::AmcFile::USUAL_RATE)]
    amc_rate: f64,
}

impl ReadArgs {
    pub(crate) fn options(&self) -> sabaki_import::ReadOptions {
        sabaki_import::ReadOptions {
            scale: self.scale,
            up: self.up,
            amc_rate: Some(self.amc_rate),
            keep_going: false,
            retarget: false,
        }
    }
}

/// Bytes of the unit of `--memory`.
const GB: f64 = (1u64 << 30) as f64;

/// Clips, and the settings of the graph built from them.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Clips")]
pub(crate) struct ClipArgs {
    /// BVH, AMC or glTF files, or folders of them.
    #[arg(long, num_args = 1.., value_name = "PATH")]
    pub(crate) clips: Vec<PathBuf>,
    /// Events file (JSON) that labels evasions and attacks in the clips.
    #[arg(long, value_name = "FILE")]
    pub(crate) events: Option<PathBuf>,
    /// Adds a mirrored copy of each clip and its events, left and right exchanged by the joints' names.
    #[arg(long, requires = "clips")]
    pub(crate) mirror: bool,
    #[command(flatten)]
    pub(crate) read: ReadArgs,
    /// Leaves out files that cannot be read, and files of other skeletons than the largest group's, and reports them (exit code 3
    /// of `bake`). Default: all such files are listed and nothing is baked.
    #[arg(long, requires = "clips")]
    pub(crate) keep_going: bool,
    /// Puts motions of other skeletons on that of the largest group of files, by the joints' names, and says what this costs.
    #[arg(long, requires = "clips")]
    pub(crate) retarget: bool,
    /// Largest distance of the poses that a transition joins: root mean square over the joints, in
    /// metres.
    #[arg(long, value_name = "METRES", requires = "clips", default_value_t = GraphSettings::default().threshold)]
    pub(crate) threshold: f32,
    /// Largest error that compressing the clips may cause at the joints, in millimetres; at the ends it may be three times as large. 0
    /// leaves the clips as they are.
    #[arg(long, value_name = "MM", requires = "clips", default_value_t = 0.1)]
    pub(crate) clip_error: f32,
    /// Memory that building the graph may take, in GB. Clips that would take more are rejected before the work begins.
    #[arg(long, value_name = "GB", requires = "clips", default_value_t = GraphSettings::MEMORY as f64 / GB)]
    pub(crate) memory: f64,
    #[command(flatten)]
    pub(crate) figure: FigureArgs,
    #[command(flatten)]
    pub(crate) maps: MapArgs,
}

impl ClipArgs {
    fn graph_settings(&self) -> GraphSettings {
        GraphSettings {
            threshold: self.threshold,
            compression: self.compression(),
            memory: (self.memory * GB) as u64,
            ..GraphSettings::default()
        }
    }

    fn compression(&self) -> Option<CompressionSettings> {
        let joint_error = 1e-3 * self.clip_error;
        (self.clip_error != 0.0).then_some(CompressionSettings {
            joint_error,
            end_error: 3.0 * joint_error,
        })
    }

    /// All files and folders that are read.
    pub(crate) fn files(&self) -> Vec<&Path> {
        let clips = self.clips.iter().chain(&self.events);
        clips
            .map(PathBuf::as_path)
            .chain(self.figure.files())
            .collect()
    }

    /// All files that are read, with those of the folders, sorted by name.
    pub(crate) fn input_files(&self) -> Result<Vec<PathBuf>, Failure> {
        let mut files = Vec::new();
        for path in self.files() {
            if !path.is_dir() {
                files.push(path.to_owned());
                continue;
            }
            let wrong = |source| Failure::Open {
                path: path.to_owned(),
                source,
            };
            let first = files.len();
            for entry in std::fs::read_dir(path).map_err(wrong)? {
                let file = entry.map_err(wrong)?.path();
                if sabaki_import::is_motion_file(&file) && file.is_file() {
                    files.push(file);
                }
            }
            files[first..].sort();
        }
        Ok(files)
    }

    /// Lets relative paths start in `folder`.
    pub(crate) fn start_in(&mut self, folder: &Path) {
        let paths = self
            .clips
            .iter_mut()
            .chain(&mut self.events)
            .chain(self.figure.files_mut());
        for path in paths {
            *path = folder.join(&*path);
        }
    }
}

/// The graph to query.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct GraphArgs {
    /// Graph written by `bake`. Default: --clips, or the embedded motions without them.
    baked: Option<PathBuf>,
    #[command(flatten)]
    clips: ClipArgs,
}

impl GraphArgs {
    pub(crate) fn load(&self) -> Result<Baked, Failure> {
        match (&self.baked, self.clips.clips.is_empty()) {
            (_, true) if self.clips.events.is_some() => {
                Err(Failure::Usage("--events needs --clips".to_owned()))
            }
            (Some(_), false) => Err(Failure::Usage(
                "either a baked graph or --clips, not both".to_owned(),
            )),
            (Some(path), true) => from_file(path),
            (None, false) => from_clips(&self.clips),
            (None, true) => embedded(),
        }
    }
}

/// Number of transitions on which foot sliding is measured; enough for three digits.
const MEASURED: usize = 2000;

/// A graph, with its build report if it was built now.
pub(crate) struct Baked {
    pub(crate) graph: BakedGraph,
    pub(crate) made: Option<Made>,
}

/// How a graph was built.
pub(crate) struct Made {
    pub(crate) report: BuildReport,
    pub(crate) feet: FootSlide,
    pub(crate) seconds: f64,
    pub(crate) warnings: Vec<String>,
    pub(crate) figure: Figure,
    /// Files that were left out, with the reasons.
    pub(crate) left_out: Vec<String>,
    /// Number of clips whose results were taken over from an earlier bake.
    pub(crate) taken_over: usize,
    /// Results that a later bake takes over.
    pub(crate) record: BakeRecord,
}

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

/// Reads a baked file.
pub(crate) fn from_file(path: &Path) -> Result<Baked, Failure> {
    Ok(Baked {
        graph: archive::read(path)?,
        made: None,
    })
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
        let builder = GraphBuilder::new(self.source, &self.graph)?.onto(self.earlier.graph);
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

fn count(graph: &MotionGraph, kind: EventKind) -> usize {
    graph
        .events()
        .iter()
        .filter(|event| event.kind == kind)
        .count()
}

/// Statistics of a graph as JSON, with stable keys.
pub(crate) fn statistics(baked: &Baked) -> Value {
    let graph = baked.graph.graph();
    let mut value = json!({
        "joints": graph.skeleton().len(),
        "frame_rate": graph.frame_rate(),
        "clips": graph.clips().len(),
        "nodes": graph.nodes().len(),
        "edges": graph.edges().len(),
        "transitions": graph.transitions(),
        "seconds_kept": graph.seconds_kept(),
        "evasions": count(graph, EventKind::Evasion),
        "attacks": count(graph, EventKind::Attack),
        "body_spheres": baked.graph.body().spheres.len(),
        "props": baked.graph.body().props.len(),
        "map_bytes": baked.graph.atlas().bytes(),
        "evasion_within": {
            "0.5": baked.graph.responsive_share(0.5),
            "1.0": baked.graph.responsive_share(1.0),
            "1.5": baked.graph.responsive_share(1.5),
        },
    });
    value["clip_bytes"] = ClipSizes::of(graph).to_json();
    let entries = baked.graph.entry_report();
    value["entries"] = json!(entries);
    value["entries"]["share"] = json!(entries.share());
    if let Some(made) = &baked.made {
        value["build_seconds"] = json!(made.seconds);
        value["report"] = json!(made.report);
        value["foot_slide"] = json!(made.feet);
        value["warnings"] = json!(made.warnings);
        value["left_out"] = json!(made.left_out);
        value["clips_taken_over"] = json!(made.taken_over);
        value["fits"] = made.figure.to_json();
    }
    value
}

/// Statistics of a graph as text.
pub(crate) fn describe(baked: &Baked) -> String {
    let graph = baked.graph.graph();
    let mut text = String::new();
    let mut line = |text_line: String| {
        text.push_str(&text_line);
        text.push('\n');
    };
    let kept = format!("{:.1} s of motion", graph.seconds_kept());
    line(match &baked.made {
        Some(made) => format!(
            "{} clips, {:.1} s; kept {kept}",
            made.report.clips, made.report.seconds
        ),
        None => format!("{} clips; {kept}", graph.clips().len()),
    });
    if let Some(made) = baked.made.as_ref().filter(|made| made.taken_over > 0) {
        let (taken_over, clips) = (made.taken_over, made.report.clips);
        line(format!(
            "what the earlier bake computed of {taken_over} of {clips} clips was taken over"
        ));
    }
    line(ClipSizes::of(graph).text());
    line(format!(
        "{} nodes, {} edges ({} of them transitions)",
        graph.nodes().len(),
        graph.edges().len(),
        graph.transitions()
    ));
    line(format!(
        "{} evasions and {} attacks",
        count(graph, EventKind::Evasion),
        count(graph, EventKind::Attack)
    ));
    if let Some(made) = &baked.made {
        line(format!(
            "{} transitions left out because a foot darts in them",
            made.report.darting
        ));
    }
    let share = |seconds| 100.0 * baked.graph.responsive_share(seconds);
    line(format!(
        "an evasion can start within 0.5 s from {:.0}% of all moments, within 1.0 s from {:.0}%, within 1.5 s from {:.0}%",
        share(0.5),
        share(1.0),
        share(1.5)
    ));
    let entries = baked.graph.entry_report();
    line(format!(
        "an evasion can be entered at once from {:.0}% of all moments, by {:.0} entries on average; the longest stretch of a clip without one is {:.2} s",
        100.0 * entries.share(),
        entries.entries as f64 / entries.moments.max(1) as f64,
        entries.longest_without
    ));
    line(format!(
        "the upper body can play an evasion over legs that go on, by {:.0} layers on average",
        entries.layers as f64 / entries.moments.max(1) as f64,
    ));
    let [all, events] = [entries.unbranched, entries.unbranched_in_events];
    line(format!(
        "stretches without a branch point (an entry, an exit or a choice of edges): {:.2} s in the median, {:.2} s at most; in evasions and attacks {:.2} and {:.2} s",
        all.median, all.longest, events.median, events.longest
    ));
    if let Some(made) = &baked.made {
        text.push_str(&made.figure.describe());
    }
    let mut line = |text_line: String| {
        text.push_str(&text_line);
        text.push('\n');
    };
    if let Some(made) = &baked.made {
        let dropped = &made.report.dropped;
        if dropped.seconds > 0.05 {
            line(format!(
                "dropped because the graph does not lead there and back: {:.1} s of motion, {} whole clips",
                dropped.seconds,
                dropped.clips.len()
            ));
        }
        for event in dropped.evasions.iter().chain(&dropped.attacks) {
            line(format!("dropped event: {event}"));
        }
        if made.feet.planted_seconds > 0.0 {
            line(format!(
                "slide of planted feet: {:.0} mm/s in transitions ({:.0} without foot locking), {:.0} mm/s in the clips",
                made.feet.kept, made.feet.blended, made.feet.clips
            ));
            let [median, most, largest] = made.feet.displacement.map(|metres| 1e3 * metres);
            line(format!(
                "feet that stand in both clips of a transition: {median:.0} mm apart in the median, {most:.0} mm at 90%, {largest:.0} mm at most; they take {} steps in place",
                made.feet.steps
            ));
        }
        line(format!(
            "baked in {:.2} s; {:.1} MB of maps",
            made.seconds,
            baked.graph.atlas().bytes() as f64 * 1e-6
        ));
        for file in &made.left_out {
            line(format!("left out: {file}"));
        }
        for warning in &made.warnings {
            line(format!("note: {warning}"));
        }
    }
    text
}
