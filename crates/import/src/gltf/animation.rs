//! Keyframes of nodes, their interpolation, and frames at a constant rate in place of keys at arbitrary times.

use std::collections::{HashMap, HashSet};

use glam::{Quat, Vec3, Vec4};
use gltf_json::animation::{Animation, Interpolation, Property, Sampler};
use gltf_json::validation::Checked;
use gltf_json::{Accessor, Index};

use super::buffers::{Container, FLOATS};
use super::named;
use super::nodes::{Local, node_name};
use crate::{FileError, MOST_ENTRIES};

/// The channels of an animation that move nodes and whose interpolation is known: node, property and index of the sampler.
pub(super) fn targets(
    animation: &Animation,
) -> impl Iterator<Item = (usize, Property, usize)> + '_ {
    let channels = animation.channels.iter();
    channels.filter_map(|channel| {
        let Checked::Valid(property) = channel.target.path else {
            return None;
        };
        let index = channel.sampler.value();
        // A sampler that is not there is reported later.
        let is_known = animation.samplers.get(index);
        let is_known =
            is_known.is_none_or(|sampler| matches!(sampler.interpolation, Checked::Valid(_)));
        let is_motion = property != Property::MorphTargetWeights && is_known;
        is_motion.then(|| (channel.target.node.value(), property, index))
    })
}

/// The nodes that the animations of a file move, of those for which `moves` returns true.
///
/// # Errors
/// The animations have more keys together than [`MOST_ENTRIES`].
pub(super) fn moved_nodes(
    container: &Container,
    moves: impl Fn(usize) -> bool,
) -> Result<HashSet<usize>, FileError> {
    let buffers = container.root.buffers.iter();
    let bytes = buffers.fold(0u64, |sum, buffer| sum.saturating_add(buffer.byte_length.0));
    // Accessors with more elements than the buffers have bytes are reported when they are read.
    let count = |accessor: Index<Accessor>| {
        let accessor = container.root.accessors.get(accessor.value());
        accessor.map_or(0, |accessor| accessor.count.0.min(bytes))
    };
    let (mut nodes, mut keys) = (HashSet::new(), 0u64);
    for animation in &container.root.animations {
        for (node, _, sampler) in targets(animation).filter(|&(node, ..)| moves(node)) {
            nodes.insert(node);
            if let Some(sampler) = animation.samplers.get(sampler) {
                let own = count(sampler.input).max(count(sampler.output));
                keys = keys.saturating_add(own);
            }
        }
    }
    match keys <= MOST_ENTRIES {
        true => Ok(nodes),
        false => Err(FileError::Invalid(format!(
            "the animations have {keys} keys together; {MOST_ENTRIES} are the most"
        ))),
    }
}

/// Tracks of one animation, by node.
pub(super) struct Tracks {
    pub(super) name: String,
    /// Translation, rotation and scale.
    nodes: HashMap<usize, [Option<Track>; 3]>,
}

/// Keyframes of one property of one node.
struct Track {
    /// Times, in seconds. Of keys of one time the last one counts at it and after it, the first one before it.
    times: Vec<f32>,
    /// Values, one for each time. Cubic splines have three: in-tangent, value, out-tangent.
    values: Vec<Vec4>,
    interpolation: Interpolation,
}

impl Tracks {
    /// Reads the tracks of the nodes for which `moves` returns true.
    pub(super) fn read(
        name: String,
        container: &Container,
        animation: &Animation,
        moves: impl Fn(usize) -> bool,
    ) -> Result<Self, FileError> {
        let mut nodes: HashMap<usize, [Option<Track>; 3]> = HashMap::new();
        for (node, property, sampler) in targets(animation).filter(|&(node, ..)| moves(node)) {
            let of_animation = || format!("animation \"{name}\"");
            let sampler = named(&animation.samplers, sampler, of_animation(), "sampler")?;
            let mut track = Track::read(container, sampler, property)?;
            track.check(property).map_err(|(key, problem)| {
                let of_node = node_name(container, node);
                let key = format!("{}, node \"{of_node}\", key {key}", of_animation());
                FileError::part(key, problem)
            })?;
            let part = match property {
                Property::Rotation => 1,
                Property::Scale => 2,
                _ => 0,
            };
            nodes.entry(node).or_default()[part] = Some(track);
        }
        Ok(Self { name, nodes })
    }

    /// Times of all keys, track by track.
    pub(super) fn times(&self) -> impl Iterator<Item = &[f32]> {
        let tracks = self.nodes.values().flatten().flatten();
        tracks.map(|track| track.times.as_slice())
    }

    /// Largest number of keys of a track that have the time of the key before. The format asks for increasing times, but programs write such
    /// keys where motions are joined or cut.
    pub(super) fn repeated(&self) -> usize {
        let repeated = |times: &[f32]| times.windows(2).filter(|pair| pair[0] == pair[1]).count();
        self.times().map(repeated).max().unwrap_or(0)
    }

    /// Transform of a node at a time, or `rest` if it has no keys.
    pub(super) fn sample(&self, node: usize, rest: &Local, time: FrameTime) -> Local {
        let Some([translation, rotation, scale]) = self.nodes.get(&node) else {
            return *rest;
        };
        let vector = |track: &Option<Track>, rest: Vec3| {
            let value = track.as_ref().map(|track| track.at(time, Vec4::lerp));
            value.map_or(rest, Vec4::truncate)
        };
        let rotation = rotation.as_ref().map(|track| {
            let value = track.at(time, |a, b, share| {
                let (a, b) = (Quat::from_vec4(a), Quat::from_vec4(b));
                let b = if a.dot(b) < 0.0 { -b } else { b };
                Vec4::from(a.slerp(b, share))
            });
            Quat::from_vec4(value).normalize()
        });
        Local {
            translation: vector(translation, rest.translation),
            rotation: rotation.unwrap_or(rest.rotation),
            scale: vector(scale, rest.scale),
        }
    }
}

impl Track {
    /// Reads the keys of a property.
    fn read(
        container: &Container,
        sampler: &Sampler,
        property: Property,
    ) -> Result<Self, FileError> {
        let (input, output) = (sampler.input.value(), sampler.output.value());
        let from = "a sampler";
        let times = container.elements::<_, 1>(input, from, &FLOATS)?;
        let values: Vec<Vec4> = if property == Property::Rotation {
            let values = container.elements::<_, 4>(output, from, &FLOATS)?;
            values.into_iter().map(Vec4::from).collect()
        } else {
            let values = container.elements::<_, 3>(output, from, &FLOATS)?;
            values
                .into_iter()
                .map(|v| Vec3::from(v).extend(0.0))
                .collect()
        };
        Ok(Self {
            times: times.into_iter().map(|[time]| time).collect(),
            values,
            interpolation: match sampler.interpolation {
                Checked::Valid(known) => known,
                // The targets have none of these.
                Checked::Invalid => Interpolation::Linear,
            },
        })
    }

    /// Checks the keys and normalises rotations. Returns the first invalid key and the reason.
    fn check(&mut self, property: Property) -> Result<(), (usize, &'static str)> {
        let parts = match self.interpolation {
            Interpolation::CubicSpline => 3,
            _ => 1,
        };
        if self.times.is_empty() {
            return Err((0, "there are no keys"));
        }
        if self.values.len() != parts * self.times.len() {
            return Err((self.times.len(), "not as many values as times"));
        }
        for (key, time) in self.times.iter().enumerate() {
            let earlier = key > 0 && *time < self.times[key - 1];
            if !time.is_finite() || *time < 0.0 || earlier {
                return Err((
                    key,
                    "its time is negative, no number, or before the key before",
                ));
            }
        }
        for (index, value) in self.values.iter_mut().enumerate() {
            if !value.is_finite() {
                return Err((index / parts, "its value is no number"));
            }
            if property == Property::Rotation && index % parts == parts / 2 {
                let unit = value.try_normalize();
                *value = unit.ok_or((index / parts, "it is no rotation"))?;
            }
        }
        Ok(())
    }

    /// Value at a time. Times before the first and after the last key are clamped. Keys have rounded times, so a step that belongs to a
    /// frame may seem to come just after it.
    fn at(&self, time: FrameTime, between: impl Fn(Vec4, Vec4, f32) -> Vec4) -> Vec4 {
        let reached = match self.interpolation {
            Interpolation::Step => time.seconds + time.slack,
            _ => time.seconds,
        };
        let after = self.times.partition_point(|&key| f64::from(key) <= reached);
        let value = |key: usize| match self.interpolation {
            Interpolation::CubicSpline => self.values[3 * key + 1],
            _ => self.values[key],
        };
        if after == 0 {
            return value(0);
        }
        let before = after - 1;
        if after == self.times.len() {
            return value(before);
        }
        let (start, end) = (f64::from(self.times[before]), f64::from(self.times[after]));
        let share = ((time.seconds - start) / (end - start)) as f32;
        match self.interpolation {
            Interpolation::Step => value(before),
            Interpolation::Linear => between(value(before), value(after), share),
            Interpolation::CubicSpline => {
                let seconds = (end - start) as f32;
                let leaving = self.values[3 * before + 2] * seconds;
                let coming = self.values[3 * after] * seconds;
                let (t, t2, t3) = (share, share * share, share * share * share);
                value(before) * (2.0 * t3 - 3.0 * t2 + 1.0)
                    + leaving * (t3 - 2.0 * t2 + t)
                    + value(after) * (3.0 * t2 - 2.0 * t3)
                    + coming * (t3 - t2)
            }
        }
    }
}

/// Frame rate of animations whose keys have no common rate, in frames per second.
const USUAL_RATE: f64 = 60.0;

/// Maximum deviation of a key from its frame, as a share of the frame time. Times are in single
/// precision.
const OFF: f64 = 0.05;

/// Frame times of an animation. The first frame is at time 0 (3.11), however late the first key is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frames {
    /// Frame rate, in frames per second.
    pub(super) rate: f64,
    /// Number of frames, at least 1.
    pub(super) count: u64,
}

/// Time of a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrameTime {
    /// Time, in seconds.
    pub(super) seconds: f64,
    /// A key that is at most this much later belongs to the frame, in seconds.
    pub(super) slack: f64,
}

impl Frames {
    /// Chooses one frame for each key if time 0 and the keys of all tracks lie on one grid, otherwise
    /// [`USUAL_RATE`]. Keys that all have one time are a pose: one frame.
    pub(super) fn of<'a>(tracks: impl Iterator<Item = &'a [f32]> + Clone) -> Self {
        let all = || tracks.clone().flatten().map(|&time| f64::from(time));
        let (start, seconds) = all().fold((f64::INFINITY, 0.0f64), |(start, end), time| {
            (start.min(time), end.max(time))
        });
        if !(seconds.is_finite() && seconds > start) {
            return Self {
                rate: 30.0,
                count: 1,
            };
        }
        let sampled = Self {
            rate: USUAL_RATE,
            // Times can be any single-precision values, so the count saturates.
            count: ((seconds * USUAL_RATE + 1e-3).floor() as u64).saturating_add(1),
        };
        let gaps = tracks.clone().flat_map(|times| times.windows(2));
        let gaps = gaps.map(|pair| f64::from(pair[1]) - f64::from(pair[0]));
        let gaps = gaps.filter(|&gap| gap > 0.0);
        let least = gaps.clone().fold(f64::INFINITY, f64::min);
        if !least.is_finite() {
            // Each track has a single key, at different times.
            return sampled;
        }
        // Mean of the gaps that differ from the smallest gap only by rounding.
        let (sum, count) = gaps
            .filter(|&gap| gap < 1.2 * least)
            .fold((0.0, 0.0), |(sum, count), gap| (sum + gap, count + 1.0));
        // The keys' own extent gives the rate more precisely than their distance from 0 does.
        let steps = ((seconds - start) * count / sum).round();
        let keys = all().count() as f64;
        if !(1.0..=1e9).contains(&steps) {
            return sampled;
        }
        let last = (seconds * steps / (seconds - start)).round();
        let frame_time = seconds / last;
        let off = |time: f64| {
            let frame = time / frame_time;
            (frame - frame.round()).abs()
        };
        // A few keys that happen to lie on a fine grid do not justify as many frames.
        let too_fine = steps > 4.0 * keys && 1.0 / frame_time > 4.0 * USUAL_RATE;
        if too_fine || all().any(|time| off(time) > OFF) {
            return sampled;
        }
        Self {
            rate: 1.0 / frame_time,
            count: last as u64 + 1,
        }
    }

    pub(super) fn time(&self, frame: u64) -> FrameTime {
        FrameTime {
            seconds: frame as f64 / self.rate,
            slack: OFF / self.rate,
        }
    }
}
