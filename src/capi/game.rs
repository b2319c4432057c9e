//! Functions that create, steer, threaten and step the characters of a game.

use std::sync::Arc;

use super::culler::JointOut;
use super::game_inputs::{EventOut, GoalIn, ObstacleIn, ThreatIn};
use super::graph::Graph;
use super::{given, given_slice, given_slice_mut};
use crate::anim::{JointTransform, Pose};
use crate::character::{CharacterEvent, CharacterId, CharacterSettings, Characters, ThreatId};
use crate::math::Rigid2;
use crate::query::Obstacle;

/// `sabaki_game`.
pub(super) struct Game {
    pub(super) characters: Characters,
    obstacles: Vec<Obstacle>,
    events: Vec<CharacterEvent>,
    joints: Vec<JointTransform>,
    pub(super) poses: [Pose; 2],
}

/// `sabaki_game_settings`.
#[repr(C)]
pub(super) struct GameSettings {
    threads: u32,
    delay: u32,
    plans_per_step: u32,
    horizon: f32,
    margin: f32,
    body_radius: f32,
    plan_milliseconds: f32,
}

impl GameSettings {
    fn settings(&self) -> CharacterSettings {
        CharacterSettings {
            threads: self.threads as usize,
            delay: self.delay,
            plans_per_step: match self.plans_per_step {
                0 => usize::MAX,
                most => most as usize,
            },
            horizon: self.horizon,
            margin: self.margin,
            body_radius: self.body_radius,
            plan_milliseconds: self.plan_milliseconds,
            ..CharacterSettings::default()
        }
    }
}

exported! {
    unsafe extern "C" fn sabaki_game_settings_default(settings: Option<&mut GameSettings>) -> () {
        let default = CharacterSettings::default();
        if let Some(settings) = settings {
            *settings = GameSettings {
                threads: default.threads as u32,
                delay: default.delay,
                plans_per_step: 0,
                horizon: default.horizon,
                margin: default.margin,
                body_radius: default.body_radius,
                plan_milliseconds: default.plan_milliseconds,
            };
        }
    }

    unsafe extern "C" fn sabaki_game_create(
        graph: Option<&Graph>,
        settings: Option<&GameSettings>,
        game: Option<&mut *mut Game>,
    ) {
        let (graph, out) = (given(graph, "graph")?, given(game, "game")?);
        let settings = settings.map_or_else(CharacterSettings::default, GameSettings::settings);
        *out = Box::into_raw(Box::new(Game {
            characters: Characters::new(Arc::clone(&graph.baked), settings)?,
            obstacles: Vec::new(),
            events: Vec::new(),
            joints: Vec::new(),
            poses: [Pose::default(), Pose::default()],
        }));
    }

    unsafe extern "C" fn sabaki_game_destroy(game: *mut Game) -> () {
        if !game.is_null() {
            // SAFETY: `sabaki_game_create` made it, and the caller does not use it any more.
            drop(unsafe { Box::from_raw(game) });
        }
    }

    unsafe extern "C" fn sabaki_game_now(game: Option<&Game>) -> f64 {
        game.map_or(0.0, |game| game.characters.now())
    }

    unsafe extern "C" fn sabaki_spawn(
        game: Option<&mut Game>,
        x: f32,
        z: f32,
        heading: f32,
        character: Option<&mut u64>,
    ) {
        let (game, out) = (given(game, "game")?, given(character, "character")?);
        let id = game.characters.spawn(Rigid2::new(heading, x, z))?;
        *out = id.to_bits();
    }

    unsafe extern "C" fn sabaki_despawn(game: Option<&mut Game>, character: u64) {
        let id = CharacterId::from_bits(character);
        given(game, "game")?.characters.despawn(id)?;
    }

    unsafe extern "C" fn sabaki_steer(
        game: Option<&mut Game>,
        character: u64,
        goal: Option<&GoalIn>,
    ) {
        let (game, id) = (given(game, "game")?, CharacterId::from_bits(character));
        game.characters.steer(id, given(goal, "goal")?.goal()?)?;
    }

    unsafe extern "C" fn sabaki_move_by(
        game: Option<&mut Game>,
        character: u64,
        x: f32,
        z: f32,
        heading: f32,
    ) {
        let (game, id) = (given(game, "game")?, CharacterId::from_bits(character));
        game.characters.move_by(id, Rigid2::new(heading, x, z))?;
    }

    unsafe extern "C" fn sabaki_set_height(
        game: Option<&mut Game>,
        character: u64,
        height: f32,
    ) {
        let (game, id) = (given(game, "game")?, CharacterId::from_bits(character));
        game.characters.set_height(id, height)?;
    }

    unsafe extern "C" fn sabaki_threaten(
        game: Option<&mut Game>,
        threat: Option<&ThreatIn>,
        id: Option<&mut u64>,
    ) {
        // SAFETY: the caller's threat has its spheres.
        let threat = unsafe { given(threat, "threat")?.threat() }?;
        let (game, out) = (given(game, "game")?, given(id, "id")?);
        *out = game.characters.threaten(threat)?.0;
    }

    unsafe extern "C" fn sabaki_update_threat(
        game: Option<&mut Game>,
        id: u64,
        threat: Option<&ThreatIn>,
    ) {
        // SAFETY: the caller's threat has its spheres.
        let threat = unsafe { given(threat, "threat")?.threat() }?;
        given(game, "game")?.characters.update(ThreatId(id), threat)?;
    }

    unsafe extern "C" fn sabaki_remove_threat(game: Option<&mut Game>, id: u64) {
        given(game, "game")?.characters.remove(ThreatId(id))?;
    }

    unsafe extern "C" fn sabaki_step(
        game: Option<&mut Game>,
        dt: f32,
        obstacles: *const ObstacleIn,
        obstacle_count: usize,
    ) {
        let game = given(game, "game")?;
        // SAFETY: the caller gives that many obstacles.
        let obstacles = unsafe { given_slice(obstacles, obstacle_count, "obstacles") }?;
        game.obstacles.clear();
        for (index, obstacle) in obstacles.iter().enumerate() {
            // SAFETY: the caller's obstacle has its corners.
            let read = unsafe { obstacle.obstacle() };
            let read = read.map_err(|error| format!("obstacle {index}: {error}"))?;
            game.obstacles.push(read);
        }
        game.events.clear();
        game.characters.step(dt, &game.obstacles, &mut game.events);
    }

    unsafe extern "C" fn sabaki_events(
        game: Option<&Game>,
        events: *mut EventOut,
        capacity: usize,
    ) -> usize {
        // SAFETY: the caller gives room for that many events.
        let out = unsafe { given_slice_mut(events, capacity, "events") };
        let events = game.map_or(&[][..], |game| &game.events);
        for (out, event) in out.unwrap_or_default().iter_mut().zip(events) {
            *out = EventOut::new(event);
        }
        events.len()
    }

    unsafe extern "C" fn sabaki_pose(
        game: Option<&mut Game>,
        character: u64,
        joints: *mut JointOut,
        count: usize,
    ) {
        // SAFETY: the caller gives place for that many joints.
        let out = unsafe { given_slice_mut(joints, count, "joints") }?;
        let game = given(game, "game")?;
        let needed = game.characters.baked().graph().skeleton().len();
        game.joints.resize(needed, JointTransform::IDENTITY);
        let id = CharacterId::from_bits(character);
        game.characters.pose(id, &mut game.joints)?;
        for (out, joint) in out.iter_mut().zip(&game.joints) {
            *out = JointOut::new(joint);
        }
    }
}
