//! Keyframes of nodes and their interpolation.

use std::collections::{HashMap, HashSet};

use glam::{Quat, Vec3, Vec4};
use gltf_json::animation::{Animation, Interpolation, Property, Sampler};
use gltf_json::validation::Checked;
use gltf_json::{Accessor, Index};

use super::GltfError;
use super::container::Container;
use super::nodes::Local;
use super::times::FrameTime;
use crate::options::MOST_ENTRIES;

/// The node and property that a channel moves.
struct Target {
    node: usize,
    property: Property,
    /// Index of the sampler.
    sampler: usize,
}

/// The channels of an animation that move nodes and whose interpolation is known.
fn targets(animation: &Animation) -> impl Iterator<Item = Target> + '_ {
    let channels = animation.channels.iter();
    channels.filter_map(|channel| {
        let Checked::Valid(property) = channel.target.path else {
            return None;
        };
        let sampler = channel.sampler.value();
        // A sampler that is not there is reported later.
        let is_known = animation
            .samplers
            .get(sampler)
            .is_none_or(|sampler| matches!(sampler.interpolation, Checked::Valid(_)));
        (property != Property::MorphTargetWeights && is_known).then(|| Target {
            node: channel.target.node.value(),
            property,
            sampler,
        })
    })
}

/// The nodes that the animations of a file move.
pub(super) struct Moves {
    /// For each animation whether it moves a node.
    pub(super) animations: Vec<bool>,
    /// All nodes that an animation moves.
    pub(super) nodes: HashSet<usize>,
}

impl Moves {
    /// Considers the nodes for which `moves` returns true.
    ///
    /// # Errors
    /// The animations have more keys together than [`MOST_ENTRIES`].
    pub(super) fn of(
        container: &Container,
        moves: impl Fn(usize) -> bool,
    ) -> Result<Self, GltfError> {
        // Accessors with more elements than the buffers have bytes are reported when they are read.
        let count = |accessor: Index<Accessor>| {
            let accessor = container.root.accessors.get(accessor.value());
            accessor.map_or(0, |accessor| accessor.count.0.min(container.bytes))
        };
        let (mut animations, mut nodes, mut keys) = (Vec::new(), HashSet::new(), 0u64);
        for animation in &container.root.animations {
            let mut is_any = false;
            for target in targets(animation).filter(|target| moves(target.node)) {
                is_any = true;
                nodes.insert(target.node);
                if let Some(sampler) = animation.samplers.get(target.sampler) {
                    let own = count(sampler.input).max(count(sampler.output));
                    keys = keys.saturating_add(own);
                }
            }
            animations.push(is_any);
        }
        match keys <= MOST_ENTRIES {
            true => Ok(Self { animations, nodes }),
            false => Err(GltfError::TooManyKeys { keys }),
        }
    }
}

/// Tracks of one animation, by node.
pub(super) struct Tracks {
    pub(super) name: String,
    nodes: HashMap<usize, NodeTracks>,
}

#[derive(Default)]
struct NodeTracks {
    translation: Option<Track>,
    rotation: Option<Track>,
    scale: Option<Track>,
}

/// Keyframes of one property of one node.
struct Track {
    /// Times, in seconds, increasing.
    times: Vec<f32>,
    /// Values, one for each time. Cubic splines have three: in-tangent, value, out-tangent.
    values: Vec<Vec4>,
    interpolation: Interpolation,
}

impl Tracks {
    /// No tracks, of an animation with a name.
    pub(super) fn new(name: String) -> Self {
        Self {
            name,
            nodes: HashMap::new(),
        }
    }

    /// Reads the tracks of the nodes for which `moves` returns true.
    pub(super) fn read(
        &mut self,
        container: &Container,
        animation: &Animation,
        moves: impl Fn(usize) -> bool,
    ) -> Result<(), GltfError> {
        for target in targets(animation).filter(|target| moves(target.node)) {
            let Target {
                node,
                property,
                sampler,
            } = target;
            let sampler = animation
                .samplers
                .get(sampler)
                .ok_or_else(|| GltfError::Index {
                    from: format!("animation \"{}\"", self.name),
                    what: "sampler",
                    index: sampler,
                })?;
            let Some(mut track) = Track::read(container, sampler, property)? else {
                continue;
            };
            track
                .check(property)
                .map_err(|(key, problem)| GltfError::Key {
                    animation: self.name.clone(),
                    node: node_name(container, node),
                    key,
                    problem,
                })?;
            let of_node = self.nodes.entry(node).or_default();
            *match property {
                Property::Rotation => &mut of_node.rotation,
                Property::Scale => &mut of_node.scale,
                _ => &mut of_node.translation,
            } = Some(track);
        }
        Ok(())
    }

    /// Times of all keys, track by track.
    pub(super) fn times(&self) -> impl Iterator<Item = &[f32]> {
        self.nodes.values().flat_map(|node| {
            [&node.translation, &node.rotation, &node.scale]
                .into_iter()
                .flatten()
                .map(|track| track.times.as_slice())
        })
    }

    /// Transform of a node at a time, or `rest` if it has no keys.
    pub(super) fn sample(&self, node: usize, rest: &Local, time: FrameTime) -> Local {
        let Some(tracks) = self.nodes.get(&node) else {
            return *rest;
        };
        let vector = |track: &Option<Track>, rest: Vec3| {
            track
                .as_ref()
                .map_or(rest, |track| track.at(time, mix).truncate())
        };
        let rotation = tracks.rotation.as_ref().map(|track| {
            let value = track.at(time, |a, b, share| {
                let (a, b) = (Quat::from_vec4(a), Quat::from_vec4(b));
                let b = if a.dot(b) < 0.0 { -b } else { b };
                Vec4::from(a.slerp(b, share))
            });
            Quat::from_vec4(value).normalize()
        });
        Local {
            translation: vector(&tracks.translation, rest.translation),
            rotation: rotation.unwrap_or(rest.rotation),
            scale: vector(&tracks.scale, rest.scale),
        }
    }
}

pub(super) fn node_name(container: &Container, node: usize) -> String {
    let named = container
        .root
        .nodes
        .get(node)
        .and_then(|node| node.name.clone());
    named.unwrap_or_else(|| format!("node_{node}"))
}

fn mix(a: Vec4, b: Vec4, share: f32) -> Vec4 {
    a.lerp(b, share)
}

impl Track {
    /// Reads the keys of a property. Returns `None` if the interpolation is unknown.
    fn read(
        container: &Container,
        sampler: &Sampler,
        property: Property,
    ) -> Result<Option<Self>, GltfError> {
        let Checked::Valid(interpolation) = sampler.interpolation else {
            return Ok(None);
        };
        let (input, output) = (sampler.input.value(), sampler.output.value());
        let from = || "a sampler".to_owned();
        let times = container.floats::<1>(input, from)?;
        let values: Vec<Vec4> = if property == Property::Rotation {
            let values = container.floats::<4>(output, from)?;
            values.into_iter().map(Vec4::from).collect()
        } else {
            let values = container.floats::<3>(output, from)?;
            values
                .into_iter()
                .map(|v| Vec3::from(v).extend(0.0))
                .collect()
        };
        Ok(Some(Self {
            times: times.into_iter().map(|[time]| time).collect(),
            values,
            interpolation,
        }))
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
            let earlier = key > 0 && *time <= self.times[key - 1];
            if !time.is_finite() || *time < 0.0 || earlier {
                return Err((
                    key,
                    "its time is negative, no number, or not after the one before",
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
