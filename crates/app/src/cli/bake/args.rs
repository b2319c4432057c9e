//! Arguments that name clips, and how they are read and built into a graph.

use std::io::Read;
use std::path::{Path, PathBuf};

use sabaki::anim::{Clip, CompressionSettings, Skeleton};
use sabaki::archive;
use sabaki::graph::{GraphError, GraphSettings};
use sabaki_fixtures::demo;
use sabaki_import::{is_motion_file, without_mark};

use super::super::Failure;
use super::super::figure::FigureArgs;
use super::super::numbers::number;

/// What motion files do not contain.
#[derive(Clone, Copy, Debug, clap::Args)]
#[command(next_help_heading = "Clips")]
pub(crate) struct ReadArgs {
    /// Metres per unit of the files. Default: derived from the figure's height, one for all files of a skeleton (glTF: 1, where that makes a figure).
    #[arg(long, value_name = "METRES")]
    scale: Option<f64>,
    /// Up axis of the files: x, y, z, -x, -y or -z. Default: y, or the axis along which the figure stands.
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true)]
    up: Option<sabaki_import::Up>,
    /// Frame rate of AMC files, in frames per second. Default: the rate that the file names, or 120.
    #[arg(long, value_name = "HZ")]
    amc_rate: Option<f64>,
}

impl ReadArgs {
    pub(crate) fn options(&self) -> sabaki_import::ReadOptions {
        sabaki_import::ReadOptions {
            scale: self.scale,
            up: self.up,
            amc_rate: self.amc_rate,
            keep_going: false,
            retarget: false,
        }
    }
}

/// Bytes of the unit of `--memory`.
const GB: f32 = (1u64 << 30) as f32;

/// Clips, and the settings of the graph built from them.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Clips")]
pub(crate) struct ClipArgs {
    /// BVH, AMC, glTF or FBX files, or folders of them. The mesh of the first glTF or FBX file is kept in the graph's file, and drawn.
    #[arg(value_name = "PATH")]
    paths: Vec<PathBuf>,
    /// Clips to bake, as PATH: BVH, AMC, glTF or FBX files, or folders of them.
    #[arg(long, num_args = 1.., value_name = "PATH")]
    clips: Vec<PathBuf>,
    /// Events file (JSON) that labels evasions and attacks in the clips.
    #[arg(long, value_name = "FILE")]
    pub(crate) events: Option<PathBuf>,
    /// Adds a mirrored copy of each clip and its events, left and right exchanged by the joints' names.
    #[arg(long)]
    pub(crate) mirror: bool,
    /// Names of the joints that are left_hand, right_hand, left_foot, right_foot and root (JSON), if names and structure do not tell them.
    #[arg(long, value_name = "FILE")]
    pub(crate) joints: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) read: ReadArgs,
    /// Leaves out files that cannot be read, and files whose skeleton is not that of most files, and lists them (exit code 3
    /// of `bake`). Default: such files are errors, and nothing is baked.
    #[arg(long)]
    pub(crate) keep_going: bool,
    /// Puts motions of other skeletons on the skeleton of most files, by the joints' names, and prints what this costs.
    #[arg(long)]
    pub(crate) retarget: bool,
    /// Largest distance of the poses that a transition joins: root mean square over the joints, in metres. Default: 0.1, but a clip that
    /// nothing near leads to is joined at any distance.
    #[arg(long, value_name = "METRES", value_parser = number(1e-6..=1e3))]
    pub(crate) threshold: Option<f32>,
    /// Largest error that compressing the clips may cause at the joints, in millimetres; at the ends it may be three times as large. 0
    /// leaves the clips as they are.
    #[arg(long, value_name = "MM", default_value_t = 0.1, value_parser = clip_error)]
    pub(crate) clip_error: f32,
    /// Memory that building the graph may take, in GB. Clips that would take more are rejected before the work begins.
    #[arg(long, value_name = "GB", default_value_t = GraphSettings::MEMORY as f32 / GB, value_parser = number(1e-6..=1e6))]
    pub(crate) memory: f32,
    #[command(flatten)]
    pub(crate) figure: FigureArgs,
    /// Uses the paper's maps: slabs of 0.30 m, outlines, no time. A program can bake on any other `MapGrid`.
    #[arg(long)]
    pub(crate) paper_maps: bool,
}

fn clip_error(text: &str) -> Result<f32, String> {
    let is_allowed = |&value: &f32| value == 0.0 || (0.01..=300.0).contains(&value);
    let value = text.parse().ok().filter(is_allowed);
    value.ok_or_else(|| "not 0, or millimetres from 0.01 to 300".to_owned())
}

impl ClipArgs {
    /// What can be refused before the clips are read.
    pub(super) fn check(&self) -> Result<(), Failure> {
        if self.clips().next().is_none() {
            let what = "name the clips to bake: BVH, AMC, glTF or FBX files, or folders of them";
            return Err(Failure::Usage(what.to_owned()));
        }
        self.figure.check()
    }

    /// Files and folders of the clips.
    pub(super) fn clips(&self) -> impl Iterator<Item = &PathBuf> + Clone {
        self.paths.iter().chain(&self.clips)
    }

    /// The files and folders that are read, and those that a bake wrote, as their first bytes tell, which are left out, with the reasons.
    pub(super) fn motion_paths(&self) -> Result<(Vec<PathBuf>, Vec<String>), Failure> {
        let (mut read, mut left_out) = (Vec::new(), Vec::new());
        for path in self.clips() {
            match check_is_motion(path) {
                Ok(()) => read.push(path.clone()),
                Err(failure) if self.keep_going => left_out.push(failure),
                Err(failure) => return Err(failure),
            }
        }
        if read.is_empty() && !left_out.is_empty() {
            return Err(left_out.swap_remove(0));
        }
        let left_out = left_out.iter().map(Failure::to_string).collect();
        Ok((read, left_out))
    }

    pub(super) fn graph_settings(&self) -> GraphSettings {
        GraphSettings {
            threshold: self.threshold.unwrap_or(GraphSettings::default().threshold),
            farthest_join: self.threshold,
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
        self.clips()
            .chain(&self.events)
            .chain(&self.joints)
            .map(PathBuf::as_path)
            .chain(self.figure.files())
            .collect()
    }
}

/// First bytes of the parts of a shared bake.
pub(super) const PART: &[u8; 8] = b"sabakis\n";

/// Refuses a file of another kind where a motion is read: one that a bake wrote, or one whose name and beginning are none of a motion file.
/// A file that cannot be opened is left to the reader.
pub(crate) fn check_is_motion(path: &Path) -> Result<(), Failure> {
    let mut head = Vec::new();
    let is_read = archive::open_regular(path).and_then(|file| file.take(64).read_to_end(&mut head));
    if is_read.is_err() {
        return Ok(());
    }
    let word = without_mark(&head).trim_ascii_start();
    let is_bvh = |word: &[u8]| word.eq_ignore_ascii_case(b"HIERARCHY");
    let what = match archive::is_baked(&head) {
        true => "this is a baked graph, and not",
        false if head.starts_with(PART) => {
            "this is a part of a shared bake (for bake join), and not"
        }
        false if is_motion_file(path) || word.get(..9).is_some_and(is_bvh) => return Ok(()),
        false => "not",
    };
    Err(Failure::Usage(format!(
        "{}: {what} a motion file (BVH, AMC, glTF, FBX)",
        path.display()
    )))
}

/// The skeleton and the clips of files, or the embedded ones without a path, and what is doubtful in them.
pub(crate) fn read_clips(
    paths: &[PathBuf],
    options: &sabaki_import::ReadOptions,
) -> Result<(Skeleton, Vec<Clip>, Vec<String>), Failure> {
    if paths.is_empty() {
        let motions = demo::motions().map_err(GraphError::from)?;
        return Ok((motions.skeleton, motions.clips, Vec::new()));
    }
    let set = sabaki_import::read_clips(paths, None, options)?;
    Ok((set.skeleton, set.clips, set.warnings))
}
