//! Queries in flight, and their answers.

use std::convert::Infallible;
use std::ffi::c_void;
use std::sync::Arc;

use ash::vk::{self, Handle};
use glam::{Vec2, Vec3};

use super::device::Device;
use super::graph::Graph;
use super::memory::HostMemory;
use super::sized::{Grows, read, read_array, sized, write};
use super::status::{Failure, NOT_YET, OK, Status, call};
use super::{given, given_slice, given_slice_mut};
use crate::anim::{JointTransform, Pose, forward_kinematics};
use crate::gpu::{self, BatchEntry, CullerDesc, Ticket, command_buffer};
use crate::graph::{EdgeId, Playhead};
use crate::maps::{BakedGraph, SphereKey};
use crate::math::{Rigid2, Space};
use crate::query::cull::{CullPath, Overlap, cpu};
use crate::query::{Answer, Attack, Query, QueryContext, QuerySettings, Request, SessionId};

/// `sabaki_place`.
#[repr(C)]
pub(super) struct Place {
    edge: u32,
    frame: f32,
    x: f32,
    z: f32,
    heading: f32,
}

/// `sabaki_key`.
#[repr(C)]
pub(super) struct Key {
    sphere: u32,
    t: f32,
    center: [f32; 3],
    radius: f32,
}

/// `sabaki_query`.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct QueryIn {
    size: u32,
    slot: u32,
    place: *const Place,
    keys: *const Key,
    key_count: usize,
}

/// `sabaki_answer`.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct AnswerOut {
    size: u32,
    avoided: u32,
    clearance: f32,
    seconds: f32,
    candidates: u32,
    removed: u32,
    counted_by_cpu: u32,
}

sized! {
    QueryIn, "queries";
    AnswerOut, "answer";
}

/// `sabaki_sphere`.
#[repr(C)]
pub(super) struct SphereOut {
    pub(super) center: [f32; 3],
    pub(super) radius: f32,
}

/// `sabaki_joint`.
#[repr(C)]
pub(super) struct JointOut {
    pub(super) position: [f32; 3],
    pub(super) rotation: [f32; 4],
}

impl SphereOut {
    /// A sphere, in the host's space.
    pub(super) fn new(centre: Vec3, radius: f32, space: Space) -> Self {
        Self {
            center: space.point(centre).to_array(),
            radius: space.length(radius),
        }
    }
}

impl JointOut {
    /// A joint, in the host's space.
    pub(super) fn new(joint: &JointTransform, space: Space) -> Self {
        let joint = space.joint(*joint);
        Self {
            position: joint.translation.to_array(),
            rotation: joint.rotation.to_array(),
        }
    }
}

/// A query in flight, with its state and its answer.
#[derive(Default)]
struct Slot {
    context: QueryContext,
    waiting: Option<SessionId>,
    /// Ticket of the recorded cull; `None` if the CPU has to count.
    ticket: Option<Ticket>,
    overlaps: Vec<Overlap>,
    answer: Answer,
    answered: bool,
    pose: Pose,
    joints: Vec<JointTransform>,
}

/// `sabaki_culler`.
pub(super) struct Culler {
    baked: Arc<BakedGraph>,
    /// Leads to the host's space.
    space: Space,
    settings: QuerySettings,
    memory: HostMemory,
    device: gpu::Culler,
    slots: Vec<Slot>,
    /// Whether the device has returned counts, which implies that it has the maps.
    has_counted: bool,
}

exported! {
    unsafe extern "C" fn sabaki_culler_create(
        graph: Option<&Graph>,
        device: *const Device,
        path: i32,
        slots: u32,
        culler: Option<&mut *mut Culler>,
    ) {
        // SAFETY: the caller gives a device.
        let (host, graph) = (unsafe { read(device) }?, given(graph, "graph")?);
        let out = given(culler, "culler")?;
        let path = match path {
            0 => CullPath::Stencil,
            1 => CullPath::Compute,
            other => return Err(format!("there is no path {other}").into()),
        };
        let desc = CullerDesc {
            frames_in_flight: slots,
            pipeline_cache: vk::PipelineCache::from_raw(host.pipeline_cache),
            ..CullerDesc::new(path, graph.baked.atlas())
        };
        // SAFETY: the caller's device has valid handles.
        let context = unsafe { host.context() }?;
        // SAFETY: the caller's allocator, or none.
        let mut memory = unsafe { host.memory(&context) }?;
        let device = match gpu::Culler::new(&context, memory.get(), &desc) {
            Ok(device) => device,
            Err(error) => {
                memory.destroy();
                return Err(error.into());
            }
        };
        *out = Box::into_raw(Box::new(Culler {
            baked: Arc::clone(&graph.baked),
            space: graph.space,
            settings: QuerySettings::default(),
            memory,
            slots: (0..device.slots()).map(|_| Slot::default()).collect(),
            device,
            has_counted: false,
        }));
    }

    unsafe extern "C" fn sabaki_culler_destroy(culler: *mut Culler) -> () {
        if culler.is_null() {
            return;
        }
        // SAFETY: `sabaki_culler_create` made it; neither the caller nor the device uses it any more.
        let Culler { device, mut memory, .. } = *unsafe { Box::from_raw(culler) };
        device.destroy(memory.get());
        memory.destroy();
    }

    unsafe extern "C" fn sabaki_release_staging(culler: Option<&mut Culler>) {
        let culler = given(culler, "culler")?;
        if culler.has_counted {
            // SAFETY: the device has the maps; the caller vouches for the other command buffers.
            unsafe { culler.device.release_staging(culler.memory.get()) };
        }
    }

    unsafe extern "C" fn sabaki_record(
        culler: Option<&mut Culler>,
        slot: u32,
        commands: *mut c_void,
        place: Option<&Place>,
        keys: *const Key,
        key_count: usize,
    ) {
        let place = given(place, "place")?;
        let query = QueryIn { slot, place, keys, key_count, ..QueryIn::blank() };
        // SAFETY: the caller gives that many keys and a command buffer, and vouches for the slot.
        unsafe { given(culler, "culler")?.record([query].into_iter(), commands) }?;
    }

    unsafe extern "C" fn sabaki_record_batch(
        culler: Option<&mut Culler>,
        commands: *mut c_void,
        queries: *const QueryIn,
        query_count: usize,
    ) {
        // SAFETY: the caller gives that many queries.
        let queries = unsafe { read_array(queries, query_count) }?;
        // SAFETY: the queries have their places and keys, and the caller vouches for command buffer and slots.
        unsafe { given(culler, "culler")?.record(queries, commands) }?;
    }

    unsafe extern "C" fn sabaki_poll(
        culler: Option<&mut Culler>,
        slot: u32,
        answer: *mut AnswerOut,
    ) -> Status {
        // SAFETY: the caller gives place for an answer.
        call(|| unsafe { given(culler, "culler")?.poll(slot, false, answer) })
    }

    unsafe extern "C" fn sabaki_answer_now(
        culler: Option<&mut Culler>,
        slot: u32,
        answer: *mut AnswerOut,
    ) -> Status {
        // SAFETY: the caller gives place for an answer.
        call(|| unsafe { given(culler, "culler")?.poll(slot, true, answer) })
    }

    unsafe extern "C" fn sabaki_sample_joints(
        culler: Option<&mut Culler>,
        slot: u32,
        seconds: f32,
        joints: *mut JointOut,
        count: usize,
    ) {
        // SAFETY: the caller gives place for that many joints.
        let out = unsafe { given_slice_mut(joints, count, "joints") }?;
        let culler = given(culler, "culler")?;
        let space = culler.space;
        for (out, joint) in out.iter_mut().zip(culler.sample(slot, seconds)?) {
            *out = JointOut::new(joint, space);
        }
    }

    unsafe extern "C" fn sabaki_sample_spheres(
        culler: Option<&mut Culler>,
        slot: u32,
        seconds: f32,
        spheres: *mut SphereOut,
        count: usize,
    ) {
        // SAFETY: the caller gives place for that many spheres.
        let out = unsafe { given_slice_mut(spheres, count, "spheres") }?;
        let culler = given(culler, "culler")?;
        let (baked, space) = (Arc::clone(&culler.baked), culler.space);
        let joints = culler.sample(slot, seconds)?;
        for (out, sphere) in out.iter_mut().zip(&baked.body().spheres) {
            *out = SphereOut::new(sphere.centre(joints), sphere.radius, space);
        }
    }

    unsafe extern "C" fn sabaki_sample_place(
        culler: Option<&mut Culler>,
        slot: u32,
        seconds: f32,
        place: Option<&mut Place>,
    ) {
        let (culler, out) = (given(culler, "culler")?, given(place, "place")?);
        let graph = culler.baked.graph();
        let answer = &culler.answered(slot)?.answer;
        let playhead = answer.motion.playhead(graph, valid_time(seconds)?);
        let world = playhead.placement(graph);
        let ground = culler.space.ground(Vec2::new(world.x, world.z));
        *out = Place {
            edge: playhead.edge.0,
            frame: playhead.frame,
            x: ground.x,
            z: ground.y,
            heading: culler.space.heading(world.heading()),
        };
    }
}

fn read_attack(keys: &[Key], space: Space) -> Result<Attack, String> {
    let of_one = keys.chunk_by(|a, b| a.sphere == b.sphere);
    let mut names: Vec<u32> = of_one.clone().map(|keys| keys[0].sphere).collect();
    names.sort_unstable();
    if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(format!(
            "the keys of sphere {} do not stand together",
            pair[0]
        ));
    }
    let spheres = of_one.map(|keys| {
        let key = |key: &Key| SphereKey {
            t: key.t,
            center: space.point(Vec3::from_array(key.center)),
            radius: space.length(key.radius),
        };
        keys.iter().map(key).collect()
    });
    Attack::new(spheres.collect()).map_err(|error| error.to_string())
}

/// A time of at most 600 s. Times before the start are clamped.
fn valid_time(seconds: f32) -> Result<f32, String> {
    let is_valid = seconds <= 600.0;
    is_valid
        .then_some(seconds.max(0.0))
        .ok_or_else(|| format!("{seconds} s is not a time of at most 600"))
}

fn no_slot() -> Failure {
    "there is no such slot".to_owned().into()
}

impl Culler {
    fn playhead(&self, place: &Place) -> Result<Playhead, String> {
        let wrong = || "the place is not in the graph".to_owned();
        let graph = self.baked.graph();
        let edge = graph.edges().get(place.edge as usize).ok_or_else(wrong)?;
        let sound = (0.0..=edge.frames as f32).contains(&place.frame)
            && [place.x, place.z, place.heading]
                .into_iter()
                .all(f32::is_finite);
        if !sound {
            return Err(wrong());
        }
        let space = self.space.inverse();
        let ground = space.ground(Vec2::new(place.x, place.z));
        let world = Rigid2::new(space.heading(place.heading), ground.x, ground.y);
        let playhead = Playhead::at(graph, EdgeId(place.edge), place.frame, world);
        playhead
            .is_sound(graph)
            .then_some(playhead)
            .ok_or_else(wrong)
    }

    /// # Safety
    /// As for [`gpu::Culler::record_batch`]. The queries have their places and keys.
    unsafe fn record(
        &mut self,
        queries: impl Iterator<Item = QueryIn>,
        commands: *mut c_void,
    ) -> Result<(), Failure> {
        if commands.is_null() {
            return Err("commands is NULL".to_owned().into());
        }
        let mut asked = Vec::new();
        for one in queries {
            // SAFETY: the caller vouches for place and keys.
            let (place, keys) = unsafe {
                (
                    given(one.place.as_ref(), "place")?,
                    given_slice(one.keys, one.key_count, "keys")?,
                )
            };
            let attack = read_attack(keys, self.space.inverse())?;
            asked.push((one.slot, self.playhead(place)?, attack));
        }
        // The slots are borrowed in their order.
        asked.sort_by_key(|(slot, ..)| *slot);
        let is_new = |pair: &[(u32, _, _)]| pair[0].0 != pair[1].0;
        let last = asked.last().map_or(0, |last| last.0 as usize + 1);
        if last > self.slots.len() || !asked.windows(2).all(is_new) {
            return Err(no_slot());
        }
        let query = Query::new(&self.baked, &self.settings);
        let mut sessions = Vec::new();
        let mut slots = self.slots.iter_mut().zip(0..);
        for (slot, playhead, attack) in &asked {
            let Some((place, _)) = slots.find(|(_, number)| number == slot) else {
                return Err(no_slot());
            };
            let Slot {
                context,
                waiting,
                ticket,
                answered,
                ..
            } = place;
            let session = query.start(Request::new(*playhead, attack), context);
            (*waiting, *ticket, *answered) = (Some(session.id()), None, false);
            sessions.push((*slot, session, ticket));
        }
        let batch = sessions.iter().map(|(slot, session, _)| BatchEntry {
            slot: *slot,
            input: session.cull_input(),
            ticket: None,
        });
        let mut batch: Vec<_> = batch.collect();
        // SAFETY: the caller vouches for the command buffer and the slots.
        let recorded = unsafe {
            self.device
                .record_batch(command_buffer(commands as u64), &mut batch)
        };
        let tickets: Vec<_> = batch.iter().map(|entry| entry.ticket).collect();
        for ((_, _, ticket), recorded) in sessions.iter_mut().zip(tickets) {
            **ticket = recorded;
        }
        match recorded {
            Err(error) if error.is_device_lost() => return Err(error.into()),
            // Nothing was recorded. The CPU computes the same counts.
            Err(error) => tracing::debug!("the CPU counts: {error}"),
            Ok(()) => {}
        }
        Ok(())
    }

    /// Answers a query if its counts are available. With `now`, the CPU counts at once.
    ///
    /// # Safety
    /// `out` is null, or an answer of as many bytes as it says.
    unsafe fn poll(
        &mut self,
        slot: u32,
        now: bool,
        out: *mut AnswerOut,
    ) -> Result<Status, Failure> {
        // What cannot be written is refused before the slot changes.
        // SAFETY: the caller vouches for the answer.
        unsafe { read(out.cast_const()) }?;
        let place = self.slots.get_mut(slot as usize).ok_or_else(no_slot)?;
        let Some(waiting) = place.waiting else {
            return Err("nothing was asked in this slot".to_owned().into());
        };
        let ticket = if now { None } else { place.ticket };
        let counted = match ticket {
            Some(ticket) => self.device.poll(ticket, &mut place.overlaps)?,
            None => false,
        };
        if ticket.is_some() && !counted {
            return Ok(NOT_YET);
        }
        self.has_counted |= counted;
        let query = Query::new(&self.baked, &self.settings);
        let session = query.resume(waiting, &mut place.context);
        let mut session = session.ok_or_else(|| "the question is gone".to_owned())?;
        let mut arrived = counted.then_some(&place.overlaps);
        let Ok(()) = session.run(&mut place.answer, |input, counts| {
            match arrived.take() {
                Some(arrived) if self.device.counts_exact() => counts.clone_from(arrived),
                Some(arrived) => {
                    // The device reports only whether there are shared texels. Scores need their number.
                    cpu::count(input, counts);
                    for (count, found) in counts.iter_mut().zip(arrived) {
                        let evasion = count.evasion;
                        *count = Overlap { evasion, ..*found };
                    }
                }
                None => cpu::count(input, counts),
            }
            Ok::<_, Infallible>(())
        });
        (place.waiting, place.ticket, place.answered) = (None, None, true);
        let answer = AnswerOut {
            size: 0,
            avoided: place.answer.avoided.into(),
            clearance: place.answer.clearance().metres,
            seconds: place.answer.motion.duration(),
            candidates: place.answer.counts.candidates as u32,
            removed: place.answer.counts.culled as u32,
            counted_by_cpu: (!counted).into(),
        };
        // SAFETY: the caller vouches for the answer.
        unsafe { write(answer, out) }?;
        Ok(OK)
    }

    fn answered(&self, slot: u32) -> Result<&Slot, Failure> {
        let slot = self.slots.get(slot as usize).ok_or_else(no_slot)?;
        let answered = slot.answered.then_some(slot);
        answered.ok_or_else(|| "this slot has no answer yet".to_owned().into())
    }

    fn sample(&mut self, slot: u32, seconds: f32) -> Result<&[JointTransform], Failure> {
        let seconds = valid_time(seconds)?;
        self.answered(slot)?;
        let graph = self.baked.graph();
        let place = &mut self.slots[slot as usize];
        place.answer.motion.sample(graph, seconds, &mut place.pose);
        forward_kinematics(graph.skeleton(), &place.pose, &mut place.joints);
        Ok(&place.joints)
    }
}
