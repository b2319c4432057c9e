//! Crowds to measure.

use std::path::PathBuf;
use std::sync::Arc;

use sabaki::anim::{Clip, Skeleton};
use sabaki::crowd::{Character, ClipId, Crowd, CrowdSettings, LevelId, Repertoire};
use sabaki::demo;
use sabaki::io::{ReadOptions, read_clip};
use sabaki::lod::{Level, Levels, rehang};
use sabaki::math::Line;

use super::plain::{PlainCharacter, PlainClip};

/// Who is posed, and what they can play.
pub(crate) struct Scene {
    skeleton: Skeleton,
    clips: Vec<Clip>,
    level: Level,
    repertoire: Arc<Repertoire>,
    characters: Vec<Character>,
}

impl Scene {
    pub(crate) fn one_clip(count: usize) -> Self {
        let (skeleton, clip) = walk();
        let levels = Levels::in_order(&skeleton, &[]).unwrap().levels;
        let clips = vec![clip];
        let repertoire = Arc::new(Repertoire::new(&skeleton, &clips, &levels).unwrap());
        let mut random = Random(1);
        let characters = (0..count).map(|_| Character {
            clip: ClipId(0),
            level: LevelId(0),
            time: random.number(0.0, 60.0),
            speed: random.number(0.9, 1.1),
            ..Character::default()
        });
        Self {
            characters: characters.collect(),
            level: levels[0].clone(),
            skeleton,
            clips,
            repertoire,
        }
    }

    pub(crate) fn crowd(&self, settings: CrowdSettings) -> Crowd {
        let mut crowd = Crowd::new(Arc::clone(&self.repertoire), settings);
        for character in &self.characters {
            crowd.add(character).unwrap();
        }
        crowd
    }

    /// Enough for the crowd, with some to spare, touched once.
    pub(crate) fn memory(&self, crowd: &mut Crowd) -> Vec<Line> {
        vec![Line([1.0; 16]); crowd.lines() + crowd.lines() / 8]
    }

    /// Of all characters together.
    pub(crate) fn joints(&self) -> usize {
        self.characters
            .iter()
            .map(|character| self.repertoire.joints(character.level))
            .sum()
    }

    pub(crate) fn plain(&self) -> (PlainClip, Vec<PlainCharacter>) {
        let motion = rehang(&self.skeleton, &self.clips[0], &self.level).unwrap();
        let characters = self.characters.iter().map(|character| PlainCharacter {
            time: character.time,
            speed: character.speed,
        });
        (PlainClip::new(&motion), characters.collect())
    }
}

/// A walk of 24 joints: the captured one, or the embedded skeleton's first motion.
pub(crate) fn walk() -> (Skeleton, Clip) {
    match std::env::var_os("SABAKI_MOCAP") {
        Some(folder) => {
            let path = PathBuf::from(folder).join("walk/fighting-01-provocation-takiguchi.bvh");
            let loaded = read_clip(&path, &ReadOptions::default()).unwrap();
            (loaded.skeleton, loaded.clip)
        }
        None => {
            let motions = demo::motions().unwrap();
            (motions.skeleton, motions.clips[0].clone())
        }
    }
}

/// Marsaglia's xorshift64*.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn number(&mut self, from: f32, to: f32) -> f32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 40;
        from + (to - from) * bits as f32 / (1 << 24) as f32
    }
}
