//! A crowd's oracle: slerp and the chain of joints in double precision, one character at a time.

use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3};
use sabaki::anim::{Clip, JointId, JointTransform, Skeleton};
use sabaki::crowd::{
    AnimationSet, AnimationSetDesc, Character, ClipId, ClipMix, Crowd, CrowdSettings, Form, Layout,
    LevelId, MemberId, Output, Placement, PoseSlice, WriteMode,
};
use sabaki::lod::{Level, LevelMotion, Levels};
use sabaki::math::{F32x16, Isa, Rigid2};

use super::random::Random;

/// The clips on one level.
pub struct Oracle {
    /// Motions of all clips, then of all layers.
    motions: Vec<LevelMotion>,
}

impl Oracle {
    pub fn new(skeleton: &Skeleton, clips: &[Clip], level: &Level) -> Self {
        let motion = |clip| LevelMotion::new(skeleton, clip, level).unwrap();
        Self {
            motions: clips.iter().map(motion).collect(),
        }
    }

    /// World positions of a character's joints, some seconds after it was described.
    pub fn pose(&self, character: &Character, seconds: f64) -> Vec<DAffine3> {
        let at = |clip: ClipId, time: f32, speed: f32| {
            let motion = &self.motions[clip.index()];
            (
                motion,
                moment(motion, f64::from(time) + f64::from(speed) * seconds),
            )
        };
        let first = at(character.clip, character.time, character.speed);
        let second = character.fade.map(
            |ClipMix {
                 clip,
                 time,
                 speed,
                 weight,
             }| { (at(clip, time, speed), f64::from(weight)) },
        );
        let layer = character.layer.map(|layer| {
            let at = at(layer.clip, layer.time, layer.speed);
            (at, f64::from(layer.weight))
        });
        let ground = character.placement.ground;
        let world = DAffine3::from_rotation_translation(
            DQuat::from_rotation_y(f64::from(ground.heading())),
            DVec3::new(
                f64::from(ground.x),
                f64::from(character.placement.height),
                f64::from(ground.z),
            ),
        );
        let mut joints: Vec<DAffine3> = Vec::new();
        for (index, parent) in first.0.parents.iter().enumerate() {
            let (mut turn, mut place) = local(first.0, first.1, index);
            if let Some((second, weight)) = second {
                let (other, there) = local(second.0, second.1, index);
                let other = if turn.dot(other) < 0.0 { -other } else { other };
                turn = (turn * (1.0 - weight) + other * weight).normalize();
                place = place.lerp(there, weight);
            }
            let above = parent.map_or(world, |parent| joints[usize::from(parent)]);
            if let Some(((motion, at), weight)) = layer {
                let (to, there) = local(motion, at, index);
                let (from, here) = local(
                    motion,
                    Moment {
                        frame: 0,
                        share: 0.0,
                    },
                    index,
                );
                let added = from.inverse() * to;
                let added = if added.w < 0.0 { -added } else { added };
                let added = if weight < 0.0 { added.inverse() } else { added };
                turn *= (DQuat::IDENTITY * (1.0 - weight.abs()) + added * weight.abs()).normalize();
                place += (there - here) * weight;
            }
            joints.push(above * DAffine3::from_rotation_translation(turn, place));
        }
        joints
    }
}

/// A time between two frames.
#[derive(Clone, Copy)]
struct Moment {
    /// The frame before it.
    frame: usize,
    /// Share of the way to the next frame.
    share: f64,
}

fn moment(motion: &LevelMotion, seconds: f64) -> Moment {
    let intervals = (motion.frames - 1).max(1) as f64;
    let at = (seconds * f64::from(motion.frame_rate)).rem_euclid(intervals);
    let at = if at.is_finite() { at } else { 0.0 };
    Moment {
        frame: at as usize,
        share: at.fract(),
    }
}

fn local(motion: &LevelMotion, moment: Moment, joint: usize) -> (DQuat, DVec3) {
    let Moment { frame, share } = moment;
    let track = &motion.tracks[joint];
    let next = (frame + 1).min(motion.frames - 1);
    let turn = |frame: usize| track.rotations[frame].as_dquat().normalize();
    let place = |frame| track.translations.at(frame).as_dvec3();
    (
        turn(frame).slerp(turn(next), share),
        place(frame).lerp(place(next), share),
    )
}

/// The slice that a character is drawn from, and the form of its joints.
#[derive(Clone, Copy)]
pub struct DrawnAs<'a> {
    pub slice: &'a PoseSlice,
    pub form: Form,
}

/// A skeleton, clips and levels, in both the crowd's form and the oracle's.
pub struct Stage {
    pub animations: Arc<AnimationSet>,
    oracles: Vec<Oracle>,
    levels: Levels,
}

impl Stage {
    /// Level 0 keeps all; each further one loses the joint named.
    pub fn new(skeleton: Skeleton, clips: Vec<Clip>, removed: &[u16]) -> Self {
        let order: Vec<(JointId, f32)> = removed.iter().map(|&id| (JointId(id), 1.0)).collect();
        let levels = Levels::in_order(&skeleton, &order).unwrap();
        Self::on_levels(&skeleton, &clips, &levels)
    }

    pub fn on_levels(skeleton: &Skeleton, clips: &[Clip], levels: &Levels) -> Self {
        Self::with_layers(skeleton, clips, &[], levels)
    }

    /// The same with additive layers, which some of [`Stage::characters`] have.
    pub fn with_layers(
        skeleton: &Skeleton,
        clips: &[Clip],
        layers: &[Clip],
        levels: &Levels,
    ) -> Self {
        let desc = AnimationSetDesc {
            skeleton,
            clips,
            layers,
            levels: &levels.levels,
        };
        let animations = AnimationSet::build(&desc).unwrap();
        let all = [clips, layers].concat();
        let oracle = |level| Oracle::new(skeleton, &all, level);
        Self {
            animations: Arc::new(animations),
            oracles: levels.levels.iter().map(oracle).collect(),
            levels: levels.clone(),
        }
    }

    /// The joints that two slices have both, by their numbers in each.
    pub fn both(&self, a: &PoseSlice, b: &PoseSlice) -> Vec<(usize, usize)> {
        let [a, b] = [a, b].map(|slice| &self.levels.levels[usize::from(slice.level.0)]);
        let in_both = |(index, &joint)| Some((index, b.index_of(joint)?));
        a.kept.iter().enumerate().filter_map(in_both).collect()
    }

    /// Joints of a character as they are drawn from its slice, in the order of the slice's level.
    pub fn drawn(&self, character: &Character, seconds: f64, drawn: DrawnAs<'_>) -> Vec<DAffine3> {
        let DrawnAs { slice, form } = drawn;
        let levels = &self.levels.levels;
        let posed = &levels[usize::from(slice.level.0)];
        let exact = self.oracles[usize::from(slice.level.0)].pose(character, seconds);
        let detail = f64::from(character.level.0) + f64::from(character.blend);
        let detail = detail.min((levels.len() - 1) as f64);
        let (own, blend) = (detail as usize, detail.fract());
        assert!(usize::from(slice.level.0) <= own);
        let ends = [own, (own + 1).min(levels.len() - 1)].map(|level| &levels[level]);
        let at = |joint: JointId| exact[posed.index_of(joint).unwrap()];
        let attached = |level: &Level, joint: JointId| {
            let attachment = level.attachments[joint.index()];
            let JointTransform {
                rotation,
                translation,
            } = attachment.offset;
            let offset =
                DAffine3::from_rotation_translation(rotation.as_dquat(), translation.as_dvec3());
            (level.kept[usize::from(attachment.carrier)], offset)
        };
        let of_own = |joint: JointId| {
            let (carrier, offset) = attached(ends[1], joint);
            if blend == 0.0 || carrier == joint {
                return at(joint);
            }
            let blend = JointBlend {
                weight: blend,
                form,
            };
            blend.between(at(joint), at(carrier) * offset)
        };
        let joints = posed.kept.iter().map(|&joint| {
            let (carrier, offset) = attached(ends[0], joint);
            if carrier == joint {
                of_own(joint)
            } else {
                of_own(carrier) * offset
            }
        });
        joints.collect()
    }

    /// Characters of every clip and level, at every moment and place, some with a second clip.
    pub fn characters(&self, count: usize, seed: u64) -> Vec<Character> {
        let mut random = Random::new(seed);
        (0..count).map(|_| self.character(&mut random)).collect()
    }

    fn character(&self, random: &mut Random) -> Character {
        let clips = self.animations.clips();
        let clip = |random: &mut Random| ClipId(random.below(clips) as u32);
        let mut number = |from: f32, to: f32| from + (to - from) * unit(random);
        let placement = Placement {
            ground: Rigid2::new(number(-3.1, 3.1), number(-4.0, 4.0), number(-4.0, 4.0)),
            height: number(-1.0, 1.0),
        };
        let fade = ClipMix {
            clip: ClipId(0),
            time: number(-1.0, 9.0),
            speed: number(-2.0, 2.0),
            weight: number(0.0, 1.0),
        };
        let layers = self.animations.layers();
        let layer = if layers > 0 && random.below(3) > 0 {
            let mut number = |from: f32, to: f32| from + (to - from) * unit(random);
            let mix = ClipMix {
                clip: ClipId(0),
                time: number(-1.0, 9.0),
                speed: number(-2.0, 2.0),
                weight: number(-1.0, 1.0),
            };
            self.animations
                .layer(random.below(layers))
                .map(|clip| ClipMix { clip, ..mix })
        } else {
            None
        };
        let mut number = |from: f32, to: f32| from + (to - from) * unit(random);
        Character {
            time: number(-1.0, 9.0),
            speed: number(-1.0, 2.0),
            placement,
            clip: clip(random),
            level: LevelId(random.below(self.animations.levels()) as u16),
            blend: [0.0, 0.0, 1.0, unit(random)][random.below(4)],
            fade: (random.below(5) == 0).then(|| ClipMix {
                clip: clip(random),
                ..fade
            }),
            layer,
        }
    }
}

/// Blending of a joint with the joint that carries it.
#[derive(Clone, Copy)]
struct JointBlend {
    weight: f64,
    form: Form,
}

impl JointBlend {
    fn between(self, from: DAffine3, to: DAffine3) -> DAffine3 {
        let Self { weight, form } = self;
        if form == Form::Matrices {
            return DAffine3 {
                matrix3: from.matrix3 * (1.0 - weight) + to.matrix3 * weight,
                translation: from.translation.lerp(to.translation, weight),
            };
        }
        let ((_, a, from), (_, b, to)) = (
            from.to_scale_rotation_translation(),
            to.to_scale_rotation_translation(),
        );
        let b = if a.dot(b) < 0.0 { -b } else { b };
        DAffine3::from_rotation_translation(
            (a * (1.0 - weight) + b * weight).normalize(),
            from.lerp(to, weight),
        )
    }
}

fn unit(random: &mut Random) -> f32 {
    (random.next() >> 40) as f32 / (1 << 24) as f32
}

/// Every form and layout, into memory of every kind.
pub fn forms() -> Vec<Output> {
    let mut all = Vec::new();
    for form in [Form::Matrices, Form::Rotations] {
        for layout in [Layout::Blocks, Layout::Rows, Layout::Instances] {
            for write in [WriteMode::Cached, WriteMode::Streamed] {
                all.push(Output {
                    form,
                    layout,
                    write,
                });
            }
        }
    }
    all
}

pub fn settings(output: Output, isa: Isa, threads: usize) -> CrowdSettings {
    CrowdSettings {
        output,
        isa,
        threads,
        ..CrowdSettings::default()
    }
}

pub fn crowd_of(
    stage: &Stage,
    characters: &[Character],
    settings: CrowdSettings,
) -> (Crowd, Vec<MemberId>) {
    let mut crowd = Crowd::new(Arc::clone(&stage.animations), settings);
    let ids = characters
        .iter()
        .map(|character| crowd.add(character).unwrap());
    let ids = ids.collect();
    (crowd, ids)
}

pub fn posed(crowd: &mut Crowd) -> Vec<F32x16> {
    let mut out = vec![F32x16([f32::NAN; 16]); crowd.output_len()];
    crowd.pose(&mut out).unwrap();
    out
}

/// The largest distance between a joint, or a point 0.1 m from it along one of its axes, and where
/// the oracle has it, after so many seconds.
pub fn furthest(
    stage: &Stage,
    characters: &[Character],
    settings: CrowdSettings,
    seconds: f32,
) -> f64 {
    let (mut crowd, ids) = crowd_of(stage, characters, settings);
    crowd.advance(f64::from(seconds));
    let out = posed(&mut crowd);
    let mut furthest: f64 = 0.0;
    for (&id, character) in ids.iter().zip(characters) {
        let slice = crowd.pose_slice(id).unwrap();
        let drawn = DrawnAs {
            slice: &slice,
            form: settings.output.form,
        };
        let expected = stage.drawn(character, f64::from(seconds), drawn);
        assert_eq!(slice.joints, expected.len());
        for (joint, expected) in expected.iter().enumerate() {
            let found = joint_of(&out, &slice, settings.output.form, joint);
            let far = |point: DVec3| {
                found
                    .transform_point3(point)
                    .distance(expected.transform_point3(point))
            };
            let axes = [DVec3::ZERO, DVec3::X * 0.1, DVec3::Y * 0.1, DVec3::Z * 0.1];
            for apart in axes.map(far) {
                assert!(!apart.is_nan(), "{character:?} joint {joint}");
                furthest = furthest.max(apart);
            }
        }
    }
    furthest
}

/// A joint as it was written.
pub fn joint_of(out: &[F32x16], slice: &PoseSlice, form: Form, joint: usize) -> DAffine3 {
    let number = |number| f64::from(slice.number(out, joint, number));
    match form {
        Form::Matrices => DAffine3::from_cols_array(&[
            number(0),
            number(4),
            number(8),
            number(1),
            number(5),
            number(9),
            number(2),
            number(6),
            number(10),
            number(3),
            number(7),
            number(11),
        ]),
        Form::Rotations => DAffine3::from_rotation_translation(
            DQuat::from_array([0, 1, 2, 3].map(number)),
            DVec3::from_array([4, 5, 6].map(number)),
        ),
    }
}
