//! `sabaki crowd`: how long a crowd takes to be posed, before levels of detail and after, on every instruction set and
//! number of threads, in one run.

use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use indicatif::ProgressIterator;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg32;
use sabaki::anim::{Clip, Skeleton};
use sabaki::crowd::{
    AnimationSet, Character, ClipId, Crowd, CrowdSettings, Form, LevelId, Output, Placement,
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

/// Characters of which each plays something.
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

struct Row {
    lod: Lod,
    isa: Isa,
    threads: usize,
    /// Joints of a character; the mean, where levels differ.
    joints: f64,
    ms: f64,
}

/// The column: so many abreast, so far apart, metres; the camera stands before its head.
const ABREAST: usize = 10;
const APART: f32 = 1.0;
const BEFORE: f32 = 5.0;

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    let scene = Scene::new(args)?;
    let cases = args.cases(scene.animations.levels());
    cancel::listen();
    let bar = output::progress("posing", cases.len() as u64);
    let mut rows = Vec::with_capacity(cases.len());
    for (lod, isa, threads) in cases.into_iter().progress_with(bar) {
        cancel::check()?;
        rows.push(scene.measure(args, (lod, isa, threads))?);
    }
    Ok(Done::ok(if as_json {
        Done::json(&json!({
            "rows": rows.iter().map(|row| row.to_json(args)).collect::<Vec<_>>(),
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

    /// Everything on the widest registers and one thread; without levels and by distance on all.
    fn cases(&self, levels: usize) -> Vec<(Lod, Isa, usize)> {
        let most = match self.threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            threads => threads,
        };
        let doubled = std::iter::successors(Some(1), |&threads| Some(2 * threads));
        let mut threads: Vec<usize> = doubled.take_while(|&threads| threads < most).collect();
        threads.push(most);
        let mut cases = Vec::new();
        for lod in [Lod::Off, Lod::Distance] {
            for isa in Isa::available() {
                cases.extend(threads.iter().map(|&threads| (lod, isa, threads)));
            }
        }
        let each = (1..levels).map(|level| (Lod::Level(level as u16), Isa::best(), 1));
        cases.extend(each);
        cases
    }
}

impl Scene {
    fn new(args: &Args) -> Result<Self, Failure> {
        let (skeleton, clips) = args.clips()?;
        let levels = Levels::build(&skeleton, &clips, &LevelSettings::default()).map_err(usage)?;
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

    fn measure(&self, args: &Args, (lod, isa, threads): (Lod, Isa, usize)) -> Result<Row, Failure> {
        let output = Output {
            form: if args.rotations {
                Form::Rotations
            } else {
                Form::Matrices
            },
            ..Output::default()
        };
        let settings = CrowdSettings {
            output,
            isa,
            threads,
            ..CrowdSettings::default()
        };
        let mut crowd = Crowd::new(Arc::clone(&self.animations), settings);
        let mut joints = 0;
        for character in &self.characters {
            let (level, blend) = self.detail(character, lod);
            joints += self.animations.joints(level);
            crowd
                .add(&Character {
                    level,
                    blend,
                    ..*character
                })
                .map_err(usage)?;
        }
        let mut out = vec![F32x16::ZERO; crowd.output_len()];
        let mut times = Vec::with_capacity(args.frames as usize);
        for frame in 0..args.frames + 3 {
            crowd.advance(1.0 / 60.0);
            let started = Instant::now();
            crowd.pose(&mut out).map_err(usage)?;
            if frame >= 3 {
                times.push(started.elapsed().as_secs_f64() * 1e3);
            }
        }
        times.sort_by(f64::total_cmp);
        Ok(Row {
            lod,
            isa,
            threads,
            joints: joints as f64 / self.characters.len() as f64,
            ms: times[times.len() / 2],
        })
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
        format!("{:?}", self.isa).to_lowercase()
    }

    /// Nanoseconds of a joint of a character.
    fn per_joint(&self, args: &Args) -> f64 {
        self.ms * 1e6 / (self.joints * f64::from(args.count))
    }

    fn to_json(&self, args: &Args) -> Value {
        json!({
            "lod": self.lod.name(),
            "isa": self.isa(),
            "threads": self.threads,
            "count": args.count,
            "joints": self.joints,
            "ms": self.ms,
            "ns_per_joint": self.per_joint(args),
        })
    }
}

fn describe(args: &Args, scene: &Scene, rows: &[Row]) -> String {
    let head = [
        "levels",
        "registers",
        "threads",
        "joints",
        "ms",
        "ns a joint",
        "against all joints",
    ];
    let mut table = output::table(&head, 2);
    for row in rows {
        let before = rows.iter().find(|before| {
            before.lod == Lod::Off && before.isa == row.isa && before.threads == row.threads
        });
        let gain = before.map_or(String::new(), |before| {
            format!("{:.2} x", before.ms / row.ms)
        });
        table.add_row(vec![
            row.lod.name(),
            row.isa(),
            row.threads.to_string(),
            format!("{:.2}", row.joints),
            format!("{:.3}", row.ms),
            format!("{:.2}", row.per_joint(args)),
            gain,
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
