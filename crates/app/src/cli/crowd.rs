//! `sabaki crowd`: how long a crowd takes to be posed, before levels of detail and after, on every instruction set and
//! number of threads, in one run.

use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;
use indicatif::ProgressIterator;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg32;
use sabaki::anim::{Clip, ClipDesc, Skeleton};
use sabaki::crowd::{
    AnimationSet, Character, ClipId, Crowd, CrowdSettings, Form, Frame, Layout, LevelId, LevelView,
    Output, Placement,
};
use sabaki::lod::{LevelSettings, Levels, Measure, Rule, SwitchSettings, Switching};
use sabaki::math::{F32x16, Isa, Rigid2};
use sabaki_app::demo;
use serde_json::{Value, json};

use super::{Done, Failure, cancel, output};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// BVH or glTF file, or a folder of them for one skeleton. Default: the embedded motions.
    #[arg(value_name = "CLIP")]
    clip: Option<PathBuf>,
    /// Number of characters.
    #[arg(long, default_value_t = 10_000, value_parser = clap::value_parser!(u32).range(1..=4_000_000))]
    count: u32,
    /// Largest number of threads; 0 for all of the machine.
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Number of frames measured in each case; the median counts.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: u32,
    /// Largest error on the screen where levels depend on distance, in pixels at 1080 lines and 60 degrees.
    #[arg(long, value_name = "PIXELS", default_value_t = 2.0)]
    error: f32,
    /// Writes quaternions and positions instead of matrices.
    #[arg(long)]
    rotations: bool,
    /// Seed of the characters' phases.
    #[arg(long, default_value_t = 5)]
    seed: u64,
}

/// Characters, and the clips that they play.
struct Scene {
    animations: Arc<AnimationSet>,
    switching: Switching,
    characters: Vec<Character>,
}

/// Which level each character has.
#[derive(Clone, Copy, PartialEq)]
enum Lod {
    /// All joints.
    Off,
    /// The same for all.
    Level(u16),
    /// By the distance from the head of the column.
    Distance,
}

/// What is measured.
#[derive(Clone, Copy, PartialEq)]
struct Case {
    what: What,
    lod: Lod,
    layout: Layout,
    isa: Isa,
    threads: usize,
    /// Clips that are cut from the motions, without levels; `None`: the clips as they are.
    cut: Option<usize>,
}

/// What a measured time contains.
#[derive(Clone, Copy, PartialEq)]
enum What {
    /// Poses of characters whose levels are known.
    Pose,
    /// The whole frame: levels by a camera at this speed, in metres per second, time and poses.
    Frame(Motion),
}

/// How the camera moves into the column.
#[derive(Clone, Copy, PartialEq)]
enum Motion {
    Still,
    Walk,
    Run,
}

struct Row {
    case: Case,
    clips: usize,
    /// Joints of a character; the mean, where levels differ.
    joints: f64,
    ms: f64,
}

/// The column: so many abreast, so far apart, metres; the camera stands before its head.
const ABREAST: usize = 10;
const APART: f32 = 1.0;
const BEFORE: f32 = 5.0;

/// Numbers of clips that are measured against each other, each clip [`CUT_SECONDS`] long.
const CUTS: [usize; 3] = [1, 8, 200];
const CUT_SECONDS: f64 = 2.0;

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    let scene = Scene::new(args, None)?;
    let cut_scenes = { CUTS.into_iter() }
        .map(|clips| Scene::new(args, Some(clips)))
        .collect::<Result<Vec<_>, _>>()?;
    let cases = args.cases(scene.animations.levels());
    cancel::listen();
    let bar = output::progress("posing", cases.len() as u64);
    let mut rows = Vec::with_capacity(cases.len());
    for case in cases.into_iter().progress_with(bar) {
        cancel::check()?;
        let cut = CUTS.iter().position(|&clips| Some(clips) == case.cut);
        let scene = match cut.map(|index| &cut_scenes[index]) {
            Some(cut) => cut,
            None => &scene,
        };
        rows.push(scene.measure(args, case)?);
    }
    Ok(Done::ok(if as_json {
        Done::json(&json!({
            "rows": rows.iter().map(|row| row.to_json(args, &rows)).collect::<Vec<_>>(),
            "clips": scene.animations.clips(),
            "levels": scene.animations.levels(),
            "key_bytes": scene.animations.bytes(),
            "error_pixels": args.error,
        }))
    } else {
        describe(args, &scene, &rows)
    }))
}

fn usage(error: impl std::fmt::Display) -> Failure {
    Failure::Usage(error.to_string())
}

impl Args {
    fn form(&self) -> Form {
        match self.rotations {
            true => Form::Rotations,
            false => Form::Matrices,
        }
    }

    fn clips(&self) -> Result<(Skeleton, Vec<Clip>), Failure> {
        match &self.clip {
            None => {
                let motions = demo::motions().map_err(sabaki::graph::GraphError::from)?;
                Ok((motions.skeleton, motions.clips))
            }
            Some(path) => {
                let paths = std::slice::from_ref(path);
                let set =
                    sabaki_import::read_clips(paths, None, &sabaki_import::ReadOptions::default())?;
                Ok((set.skeleton, set.clips))
            }
        }
    }

    /// Poses without levels and by distance, and frames, on all instruction sets and numbers of threads; the rest on the
    /// widest registers and one thread.
    fn cases(&self, levels: usize) -> Vec<Case> {
        let most = match self.threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            threads => threads,
        };
        let doubled = std::iter::successors(Some(1), |&threads| Some(2 * threads));
        let mut threads: Vec<usize> = doubled.take_while(|&threads| threads < most).collect();
        threads.push(most);
        let plain = Case {
            what: What::Pose,
            lod: Lod::Off,
            layout: Layout::Blocks,
            isa: Isa::best(),
            threads: 1,
            cut: None,
        };
        let mut cases = Vec::new();
        let frame = |motion| (What::Frame(motion), Lod::Distance);
        for (what, lod) in [
            (What::Pose, Lod::Off),
            (What::Pose, Lod::Distance),
            frame(Motion::Still),
            frame(Motion::Walk),
            frame(Motion::Run),
        ] {
            for isa in Isa::available() {
                let all = threads.iter().map(|&threads| Case {
                    what,
                    lod,
                    isa,
                    threads,
                    ..plain
                });
                cases.extend(all);
            }
        }
        cases.push(Case {
            layout: Layout::Rows,
            ..plain
        });
        cases.extend(CUTS.map(|clips| Case {
            cut: Some(clips),
            ..plain
        }));
        let each = (1..levels).map(|level| Case {
            lod: Lod::Level(level as u16),
            ..plain
        });
        cases.extend(each);
        cases
    }
}

/// So many stretches of the clips, which begin later and later.
fn cut_clips(skeleton: &Skeleton, clips: &[Clip], count: usize) -> Result<Vec<Clip>, Failure> {
    let cut = |index: usize| {
        let clip = &clips[index % clips.len()];
        let (desc, joints) = (clip.desc(), skeleton.len());
        let length = ((CUT_SECONDS * clip.frame_rate()) as usize + 1).min(clip.frames());
        let first = (index / clips.len() * 7) % (clip.frames() - length + 1);
        let end = first + length;
        let translations = match desc.translations.is_empty() {
            true => Vec::new(),
            false => desc.translations[first * joints..end * joints].to_vec(),
        };
        let desc = ClipDesc {
            name: format!("{} {index}", desc.name),
            frame_rate: desc.frame_rate,
            roots: desc.roots[first..end].to_vec(),
            rotations: desc.rotations[first * joints..end * joints].to_vec(),
            translations,
        };
        Clip::new(skeleton, desc).map_err(usage)
    };
    (0..count).map(cut).collect()
}

impl Scene {
    /// `cut`: with so many stretches of the clips, and without levels.
    fn new(args: &Args, cut: Option<usize>) -> Result<Self, Failure> {
        let (skeleton, mut clips) = args.clips()?;
        if let Some(count) = cut {
            clips = cut_clips(&skeleton, &clips, count)?;
        }
        let levels = match cut {
            Some(_) => Levels::in_order(&skeleton, &[]),
            None => Levels::build(&skeleton, &clips, &LevelSettings::default()),
        };
        let levels = levels.map_err(usage)?;
        let settings = SwitchSettings {
            rule: Rule::ScreenError {
                pixels: args.error,
                measure: Measure::Greatest,
            },
            ..SwitchSettings::default()
        };
        let animations = AnimationSet::new(&skeleton, &clips, &levels.levels).map_err(usage)?;
        let mut random = Pcg32::seed_from_u64(args.seed);
        let characters = (0..args.count as usize)
            .map(|index| Self::character(index, &animations, &mut random))
            .collect();
        Ok(Self {
            switching: Switching::new(&levels, &settings).map_err(usage)?,
            animations: Arc::new(animations),
            characters,
        })
    }

    /// In a column that walks towards the camera, each at a moment of its own.
    fn character(index: usize, animations: &AnimationSet, random: &mut impl Rng) -> Character {
        let (row, file) = (index / ABREAST, index % ABREAST);
        let clip = ClipId(random.random_range(0..animations.clips()) as u16);
        let seconds = animations.duration(clip).unwrap_or_default();
        Character {
            clip,
            time: seconds * random.random_range(0.0..1.0f32),
            speed: random.random_range(0.9..1.1),
            placement: Placement {
                ground: Rigid2::new(
                    0.0,
                    (file as f32 - 0.5 * (ABREAST - 1) as f32) * APART,
                    -BEFORE - row as f32 * APART,
                ),
                height: 0.0,
            },
            ..Character::default()
        }
    }

    /// The level, and how far it is on the way to the next.
    fn detail(&self, character: &Character, lod: Lod) -> (LevelId, f32) {
        match lod {
            Lod::Off => (LevelId(0), 0.0),
            Lod::Level(level) => (LevelId(level), 0.0),
            Lod::Distance => {
                let distance = character.placement.ground.ground().length();
                let choice = self.switching.choose(distance, None);
                (choice.level, choice.blend)
            }
        }
    }

    fn measure(&self, args: &Args, case: Case) -> Result<Row, Failure> {
        let output = Output {
            form: args.form(),
            layout: case.layout,
            ..Output::default()
        };
        let settings = CrowdSettings {
            output,
            isa: case.isa,
            threads: case.threads,
            ..CrowdSettings::default()
        };
        let count = self.characters.len();
        let mut crowd = Crowd::with_capacity(Arc::clone(&self.animations), settings, count);
        let mut joints = 0;
        for character in &self.characters {
            let (level, blend) = self.detail(character, case.lod);
            joints += self.animations.joints(level);
            crowd
                .add(&Character {
                    level,
                    blend,
                    ..*character
                })
                .map_err(usage)?;
        }
        let mut out = vec![F32x16::ZERO; crowd.max_output_len(count)];
        let mut times = Vec::with_capacity(args.frames as usize);
        for frame in 0..args.frames + WARM_UP {
            let started = Instant::now();
            self.step(&mut crowd, (case, frame), &mut out)?;
            if frame >= WARM_UP {
                times.push(started.elapsed().as_secs_f64() * 1e3);
            }
        }
        times.sort_by(f64::total_cmp);
        Ok(Row {
            case,
            clips: self.animations.clips(),
            joints: joints as f64 / count as f64,
            ms: times[times.len() / 2],
        })
    }

    fn step(
        &self,
        crowd: &mut Crowd,
        (case, frame): (Case, u32),
        out: &mut [F32x16],
    ) -> Result<(), Failure> {
        let What::Frame(motion) = case.what else {
            crowd.advance(SECONDS);
            return crowd.pose(out).map_err(usage);
        };
        let walked = motion.speed() * frame as f32 * SECONDS as f32;
        let view = LevelView {
            switching: &self.switching,
            eye: Vec3::new(0.0, 0.0, -walked),
        };
        let frame = Frame {
            seconds: SECONDS,
            levels: Some(view),
            ..Frame::default()
        };
        crowd.frame(&frame, out).map(drop).map_err(usage)
    }
}

/// Length of a frame, in seconds.
const SECONDS: f64 = 1.0 / 60.0;

/// Frames that are not measured.
const WARM_UP: u32 = 3;

impl Motion {
    fn name(self) -> &'static str {
        match self {
            Self::Still => "still",
            Self::Walk => "walk",
            Self::Run => "run",
        }
    }

    /// Metres per second.
    fn speed(self) -> f32 {
        match self {
            Self::Still => 0.0,
            Self::Walk => 1.5,
            Self::Run => 5.0,
        }
    }
}

impl What {
    fn name(self) -> &'static str {
        match self {
            Self::Pose => "pose",
            Self::Frame(_) => "frame",
        }
    }

    fn camera(self) -> &'static str {
        match self {
            Self::Pose => Motion::Still.name(),
            Self::Frame(motion) => motion.name(),
        }
    }
}

impl Lod {
    fn name(self) -> String {
        match self {
            Self::Off => "off".to_owned(),
            Self::Level(level) => level.to_string(),
            Self::Distance => "distance".to_owned(),
        }
    }
}

impl Row {
    fn isa(&self) -> String {
        format!("{:?}", self.case.isa).to_lowercase()
    }

    fn layout(&self) -> &'static str {
        match self.case.layout {
            Layout::Blocks => "blocks",
            Layout::Rows => "rows",
        }
    }

    /// Nanoseconds for a joint of a character.
    fn per_joint(&self, args: &Args) -> f64 {
        self.ms * 1e6 / (self.joints * f64::from(args.count))
    }

    /// How many times as fast as posing all joints in blocks, on the same instruction set and number of threads; of cut
    /// clips, as one of them.
    fn against_plain(&self, rows: &[Self]) -> f64 {
        let plain = Case {
            what: What::Pose,
            lod: Lod::Off,
            layout: Layout::Blocks,
            cut: self.case.cut.map(|_| CUTS[0]),
            ..self.case
        };
        let plain = rows.iter().find(|row| row.case == plain);
        plain.map_or(1.0, |plain| plain.ms / self.ms)
    }

    fn to_json(&self, args: &Args, rows: &[Self]) -> Value {
        json!({
            "what": self.case.what.name(),
            "camera": self.case.what.camera(),
            "clips": self.clips,
            "layout": self.layout(),
            "form": match args.form() {
                Form::Matrices => "matrices",
                Form::Rotations => "rotations",
            },
            "lod": self.case.lod.name(),
            "isa": self.isa(),
            "threads": self.case.threads,
            "count": args.count,
            "joints": self.joints,
            "ms": self.ms,
            "ns_per_joint": self.per_joint(args),
            "against_plain": self.against_plain(rows),
        })
    }
}

fn describe(args: &Args, scene: &Scene, rows: &[Row]) -> String {
    let head = [
        "what",
        "camera",
        "levels",
        "clips",
        "layout",
        "registers",
        "threads",
        "joints",
        "ms",
        "ns a joint",
        "against all joints",
    ];
    let mut table = output::table(&head, 6);
    for row in rows {
        table.add_row(vec![
            row.case.what.name().to_owned(),
            row.case.what.camera().to_owned(),
            row.case.lod.name(),
            row.clips.to_string(),
            row.layout().to_owned(),
            row.isa(),
            row.case.threads.to_string(),
            format!("{:.2}", row.joints),
            format!("{:.3}", row.ms),
            format!("{:.2}", row.per_joint(args)),
            format!("{:.2} x", row.against_plain(rows)),
        ]);
    }
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{} characters, {} clips, {} levels, {:.1} MB of keys; medians of {} frames",
        args.count,
        scene.animations.clips(),
        scene.animations.levels(),
        scene.animations.bytes() as f64 * 1e-6,
        args.frames
    );
    let _ = writeln!(
        text,
        "distance: a column {ABREAST} abreast, {APART} m apart, seen from its head; at most {} pixels of error on the screen",
        args.error
    );
    let _ = writeln!(text, "{table}");
    text
}
