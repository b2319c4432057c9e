//! Functions that create, steer, threaten and step the characters of a game.

use std::sync::Arc;

use glam::Vec2;

use super::culler::{JointOut, SphereOut};
use super::game_inputs::{EventOut, GoalIn, ObstacleIn, ThreatIn};
use super::graph::Graph;
use super::sized::{Grows, read, read_array, write, write_array};
use super::status::{OK, Status, call};
use super::{given, given_slice_mut};
use crate::anim::{JointTransform, Pose};
use crate::character::{
    CharacterError, CharacterEvent, CharacterId, CharacterSettings, Characters, KindId, ThreatId,
};
use crate::math::{Rigid2, Space};
use crate::query::Obstacle;

/// `sabaki_game`.
pub(super) struct Game {
    pub(super) characters: Characters,
    /// Leads to the host's space.
    pub(super) space: Space,
    obstacles: Vec<Obstacle>,
    events: Vec<CharacterEvent>,
    joints: Vec<JointTransform>,
    pub(super) poses: [Pose; 2],
}

impl Game {
    /// A place on the host's ground.
    fn rigid(&self, x: f32, z: f32, heading: f32) -> Rigid2 {
        let space = self.space.inverse();
        let ground = space.ground(Vec2::new(x, z));
        Rigid2::new(space.heading(heading), ground.x, ground.y)
    }

    /// The joints of a character in the world.
    fn posed(&mut self, character: u64) -> Result<&[JointTransform], CharacterError> {
        let id = CharacterId::from_bits(character);
        let needed = self.characters.baked_of(id)?.graph().skeleton().len();
        self.joints.resize(needed, JointTransform::IDENTITY);
        self.characters.pose(id, &mut self.joints)?;
        Ok(&self.joints)
    }
}

/// The kind of a number of the caller.
pub(super) fn kind_id(kind: u32) -> KindId {
    KindId(u16::try_from(kind).unwrap_or(u16::MAX))
}

/// Reads settings, or the default ones.
///
/// # Safety
/// Null, or settings that begin with their size.
unsafe fn read_settings(settings: *const GameSettings) -> Result<CharacterSettings, String> {
    if settings.is_null() {
        return Ok(CharacterSettings::default());
    }
    // SAFETY: as the caller of this function promises.
    Ok(unsafe { read(settings) }?.settings())
}

/// `sabaki_game_settings`, and its conversions: each field of C with the field that it sets.
macro_rules! settings {
    ($($name:ident: $type:ty => $($field:ident).+;)*) => {
        #[derive(Clone, Copy)]
        #[repr(C)]
        pub(super) struct GameSettings {
            size: u32,
            $($name: $type,)*
        }

        impl GameSettings {
            fn new(from: &CharacterSettings) -> Self {
                Self {
                    size: size_of::<Self>() as u32,
                    $($name: from.$($field).+ as $type,)*
                }
            }

            fn settings(&self) -> CharacterSettings {
                let mut to = CharacterSettings::default();
                $(to.$($field).+ = self.$name as _;)*
                if self.plans_per_step == 0 {
                    to.plans_per_step = usize::MAX;
                }
                to
            }
        }
    };
}

settings! {
    threads: u32 => threads;
    delay: u32 => delay;
    plans_per_step: u32 => plans_per_step;
    horizon: f32 => horizon;
    margin: f32 => margin;
    body_radius: f32 => body_radius;
    plan_milliseconds: f32 => plan_milliseconds;
    plan_work: u32 => plan_work;
    searches_per_step: u32 => searches_per_step;
    obstacle_margin: f32 => obstacle_margin;
    push: f32 => push;
    retry: f32 => retry;
    steer_interval: f32 => steer.interval;
    steer_blend: f32 => steer.blend;
    steer_gain: f32 => steer.gain;
    steer_slowest: f32 => steer.slowest;
    steer_fastest: f32 => steer.fastest;
    steer_turn: f32 => steer.turn;
    steer_standing_turn: f32 => steer.standing_turn;
    steer_jump_turn: f32 => steer.jump_turn;
    steer_clearance: f32 => steer.clearance;
    steer_foresight: f32 => steer.foresight;
    steer_repeat: f32 => steer.repeat;
}

// SAFETY: numbers alone, the first of which is the size.
unsafe impl Grows for GameSettings {
    const NAME: &'static str = "settings";

    fn blank() -> Self {
        Self::new(&CharacterSettings::default())
    }
}

exported! {
    unsafe extern "C" fn sabaki_game_settings_default(settings: *mut GameSettings) {
        // SAFETY: the caller gives place for settings.
        unsafe { write(GameSettings::blank(), settings) }?;
    }

    unsafe extern "C" fn sabaki_game_create(
        graph: Option<&Graph>,
        settings: *const GameSettings,
        game: Option<&mut *mut Game>,
    ) {
        let (graph, out) = (given(graph, "graph")?, given(game, "game")?);
        // SAFETY: the caller gives settings, or none.
        let settings = unsafe { read_settings(settings) }?;
        *out = Box::into_raw(Box::new(Game {
            space: graph.space,
            characters: Characters::new(Arc::clone(&graph.baked), settings)?,
            obstacles: Vec::new(),
            events: Vec::new(),
            joints: Vec::new(),
            poses: [Pose::default(), Pose::default()],
        }));
    }

    unsafe extern "C" fn sabaki_add_kind(
        game: Option<&mut Game>,
        graph: Option<&Graph>,
        settings: *const GameSettings,
        kind: Option<&mut u32>,
    ) {
        let (game, graph, out) = (given(game, "game")?, given(graph, "graph")?, given(kind, "kind")?);
        // SAFETY: the caller gives settings, or none.
        let settings = unsafe { read_settings(settings) }?;
        let added = game.characters.add_kind(Arc::clone(&graph.baked), settings)?;
        *out = added.0.into();
    }

    unsafe extern "C" fn sabaki_kind_of(game: Option<&Game>, character: u64) -> u32 {
        let id = CharacterId::from_bits(character);
        let kind = game.and_then(|game| game.characters.kind(id).ok());
        kind.map_or(u32::MAX, |kind| kind.0.into())
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
    ) -> Status {
        // SAFETY: nothing but references is asked of the caller.
        unsafe { sabaki_spawn_kind(game, 0, x, z, heading, character) }
    }

    unsafe extern "C" fn sabaki_spawn_kind(
        game: Option<&mut Game>,
        kind: u32,
        x: f32,
        z: f32,
        heading: f32,
        character: Option<&mut u64>,
    ) {
        let (game, out) = (given(game, "game")?, given(character, "character")?);
        let place = game.rigid(x, z, heading);
        let id = game.characters.spawn_kind(kind_id(kind), place)?;
        *out = id.to_bits();
    }

    unsafe extern "C" fn sabaki_despawn(game: Option<&mut Game>, character: u64) {
        let id = CharacterId::from_bits(character);
        given(game, "game")?.characters.despawn(id)?;
    }

    unsafe extern "C" fn sabaki_steer(
        game: Option<&mut Game>,
        character: u64,
        goal: *const GoalIn,
    ) {
        let (game, id) = (given(game, "game")?, CharacterId::from_bits(character));
        // SAFETY: the caller gives a goal.
        let goal = unsafe { read(goal) }?.goal(game.space.inverse())?;
        game.characters.steer(id, goal)?;
    }

    unsafe extern "C" fn sabaki_move_by(
        game: Option<&mut Game>,
        character: u64,
        x: f32,
        z: f32,
        heading: f32,
    ) {
        let (game, id) = (given(game, "game")?, CharacterId::from_bits(character));
        game.characters.move_by(id, game.rigid(x, z, heading))?;
    }

    unsafe extern "C" fn sabaki_set_height(
        game: Option<&mut Game>,
        character: u64,
        height: f32,
    ) {
        let (game, id) = (given(game, "game")?, CharacterId::from_bits(character));
        game.characters.set_height(id, game.space.inverse().length(height))?;
    }

    unsafe extern "C" fn sabaki_threaten(
        game: Option<&mut Game>,
        threat: *const ThreatIn,
        id: Option<&mut u64>,
    ) {
        let (game, out) = (given(game, "game")?, given(id, "id")?);
        // SAFETY: the caller's threat has its spheres.
        let threat = unsafe { read(threat)?.threat(game.space.inverse()) }?;
        *out = game.characters.threaten(threat)?.0;
    }

    unsafe extern "C" fn sabaki_update_threat(
        game: Option<&mut Game>,
        id: u64,
        threat: *const ThreatIn,
    ) {
        let game = given(game, "game")?;
        // SAFETY: the caller's threat has its spheres.
        let threat = unsafe { read(threat)?.threat(game.space.inverse()) }?;
        game.characters.update(ThreatId(id), threat)?;
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
        let obstacles = unsafe { read_array(obstacles, obstacle_count) }?;
        let space = game.space.inverse();
        game.obstacles.clear();
        for (index, obstacle) in obstacles.enumerate() {
            // SAFETY: the caller's obstacle has its corners.
            let read = unsafe { obstacle.obstacle(space) };
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
        let Some(game) = game else { return 0 };
        let found = &game.events;
        let mut count = 0;
        call(|| {
            let each = found.iter().map(|event| EventOut::new(event, game.space));
            // SAFETY: the caller gives room for that many events.
            unsafe { write_array(each, events, capacity) }?;
            count = found.len();
            Ok(OK)
        });
        count
    }

    unsafe extern "C" fn sabaki_body(
        game: Option<&mut Game>,
        character: u64,
        spheres: *mut SphereOut,
        count: usize,
    ) {
        // SAFETY: the caller gives place for that many spheres.
        let out = unsafe { given_slice_mut(spheres, count, "spheres") }?;
        let game = given(game, "game")?;
        game.posed(character)?;
        let baked = game.characters.baked_of(CharacterId::from_bits(character))?;
        for (out, sphere) in out.iter_mut().zip(&baked.body().spheres) {
            *out = SphereOut::new(sphere.centre(&game.joints), sphere.radius, game.space);
        }
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
        let space = game.space;
        for (out, joint) in out.iter_mut().zip(game.posed(character)?) {
            *out = JointOut::new(joint, space);
        }
    }
}
