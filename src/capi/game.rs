//! Functions that create, steer, threaten and step the characters of a game.

use std::sync::Arc;

use super::culler::JointOut;
use super::game_inputs::{EventOut, GoalIn, ObstacleIn, ThreatIn};
use super::graph::Graph;
use super::status::{OK, Status, call};
use super::{given, given_mut, given_slice, given_slice_mut};
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

/// # Safety
/// As `sabaki.h` says.
#[cfg_attr(not(test), unsafe(no_mangle))]
unsafe extern "C" fn sabaki_game_settings_default(settings: *mut GameSettings) {
    let default = CharacterSettings::default();
    // SAFETY: null, or the caller's place for the settings.
    if let Some(settings) = unsafe { settings.as_mut() } {
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

/// # Safety
/// As `sabaki.h` says.
#[cfg_attr(not(test), unsafe(no_mangle))]
unsafe extern "C" fn sabaki_game_create(
    graph: *const Graph,
    settings: *const GameSettings,
    game: *mut *mut Game,
) -> Status {
    call(|| {
        // SAFETY: the caller's graph, settings or null, and place for the game.
        let (graph, settings, out) = unsafe {
            let settings = settings.as_ref();
            (given(graph, "graph")?, settings, given_mut(game, "game")?)
        };
        let settings = settings.map_or_else(CharacterSettings::default, GameSettings::settings);
        let characters = Characters::new(Arc::clone(&graph.baked), settings)?;
        *out = Box::into_raw(Box::new(Game {
            characters,
            obstacles: Vec::new(),
            events: Vec::new(),
            joints: Vec::new(),
            poses: [Pose::default(), Pose::default()],
        }));
        Ok(OK)
    })
}

/// # Safety
/// As `sabaki.h` says.
#[cfg_attr(not(test), unsafe(no_mangle))]
unsafe extern "C" fn sabaki_game_destroy(game: *mut Game) {
    if !game.is_null() {
        // SAFETY: `sabaki_game_create` made it, and the caller does not use it any more.
        drop(unsafe { Box::from_raw(game) });
    }
}

/// # Safety
/// As `sabaki.h` says.
#[cfg_attr(not(test), unsafe(no_mangle))]
unsafe extern "C" fn sabaki_game_now(game: *const Game) -> f64 {
    // SAFETY: null, or the caller's game.
    unsafe { game.as_ref() }.map_or(0.0, |game| game.characters.now())
}

/// # Safety
/// As `sabaki.h` says.
#[cfg_attr(not(test), unsafe(no_mangle))]
unsafe extern "C" fn sabaki_spawn(
    game: *mut Game,
    x: f32,
    z: f32,
    heading: f32,
    character: *mut u64,
) -> Status {
    call(|| {
        // SAFETY: the caller's game, and place for the name.
        let (game, out) = unsafe { (given_mut(game, "game")?, given_mut(character, "character")?) };
        let id = game.characters.spawn(Rigid2::new(heading, x, z))?;
        *out = id.to_bits();
        Ok(OK)
    })
}

/// # Safety
/// As `sabaki.h` says.
#[cfg_attr(not(test), unsafe(no_mangle))]
unsafe extern "C" fn sabaki_despawn(game: *mut Game, character: u64) -> Status {
    call(|| {
        // SAFETY: the caller's game.
        let game = unsafe { given_mut(game, "game")? };
        game.characters.despawn(CharacterId::from_bits(character))?;
        Ok(OK)
    })
}

/// # Safety
/// As `sabaki.h` says.
#[cfg_attr(not(test), unsafe(no_mangle))]
unsafe extern "C" fn sabaki_steer(game: *mut Game, character: u64, goal: *const GoalIn) -> Status {
    call(|| {
        // SAFETY: the caller's game and goal.
        let (game, goal) = unsafe { (given_mut(game, "game")?, given(goal, "goal")?) };
        let id = CharacterId::from_bits(character);
        game.characters.steer(id, goal.goal()?)?;
        Ok(OK)
    })
}

/// # Safety
/// As `sabaki.h` says.
#[cfg_attr(not(test), unsafe(no_mangle))]
unsafe extern "C" fn sabaki_threaten(
    game: *mut Game,
    threat: *const ThreatIn,
    id: *mut u64,
) -> Status {
    call(|| {
        // SAFETY: the caller's game, threat with its spheres, and place for the name.
        let (game, threat, out) = unsafe {
            let threat = given(threat, "threat")?.threat()?;
            (given_mut(game, "game")?, threat, given_mut(id, "id")?)
        };
        *out = game.characters.threaten(threat)?.0;
        Ok(OK)
    })
}

/// # Safety
/// As `sabaki.h` says.
#[cfg_attr(not(test), unsafe(no_mangle))]
unsafe extern "C" fn sabaki_update_threat(
    game: *mut Game,
    id: u64,
    threat: *const ThreatIn,
) -> Status {
    call(|| {
        // SAFETY: the caller's game, and threat with its spheres.
        let (game, threat) = unsafe {
            let threat = given(threat, "threat")?.threat()?;
            (given_mut(game, "game")?, threat)
        };
        game.characters.update(ThreatId(id), threat)?;
        Ok(OK)
    })
}

/// # Safety
/// As `sabaki.h` says.
#[cfg_attr(not(test), unsafe(no_mangle))]
unsafe extern "C" fn sabaki_remove_threat(game: *mut Game, id: u64) -> Status {
    call(|| {
        // SAFETY: the caller's game.
        let game = unsafe { given_mut(game, "game")? };
        game.characters.remove(ThreatId(id))?;
        Ok(OK)
    })
}

/// # Safety
/// As `sabaki.h` says.
#[cfg_attr(not(test), unsafe(no_mangle))]
unsafe extern "C" fn sabaki_step(
    game: *mut Game,
    dt: f32,
    obstacles: *const ObstacleIn,
    obstacle_count: usize,
) -> Status {
    call(|| {
        // SAFETY: the caller's game, and that many obstacles with their corners.
        unsafe {
            let game = given_mut(game, "game")?;
            let given = given_slice(obstacles, obstacle_count, "obstacles")?;
            game.obstacles.clear();
            for (index, obstacle) in given.iter().enumerate() {
                let read = obstacle.obstacle();
                let read = read.map_err(|error| format!("obstacle {index}: {error}"))?;
                game.obstacles.push(read);
            }
            game.events.clear();
            game.characters.step(dt, &game.obstacles, &mut game.events);
        }
        Ok(OK)
    })
}

/// # Safety
/// As `sabaki.h` says.
#[cfg_attr(not(test), unsafe(no_mangle))]
unsafe extern "C" fn sabaki_events(
    game: *const Game,
    events: *mut EventOut,
    capacity: usize,
) -> usize {
    // SAFETY: null, or the caller's game; room for that many events.
    let (game, out) = unsafe {
        let out = given_slice_mut(events, capacity, "events").unwrap_or_default();
        (game.as_ref(), out)
    };
    let Some(game) = game else {
        return 0;
    };
    for (out, event) in out.iter_mut().zip(&game.events) {
        *out = EventOut::of(event);
    }
    game.events.len()
}

/// # Safety
/// As `sabaki.h` says.
#[cfg_attr(not(test), unsafe(no_mangle))]
unsafe extern "C" fn sabaki_pose(
    game: *mut Game,
    character: u64,
    joints: *mut JointOut,
    count: usize,
) -> Status {
    call(|| {
        // SAFETY: the caller's game, and place for that many joints.
        let (game, out) = unsafe {
            (
                given_mut(game, "game")?,
                given_slice_mut(joints, count, "joints")?,
            )
        };
        let needed = game.characters.baked().graph().skeleton().len();
        game.joints.resize(needed, JointTransform::IDENTITY);
        let id = CharacterId::from_bits(character);
        game.characters.pose(id, &mut game.joints)?;
        for (out, joint) in out.iter_mut().zip(&game.joints) {
            *out = JointOut::of(joint);
        }
        Ok(OK)
    })
}
