//! Bakes of clips that were read from files, and of the embedded motions.

use std::path::{Path, PathBuf};
use std::time::Instant;

use sabaki::gpu::GpuError;
use sabaki::graph::GraphBuilder;
use sabaki::graph::search::TransitionList;
use sabaki::graph::{BuildReport, ClipSource, FootSlide, GraphError, GraphSettings, MotionGraph};
use sabaki::maps::EntryShare;
use sabaki::maps::{BakeSettings, BakedGraph, Baker, DrawnMaps, MapGrid};
use sabaki_fixtures::demo;
use sabaki_fixtures::headless::{Headless, HeadlessDesc};
use sabaki_import::gltf::SkinJoint;
use sabaki_import::{ClipSet, EventsFile, FileError, MeshFile, ReadError, is_gltf, motion_files};
use serde::{Deserialize, Serialize};

use super::super::figure::Figure;
use super::super::output::usage;
use super::super::{Failure, culling};
use super::MapDrawing;
use super::args::ClipArgs;
use super::bar::BakeBar;

/// Number of transitions on which foot sliding is measured; enough for three digits.
const MEASURED: usize = 2000;

/// A graph, with the report on its build.
pub(crate) struct Baked {
    pub(crate) graph: BakedGraph,
    /// The file of the character's mesh, serialized by postcard; empty without one.
    pub(crate) mesh: Vec<u8>,
    pub(crate) report: BuildReport,
    pub(crate) feet: FootSlide,
    pub(crate) seconds: f64,
    pub(crate) warnings: Vec<String>,
    pub(crate) figure: Figure,
    /// What was taken for root, hands and feet.
    pub(crate) joints: String,
    /// Files that were left out, with the reasons.
    pub(crate) left_out: Vec<String>,
}

/// Clips, body and props that were read from files, and the settings of their bake.
pub(crate) struct BakeInput {
    pub(crate) set: sabaki_import::ClipSet,
    /// As [`Baked::mesh`].
    pub(crate) mesh: Vec<u8>,
    figure: Figure,
    graph: GraphSettings,
    maps: MapGrid,
}

impl BakeInput {
    pub(crate) fn read(args: &ClipArgs) -> Result<Self, Failure> {
        args.check()?;
        let (read, left_out) = args.motion_paths()?;
        let options = sabaki_import::ReadOptions {
            keep_going: args.keep_going,
            retarget: args.retarget,
            ..args.read.options()
        };
        let set = sabaki_import::read_clips(&read, args.events.as_deref(), &options);
        let mut set = set.map_err(|error| match error {
            ReadError::Files { .. } => Failure::Clips(error),
            error => error.into(),
        })?;
        set.left_out.splice(..0, left_out);
        if let Some(joints) = &args.joints {
            set.take_joints(joints)?;
        }
        if args.mirror {
            set.add_mirrored().map_err(usage)?;
        }
        let figure = args.figure.read(&set)?;
        Ok(Self {
            mesh: mesh_of(&read, &mut set)?,
            set,
            figure,
            graph: args.graph_settings(),
            maps: match args.paper_maps {
                true => MapGrid::PAPER,
                false => MapGrid::default(),
            },
        })
    }

    /// What is doubtful in the clips, the body and the props.
    pub(crate) fn notes(&self) -> Vec<String> {
        let of_clips = self.set.warnings.iter();
        of_clips.chain(&self.figure.warnings).cloned().collect()
    }

    pub(crate) fn bake(&self) -> Bake<'_> {
        Bake {
            source: ClipSource {
                skeleton: &self.set.skeleton,
                clips: &self.set.clips,
                events: &self.set.events,
            },
            graph: self.graph.clone(),
            settings: BakeSettings {
                body: self.figure.body.clone(),
                props: self.figure.props.clone(),
                maps: self.maps,
                ..BakeSettings::default()
            },
        }
    }
}

/// The first glTF file that has a skinned mesh with joints of the clips' skeleton, serialized by postcard. The figures in files that sabaki
/// wrote are no characters.
fn mesh_of(paths: &[PathBuf], set: &mut ClipSet) -> Result<Vec<u8>, Failure> {
    for path in motion_files(paths)?.iter().filter(|path| is_gltf(path)) {
        match MeshFile::read(path) {
            Ok((file, mesh)) => {
                let is_known = |joint: &&SkinJoint| set.skeleton.find(&joint.name).is_some();
                let known = mesh.joints.iter().filter(is_known).count();
                if mesh.generator.starts_with("sabaki ") || known < 2 {
                    continue;
                }
                let notes = mesh
                    .notes
                    .iter()
                    .map(|note| format!("{}: {note}", file.name));
                set.warnings.extend(notes);
                return postcard::to_stdvec(&file).map_err(usage);
            }
            Err(ReadError::File { error, .. }) if matches!(*error, FileError::NoMesh) => {}
            Err(error) => set.warnings.push(format!("its mesh is not kept: {error}")),
        }
    }
    Ok(Vec::new())
}

pub(super) fn from_clips(args: &ClipArgs, draw: MapDrawing) -> Result<Baked, Failure> {
    let started = Instant::now();
    let input = BakeInput::read(args)?;
    let mut baked = input
        .bake()
        .run(draw)
        .map_err(|failure| within(args, failure))?;
    baked.mesh.clone_from(&input.mesh);
    baked.warnings.splice(..0, input.notes());
    baked.figure = input.figure;
    baked.left_out = input.set.left_out;
    baked.joints = input.set.figure;
    baked.seconds = started.elapsed().as_secs_f64();
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
    let mut clips = args.clips();
    match (failure, clips.next(), clips.count()) {
        (failure @ Failure::Cancelled, ..) | (failure, None, _) => failure,
        (failure, Some(only), 0) => failure.within(only),
        (failure, Some(first), more) => {
            failure.within(Path::new(&format!("{} and {more} more", first.display())))
        }
    }
}

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
    .run(MapDrawing::Cpu)
}

/// A graph, and how it was built.
#[derive(Serialize, Deserialize)]
pub(crate) struct BuiltGraph {
    pub(crate) graph: MotionGraph,
    pub(crate) report: BuildReport,
}

/// Input and settings of a bake.
pub(crate) struct Bake<'a> {
    pub(crate) source: ClipSource<'a>,
    pub(crate) graph: GraphSettings,
    pub(crate) settings: BakeSettings,
}

impl Bake<'_> {
    fn run(self, draw: MapDrawing) -> Result<Baked, Failure> {
        let started = Instant::now();
        let watch = BakeBar::new();
        let built = self.build(&watch, |builder| Ok(builder.find_transitions()?))?;
        let mut baked = finish(built, self.settings, Vec::new(), draw, &watch)?;
        baked.seconds = started.elapsed().as_secs_f64();
        Ok(baked)
    }

    /// Builds the graph with the transitions that `find` returns.
    pub(crate) fn build(
        &self,
        watch: &BakeBar,
        find: impl FnOnce(&GraphBuilder<'_>) -> Result<TransitionList, Failure>,
    ) -> Result<BuiltGraph, Failure> {
        watch.short("preparing clips");
        let builder = GraphBuilder::new(self.source, &self.graph)?.watched(watch);
        let transitions = find(&builder)?;
        let (graph, report) = builder.build(transitions)?;
        Ok(BuiltGraph { graph, report })
    }
}

/// Computes maps, paths and tables of a graph, and its entries unless all shares of them are given.
pub(crate) fn finish(
    BuiltGraph { graph, report }: BuiltGraph,
    settings: BakeSettings,
    entries: Vec<EntryShare>,
    draw: MapDrawing,
    watch: &BakeBar,
) -> Result<Baked, Failure> {
    let started = Instant::now();
    watch.short("drawing maps");
    let feet = graph.foot_slide(MEASURED);
    let baker = Baker::new(graph, settings)?;
    let maps = match draw {
        MapDrawing::Cpu => baker.draw_on_cpu(),
        MapDrawing::Stencil => draw_on_device(&baker)?,
    };
    let graph = baker.finish_watched(maps, entries, watch)?;
    let mut warnings = Vec::new();
    if graph.evasions().is_empty() {
        let labelled = report.events.evasions;
        let what = match labelled {
            0 => "no clip has an evasion (`sabaki annotate` proposes some)".to_owned(),
            n => format!("none of the {n} evasions can be reached and left again"),
        };
        warnings.push(format!(
            "{what}: attacks are avoided by whatever motion there is"
        ));
    }
    Ok(Baked {
        graph,
        mesh: Vec::new(),
        report,
        feet,
        seconds: started.elapsed().as_secs_f64(),
        warnings,
        figure: Figure::default(),
        joints: String::new(),
        left_out: Vec::new(),
    })
}

/// Draws all maps with the stencil buffer of the most capable device.
fn draw_on_device(baker: &Baker) -> Result<DrawnMaps, Failure> {
    let failed = |error: GpuError| Failure::Device(format!("--draw stencil: {error}"));
    let mut device = Headless::new(&HeadlessDesc::default()).map_err(failed)?;
    let drawn = device.draw_maps(baker).map_err(failed);
    culling::destroy(device);
    drawn
}
