//! Keyframes of nodes and their interpolation.

use std::collections::HashMap;

use glam::{Quat, Vec3, Vec4};
use gltf_json::animation::{Animation, Interpolation, Property, Sampler};
use gltf_json::validation::Checked;

use super::GltfError;
use super::container::Container;
use super::nodes::Local;
use super::times::FrameTime;

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
        for channel in &animation.channels {
            let node = channel.target.node.value();
            let property = match channel.target.path {
                Checked::Valid(property) => property,
                Checked::Invalid => continue,
            };
            if property == Property::MorphTargetWeights || !moves(node) {
                continue;
            }
            let sampler = animation.samplers.get(channel.sampler.value());
            let sampler = sampler.ok_or_else(|| GltfError::Index {
                from: format!("animation \"{}\"", self.name),
                what: "sampler",
                index: channel.sampler.value(),
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

    /// Whether the animation has no tracks.
    pub(super) fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Whether a node has keys.
    pub(super) fn moves(&self, node: usize) -> bool {
        self.nodes.contains_key(&node)
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
