//! Reads FBX files as glTF: the crate `ufbx` parses them, and what it finds is written as a GLB file, which the reader of glTF takes.
//!
//! Source: Samuli Raivio, ufbx (<https://ufbx.github.io>). Clips are read without the mesh, and the mesh without the takes. Lengths become metres and +Y up. Nodes keep their tree, and each take becomes an
//! animation with a key in each frame of the file's rate. Bones become a skin without a mesh, so that files with and without a mesh have the
//! same skeleton. Of materials, colour and embedded texture are kept.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::{DAffine3, DMat3, DVec3};
use serde_json::{Value, json};
use ufbx::{AnimStack, LoadOpts, Matrix, Mesh, Node, Scene, Transform};

use crate::gltf::{Buffer, ReadPurpose, animation_of};
use crate::{FileError, MOST_ENTRIES};

/// Part of the name that Assimp writes into its files.
const ASSIMP: &[u8] = b"Open Asset Import Library";

/// Most bytes that the parser may allocate.
const MEMORY: usize = 2 << 30;

/// Converts a part of a file to GLB: its bones with either their takes or the mesh.
pub(crate) fn to_glb(bytes: &[u8], purpose: ReadPurpose) -> Result<Vec<u8>, FileError> {
    let mut options = LoadOpts {
        ignore_geometry: purpose == ReadPurpose::Motion,
        ignore_animation: purpose == ReadPurpose::Mesh,
        target_axes: ufbx::CoordinateAxes::right_handed_y_up(),
        target_unit_meters: 1.0,
        space_conversion: ufbx::SpaceConversion::ModifyGeometry,
        geometry_transform_handling: ufbx::GeometryTransformHandling::ModifyGeometry,
        inherit_mode_handling: ufbx::InheritModeHandling::Compensate,
        generate_missing_normals: true,
        normalize_normals: true,
        clean_skin_weights: true,
        ..LoadOpts::default()
    };
    options.temp_allocator.memory_limit = MEMORY;
    options.result_allocator.memory_limit = MEMORY;
    let scene = ufbx::load_memory(bytes, options);
    let scene =
        scene.map_err(
            |error| match bytes.windows(ASSIMP.len()).any(|part| part == ASSIMP) {
                true => FileError::invalid(
                    "Assimp writes FBX files without the records that end lists of nodes, which cannot be read: export glTF from it",
                ),
                false => {
                    let problem = &error.description;
                    FileError::part("not an FBX file that can be read", problem)
                }
            },
        )?;
    let mut writer = Writer {
        scene: &scene,
        nodes: scene.nodes.iter().map(node).collect(),
        buffer: Buffer::default(),
        skins: Vec::new(),
        meshes: Vec::new(),
        materials: Vec::new(),
        images: Vec::new(),
    };
    writer.add_bones();
    let animations = match purpose {
        ReadPurpose::Motion => writer.animations()?,
        ReadPurpose::Mesh => {
            scene.nodes.iter().for_each(|node| writer.add_mesh(node));
            Vec::new()
        }
    };
    let root = scene.root_node.element.typed_id;
    let document = json!({
        "asset": { "version": "2.0", "generator": "FBX" },
        "scene": 0,
        "scenes": [{ "nodes": [root] }],
        "nodes": writer.nodes,
    });
    let textures = 0..writer.images.len();
    let textures = textures.map(|image| json!({ "source": image })).collect();
    let lists = [
        ("skins", writer.skins),
        ("meshes", writer.meshes),
        ("materials", writer.materials),
        ("textures", textures),
        ("images", writer.images),
        ("animations", animations),
    ];
    let mut out = Vec::new();
    let written = writer.buffer.write(&mut out, document, lists);
    written?;
    Ok(out)
}

fn node(node: &ufbx::Ref<Node>) -> Value {
    let [translation, rotation, scale] = parts(&node.local_transform);
    let children = node.children.iter().map(|child| child.element.typed_id);
    let children: Vec<u32> = children.collect();
    let name = match node.is_root {
        true => "Root",
        false => &node.element.name[..],
    };
    let mut value =
        json!({ "name": name, "translation": translation, "rotation": rotation, "scale": scale });
    if !children.is_empty() {
        value["children"] = json!(children);
    }
    value
}

/// Translation, rotation and scale.
fn parts(transform: &Transform) -> [Vec<f32>; 3] {
    let Transform {
        translation: t,
        rotation: r,
        scale: s,
    } = transform;
    [
        vec![t.x, t.y, t.z],
        vec![r.x, r.y, r.z, r.w],
        vec![s.x, s.y, s.z],
    ]
    .map(|parts| parts.into_iter().map(|part| part as f32).collect())
}

fn affine(matrix: &Matrix) -> DAffine3 {
    let m = matrix;
    DAffine3 {
        matrix3: DMat3::from_cols_array(&[
            m.m00, m.m10, m.m20, m.m01, m.m11, m.m21, m.m02, m.m12, m.m22,
        ]),
        translation: DVec3::new(m.m03, m.m13, m.m23),
    }
}

struct Writer<'a> {
    scene: &'a Scene,
    nodes: Vec<Value>,
    buffer: Buffer,
    skins: Vec<Value>,
    meshes: Vec<Value>,
    materials: Vec<Value>,
    images: Vec<Value>,
}

impl Writer<'_> {
    fn bones(&self) -> BTreeSet<u32> {
        let bones = self.scene.nodes.iter().filter(|node| node.bone.is_some());
        let clusters = self.scene.skin_clusters.iter();
        let of_skins = clusters.filter_map(|cluster| cluster.bone_node.as_ref());
        let all = bones.chain(of_skins).map(|node| node.element.typed_id);
        all.collect()
    }

    /// Adds the skin of all bones, in the pose that the skins were bound in.
    fn add_bones(&mut self) {
        let bones = self.bones();
        let clusters = self.scene.skin_clusters.iter();
        let binds = clusters.filter_map(|cluster| {
            let bone = cluster.bone_node.as_ref()?;
            Some((bone.element.typed_id, affine(&cluster.bind_to_world)))
        });
        let binds: HashMap<u32, DAffine3> = binds.collect();
        let of_node = |bone: u32| affine(&self.scene.nodes[bone as usize].node_to_world);
        let inverses = bones.iter().map(|bone| {
            let bind = binds.get(bone).copied();
            bind.unwrap_or_else(|| of_node(*bone)).inverse()
        });
        let inverses: Vec<DAffine3> = inverses.collect();
        if !bones.is_empty() {
            self.add_skin(bones.into_iter().collect(), &inverses);
        }
    }

    fn add_skin(&mut self, joints: Vec<u32>, inverses: &[DAffine3]) {
        let matrices = inverses
            .iter()
            .flat_map(|inverse| glam::DMat4::from(*inverse).as_mat4().to_cols_array());
        let matrices = self.buffer.floats("MAT4", matrices);
        self.skins
            .push(json!({ "joints": joints, "inverseBindMatrices": matrices }));
    }

    /// Adds the mesh of a node, if it has one with a skin.
    fn add_mesh(&mut self, node: &Node) {
        let Some(mesh) = &node.mesh else { return };
        let Some(skin) = mesh.skin_deformers.first() else {
            return;
        };
        let bones = skin
            .clusters
            .iter()
            .map(|cluster| cluster.bone_node.as_ref());
        let joints = bones.map(|bone| Some(bone?.element.typed_id));
        let Some(joints) = joints.collect() else {
            return;
        };
        let inverses = skin.clusters.iter();
        let inverses = inverses.map(|cluster| affine(&cluster.geometry_to_bone));
        self.add_skin(joints, &inverses.collect::<Vec<_>>());
        let mut parts: BTreeMap<u32, Part> = BTreeMap::new();
        let mut corners = vec![0; 3 * mesh.max_face_triangles];
        for (face, &shape) in mesh.faces.iter().enumerate() {
            if shape.num_indices < 3 {
                continue;
            }
            let material = mesh.face_material.get(face).copied().unwrap_or(0);
            let part = parts.entry(material).or_default();
            let count = mesh.triangulate_face(&mut corners, shape) as usize;
            corners[..3 * count]
                .iter()
                .for_each(|&corner| part.add(mesh, skin, corner));
        }
        let mut primitives = Vec::new();
        for (material, part) in parts {
            let mut primitive = part.write(&mut self.buffer);
            let of_node = node.materials.get(material as usize);
            if let Some(material) = of_node.or(mesh.materials.get(material as usize)) {
                primitive["material"] = json!(self.materials.len());
                let material = self.material(material);
                self.materials.push(material);
            }
            primitives.push(primitive);
        }
        let value = &mut self.nodes[node.element.typed_id as usize];
        value["mesh"] = json!(self.meshes.len());
        value["skin"] = json!(self.skins.len() - 1);
        self.meshes.push(json!({ "primitives": primitives }));
    }

    fn material(&mut self, material: &ufbx::Material) -> Value {
        let (pbr, fbx) = (&material.pbr.base_color, &material.fbx.diffuse_color);
        let texture = pbr.texture.as_ref().or(fbx.texture.as_ref());
        let content = texture
            .map(|texture| &texture.content[..])
            .unwrap_or_default();
        if content.starts_with(b"\x89PNG") || content.starts_with(b"\xff\xd8") {
            let start = self.buffer.bytes.len();
            self.buffer.bytes.extend(content);
            let view = self.buffer.view(start, None);
            self.images.push(json!({ "bufferView": view }));
            return json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": self.images.len() - 1 } } });
        }
        let colour = if pbr.has_value {
            pbr.value_vec4
        } else {
            fbx.value_vec4
        };
        json!({ "pbrMetallicRoughness": { "baseColorFactor": [colour.x, colour.y, colour.z, 1.0] } })
    }

    /// The bones and the nodes above them or, in a file without bones, all nodes.
    fn moving_nodes(&self) -> BTreeSet<u32> {
        let nodes = &self.scene.nodes;
        let above = |bone: u32| {
            let first = Some(&nodes[bone as usize]);
            std::iter::successors(first, |node| node.parent.as_deref())
        };
        let bones = self.bones().into_iter().flat_map(above);
        let moving: BTreeSet<u32> = bones.map(|node| node.element.typed_id).collect();
        match moving.is_empty() {
            true => (0..nodes.len() as u32).collect(),
            false => moving,
        }
    }

    /// An animation for each take in which a node leaves its rest.
    fn animations(&mut self) -> Result<Vec<Value>, FileError> {
        let scene = self.scene;
        let moving = self.moving_nodes();
        let rate = Some(scene.settings.frames_per_second)
            .filter(|rate| (1.0..=1000.0).contains(rate))
            .unwrap_or(30.0);
        let (mut animations, mut entries) = (Vec::new(), 0.0);
        for take in &scene.anim_stacks {
            let frames = (seconds(take) * rate).round() + 1.0;
            entries += frames * moving.len() as f64;
            if entries > MOST_ENTRIES as f64 {
                let take = &take.element.name;
                return Err(FileError::Invalid(format!(
                    "take \"{take}\" has more than {MOST_ENTRIES} frames times nodes"
                )));
            }
            let times: Vec<f64> = (0..frames as usize)
                .map(|frame| frame as f64 / rate)
                .collect();
            animations.extend(self.animation(take, &moving, &times));
        }
        Ok(animations)
    }

    /// The animation of a take, with keys at times from its start on. `None` if no node leaves its rest.
    fn animation(
        &mut self,
        take: &AnimStack,
        moving: &BTreeSet<u32>,
        times: &[f64],
    ) -> Option<Value> {
        /// What may move of a node.
        const PATHS: [(&str, &str); 3] = [
            ("translation", "VEC3"),
            ("rotation", "VEC4"),
            ("scale", "VEC3"),
        ];
        let keys = times.iter().map(|&time| time as f32);
        let keys = self.buffer.floats("SCALAR", keys);
        let mut moved = Vec::new();
        for &index in moving {
            let node = &self.scene.nodes[index as usize];
            let rest = parts(&node.local_transform);
            let at =
                |time: &f64| parts(&node.evaluate_transform(&take.anim, take.time_begin + time));
            let poses: Vec<[Vec<f32>; 3]> = times.iter().map(at).collect();
            for (part, (path, kind)) in PATHS.into_iter().enumerate() {
                let values = || poses.iter().flat_map(|pose| pose[part].iter().copied());
                let rests = rest[part].iter().cycle();
                if values()
                    .zip(rests)
                    .any(|(value, rest)| (value - rest).abs() > 1e-6)
                {
                    moved.push((index as usize, path, self.buffer.floats(kind, values())));
                }
            }
        }
        (!moved.is_empty()).then(|| animation_of(&take.element.name, keys, &moved))
    }
}

/// Duration of a take. Some programs leave out the range of one that begins at 0; then its last key ends it.
fn seconds(take: &AnimStack) -> f64 {
    let layers = take
        .layers
        .iter()
        .flat_map(|layer| layer.anim_values.iter());
    let curves = layers.flat_map(|value| value.curves.iter().flatten());
    let last = curves
        .filter_map(|curve| curve.keyframes.last())
        .map(|key| key.time);
    let end = match take.time_end > take.time_begin {
        true => take.time_end,
        false => last.fold(take.time_begin, f64::max),
    };
    let seconds = end - take.time_begin;
    if seconds > 0.0 { seconds } else { 0.0 }
}

/// The triangles of one material of a mesh.
#[derive(Default)]
struct Part {
    /// Vertices by their indices of position, normal and texture coordinates.
    known: HashMap<[u32; 3], u32>,
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    joints: Vec<[u16; 4]>,
    weights: Vec<[f32; 4]>,
    indices: Vec<u32>,
}

impl Part {
    fn add(&mut self, mesh: &Mesh, skin: &ufbx::SkinDeformer, corner: u32) {
        let corner = corner as usize;
        let vertex = mesh.vertex_indices[corner];
        let index = |exists: bool, indices: &[u32]| if exists { indices[corner] } else { 0 };
        let normal = index(mesh.vertex_normal.exists, &mesh.vertex_normal.indices);
        let uv = index(mesh.vertex_uv.exists, &mesh.vertex_uv.indices);
        let next = self.positions.len() as u32;
        let found = *self.known.entry([vertex, normal, uv]).or_insert(next);
        self.indices.push(found);
        if found != next {
            return;
        }
        let place = mesh.vertices[vertex as usize];
        self.positions
            .push([place.x, place.y, place.z].map(|part| part as f32));
        if let Some(normal) = mesh.vertex_normal.values.get(normal as usize) {
            self.normals
                .push([normal.x, normal.y, normal.z].map(|part| part as f32));
        }
        if let Some(uv) = mesh.vertex_uv.values.get(uv as usize) {
            self.uvs.push([uv.x as f32, 1.0 - uv.y as f32]);
        }
        // The largest weights come first. A vertex without any stays with the first joint.
        let (mut joints, mut weights) = ([0; 4], [0.0; 4]);
        let own = skin.vertices.get(vertex as usize);
        let own = own.map_or(0..0, |own| {
            own.weight_begin as usize..(own.weight_begin + own.num_weights) as usize
        });
        for (at, weight) in skin
            .weights
            .get(own)
            .unwrap_or_default()
            .iter()
            .take(4)
            .enumerate()
        {
            (joints[at], weights[at]) = (weight.cluster_index as u16, weight.weight as f32);
        }
        if weights == [0.0; 4] {
            weights[0] = 1.0;
        }
        self.joints.push(joints);
        self.weights.push(weights);
    }

    fn write(self, buffer: &mut Buffer) -> Value {
        let count = self.positions.len();
        let mut attributes = json!({
            "POSITION": buffer.floats("VEC3", self.positions.into_iter().flatten()),
            "WEIGHTS_0": buffer.floats("VEC4", self.weights.into_iter().flatten()),
        });
        if self.normals.len() == count {
            attributes["NORMAL"] = json!(buffer.floats("VEC3", self.normals.into_iter().flatten()));
        }
        if self.uvs.len() == count {
            attributes["TEXCOORD_0"] = json!(buffer.floats("VEC2", self.uvs.into_iter().flatten()));
        }
        attributes["JOINTS_0"] = json!(buffer.joints(&self.joints, None));
        json!({ "attributes": attributes, "indices": buffer.indices(&self.indices, None) })
    }
}
