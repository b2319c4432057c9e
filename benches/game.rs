//! What a frame of a game costs, as time of the thread, and what bounds it: `cargo bench --bench game -- --json FILE`.
//!
//! The graph is that of the embedded motions, or a baked file: `--baked FILE`. `--only PART` measures one part, such as `plans`. Rows of times have the median, 99% and the worst, in milliseconds.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::collections::BTreeMap;
use std::f32::consts::TAU;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use rustix::time::{ClockId, clock_gettime};
use sabaki::anim::JointTransform;
use sabaki::archive;
use sabaki::character::{
    CharacterEvent, CharacterEventKind, CharacterId, CharacterSettings, Characters,
    CrowdPoseSettings, Goal, KindId, Threat,
};
use sabaki::lod::{LevelSettings, Levels, SwitchSettings, Switching};
use sabaki::maps::BakedGraph;
use sabaki::math::{F32x16, Rigid2, Sphere};
use sabaki::query::Obstacle;
use sabaki_fixtures::baked::embedded_file;
use sabaki_fixtures::memory::{Counting, allocations, status};
use sabaki_fixtures::random::Random;

#[global_allocator]
static COUNTING: Counting = Counting;

/// Duration of a frame, in seconds.
const FRAME: f32 = 1.0 / 60.0;
/// Speed of walkers, in metres per second.
const WALK: f32 = 1.3;
/// Budget of plans against threats that cannot be avoided, in milliseconds.
const BUDGET: f32 = 2.0;

type Figures = BTreeMap<&'static str, f64>;
/// Measures a part of the figures.
type Part = fn(&Arc<BakedGraph>, &mut Figures);

fn main() {
    let options: Vec<String> = std::env::args().collect();
    let option = |name: &str| {
        let place = options.iter().position(|option| option == name);
        place.and_then(|place| options.get(place + 1).map(PathBuf::from))
    };
    if let Some(file) = option("--resident") {
        let before = status("VmRSS:");
        let baked = Arc::new(archive::read(&file).unwrap());
        let characters = Characters::new(baked, CharacterSettings::default());
        println!("{}", status("VmRSS:") - before);
        return drop(characters);
    }
    let folder = tempfile::tempdir().unwrap();
    let file = option("--baked").unwrap_or_else(|| embedded_file(folder.path()));
    let mut figures = Figures::new();
    let baked = memory(&file, &mut figures);
    println!(
        "{:<52}{:>14}{:>14}{:>14}",
        "milliseconds", "median", "99%", "worst"
    );
    let only = option("--only").map(|name| name.to_string_lossy().into_owned());
    let parts: [(&str, Part); 8] = [
        ("steps", steps),
        ("searches", searches),
        ("plans", plans),
        ("unavoidable", unavoidable),
        ("warm", warm),
        ("poses", poses),
        ("rollback", rollback),
        ("fire", under_fire),
    ];
    for (name, measure) in parts {
        if only.as_ref().is_none_or(|only| only == name) {
            measure(&baked, &mut figures);
        }
    }
    if let Some(json) = option("--json") {
        std::fs::write(json, serde_json::to_string_pretty(&figures).unwrap()).unwrap();
    }
}

/// Time of this thread, in milliseconds.
fn thread_milliseconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    1e3 * time.tv_sec as f64 + 1e-6 * time.tv_nsec as f64
}

fn note(figures: &mut Figures, name: &'static str, value: f64) {
    println!("{name:<52}{value:>14.3}");
    figures.insert(name, value);
}

/// Prints a row, and returns the median and the worst.
fn row(name: &str, times: &[f64]) -> (f64, f64) {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share) as usize];
    let [median, most, worst] = [at(0.5), at(0.99), at(1.0)];
    println!("{name:<52}{median:>14.3}{most:>14.3}{worst:>14.3}");
    (median, worst)
}

fn memory(file: &Path, figures: &mut Figures) -> Arc<BakedGraph> {
    let bytes = std::fs::metadata(file).unwrap().len() as f64;
    let started = thread_milliseconds();
    let baked = Arc::new(archive::read(file).unwrap());
    let opened = thread_milliseconds() - started;
    // In a process of its own, whose memory holds nothing else.
    let mut alone = Command::new(std::env::current_exe().unwrap());
    let output = alone.arg("--resident").arg(file).output().unwrap();
    let held: f64 = String::from_utf8_lossy(&output.stdout)
        .trim()
        .parse()
        .unwrap();
    note(figures, "file_mb", 1e-6 * bytes);
    note(figures, "open_ms", opened);
    note(figures, "resident_by_file_size", held / bytes);
    let mut game = Game::new(&baked, 1, CharacterSettings::default());
    game.play(120, |_| ());
    note(
        figures,
        "saved_bytes_of_a_character",
        game.characters.save().unwrap().len() as f64,
    );
    baked
}

/// A game in a loop.
struct Game {
    characters: Characters,
    ids: Vec<CharacterId>,
    random: Random,
    obstacles: Vec<Obstacle>,
    events: Vec<CharacterEvent>,
}

impl Game {
    /// Characters in rows, 3 m apart, which have stood for a moment.
    fn new(baked: &Arc<BakedGraph>, count: usize, settings: CharacterSettings) -> Self {
        let mut characters = Characters::new(Arc::clone(baked), settings).unwrap();
        let place = |index: usize| {
            let [x, z] = [index % 20, index / 20].map(|at| 3.0 * at as f32);
            Rigid2::new(index as f32, x, z)
        };
        let ids = (0..count).map(|index| characters.spawn(place(index)).unwrap());
        let mut game = Self {
            ids: ids.collect(),
            characters,
            random: Random::new(7),
            obstacles: Vec::new(),
            events: Vec::new(),
        };
        game.play(30, |_| ());
        game
    }

    /// The times of so many frames. `before` is called before each one, outside the measured time.
    fn play(&mut self, frames: usize, mut before: impl FnMut(&mut Self)) -> Vec<f64> {
        let mut one = || {
            before(self);
            let started = thread_milliseconds();
            self.characters
                .step(FRAME, &self.obstacles, &mut self.events);
            thread_milliseconds() - started
        };
        (0..frames).map(|_| one()).collect()
    }

    fn walk(&mut self) {
        for &id in &self.ids {
            let velocity = Vec3::Z * WALK;
            let goal = Goal::Walk {
                velocity,
                facing: None,
            };
            self.characters.steer(id, goal).unwrap();
        }
    }

    /// The pelvis of a character.
    fn middle(&mut self, index: usize) -> Vec3 {
        let count = self.characters.baked().graph().skeleton().len();
        let mut joints = vec![JointTransform::IDENTITY; count];
        self.characters.pose(self.ids[index], &mut joints).unwrap();
        joints[0].translation
    }

    /// A ball at the middle of a character as it moves, which arrives after so many seconds.
    fn ball(&mut self, index: usize, speed: f32, seconds: f32) -> Threat {
        let around = self.random.float(0.0, TAU);
        let height = self.random.float(-0.2, 0.5);
        let walks = self.characters.velocity(self.ids[index]).unwrap();
        let middle = self.middle(index) + Vec3::Y * height + walks * seconds;
        let velocity = Vec3::new(around.sin(), 0.0, around.cos()) * speed;
        Threat {
            seconds: seconds + 1.0,
            target: Some(self.ids[index]),
            ..Threat::ball(
                self.characters.now(),
                middle - velocity * seconds,
                velocity,
                0.1,
            )
        }
    }

    /// A ball that flies over all characters, out of reach; every other one falls.
    fn flyby(&mut self) -> Threat {
        let [x, z, around] = [60.0, 30.0, TAU].map(|most| self.random.float(0.0, most));
        let speed = self.random.float(4.0, 20.0);
        let way = Vec3::new(around.sin(), 0.0, around.cos());
        let place = Vec3::new(x, 8.0, z) - way * (3.0 * speed);
        let straight = Threat::ball(self.characters.now(), place, way * speed, 0.1);
        match self.characters.threats().count() % 2 {
            0 => straight,
            _ => Threat {
                velocity: straight.velocity + Vec3::Y * 30.0,
                gravity: 9.81,
                seconds: 6.0,
                ..straight
            },
        }
    }
}

fn steps(baked: &Arc<BakedGraph>, figures: &mut Figures) {
    for characters in [1, 30, 200] {
        let mut without = 0.0;
        for threats in [0, 10, 100, 1000] {
            let mut game = Game::new(baked, characters, CharacterSettings::default());
            for _ in 0..threats {
                let threat = game.flyby();
                game.characters.threaten(threat).unwrap();
            }
            let times = game.play(120, |_| ());
            let name = format!("{characters} characters, {threats} threats out of reach");
            let (median, _) = row(&name, &times);
            if threats == 0 {
                without = median;
            }
            if (characters, threats) == (200, 100) {
                note(figures, "step_200_characters_100_threats_ms", median);
            }
            if (characters, threats) == (200, 1000) {
                let pairs = (characters * threats) as f64;
                note(figures, "pair_ns", 1e6 * (median - without) / pairs);
            }
        }
    }
}

/// Walkers that are steered in one frame. Each frame's time is the least of several runs.
fn searches(baked: &Arc<BakedGraph>, figures: &mut Figures) {
    let mut least = vec![f64::INFINITY; 240];
    for _ in 0..5 {
        let mut game = Game::new(baked, 200, CharacterSettings::default());
        game.walk();
        let times = game.play(least.len(), |_| ());
        least
            .iter_mut()
            .zip(times)
            .for_each(|(least, time)| *least = least.min(time));
    }
    let (_, worst) = row("200 walkers steered in one frame", &least);
    let mean = least.iter().sum::<f64>() / least.len() as f64;
    note(figures, "search_worst_by_mean", worst / mean);
}

fn plans(baked: &Arc<BakedGraph>, figures: &mut Figures) {
    let threatened = |game: &mut Game, obstacles: usize| {
        game.play(150, |_| ());
        let middle = game.middle(0);
        let disc = |index: usize| {
            let far = 1.2 + 4.0 * index as f32 / obstacles as f32;
            let way = Vec2::from_angle(index as f32 * 2.4) * far;
            Obstacle::disc(Vec2::new(middle.x, middle.z) + way, 0.2).unwrap()
        };
        game.obstacles = (0..obstacles).map(disc).collect();
        for index in 0..game.ids.len() {
            let threat = game.ball(index, 8.0, 1.2);
            game.characters.threaten(threat).unwrap();
        }
        game.play(1, |_| ())[0]
    };
    for (figure, obstacles) in [("plan_ms", 0), ("plan_among_obstacles_ms", 100)] {
        let mut game = Game::new(baked, 1, CharacterSettings::default());
        let times: Vec<f64> = (0..60).map(|_| threatened(&mut game, obstacles)).collect();
        let name = format!("one plan, for a ball seen 1.2 s before, {obstacles} obstacles");
        note(figures, figure, row(&name, &times).0);
    }
    // All have planned after a quarter of a second.
    let mut game = Game::new(baked, 200, CharacterSettings::default());
    let mut longest = 0.0;
    let mut all = || {
        let first = threatened(&mut game, 0);
        let times = game.play(14, |_| ());
        longest = times.iter().copied().fold(first.max(longest), f64::max);
        first + times.iter().sum::<f64>()
    };
    let times: Vec<f64> = (0..5).map(|_| all()).collect();
    let name = "200 newly threatened in one step, all their plans";
    note(figures, "plans_of_200_ms", row(name, &times).0);
    note(figures, "plans_of_200_worst_step_ms", longest);
}

fn unavoidable(baked: &Arc<BakedGraph>, figures: &mut Figures) {
    let settings = CharacterSettings {
        plan_milliseconds: BUDGET,
        ..CharacterSettings::default()
    };
    let wall = |threat: Threat| Threat {
        spheres: (0..64)
            .map(|index| Vec3::new((index % 8) as f32 - 3.5, (index / 8) as f32 - 3.5, 0.0) * 0.4)
            .map(|centre| Sphere::new(centre, 0.25))
            .collect(),
        ..threat
    };
    let mut all: f64 = 0.0;
    for name in [
        "stays in the chest",
        "64 spheres",
        "radius 3 m",
        "slow",
        "seen 0.2 s before",
    ] {
        let mut times = Vec::new();
        for round in 0..4 {
            let mut game = Game::new(baked, 1, settings);
            game.play(20 * round, |_| ());
            let threat = match name {
                "stays in the chest" => Threat {
                    velocity: Vec3::ZERO,
                    ..game.ball(0, 0.1, 0.0)
                },
                "64 spheres" => wall(game.ball(0, 6.0, 1.0)),
                "radius 3 m" => Threat {
                    spheres: vec![Sphere::new(Vec3::ZERO, 3.0)],
                    ..game.ball(0, 6.0, 1.5)
                },
                "slow" => Threat {
                    seconds: 20.0,
                    ..game.ball(0, 0.3, 1.5)
                },
                _ => game.ball(0, 15.0, 0.2),
            };
            game.characters.threaten(threat).unwrap();
            times.extend(game.play(240, |_| ()));
        }
        all = all.max(row(&format!("one character, unavoidable: {name}"), &times).1);
    }
    note(figures, "worst_step_ms", all);
}

fn warm(baked: &Arc<BakedGraph>, figures: &mut Figures) {
    const FRAMES: usize = 300;
    let mut game = Game::new(baked, 31, CharacterSettings::default());
    game.walk();
    let mut allocated = 0;
    for measured in [false, false, true] {
        let mut frame = 0;
        let mut made = 0;
        let times = game.play(FRAMES, |game| {
            made += allocations() - allocated;
            if frame % 90 == 0 {
                for index in 0..game.ids.len() {
                    let threat = game.ball(index, 8.0, 1.0);
                    game.characters.threaten(threat).unwrap();
                }
                game.events.clear();
                game.events.reserve(1000);
            }
            frame += 1;
            allocated = allocations();
        });
        if measured {
            row("31 walkers, a ball each 1.5 s for each", &times);
            note(figures, "allocations_per_step", made as f64 / FRAMES as f64);
        }
    }
}

/// Poses of many walkers: one character after the other with all joints, and all at once on levels of detail seen from the edge of the crowd.
fn poses(baked: &Arc<BakedGraph>, figures: &mut Figures) {
    const COUNT: usize = 1000;
    let mut game = Game::new(baked, COUNT, CharacterSettings::default());
    game.walk();
    let graph = baked.graph();
    let levels = Levels::build(graph.skeleton(), graph.clips(), &LevelSettings::default()).unwrap();
    let settings = CrowdPoseSettings {
        switching: Switching::new(&levels, &SwitchSettings::default()).unwrap(),
        ..CrowdPoseSettings::default()
    };
    game.characters
        .use_crowd(KindId::default(), &levels, settings)
        .unwrap();
    let mut out = vec![F32x16::ZERO; game.characters.max_output_len(KindId::default(), COUNT)];
    let (mut one_by_one, mut all_at_once) = (Vec::new(), Vec::new());
    for _ in 0..100 {
        game.play(1, |_| ());
        let started = thread_milliseconds();
        for index in 0..COUNT {
            game.middle(index);
        }
        let posed = thread_milliseconds();
        let eye = Vec3::new(-5.0, 1.7, -5.0);
        game.characters
            .pose_all(KindId::default(), eye, &mut out)
            .unwrap();
        one_by_one.push(posed - started);
        all_at_once.push(thread_milliseconds() - posed);
    }
    let name = format!("{COUNT} walkers, posed one by one");
    note(figures, "pose_one_by_one_ms", row(&name, &one_by_one).0);
    let name = format!("{COUNT} walkers, posed at once");
    note(figures, "pose_all_ms", row(&name, &all_at_once).0);
}

/// Eight frames of walkers that are stepped from a saved state, which then comes back, as in a game with rollback.
fn rollback(baked: &Arc<BakedGraph>, figures: &mut Figures) {
    const FRAMES: usize = 8;
    let mut game = Game::new(baked, 200, CharacterSettings::default());
    game.walk();
    game.play(60, |_| ());
    let mut one = || {
        let started = thread_milliseconds();
        let saved = game.characters.state();
        game.play(FRAMES, |_| ());
        game.characters.restore(saved).unwrap();
        thread_milliseconds() - started
    };
    let times: Vec<f64> = (0..40).map(|_| one()).collect();
    let (median, _) = row("200 walkers saved, stepped 8 times and restored", &times);
    note(figures, "rollback_ms", median);
}

/// Walkers with a ball each second, and the way that they make of what they are asked for.
fn under_fire(baked: &Arc<BakedGraph>, figures: &mut Figures) {
    const WALKERS: usize = 10;
    const SECONDS: usize = 30;
    let mut without_fire = None;
    for (pause, way_name, hits_name) in [
        (usize::MAX, "way_by_asked_without_fire", "hits_without_fire"),
        (60, "way_under_fire", "hits_under_fire"),
        (30, "way_under_more_fire", "hits_under_more_fire"),
    ] {
        let mut game = Game::new(baked, WALKERS, CharacterSettings::default());
        game.walk();
        let mut way = -(0..WALKERS).map(|index| game.middle(index).z).sum::<f32>();
        let (mut frame, mut balls) = (1, 0);
        let times = game.play(60 * SECONDS, |game| {
            for index in 0..WALKERS {
                if (frame + 7 * index) % pause == 0 {
                    let threat = game.ball(index, 8.0, 0.9);
                    game.characters.threaten(threat).unwrap();
                    balls += 1;
                }
            }
            frame += 1;
        });
        row(
            &format!("{WALKERS} walkers, {balls} balls in {SECONDS} s"),
            &times,
        );
        way += (0..WALKERS).map(|index| game.middle(index).z).sum::<f32>();
        let most = without_fire.unwrap_or(WALK * (WALKERS * SECONDS) as f32);
        without_fire = without_fire.or(Some(way));
        note(figures, way_name, f64::from(way / most));
        let is_hit = |event: &&CharacterEvent| matches!(event.kind, CharacterEventKind::Hit { .. });
        let hits = game.events.iter().filter(is_hit).count();
        note(
            figures,
            hits_name,
            hits as f64 / f64::max(f64::from(balls), 1.0),
        );
    }
}
