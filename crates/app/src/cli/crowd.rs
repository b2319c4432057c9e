//! `sabaki crowd`: how long a crowd takes to be posed, without levels of detail and with them, on every instruction set and number of
//! threads, in one run. `cargo bench --bench crowd` measures layouts, clips, fades and whole frames, too.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use indicatif::ProgressIterator;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;
use sabaki::crowd::{AnimationSet, Character, ClipId, Crowd, CrowdSettings, LevelId, Placement};
use sabaki::lod::{LevelSettings, Levels, Measure, Rule, SwitchSettings, Switching};
use sabaki::math::{F32x16, Isa, Rigid2, thread_count};
use sabaki_app::percentile::percentile;
use serde_json::{Value, json};

use super::bake;
use super::numbers::{number, whole};
use super::output::usage;
use super::{Done, Failure, cancel, output};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// BVH, AMC, glTF or FBX file, or a folder of them for one skeleton. Default: the embedded motions.
    #[arg(value_name = "CLIP")]
    clip: Option<PathBuf>,
    /// Number of characters.
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = whole::<u32>(1..=4_000_000))]
    count: u32,
    /// Largest number of threads; 0: all of the machine. A crowd uses 64 at most.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole::<u64>(0..=1024))]
    threads: u64,
    /// Number of frames measured in each case; the median counts.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = whole::<u32>(1..=100_000))]
    frames: u32,
    /// Largest error on the screen where levels depend on distance, in pixels at 1080 lines and 60 degrees.
    #[arg(long, value_name = "PIXELS", default_value_t = 2.0, value_parser = number(1e-3..=1e6))]
    error: f32,
    /// Seed of the characters' clips and times.
    #[arg(long, value_name = "S", default_value_t = 5, value_parser = whole::<u64>(0..=u64::MAX))]
    seed: u64,
}

/// Number of characters in a row of the column, the distance between neighbours, and that of the camera from its head, in metres.
const ABREAST: usize = 10;
const APART: f32 = 1.0;
const BEFORE: f32 = 5.0;
/// Length of a frame, in seconds, and the number of frames before the measured ones.
const SECONDS: f64 = 1.0 / 60.0;
const WARM_UP: u32 = 3;

/// The level of each character.
#[derive(Clone, Copy, PartialEq)]
enum Lod {
    /// All joints.
    Off,
    /// One level for all characters.
    Level(u16),
    /// Levels by the distance from the camera.
    Distance,
}

/// A case and its time.
struct Row {
    lod: Lod,
    isa: Isa,
    threads: usize,
    /// Joints of a character; the mean, where levels differ.
    joints: f64,
    ms: f64,
}

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    if let Some(path) = &args.clip {
        bake::check_is_motion(path)?;
    }
    cancel::listen();
    let scene = Scene::new(args)?;
    let cases = cases(args, scene.animations.levels());
    let bar = output::progress("posing", cases.len() as u64);
    let mut rows = Vec::with_capacity(cases.len());
    for (lod, isa, threads) in cases.into_iter().progress_with(bar) {
        rows.push(scene.measure(args, lod, isa, threads)?);
    }
    let all = rows.iter().map(|row| row.to_json(args, &rows));
    Ok(Done::ok(match as_json {
        true => Done::json(&json!({
            "rows": all.collect::<Vec<_>>(),
            "clips": scene.animations.clips(),
            "levels": scene.animations.levels(),
            "key_bytes": scene.animations.bytes(),
            "error_pixels": args.error,
        })),
        false => describe(args, &scene, &rows),
    }))
}

/// All joints, and levels by distance, on all instruction sets and numbers of threads; each level on the widest registers and one thread.
fn cases(args: &Args, levels: usize) -> Vec<(Lod, Isa, usize)> {
    let most = thread_count(args.threads as usize).min(CrowdSettings::MOST_THREADS);
    let doubled = std::iter::successors(Some(1), |&threads| Some(2 * threads));
    let mut threads: Vec<usize> = doubled.take_while(|&threads| threads < most).collect();
    threads.push(most);
    let mut cases = Vec::new();
    for lod in [Lod::Off, Lod::Distance] {
        for isa in Isa::available() {
            cases.extend(threads.iter().map(|&threads| (lod, isa, threads)));
        }
    }
    cases.extend((1..levels).map(|level| (Lod::Level(level as u16), Isa::best(), 1)));
    cases
}

/// Characters in a column, and the clips that they play.
struct Scene {
    animations: Arc<AnimationSet>,
    switching: Switching,
    characters: Vec<Character>,
}

impl Scene {
    fn new(args: &Args) -> Result<Self, Failure> {
        let (skeleton, clips, _) = bake::read_clips(args.clip.as_slice(), &Default::default())?;
        let levels = Levels::build(&skeleton, &clips, &LevelSettings::default()).map_err(usage)?;
        let settings = SwitchSettings {
            rule: Rule::ScreenError {
                pixels: args.error,
                measure: Measure::Greatest,
            },
            ..SwitchSettings::default()
        };
        let animations = AnimationSet::new(&skeleton, &clips, &levels.levels);
        let animations = animations.map_err(usage)?;
        let mut random = Pcg32::seed_from_u64(args.seed);
        let character = |index: usize| {
            let (row, file) = (index / ABREAST, index % ABREAST);
            let clip = ClipId(random.random_range(0..animations.clips()) as u32);
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
        };
        let characters = (0..args.count as usize).map(character).collect();
        Ok(Self {
            switching: Switching::new(&levels, &settings).map_err(usage)?,
            characters,
            animations: Arc::new(animations),
        })
    }

    /// Poses the crowd frame after frame.
    fn measure(&self, args: &Args, lod: Lod, isa: Isa, threads: usize) -> Result<Row, Failure> {
        let settings = CrowdSettings {
            isa,
            threads,
            ..CrowdSettings::default()
        };
        let count = self.characters.len();
        let mut crowd = Crowd::with_capacity(Arc::clone(&self.animations), settings, count);
        let mut joints = 0;
        for character in &self.characters {
            let (level, blend) = match lod {
                Lod::Off => (LevelId(0), 0.0),
                Lod::Level(level) => (LevelId(level), 0.0),
                Lod::Distance => {
                    let distance = character.placement.position().length();
                    let choice = self.switching.choose(distance, None);
                    (choice.level, choice.blend)
                }
            };
            joints += self.animations.joints(level);
            let character = Character {
                level,
                blend,
                ..*character
            };
            crowd.add(&character).map_err(usage)?;
        }
        let mut out = vec![F32x16::ZERO; crowd.max_output_len(count)];
        let mut times = Vec::with_capacity(args.frames as usize);
        for frame in 0..args.frames + WARM_UP {
            cancel::check()?;
            let started = Instant::now();
            crowd.advance(SECONDS);
            crowd.pose(&mut out).map_err(usage)?;
            if frame >= WARM_UP {
                times.push(started.elapsed().as_secs_f64() * 1e3);
            }
        }
        Ok(Row {
            lod,
            isa,
            threads,
            joints: joints as f64 / count as f64,
            ms: percentile(times, 0.5),
        })
    }
}

impl Row {
    fn lod(&self) -> String {
        match self.lod {
            Lod::Off => "off".to_owned(),
            Lod::Level(level) => level.to_string(),
            Lod::Distance => "distance".to_owned(),
        }
    }

    fn isa(&self) -> String {
        format!("{:?}", self.isa).to_lowercase()
    }

    /// Nanoseconds for a joint of a character.
    fn per_joint(&self, args: &Args) -> f64 {
        self.ms * 1e6 / (self.joints * f64::from(args.count))
    }

    /// How many times as fast as posing all joints, on the same instruction set and number of threads.
    fn against_plain(&self, rows: &[Self]) -> f64 {
        let mut plain = rows.iter().filter(|row| row.lod == Lod::Off);
        let plain = plain.find(|row| (row.isa, row.threads) == (self.isa, self.threads));
        plain.map_or(1.0, |plain| plain.ms / self.ms)
    }

    fn to_json(&self, args: &Args, rows: &[Self]) -> Value {
        json!({
            "lod": self.lod(),
            "isa": self.isa(),
            "threads": self.threads,
            "count": args.count,
            "joints": self.joints,
            "ms": self.ms,
            "ns_per_joint": self.per_joint(args),
            "against_plain": self.against_plain(rows),
        })
    }
}

fn describe(args: &Args, scene: &Scene, rows: &[Row]) -> String {
    let two = |number: f64| format!("{number:.2}");
    let table = output::table_of(
        2,
        rows,
        &[
            ("levels", &|row| row.lod()),
            ("registers", &|row| row.isa()),
            ("threads", &|row| row.threads.to_string()),
            ("joints", &|row| two(row.joints)),
            ("ms", &|row| format!("{:.3}", row.ms)),
            ("ns a joint", &|row| two(row.per_joint(args))),
            ("times as fast", &|row| two(row.against_plain(rows))),
        ],
    );
    format!(
        "{} characters, {} clips, {} levels, {:.1} MB of keys; medians of {} frames\n\
         distance: a column {ABREAST} abreast, {APART} m apart, seen from its head; at most {} pixels of error\n\
         {table}\n\
         times as fast: as all joints, on the same registers and threads\n",
        args.count,
        scene.animations.clips(),
        scene.animations.levels(),
        scene.animations.bytes() as f64 * 1e-6,
        args.frames,
        args.error,
    )
}
