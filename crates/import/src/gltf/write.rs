//! Writes glTF files: a skeleton, a figure of its bones, and clips.

use std::io::{Error, ErrorKind, Result, Write};

use glam::{Mat4, Vec3};
use serde_json::{Value, json};

use crate::EventEntry;
use crate::bvh::moving_joints;
use crate::figure::on_whole;
use sabaki::anim::{
    Clip, Event, JointId, JointKind, Pose, Skeleton, WholeSkeleton, forward_kinematics,
};

/// Component types and targets of the specification, section 3.6.
const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

/// Writes clips of one skeleton as a GLB file with one animation for each clip, in metres. A figure
/// of thin bones is bound to the skeleton, so that every viewer shows the motion. End sites become
/// nodes too, and so do the joints that the skeleton's file has above and beside the body ([`Skeleton::whole`]).
///
/// The clips' events stand in the `extras` of each animation: `{"sabaki": {"events": [...]}}`, each event as in an
/// [`EventsFile`](crate::EventsFile). Reading the file returns them.
///
/// Key times are in single precision, so frame rates keep about six digits.
///
/// # Errors
/// An error of `out`, or `InvalidInput` for a clip of another skeleton, an event of an unknown clip, or a file larger than GLB's limit of
/// 4 GiB.
pub fn write(
    out: &mut impl Write,
    skeleton: &Skeleton,
    clips: &[Clip],
    events: &[Event],
) -> Result<()> {
    if let Some(event) = events.iter().find(|event| event.clip >= clips.len()) {
        let clip = event.clip;
        return Err(invalid(format!(
            "an event is of clip {clip}, which is not there"
        )));
    }
    let of_body = skeleton;
    let whole = skeleton.whole();
    let skeleton = whole.as_ref().map_or(of_body, |whole| &whole.skeleton);
    let mut buffer = Buffer::default();
    let places = rest_places(skeleton);
    let binds = places
        .iter()
        .map(|place| Mat4::from_translation(-*place).to_cols_array());
    let binds = buffer.floats("MAT4", binds.flatten());
    let mut animations = Vec::new();
    for clip in clips {
        if clip.joints() != of_body.len() {
            let name = clip.name();
            return Err(invalid(format!("clip \"{name}\" is of another skeleton")));
        }
        let mut animation = match &whole {
            Some(whole) => {
                let clip = on_whole(whole, clip).map_err(Error::other)?;
                buffer.animation(skeleton, &clip)
            }
            None => buffer.animation(skeleton, clip),
        };
        let labels: Vec<EventEntry> = events
            .iter()
            .filter(|event| event.clip == animations.len())
            .map(|event| EventEntry::of(event, of_body))
            .collect();
        if !labels.is_empty() {
            animation["extras"] = json!({ "sabaki": { "events": labels } });
        }
        animations.push(animation);
    }
    let joints: Vec<usize> = (0..skeleton.len()).collect();
    let root = match (&whole, clips.first()) {
        (None, Some(clip)) => clip.root(0),
        (Some(_), _) => skeleton.joint(JointId::ROOT).offset,
        _ => Vec3::ZERO,
    };
    let mut nodes = nodes(skeleton, root);
    let mut roots = vec![0];
    let is_bone = |child: JointId| {
        let mut ends = skeleton.joint(child).parent.into_iter().chain([child]);
        let is_of_body = |whole: &WholeSkeleton| ends.all(|joint| whole.is_of_body(joint));
        whole.as_ref().is_none_or(is_of_body)
    };
    let meshes = buffer.figure(skeleton, &places, is_bone);
    if !meshes.is_empty() {
        roots.push(nodes.len());
        nodes.push(json!({ "name": "figure", "mesh": 0, "skin": 0 }));
    }
    let document = json!({
        "asset": { "version": "2.0", "generator": concat!("sabaki ", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "nodes": roots }],
        "nodes": nodes,
        "skins": [{ "joints": joints, "inverseBindMatrices": binds, "skeleton": 0 }],
    });
    let lists = [("meshes", meshes), ("animations", animations)];
    buffer.write(out, document, lists)
}

fn invalid(problem: impl Into<String>) -> Error {
    Error::new(ErrorKind::InvalidInput, problem.into())
}

fn container(out: &mut impl Write, json: &[u8], binary: &[u8]) -> Result<()> {
    let padded = |length: usize| length.next_multiple_of(4);
    let word = |length: usize| {
        let length = u32::try_from(length).map(u32::to_le_bytes);
        length.map_err(|_| invalid("beyond 4 GiB, which GLB cannot hold"))
    };
    let whole = word(12 + 8 + padded(json.len()) + 8 + padded(binary.len()))?;
    out.write_all(b"glTF")?;
    out.write_all(&2u32.to_le_bytes())?;
    out.write_all(&whole)?;
    for (kind, data, filler) in [(b"JSON", json, b" "), (b"BIN\0", binary, b"\0")] {
        out.write_all(&word(padded(data.len()))?)?;
        out.write_all(kind)?;
        out.write_all(data)?;
        out.write_all(&filler.repeat(padded(data.len()) - data.len()))?;
    }
    Ok(())
}

/// Positions of the joints without rotations, with the root at the origin.
fn rest_places(skeleton: &Skeleton) -> Vec<Vec3> {
    let pose = Pose::at_rest(skeleton, Vec3::ZERO);
    let mut joints = Vec::new();
    forward_kinematics(skeleton, &pose, &mut joints);
    joints.iter().map(|joint| joint.translation).collect()
}

/// Nodes of the joints, with the root at a place.
fn nodes(skeleton: &Skeleton, root: Vec3) -> Vec<Value> {
    let node = |id: JointId| {
        let joint = skeleton.joint(id);
        let place = joint.parent.map_or(root, |_| joint.offset);
        let mut node = json!({ "name": joint.name, "translation": place.to_array() });
        let children: Vec<u16> = skeleton.children(id).map(|child| child.0).collect();
        if !children.is_empty() {
            node["children"] = json!(children);
        }
        node
    };
    skeleton.ids().map(node).collect()
}

/// An animation of nodes: what moves of each, and the accessor of its values at the keys.
pub(crate) fn animation_of(name: &str, keys: usize, moved: &[(usize, &str, usize)]) -> Value {
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    for (node, path, output) in moved {
        let target = json!({ "node": node, "path": path });
        channels.push(json!({ "sampler": samplers.len(), "target": target }));
        samplers.push(json!({ "input": keys, "output": output }));
    }
    json!({ "name": name, "samplers": samplers, "channels": channels })
}

/// The binary chunk and its views and accessors.
#[derive(Default)]
pub(crate) struct Buffer {
    pub(crate) bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    /// Writes a GLB file of this buffer: the document, with those of the lists that are not empty, as glTF demands.
    pub(crate) fn write<const N: usize>(
        self,
        out: &mut impl Write,
        mut document: Value,
        lists: [(&str, Vec<Value>); N],
    ) -> Result<()> {
        let own = [("accessors", self.accessors), ("bufferViews", self.views)];
        for (key, list) in own.into_iter().chain(lists) {
            if !list.is_empty() {
                document[key] = Value::Array(list);
            }
        }
        document["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        container(out, document.to_string().as_bytes(), &self.bytes)
    }

    /// Adds a view of everything that was written from `start` on, and returns its index.
    pub(crate) fn view(&mut self, start: usize, target: Option<u32>) -> usize {
        let mut view =
            json!({ "buffer": 0, "byteOffset": start, "byteLength": self.bytes.len() - start });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.views.push(view);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.len() - 1
    }

    /// Adds the joints of vertices, and returns the index of their accessor.
    pub(crate) fn joints(&mut self, joints: &[[u16; 4]], target: Option<u32>) -> usize {
        let words = joints.as_flattened().iter();
        let words = words.map(|joint| joint.to_le_bytes());
        self.add(UNSIGNED_SHORT, "VEC4", words, target)
    }

    /// Adds the corners of triangles, and returns the index of their accessor.
    pub(crate) fn indices(&mut self, corners: &[u32], target: Option<u32>) -> usize {
        let words = corners.iter().map(|corner| corner.to_le_bytes());
        self.add(UNSIGNED_INT, "SCALAR", words, target)
    }

    pub(crate) fn floats(&mut self, kind: &str, floats: impl Iterator<Item = f32>) -> usize {
        self.add(FLOAT, kind, floats.map(f32::to_le_bytes), None)
    }

    /// Adds an accessor of numbers, and returns its index.
    fn add<const N: usize>(
        &mut self,
        component: u32,
        kind: &str,
        numbers: impl Iterator<Item = [u8; N]>,
        target: Option<u32>,
    ) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let start = self.bytes.len();
        numbers.for_each(|number| self.bytes.extend(number));
        let count = (self.bytes.len() - start) / (N * width);
        let view = self.view(start, target);
        self.accessors.push(
            json!({ "bufferView": view, "componentType": component, "count": count, "type": kind }),
        );
        self.accessors.len() - 1
    }

    /// Adds floats with their bounds, which times and positions require.
    fn bounded<const N: usize>(&mut self, kind: &str, values: &[[f32; N]]) -> usize {
        let index = self.floats(kind, values.iter().flatten().copied());
        let bound = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
            let parts = (0..N).map(|part| values.iter().map(move |value| value[part]));
            parts.map(|part| part.reduce(pick).unwrap_or(0.0)).collect()
        };
        self.accessors[index]["min"] = json!(bound(f32::min));
        self.accessors[index]["max"] = json!(bound(f32::max));
        index
    }

    fn animation(&mut self, skeleton: &Skeleton, clip: &Clip) -> Value {
        let desc = clip.desc();
        let times: Vec<[f32; 1]> = (0..clip.frames())
            .map(|frame| [(frame as f64 / desc.frame_rate) as f32])
            .collect();
        let times = self.bounded("SCALAR", &times);
        let roots = desc.roots.iter().flat_map(Vec3::to_array);
        let mut moved = vec![(0, "translation", self.floats("VEC3", roots))];
        let moves = moving_joints(skeleton, clip);
        for (joint, of_skeleton) in skeleton.joints().iter().enumerate() {
            let every = |at: usize| at * skeleton.len() + joint;
            if of_skeleton.kind == JointKind::Moving {
                let turns = (0..clip.frames())
                    .flat_map(|at| desc.rotations[every(at)].normalize().to_array());
                moved.push((joint, "rotation", self.floats("VEC4", turns)));
            }
            if joint > 0 && moves[joint] {
                let places =
                    (0..clip.frames()).flat_map(|at| desc.translations[every(at)].to_array());
                moved.push((joint, "translation", self.floats("VEC3", places)));
            }
        }
        animation_of(&desc.name, times, &moved)
    }

    /// Creates an octahedron along each bone, bound to the joint at the bone's start. A skeleton
    /// without bones gets no mesh.
    fn figure(
        &mut self,
        skeleton: &Skeleton,
        places: &[Vec3],
        is_bone: impl Fn(JointId) -> bool,
    ) -> Vec<Value> {
        /// Position and width of an octahedron's waist, as shares of the bone's length.
        const WAIST: (f32, f32) = (0.15, 0.08);
        const FACES: [[u32; 3]; 8] = [
            [0, 2, 1],
            [0, 3, 2],
            [0, 4, 3],
            [0, 1, 4],
            [5, 1, 2],
            [5, 2, 3],
            [5, 3, 4],
            [5, 4, 1],
        ];
        let (mut vertices, mut joints, mut faces): (Vec<[f32; 3]>, Vec<[u16; 4]>, Vec<u32>) =
            Default::default();
        for id in skeleton.ids().filter(|&id| is_bone(id)) {
            let (child, joint) = (id.index(), skeleton.joint(id));
            let Some(parent) = joint.parent else { continue };
            let Some(along) = joint.offset.try_normalize() else {
                continue;
            };
            let (u, v) = along.any_orthonormal_pair();
            let (from, to) = (places[parent.index()], places[child]);
            let waist = from.lerp(to, WAIST.0);
            let width = WAIST.1 * joint.offset.length();
            let first = vertices.len() as u32;
            let ring = [u, v, -u, -v].map(|side| (waist + width * side).to_array());
            vertices.push(from.to_array());
            vertices.extend(ring);
            vertices.push(to.to_array());
            joints.extend([[parent.0, 0, 0, 0]; 6]);
            faces.extend(FACES.as_flattened().iter().map(|corner| first + corner));
        }
        if vertices.is_empty() {
            return Vec::new();
        }
        let position = self.bounded("VEC3", &vertices);
        let of_vertices = self.joints(&joints, Some(VERTICES));
        let weights = joints.iter().flat_map(|_| [1.0, 0.0, 0.0, 0.0]);
        let weights = self.floats("VEC4", weights);
        let corners = self.indices(&faces, Some(INDICES));
        for accessor in [position, weights] {
            let view = self.accessors[accessor]["bufferView"].as_u64().unwrap_or(0) as usize;
            self.views[view]["target"] = json!(VERTICES);
        }
        let attributes =
            json!({ "POSITION": position, "JOINTS_0": of_vertices, "WEIGHTS_0": weights });
        vec![
            json!({ "name": "figure", "primitives": [{ "attributes": attributes, "indices": corners }] }),
        ]
    }
}
