//! Characters in a column, and how long they take.

use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg32;
use sabaki::anim::{Clip, ClipDesc, Skeleton};
use sabaki::crowd::{
    AnimationSet, AnimationSetDesc, Character, ClipId, ClipMix, Crowd, CrowdSettings, Frame, Hold,
    LevelId, MemberId, Output, Placement,
};
use sabaki::lod::{LevelSettings, Levels, Measure, Rule, SwitchSettings, Switching};
use sabaki::math::{F32x16, Rigid2};

use super::busy::BusyThreads;
use super::cases::{CUT_SECONDS, Case, Lod, Mixed, Motion, TimedWork};
use super::row::Row;
use super::{Args, usage};
use crate::cli::{Failure, cancel};

/// Characters, and the clips that they play.
pub(super) struct Scene {
    pub(super) animations: Arc<AnimationSet>,
    pub(super) levels: Levels,
    switching: Switching,
    pub(super) characters: Vec<Character>,
}

/// Number of characters in a row of the column.
pub(super) const ABREAST: usize = 10;
/// Distance between neighbours in the column, in metres.
pub(super) const APART: f32 = 1.0;
/// Distance of the camera from the head of the column, in metres.
pub(super) const BEFORE: f32 = 5.0;

/// Length of a frame, in seconds.
pub(super) const SECONDS: f64 = 1.0 / 60.0;

/// Number of frames before the measured ones.
pub(super) const WARM_UP: u32 = 3;

impl Scene {
    /// Creates the column. With `cut`, its clips are that many stretches of the given ones, and there are no levels.
    pub(super) fn new(args: &Args, cut: Option<usize>) -> Result<Self, Failure> {
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
        // Any clip serves as a layer.
        let desc = AnimationSetDesc {
            skeleton: &skeleton,
            clips: &clips,
            layers: &clips[..usize::from(cut.is_some())],
            levels: &levels.levels,
        };
        let animations = AnimationSet::build(&desc).map_err(usage)?;
        let mut random = Pcg32::seed_from_u64(args.seed);
        let characters = (0..args.count as usize)
            .map(|index| Self::character(index, &animations, &mut random))
            .collect();
        Ok(Self {
            switching: Switching::new(&levels, &settings).map_err(usage)?,
            levels,
            animations: Arc::new(animations),
            characters,
        })
    }

    /// A character of a column that walks towards the camera. Each starts its clip at another moment.
    fn character(index: usize, animations: &AnimationSet, random: &mut impl Rng) -> Character {
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
    }

    /// The level, and how far it is on the way to the next.
    fn detail(&self, character: &Character, lod: Lod) -> (LevelId, f32) {
        match lod {
            Lod::Off => (LevelId(0), 0.0),
            Lod::Level(level) => (LevelId(level), 0.0),
            Lod::Distance => {
                let distance = character.placement.position().length();
                let choice = self.switching.choose(distance, None);
                (choice.level, choice.blend)
            }
        }
    }

    /// A clip at a moment of its own, half of it.
    fn mixed(character: &Character, is_mixed: bool, clip: Option<ClipId>) -> Option<ClipMix> {
        let clip = clip.filter(|_| is_mixed)?;
        Some(ClipMix {
            clip,
            time: 7.1 * character.time,
            speed: 1.0,
            weight: 0.5,
        })
    }

    /// A crowd of all characters as the case says, and the number of their joints.
    pub(super) fn crowd(&self, args: &Args, case: Case) -> Result<(Crowd, usize), Failure> {
        let output = Output {
            form: args.form(),
            layout: case.layout,
            ..Output::default()
        };
        let settings = CrowdSettings {
            output,
            isa: case.isa,
            threads: case.threads,
            hold: Hold {
                from: LevelId((self.animations.levels() / 2) as u16),
                frames: case.hold,
            },
            ..CrowdSettings::default()
        };
        let count = self.characters.len();
        let mut crowd = Crowd::with_capacity(Arc::clone(&self.animations), settings, count);
        let layer = self.animations.layer(0);
        let mut joints = 0;
        for character in &self.characters {
            let (level, blend) = self.detail(character, case.lod);
            joints += self.animations.joints(level);
            let fade = Self::mixed(character, case.mixed == Mixed::Fade, Some(ClipId(0)));
            let layer = Self::mixed(character, case.mixed == Mixed::Layer, layer);
            let character = Character {
                level,
                blend,
                fade,
                layer,
                ..*character
            };
            crowd.add(&character).map_err(usage)?;
        }
        Ok((crowd, joints))
    }

    pub(super) fn measure(&self, args: &Args, case: Case) -> Result<Row, Failure> {
        let (crowd, joints) = self.crowd(args, case)?;
        let joints = match case.what {
            TimedWork::Pose => joints as f64 / crowd.len() as f64,
            TimedWork::Frame(_) => self.mean_joints(args, case)?,
        };
        let mut posed = PosedCrowd::new(crowd);
        let mut times = Vec::with_capacity(args.frames as usize);
        let _busy = BusyThreads::new(case.busy);
        for frame in 0..args.frames + WARM_UP {
            let started = Instant::now();
            self.step(&mut posed, case, frame)?;
            if frame >= WARM_UP {
                times.push(started.elapsed().as_secs_f64() * 1e3);
            }
        }
        times.sort_by(f64::total_cmp);
        let held = (case.hold > 0).then(|| self.held_error(args, case));
        Ok(Row {
            case,
            clips: self.animations.clips(),
            joints,
            ms: times[times.len() / 2],
            held: held.transpose()?,
        })
    }

    /// Joints of a character in the frames that are measured, on average. The frames are played once more, so that no time is taken
    /// while they are counted.
    fn mean_joints(&self, args: &Args, case: Case) -> Result<f64, Failure> {
        let mut posed = PosedCrowd::new(self.crowd(args, case)?.0);
        let mut joints = 0;
        for frame in 0..args.frames + WARM_UP {
            self.step(&mut posed, case, frame)?;
            if frame < WARM_UP {
                continue;
            }
            for member in 0..args.count {
                let character = posed.crowd.character(MemberId(member)).map_err(usage)?;
                joints += self.animations.joints(character.level);
            }
        }
        Ok(joints as f64 / (f64::from(args.count) * f64::from(args.frames)))
    }

    /// Position of the camera in a frame, in metres.
    pub(super) fn eye(&self, motion: Motion, frame: u32) -> Vec3 {
        Vec3::new(0.0, 0.0, -motion.walked(frame as f32 * SECONDS as f32))
    }

    pub(super) fn step(
        &self,
        posed: &mut PosedCrowd,
        case: Case,
        frame: u32,
    ) -> Result<(), Failure> {
        cancel::check()?;
        let PosedCrowd { crowd, out } = posed;
        let TimedWork::Frame(motion) = case.what else {
            crowd.advance(SECONDS);
            return crowd.pose(out).map_err(usage);
        };
        let frame = Frame {
            seconds: SECONDS,
            switching: Some(&self.switching),
            eye: self.eye(motion, frame),
            ..Frame::default()
        };
        crowd.frame(&frame, out).map(drop).map_err(usage)
    }
}

/// A crowd and the memory of its poses.
pub(super) struct PosedCrowd {
    pub(super) crowd: Crowd,
    pub(super) out: Vec<F32x16>,
}

impl PosedCrowd {
    pub(super) fn new(crowd: Crowd) -> Self {
        Self {
            out: vec![F32x16::ZERO; crowd.max_output_len(crowd.len())],
            crowd,
        }
    }
}

/// Cuts `count` clips out of the given ones, each beginning later than the one before.
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
