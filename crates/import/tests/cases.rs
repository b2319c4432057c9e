//! Files as other programs write them, which were once read wrongly.

use std::path::{Path, PathBuf};

use glam::{Affine3A, Quat, Vec3};
use sabaki::anim::{Clip, JointId, JointTransform, Pose, Skeleton};
use sabaki::maps::Body;
use sabaki_fixtures::clips::joints_at;
use sabaki_import::fit::{FitSettings, fit_prop};
use sabaki_import::gltf::{GltfError, GltfFile, SkinVertex, SkinnedMesh};
use sabaki_import::{ReadOptions, parse_obj, read_clip, read_clips, read_mesh, read_obj, stature};
use serde_json::{Value, json};

use super::gltf::{glb, glb_parts};

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/corpus/cases")
        .join(name)
}

fn parts(name: &str) -> (Value, Vec<u8>) {
    glb_parts(&std::fs::read(path(name)).unwrap())
}

fn mesh_of(document: &Value, binary: &[u8]) -> Result<SkinnedMesh, GltfError> {
    SkinnedMesh::parse(&glb(document, binary), |_| Err("no such file".to_owned()))
}

fn clip_of(document: &Value, binary: &[u8]) -> (Skeleton, Clip) {
    let file = GltfFile::parse(&glb(document, binary), |_| Err("no such file".to_owned())).unwrap();
    (file.skeleton().clone(), file.animations()[0].clip.clone())
}

/// The joints of every tenth frame.
fn frames(skeleton: &Skeleton, clip: &Clip) -> Vec<Vec<JointTransform>> {
    let joints = |frame| joints_at(skeleton, clip, frame);
    (0..clip.frames()).step_by(10).map(joints).collect()
}

#[test]
fn time_0_is_the_start_however_late_the_first_key_is() {
    let events = path("first_key_at_5s.events.json");
    let set = read_clips(
        &[path("first_key_at_5s.glb")],
        Some(&events),
        &ReadOptions::default(),
    )
    .unwrap();
    let clip = &set.clips[0];
    assert!(
        (clip.duration() - (5.0 + 59.0 / 30.0)).abs() < 1e-3,
        "{}",
        clip.duration()
    );
    assert_eq!((clip.frames(), set.events[0].start), (210, 5.5));
    let place = |frame: usize| {
        (
            clip.root(frame),
            clip.desc().rotations[frame * clip.joints() + 3],
        )
    };
    for frame in 0..150 {
        let (root, turn) = place(frame);
        assert!(root.distance(place(150).0) < 1e-5, "{frame}");
        assert!(turn.dot(place(150).1) > 1.0 - 1e-6, "{frame}");
    }
    assert_ne!(place(151), place(150));
}

/// Largest distance of a sphere's centre from its bone, and of a bone's point from the spheres.
fn off_the_bones(skeleton: &Skeleton, clip: &Clip) -> (f32, f32) {
    let body = Body::from_bones(skeleton);
    let (mut away, mut bare) = (0.0f32, 0.0f32);
    for joints in frames(skeleton, clip) {
        let place = |id: JointId| joints[id.index()].translation;
        let bones = skeleton
            .ids()
            .filter_map(|id| Some((place(skeleton.joint(id).parent?), place(id))));
        let bones: Vec<(Vec3, Vec3)> = bones.collect();
        let centre =
            |sphere: &sabaki::maps::BodySphere| joints[sphere.joint.index()].point(sphere.offset);
        for sphere in &body.spheres {
            let distance = |&(a, b): &(Vec3, Vec3)| {
                let share = (centre(sphere) - a).dot(b - a) / (b - a).length_squared().max(1e-12);
                centre(sphere).distance(a.lerp(b, share.clamp(0.0, 1.0)))
            };
            away = away.max(bones.iter().map(distance).fold(f32::MAX, f32::min));
        }
        for (a, b) in bones {
            for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
                let gap = |sphere: &sabaki::maps::BodySphere| {
                    a.lerp(b, share).distance(centre(sphere)) - sphere.radius
                };
                bare = bare.max(body.spheres.iter().map(gap).fold(f32::MAX, f32::min));
            }
        }
    }
    (away, bare)
}

#[test]
fn spheres_lie_on_the_bones_below_any_scale() {
    let (document, binary) = parts("mirrored_armature.glb");
    let scaled = |scale: [f32; 3]| {
        let mut document = document.clone();
        document["nodes"][24]["scale"] = json!(scale);
        clip_of(&document, &binary)
    };
    let plain = scaled([1.0; 3]);
    for scale in [
        [-1.0, 1.0, 1.0],
        [-1.0; 3],
        [0.01, -0.01, 0.01],
        [1.0, 1.0, 1.2],
        [1.1, -0.9, 1.0],
    ] {
        let (skeleton, clip) = scaled(scale);
        let size = scale[0].abs();
        for (found, wanted) in frames(&skeleton, &clip)
            .iter()
            .zip(frames(&plain.0, &plain.1))
        {
            for (found, wanted) in found.iter().zip(wanted) {
                let wanted = Vec3::from(scale) * wanted.translation;
                assert!(found.translation.distance(wanted) < 1e-5, "{scale:?}");
            }
        }
        let (away, bare) = off_the_bones(&skeleton, &clip);
        assert!(
            away < 0.01 * size && bare < 0.01 * size,
            "{scale:?}: {away} {bare}"
        );
        let is_uniform = scale.iter().all(|part| part.abs() == size);
        assert_eq!(clip.moves_joints(), !is_uniform, "{scale:?}");
    }
}

#[test]
fn leaves_of_ends_add_no_height() {
    let read = read_clip(&path("leaf_bones.glb"), &ReadOptions::default()).unwrap();
    let mut pose = Pose::default();
    read.clip.pose(0, &mut pose);
    let height = stature(&read.skeleton, &pose);
    assert!((height - 1.90).abs() < 0.01, "{height}");
    assert!(read.skeleton.find("Head_Tip").is_some());
    assert!(read.skeleton.find("Head_Tip_end").is_none());
    assert!(
        read.notes[0].starts_with("leaf bones below ends are left out: 5"),
        "{:?}",
        read.notes
    );
    let crown = read.skeleton.find("Head_Tip").unwrap();
    let body = Body::from_bones(&read.skeleton);
    for joints in frames(&read.skeleton, &read.clip) {
        let tops = body
            .spheres
            .iter()
            .map(|sphere| joints[sphere.joint.index()].point(sphere.offset).y + sphere.radius);
        let above = tops.fold(f32::MIN, f32::max) - joints[crown.index()].translation.y;
        assert!(above.abs() < 0.05, "{above}");
    }
}

/// The file with its buffer views compressed.
fn compressed(document: &Value, binary: &[u8]) -> (Value, Vec<u8>) {
    let (mut document, mut bytes) = (document.clone(), Vec::new());
    let mut at = 0;
    for (index, accessor) in document["accessors"]
        .as_array()
        .unwrap()
        .clone()
        .iter()
        .enumerate()
    {
        let view = accessor["bufferView"].as_u64().unwrap() as usize;
        let range = &document["bufferViews"][view];
        let [start, length] =
            ["byteOffset", "byteLength"].map(|key| range[key].as_u64().unwrap() as usize);
        let data = &binary[start..start + length];
        let count = accessor["count"].as_u64().unwrap() as usize;
        let floats = || -> Vec<f32> {
            data.as_chunks::<4>()
                .0
                .iter()
                .map(|bytes| f32::from_le_bytes(*bytes))
                .collect()
        };
        let (mode, filter, stride, stream) = match (
            accessor["type"].as_str().unwrap(),
            accessor["componentType"].as_u64().unwrap(),
        ) {
            ("SCALAR", 5125) => {
                let indices: Vec<u32> = data
                    .as_chunks::<4>()
                    .0
                    .iter()
                    .map(|bytes| u32::from_le_bytes(*bytes))
                    .collect();
                (
                    "TRIANGLES",
                    "NONE",
                    4,
                    meshopt::encode_index_buffer(&indices, count).unwrap(),
                )
            }
            ("VEC4", 5126)
                if document["animations"][0]["samplers"]
                    .as_array()
                    .unwrap()
                    .iter()
                    .any(|sampler| sampler["output"] == index) =>
            {
                let turns = meshopt::encode_filter_quat(floats().as_chunks::<4>().0, 16);
                document["accessors"][index]["componentType"] = json!(5122);
                document["accessors"][index]["normalized"] = json!(true);
                (
                    "ATTRIBUTES",
                    "QUATERNION",
                    8,
                    meshopt::encode_vertex_buffer(&turns).unwrap(),
                )
            }
            ("VEC3", 5126) => (
                "ATTRIBUTES",
                "NONE",
                12,
                meshopt::encode_vertex_buffer(floats().as_chunks::<3>().0).unwrap(),
            ),
            _ => {
                let stride = length / count;
                let stream = match stride {
                    4 => meshopt::encode_vertex_buffer(data.as_chunks::<4>().0),
                    16 => meshopt::encode_vertex_buffer(data.as_chunks::<16>().0),
                    _ => meshopt::encode_vertex_buffer(data.as_chunks::<64>().0),
                };
                ("ATTRIBUTES", "NONE", stride, stream.unwrap())
            }
        };
        document["bufferViews"][view] = json!({
            "buffer": 1, "byteOffset": at, "byteLength": count * stride,
            "extensions": { "EXT_meshopt_compression": {
                "buffer": 0, "byteOffset": bytes.len(), "byteLength": stream.len(), "byteStride": stride, "count": count, "mode": mode, "filter": filter,
            } },
        });
        at += count * stride;
        bytes.extend(stream);
    }
    document["buffers"] = json!([{ "byteLength": bytes.len() }, { "byteLength": at, "extensions": { "EXT_meshopt_compression": { "fallback": true } } }]);
    document["extensionsUsed"] = json!(["EXT_meshopt_compression"]);
    document["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
    (document, bytes)
}

#[test]
fn compressed_buffers_are_decoded() {
    let (document, binary) = parts("mesh_vcol.glb");
    let (small, bytes) = compressed(&document, &binary);
    assert!(bytes.len() < binary.len() * 3 / 4);
    let (mesh, wanted) = (
        mesh_of(&small, &bytes).unwrap(),
        mesh_of(&document, &binary).unwrap(),
    );
    for (found, wanted) in mesh.vertices.iter().zip(&wanted.vertices) {
        // Normals are sums over triangles, whose corners the codec may turn round.
        assert!(found.normal.distance(wanted.normal) < 1e-4);
        let normal = found.normal;
        assert_eq!(*found, SkinVertex { normal, ..*wanted });
    }
    let turned = |&[a, b, c]: &[u32; 3]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min();
    assert!(
        mesh.triangles
            .iter()
            .map(turned)
            .eq(wanted.triangles.iter().map(turned))
    );
    let ((skeleton, clip), (_, wanted)) = (clip_of(&small, &bytes), clip_of(&document, &binary));
    assert_eq!(clip.frames(), wanted.frames());
    for (found, wanted) in frames(&skeleton, &clip)
        .iter()
        .flatten()
        .zip(frames(&skeleton, &wanted).iter().flatten())
    {
        assert!(found.translation.distance(wanted.translation) < 1e-3);
    }
    // A stream that does not end where its elements do, and one that is cut off.
    for (key, value) in [
        ("byteLength", json!(20)),
        ("byteStride", json!(6)),
        ("mode", json!("OTHER")),
        ("count", json!(1u64 << 40)),
    ] {
        let mut spoilt = small.clone();
        spoilt["bufferViews"][1]["extensions"]["EXT_meshopt_compression"][key] = value;
        let error = GltfFile::parse(&glb(&spoilt, &bytes), |_| Err(String::new())).unwrap_err();
        assert!(
            matches!(error, GltfError::Compressed { view: 1, .. }),
            "{error}"
        );
    }
    let error = read_clip(&path("meshopt_fallback.glb"), &ReadOptions::default())
        .unwrap_err()
        .to_string();
    assert!(error.contains("EXT_meshopt_compression"), "{error}");
}

#[test]
fn extensions_that_are_not_read_are_named() {
    let error = read_mesh(&path("mesh_draco.glb")).unwrap_err().to_string();
    assert!(
        error.ends_with("it requires the extension KHR_draco_mesh_compression, which is not read"),
        "{error}"
    );
    let motion = read_clip(&path("mesh_draco.glb"), &ReadOptions::default()).unwrap();
    assert_eq!(
        motion.notes,
        ["extensions that are not read: KHR_draco_mesh_compression"]
    );
    let (mut document, binary) = parts("mesh_vcol.glb");
    document["extensionsUsed"] =
        json!(["EXT_some", "KHR_materials_unlit", "KHR_mesh_quantization"]);
    let mesh = mesh_of(&document, &binary).unwrap();
    assert_eq!(mesh.notes, ["extensions that are not read: EXT_some"]);
}

/// Positions of the triangles' corners, sorted.
fn corners(mesh: &SkinnedMesh) -> Vec<[i32; 3]> {
    let place = |&corner: &u32| {
        mesh.vertices[corner as usize]
            .position
            .to_array()
            .map(|part| (1e4 * part).round() as i32)
    };
    let mut all: Vec<_> = mesh.triangles.as_flattened().iter().map(place).collect();
    all.sort_unstable();
    all
}

#[test]
fn the_meshes_of_all_skins_are_read() {
    let one = read_mesh(&path("mesh_vcol.glb")).unwrap();
    let two = read_mesh(&path("mesh_twoskins.glb")).unwrap();
    assert_eq!(two.joints, one.joints);
    assert_eq!(corners(&two), corners(&one));
    for &corner in two.triangles.as_flattened() {
        let vertex = &two.vertices[corner as usize];
        let joint = &two.joints[usize::from(vertex.joints[0])];
        assert!(
            vertex.position.distance(joint.position) < 0.5,
            "{}",
            joint.name
        );
    }
    // A second skin whose mesh is stored in millimetres, lying down.
    let (mut document, mut binary) = parts("mesh_twoskins.glb");
    let stored = Affine3A::from_scale_rotation_translation(
        Vec3::splat(1e3),
        Quat::from_rotation_x(-1.5),
        Vec3::X,
    );
    let view = |document: &Value, accessor: usize| {
        let view = document["accessors"][accessor]["bufferView"]
            .as_u64()
            .unwrap() as usize;
        document["bufferViews"][view]["byteOffset"]
            .as_u64()
            .unwrap() as usize
    };
    let floats = |binary: &[u8], at: usize, count: usize| -> Vec<f32> {
        binary[at..at + 4 * count]
            .as_chunks::<4>()
            .0
            .iter()
            .map(|bytes| f32::from_le_bytes(*bytes))
            .collect()
    };
    let inverses = view(&document, 29);
    for joint in 0..9 {
        let at = inverses + 64 * joint;
        let inverse = glam::Mat4::from_cols_slice(&floats(&binary, at, 16))
            * glam::Mat4::from(stored.inverse());
        binary[at..at + 64]
            .copy_from_slice(inverse.to_cols_array().map(f32::to_le_bytes).as_flattened());
    }
    let places = floats(&binary, view(&document, 22), 3 * 368);
    let moved = places
        .as_chunks::<3>()
        .0
        .iter()
        .map(|place| stored.transform_point3(Vec3::from(*place)).to_array());
    let moved: Vec<u8> = moved.flatten().flat_map(f32::to_le_bytes).collect();
    append(
        &mut document,
        &mut binary,
        &moved,
        json!({ "componentType": 5126, "count": 368, "type": "VEC3" }),
    );
    let added = document["accessors"].as_array().unwrap().len() - 1;
    document["meshes"][1]["primitives"][0]["attributes"]["POSITION"] = json!(added);
    assert_eq!(
        corners(&mesh_of(&document, &binary).unwrap()),
        corners(&one)
    );
}

/// Adds an accessor.
fn append(document: &mut Value, binary: &mut Vec<u8>, bytes: &[u8], accessor: Value) -> usize {
    let mut accessor = accessor;
    let views = document["bufferViews"].as_array_mut().unwrap();
    accessor["bufferView"] = json!(views.len());
    views.push(json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len() }));
    binary.extend(bytes);
    document["buffers"][0]["byteLength"] = json!(binary.len());
    let accessors = document["accessors"].as_array_mut().unwrap();
    accessors.push(accessor);
    accessors.len() - 1
}

#[test]
fn quantized_and_filtered_meshes_are_read() {
    const COUNT: usize = 368;
    let (mut plain, mut binary) = parts("mesh_vcol.glb");
    let ahead: Vec<u8> = (0..COUNT)
        .flat_map(|vertex| {
            let turn = Quat::from_rotation_y(0.1 * vertex as f32);
            (turn * Vec3::new(0.6, 0.0, 0.8)).to_array()
        })
        .flat_map(f32::to_le_bytes)
        .collect();
    let floats = json!({ "componentType": 5126, "count": COUNT, "type": "VEC3" });
    let normals = append(&mut plain, &mut binary, &ahead, floats);
    plain["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    let wanted = mesh_of(&plain, &binary).unwrap();
    let vectors = |bytes: &[u8]| -> Vec<[f32; 4]> {
        let floats = bytes
            .as_chunks::<4>()
            .0
            .iter()
            .map(|bytes| f32::from_le_bytes(*bytes));
        let floats: Vec<f32> = floats.collect();
        floats
            .as_chunks::<3>()
            .0
            .iter()
            .map(|&[x, y, z]| [x, y, z, 0.0])
            .collect()
    };
    let places = vectors(&binary[20736..20736 + 12 * COUNT]);
    let as_compressed = |document: &mut Value, accessor: usize, stride: usize, filter: &str| {
        let view = &mut document["bufferViews"][accessor];
        let length = view["byteLength"].clone();
        view["extensions"] = json!({ "EXT_meshopt_compression": {
            "buffer": 0, "byteOffset": view["byteOffset"], "byteLength": length, "byteStride": stride,
            "count": COUNT, "mode": "ATTRIBUTES", "filter": filter
        } });
        view["byteStride"] = json!(stride);
        view["byteLength"] = json!(stride * COUNT);
    };

    // Millimetres in 16 bits, which the bind matrices undo, and normals in 8.
    let (mut document, mut bytes) = (plain.clone(), binary.clone());
    let millimetres = places
        .iter()
        .flat_map(|place| place.map(|part| (1000.0 * part).round() as i16));
    let millimetres: Vec<u8> = millimetres.flat_map(i16::to_le_bytes).collect();
    let shorts = json!({ "componentType": 5122, "count": COUNT, "type": "VEC3" });
    let position = append(&mut document, &mut bytes, &millimetres, shorts);
    document["bufferViews"][position]["byteStride"] = json!(8);
    let eighths = meshopt::encode_filter_oct::<i8>(&vectors(&ahead), 8);
    let eighths = meshopt::encode_vertex_buffer(&eighths).unwrap();
    let of_bytes =
        json!({ "componentType": 5120, "normalized": true, "count": COUNT, "type": "VEC3" });
    let normal = append(&mut document, &mut bytes, &eighths, of_bytes);
    as_compressed(&mut document, normal, 4, "OCTAHEDRAL");
    let attributes = &mut document["meshes"][0]["primitives"][0]["attributes"];
    attributes["POSITION"] = json!(position);
    attributes["NORMAL"] = json!(normal);
    for inverse in bytes[19200..20736].as_chunks_mut::<64>().0 {
        let parts = inverse
            .as_chunks::<4>()
            .0
            .iter()
            .map(|part| f32::from_le_bytes(*part));
        let matrix = glam::Mat4::from_cols_slice(&parts.collect::<Vec<_>>());
        let matrix = matrix * glam::Mat4::from_scale(Vec3::splat(1e-3));
        inverse.copy_from_slice(matrix.to_cols_array().map(f32::to_le_bytes).as_flattened());
    }
    document["extensionsRequired"] = json!(["KHR_mesh_quantization", "EXT_meshopt_compression"]);
    let found = mesh_of(&document, &bytes).unwrap();
    assert_eq!(found.vertices.len(), wanted.vertices.len());
    for (found, wanted) in found.vertices.iter().zip(&wanted.vertices) {
        // The mesh is in its own unit, millimetres.
        assert!((1e-3 * found.position).distance(wanted.position) < 1e-3);
        assert!(
            found.normal.angle_between(wanted.normal) < 0.02,
            "{} {}",
            found.normal,
            wanted.normal
        );
    }

    // Positions with an exponent for each vector.
    let (mut document, mut bytes) = (plain, binary);
    let three: Vec<[f32; 3]> = places.iter().map(|&[x, y, z, _]| [x, y, z]).collect();
    let exponents = meshopt::encode_filter_exp(&three, 15, meshopt::EncodeExpMode::SharedVector);
    let exponents = meshopt::encode_vertex_buffer(&exponents).unwrap();
    let floats = json!({ "componentType": 5126, "count": COUNT, "type": "VEC3" });
    let position = append(&mut document, &mut bytes, &exponents, floats);
    as_compressed(&mut document, position, 12, "EXPONENTIAL");
    document["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(position);
    let found = mesh_of(&document, &bytes).unwrap();
    for (found, wanted) in found.vertices.iter().zip(&wanted.vertices) {
        assert!(found.position.distance(wanted.position) < 2e-4);
    }
}

#[test]
fn a_mirrored_mesh_stands_as_its_nodes_do() {
    let (mut document, binary) = parts("mesh_vcol.glb");
    let plain = mesh_of(&document, &binary).unwrap();
    let armature = document["nodes"].as_array().unwrap().len();
    document["nodes"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "children": [0], "scale": [-1, 1, 1] }));
    document["scenes"][0]["nodes"] = json!([armature, 24]);
    let mirrored = mesh_of(&document, &binary).unwrap();
    let flip = Vec3::new(-1.0, 1.0, 1.0);
    for (found, wanted) in mirrored.vertices.iter().zip(&plain.vertices) {
        assert!(found.position.distance(flip * wanted.position) < 1e-5);
        assert!(
            found.normal.distance(flip * wanted.normal) < 1e-4,
            "as seen from outside"
        );
    }
    // Its joints' frames are those of the clip, so that it is bound exactly.
    let (skeleton, _) = clip_of(&document, &binary);
    for joint in mirrored.joints.iter().skip(1) {
        let parent = &mirrored.joints[joint.parent.unwrap()];
        let own = parent.rotation.conjugate() * (joint.position - parent.position);
        let wanted = skeleton.joint(skeleton.find(&joint.name).unwrap()).offset;
        assert!(
            own.distance(wanted) < 1e-4,
            "{}: {own} {wanted}",
            joint.name
        );
    }
}

#[test]
fn colours_of_vertices_are_read() {
    let (document, binary) = parts("mesh_vcol.glb");
    let mesh = mesh_of(&document, &binary).unwrap();
    let view = document["accessors"][25]["bufferView"].as_u64().unwrap() as usize;
    let start = document["bufferViews"][view]["byteOffset"]
        .as_u64()
        .unwrap() as usize;
    let colours = binary[start..]
        .as_chunks::<4>()
        .0
        .iter()
        .map(|bytes| f32::from_le_bytes(*bytes));
    let colours: Vec<f32> = colours.take(3 * mesh.vertices.len()).collect();
    for (vertex, colour) in mesh.vertices.iter().zip(colours.as_chunks::<3>().0) {
        assert_eq!(vertex.colour[..3], *colour);
    }
    assert!(colours.iter().any(|&part| part < 0.5));
}

#[test]
fn of_more_than_four_joints_the_strongest_stay() {
    let (mut document, mut binary) = parts("mesh_vcol.glb");
    let joints = [5u8, 6, 7, 8].repeat(368);
    let joints = append(
        &mut document,
        &mut binary,
        &joints,
        json!({ "componentType": 5121, "count": 368, "type": "VEC4" }),
    );
    let weights: Vec<u8> = [0.05f32, 0.04, 0.03, 0.02]
        .map(f32::to_le_bytes)
        .as_flattened()
        .repeat(368);
    let weights = append(
        &mut document,
        &mut binary,
        &weights,
        json!({ "componentType": 5126, "count": 368, "type": "VEC4" }),
    );
    let attributes = &mut document["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_1"] = json!(joints);
    attributes["WEIGHTS_1"] = json!(weights);
    let mesh = mesh_of(&document, &binary).unwrap();
    assert_eq!(
        mesh.notes,
        ["vertices with more than four joints keep the strongest four: 368"]
    );
    for vertex in &mesh.vertices {
        assert!((vertex.weights.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        assert!(
            vertex.weights.is_sorted_by(|a, b| a >= b),
            "{:?}",
            vertex.weights
        );
        assert!((vertex.weights[1] / vertex.weights[2] - 1.25).abs() < 1e-4);
    }
}

#[test]
fn a_mesh_may_have_many_textures() {
    let (mut document, binary) = parts("mesh_vcol.glb");
    let image = |shade: u8| {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
        encoder.set_color(png::ColorType::Rgb);
        encoder
            .write_header()
            .unwrap()
            .write_image_data(&[255, shade, 0])
            .unwrap();
        let text = base64::Engine::encode(&base64::engine::general_purpose::STANDARD, &bytes);
        json!({ "uri": format!("data:image/png;base64,{text}") })
    };
    const MANY: usize = 12;
    let primitive = document["meshes"][0]["primitives"][0].clone();
    let primitives = (0..MANY).map(|index| {
        let mut primitive = primitive.clone();
        primitive["material"] = json!(index);
        primitive["attributes"]["TEXCOORD_0"] = json!(index + 100);
        primitive["attributes"]
            .as_object_mut()
            .unwrap()
            .remove("COLOR_0");
        primitive
    });
    let mut primitives: Vec<Value> = primitives.collect();
    let mut binary = binary;
    let uvs = append(
        &mut document,
        &mut binary,
        &[0; 8 * 368],
        json!({ "componentType": 5126, "count": 368, "type": "VEC2" }),
    );
    primitives
        .iter_mut()
        .for_each(|primitive| primitive["attributes"]["TEXCOORD_0"] = json!(uvs));
    // The mesh's own texture is that of most vertices.
    primitives.push(primitives[7].clone());
    document["meshes"][0]["primitives"] = json!(primitives);
    document["materials"] = (0..MANY)
        .map(|index| json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": index } } }))
        .collect();
    document["textures"] = (0..MANY).map(|index| json!({ "source": index })).collect();
    document["images"] = (0..MANY).map(|index| image(20 * index as u8)).collect();
    let mesh = mesh_of(&document, &binary).unwrap();
    assert_eq!(mesh.texture.as_ref().unwrap().texels, [[255, 140, 0, 255]]);
    assert_eq!(
        mesh.vertices
            .iter()
            .filter(|vertex| vertex.uv.is_some())
            .count(),
        2 * 368
    );
    let mut greens: Vec<u32> = mesh
        .vertices
        .iter()
        .filter(|vertex| vertex.uv.is_none())
        .map(|vertex| vertex.colour[1].to_bits())
        .collect();
    greens.dedup();
    assert_eq!(greens.len(), MANY - 1);
    assert_eq!(
        mesh.notes,
        ["textures beside that of most vertices become colours of vertices: 11"]
    );
}

#[test]
fn concave_polygons_are_the_solid_that_they_bound() {
    let volume = |mesh: &sabaki_import::fit::Mesh| -> f32 {
        let triangles = mesh.triangles().iter();
        triangles
            .map(|corners| {
                let [a, b, c] = corners.map(|corner| mesh.positions()[corner as usize]);
                a.dot(b.cross(c)) / 6.0
            })
            .sum()
    };
    let fits = ["concave_ngon.obj", "concave_split.obj"].map(|name| {
        let mesh = read_obj(&path(name)).unwrap();
        assert!(
            (volume(&mesh) - 0.016).abs() < 1e-6,
            "{name}: {}",
            volume(&mesh)
        );
        fit_prop(JointId::ROOT, &mesh, &FitSettings::HELD).unwrap()
    });
    let [(ngon, a), (split, b)] = fits;
    // The points that the fit covers lie on the triangles, which differ.
    assert_eq!(ngon.spheres.len(), split.spheres.len());
    assert!(
        (a.mesh_out_max - b.mesh_out_max).abs() < 0.003,
        "{a:?} {b:?}"
    );
    assert!(
        (a.mesh_out_mean - b.mesh_out_mean).abs() < 0.0005,
        "{a:?} {b:?}"
    );
}

#[test]
fn lines_of_obj_files_may_go_on() {
    let text = "# a path C:\\\nv 0 0 0\nv 1 0 \\\r\n 0\nv 0 1 0\nv 0 0 1\nf 1 \\\n 2 \\\n 3\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    let mesh = parse_obj(text.as_bytes()).unwrap();
    assert_eq!(mesh.triangles()[0], [0, 1, 2]);
    assert_eq!(mesh.positions()[1], Vec3::X);
    let error = parse_obj(text.replace("f 3 1", "f 3 0").as_bytes()).unwrap_err();
    assert!(error.to_string().starts_with("line 12:"), "{error}");
}

#[test]
fn an_amc_file_may_name_its_rate_and_move_its_bones() {
    let read = |file: &str| read_clip(&path(file), &ReadOptions::default()).unwrap();
    let plain = read("amc_sps/own.amc");
    assert_eq!(plain.clip.frame_rate(), 60.0);
    let moving = read("amc_tdof/own.amc");
    assert_eq!(moving.clip.frame_rate(), 120.0);
    let arm = moving.skeleton.find("lhumerus").unwrap().index();
    let joints = moving.clip.joints();
    let places = moving.clip.desc().translations;
    let offset = moving.skeleton.joints()[arm].offset;
    let unit = moving.scale.metres_per_unit as f32;
    assert!(places[arm].distance(offset) < 1e-6);
    let moved = places[joints + arm].distance(offset);
    assert!(
        (moved - 0.199667 * 3f32.sqrt() * unit).abs() < 1e-6,
        "{moved}"
    );
    // All other joints keep their places.
    for joint in (1..joints).filter(|&joint| joint != arm) {
        assert!(places[joints + joint].distance(moving.skeleton.joints()[joint].offset) < 1e-6);
    }
}

#[test]
fn names_of_files_are_compared_in_one_form_and_those_of_macos_are_passed_over() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    // Decomposed, as macOS stores names, and composed, as they are typed.
    std::fs::copy(path("leaf_bones.glb"), at("fu\u{308}r.glb")).unwrap();
    std::fs::write(at("._fu\u{308}r.glb"), b"\0\x05\x16\x07").unwrap();
    let events =
        r#"{"clips":[{"file":"für.glb","events":[{"kind":"evasion","start":0.1,"end":0.5}]}]}"#;
    std::fs::write(at("events.json"), events).unwrap();
    let set = read_clips(
        &[folder.path().to_owned()],
        Some(&at("events.json")),
        &ReadOptions::default(),
    )
    .unwrap();
    assert_eq!((set.clips[0].name(), set.events.len()), ("für.glb", 1));
    assert!(
        set.warnings
            .iter()
            .any(|line| line.starts_with("files of macOS beside others are passed over: 1")),
        "{:?}",
        set.warnings
    );
}
