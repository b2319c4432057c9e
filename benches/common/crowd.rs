//! Crowds to measure.

use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use sabaki::anim::{Clip, ClipDesc, Skeleton};
use sabaki::crowd::{AnimationSet, Character, ClipId, ClipMix, Crowd, CrowdSettings, LevelId};
use sabaki::lod::{LevelMotion, LevelSettings, Levels, Measure, Rule, SwitchSettings, Switching};
use sabaki::math::{F32x16, Rigid2};
use sabaki_fixtures::demo;
use sabaki_fixtures::random::Random;
use sabaki_import::{ReadOptions, read_clip};

use super::plain::{PlainCharacter, PlainClip};

/// Who is posed, and what they can play.
pub(crate) struct Scene {
    skeleton: Skeleton,
    clips: Vec<Clip>,
    levels: Levels,
    animations: Arc<AnimationSet>,
    characters: Vec<Character>,
}

impl Scene {
    /// Everybody plays the walk with all joints, at a moment and a speed of their own.
    pub(crate) fn one_clip(count: usize) -> Self {
        Self::of(vec![walk().1], count)
    }

    /// Clips of two seconds that begin later and later, without levels of detail: hardly any two characters are near each
    /// other in time.
    pub(crate) fn of_many_clips(clips: usize, count: usize) -> Self {
        let (skeleton, walk) = walk();
        let frames = ((2.0 * walk.frame_rate()) as usize + 1).min(walk.frames());
        let cut = |index: usize| {
            let first = index * 7 % (walk.frames() - frames + 1);
            cut(&walk, first..first + frames)
        };
        let levels = Levels::in_order(&skeleton, &[]).unwrap();
        Self::with_levels((0..clips).map(cut).collect(), levels, count)
    }

    /// The same, each with a second clip.
    pub(crate) fn fading(mut self) -> Self {
        let mut random = Random::new(3);
        for character in &mut self.characters {
            character.fade = Some(ClipMix {
                clip: ClipId(random.float(0.0, self.clips.len() as f32) as u32),
                time: random.float(0.0, 60.0),
                speed: 1.0,
                weight: random.float(0.0, 1.0),
            });
        }
        self
    }

    fn of(clips: Vec<Clip>, count: usize) -> Self {
        let levels = Levels::build(&walk().0, &clips, &LevelSettings::default()).unwrap();
        Self::with_levels(clips, levels, count)
    }

    fn with_levels(clips: Vec<Clip>, levels: Levels, count: usize) -> Self {
        let skeleton = walk().0;
        let animations = Arc::new(AnimationSet::new(&skeleton, &clips, &levels.levels).unwrap());
        let mut random = Random::new(1);
        let characters = (0..count).map(|_| Character {
            clip: ClipId(random.float(0.0, clips.len() as f32) as u32),
            time: random.float(0.0, 60.0),
            speed: random.float(0.9, 1.1),
            ..Character::default()
        });
        Self {
            characters: characters.collect(),
            skeleton,
            clips,
            levels,
            animations,
        }
    }

    /// The same on all levels, as many on each.
    pub(crate) fn mixed(mut self) -> Self {
        let levels = self.animations.levels();
        for (index, character) in self.characters.iter_mut().enumerate() {
            character.level = LevelId((index % levels) as u16);
        }
        self
    }

    /// The same in a column of ten abreast, a metre apart, seen from 5 m before its head: levels by
    /// distance, with 2 pixels of error at most.
    pub(crate) fn in_a_column(mut self) -> Self {
        let switching = self.switching();
        for (index, character) in self.characters.iter_mut().enumerate() {
            let (x, z) = ((index % 10) as f32 - 4.5, 5.0 + (index / 10) as f32);
            character.placement.ground = Rigid2::new(0.0, x, -z);
            let choice = switching.choose(x.hypot(z), None);
            character.level = choice.level;
            character.blend = choice.blend;
        }
        self
    }

    /// Levels by distance, with 2 pixels of error at most.
    pub(crate) fn switching(&self) -> Switching {
        let settings = SwitchSettings {
            rule: Rule::ScreenError {
                pixels: 2.0,
                measure: Measure::Greatest,
            },
            ..SwitchSettings::default()
        };
        Switching::new(&self.levels, &settings).unwrap()
    }

    pub(crate) fn crowd(&self, settings: CrowdSettings) -> Crowd {
        let mut crowd = Crowd::new(Arc::clone(&self.animations), settings);
        for character in &self.characters {
            crowd.add(character).unwrap();
        }
        crowd
    }

    /// Enough for the crowd, with some to spare, touched once.
    pub(crate) fn memory(&self, crowd: &mut Crowd) -> Vec<F32x16> {
        vec![F32x16([1.0; 16]); crowd.output_len() + crowd.output_len() / 8]
    }

    /// Of all characters together.
    pub(crate) fn joints(&self) -> usize {
        self.characters
            .iter()
            .map(|character| self.animations.joints(character.level))
            .sum()
    }

    pub(crate) fn plain(&self) -> (PlainClip, Vec<PlainCharacter>) {
        let motion =
            LevelMotion::new(&self.skeleton, &self.clips[0], &self.levels.levels[0]).unwrap();
        let characters = self.characters.iter().map(|character| PlainCharacter {
            time: character.time,
            speed: character.speed,
        });
        (PlainClip::new(&motion), characters.collect())
    }
}

/// A walk: the captured one, or the embedded skeleton's first motion.
pub(crate) fn walk() -> (Skeleton, Clip) {
    let Some(folder) = std::env::var_os("SABAKI_MOCAP") else {
        let motions = demo::motions().unwrap();
        return (motions.skeleton, motions.clips[0].clone());
    };
    let path = PathBuf::from(folder).join("walk/Male2_B3_Walk.bvh");
    let loaded = read_clip(&path, &ReadOptions::default()).unwrap();
    (loaded.skeleton, loaded.clip)
}

/// Some frames of a clip.
fn cut(clip: &Clip, frames: Range<usize>) -> Clip {
    let (skeleton, _) = walk();
    let desc = clip.desc();
    let joints = skeleton.len();
    let desc = ClipDesc {
        name: format!("{} {}", desc.name, frames.start),
        roots: desc.roots[frames.clone()].to_vec(),
        rotations: desc.rotations[frames.start * joints..frames.end * joints].to_vec(),
        ..desc.clone()
    };
    Clip::new(&skeleton, desc).unwrap()
}
