//! Files as other programs write them, which were once read wrongly.

use std::path::{Path, PathBuf};

use glam::{Affine3A, Mat4, Quat, Vec3};
use meshopt::{encode_filter_quat, encode_index_buffer, encode_vertex_buffer};
use sabaki::anim::{Clip, JointId, JointTransform, Pose, Skeleton};
use sabaki::maps::{Body, BodySphere};
use sabaki_fixtures::clips::{joints_at, most_apart};
use sabaki_fixtures::files::{glb, glb_parts};
use sabaki_import::fit::{FitSettings, Mesh, fit_prop};
use sabaki_import::gltf::{GltfFile, SkinVertex, SkinnedMesh};
use sabaki_import::{
    FileError, LoadedClip, ReadOptions, parse_obj, read_clip, read_clips, read_mesh, read_obj,
    stature,
};
use serde_json::{Value, json};

use super::common::{append, bytes_of, floats_of, place_of, refusal, written};

/// Number of vertices of `mesh_vcol.glb`.
const COUNT: usize = 368;

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/corpus/cases")
        .join(name)
}

fn clip(name: &str) -> LoadedClip {
    read_clip(&path(name), &ReadOptions::default()).unwrap()
}

fn parts(name: &str) -> (Value, Vec<u8>) {
    glb_parts(&std::fs::read(path(name)).unwrap())
}

fn try_mesh(document: &Value, binary: &[u8]) -> Result<SkinnedMesh, FileError> {
    SkinnedMesh::parse(&glb(document, binary), |_| Err("no such file".to_owned()))
}

fn mesh_of(document: &Value, binary: &[u8]) -> SkinnedMesh {
    try_mesh(document, binary).unwrap()
}

fn clip_of(document: &Value, binary: &[u8]) -> (Skeleton, Clip) {
    let file = GltfFile::parse(&glb(document, binary), |_| Err("no such file".to_owned())).unwrap();
    (file.skeleton.clone(), file.animations[0].clip.clone())
}

/// The attributes of the first primitive.
fn attributes(document: &mut Value) -> &mut Value {
    &mut document["meshes"][0]["primitives"][0]["attributes"]
}

fn of_floats(kind: &str) -> Value {
    json!({ "componentType": 5126, "count": COUNT, "type": kind })
}

/// The joints of every tenth frame.
fn frames(skeleton: &Skeleton, clip: &Clip) -> Vec<Vec<JointTransform>> {
    let joints = |frame| joints_at(skeleton, clip, frame);
    (0..clip.frames()).step_by(10).map(joints).collect()
}

#[test]
fn time_0_is_the_start_however_late_the_first_key_is() {
    let events = path("first_key_at_5s.events.json");
    let glb = [path("first_key_at_5s.glb")];
    let set = read_clips(&glb, Some(&events), &ReadOptions::default()).unwrap();
    let clip = &set.clips[0];
    let seconds = clip.duration();
    assert!((seconds - (5.0 + 59.0 / 30.0)).abs() < 1e-3, "{seconds}");
    assert_eq!((clip.frames(), set.events[0].start), (210, 5.5));
    let turns = clip.desc().rotations;
    let place = |frame: usize| (clip.root(frame), turns[frame * clip.joints() + 3]);
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
        let centre = |sphere: &BodySphere| sphere.centre(&joints);
        for sphere in &body.spheres {
            let distance = |&(a, b): &(Vec3, Vec3)| {
                let share = (centre(sphere) - a).dot(b - a) / (b - a).length_squared().max(1e-12);
                centre(sphere).distance(a.lerp(b, share.clamp(0.0, 1.0)))
            };
            away = away.max(bones.iter().map(distance).fold(f32::MAX, f32::min));
        }
        for (a, b) in bones {
            for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
                let gap =
                    |sphere: &BodySphere| a.lerp(b, share).distance(centre(sphere)) - sphere.radius;
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
        let (found, wanted) = (frames(&skeleton, &clip), frames(&plain.0, &plain.1));
        for (found, wanted) in found.iter().flatten().zip(wanted.iter().flatten()) {
            let wanted = Vec3::from(scale) * wanted.translation;
            assert!(found.translation.distance(wanted) < 1e-5, "{scale:?}");
        }
        let (away, bare) = off_the_bones(&skeleton, &clip);
        let most = away.max(bare);
        assert!(most < 0.01 * size, "{scale:?}: {away} {bare}");
        let is_uniform = scale.iter().all(|part| part.abs() == size);
        assert_eq!(clip.moves_joints(), !is_uniform, "{scale:?}");
    }
}

#[test]
fn leaves_of_ends_add_no_height() {
    let read = clip("leaf_bones.glb");
    let mut pose = Pose::default();
    read.clip.pose(0, &mut pose);
    let height = stature(&read.skeleton, &pose);
    assert!((height - 1.90).abs() < 0.01, "{height}");
    assert!(read.skeleton.find("Head_Tip").is_some());
    assert!(read.skeleton.find("Head_Tip_end").is_none());
    let said = "leaf bones below ends are left out: 5";
    assert!(read.notes[0].starts_with(said), "{:?}", read.notes);
    let crown = read.skeleton.find("Head_Tip").unwrap();
    let body = Body::from_bones(&read.skeleton);
    for joints in frames(&read.skeleton, &read.clip) {
        let tops = body.spheres.iter();
        let tops = tops.map(|sphere| sphere.centre(&joints).y + sphere.radius);
        let above = tops.fold(f32::MIN, f32::max) - joints[crown.index()].translation.y;
        assert!(above.abs() < 0.05, "{above}");
    }
}

/// The file with its buffer views compressed.
fn compressed(document: &Value, binary: &[u8]) -> (Value, Vec<u8>) {
    let (mut document, mut bytes) = (document.clone(), Vec::new());
    let mut at = 0;
    let samplers = document["animations"][0]["samplers"].clone();
    let is_turn = |index: usize| {
        let mut samplers = samplers.as_array().unwrap().iter();
        samplers.any(|sampler| sampler["output"] == index)
    };
    for index in 0..document["accessors"].as_array().unwrap().len() {
        let [start, length] = place_of(&document, index);
        let accessor = &mut document["accessors"][index];
        let view = accessor["bufferView"].as_u64().unwrap() as usize;
        let data = &binary[start..start + length];
        let count = accessor["count"].as_u64().unwrap() as usize;
        let kind = accessor["type"].as_str().unwrap();
        let (mode, filter, stride, stream) = match (kind, &accessor["componentType"]) {
            ("SCALAR", component) if component == 5125 => {
                let indices = data.as_chunks::<4>().0.iter();
                let indices = indices.map(|bytes| u32::from_le_bytes(*bytes));
                let indices: Vec<u32> = indices.collect();
                ("TRIANGLES", "NONE", 4, encode_index_buffer(&indices, count))
            }
            ("VEC4", component) if component == 5126 && is_turn(index) => {
                let turns = encode_filter_quat(floats_of(data).as_chunks::<4>().0, 16);
                accessor["componentType"] = json!(5122);
                accessor["normalized"] = json!(true);
                ("ATTRIBUTES", "QUATERNION", 8, encode_vertex_buffer(&turns))
            }
            _ => {
                let stream = match length / count {
                    4 => encode_vertex_buffer(data.as_chunks::<4>().0),
                    12 => encode_vertex_buffer(data.as_chunks::<12>().0),
                    16 => encode_vertex_buffer(data.as_chunks::<16>().0),
                    _ => encode_vertex_buffer(data.as_chunks::<64>().0),
                };
                ("ATTRIBUTES", "NONE", length / count, stream)
            }
        };
        let stream = stream.unwrap();
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
    let (mesh, wanted) = (mesh_of(&small, &bytes), mesh_of(&document, &binary));
    for (found, wanted) in mesh.vertices.iter().zip(&wanted.vertices) {
        // Normals are sums over triangles, whose corners the codec may turn round.
        assert!(found.normal.distance(wanted.normal) < 1e-4);
        let normal = found.normal;
        assert_eq!(*found, SkinVertex { normal, ..*wanted });
    }
    let turned = |&[a, b, c]: &[u32; 3]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min();
    let [found, wanted] = [&mesh, &wanted].map(|mesh| mesh.triangles.iter().map(turned));
    assert!(found.eq(wanted));
    let ((skeleton, clip), (_, wanted)) = (clip_of(&small, &bytes), clip_of(&document, &binary));
    assert_eq!(clip.frames(), wanted.frames());
    let [found, wanted] = [clip, wanted].map(|clip| frames(&skeleton, &clip));
    for (found, wanted) in found.iter().zip(&wanted) {
        assert!(most_apart(found, wanted) < 1e-3);
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
        let spoilt = GltfFile::parse(&glb(&spoilt, &bytes), |_| Err(String::new()));
        let error = refusal(spoilt);
        let view = "buffer view 1, compressed by EXT_meshopt_compression: ";
        assert!(error.starts_with(view), "{error}");
    }
    let fallback = read_clip(&path("meshopt_fallback.glb"), &ReadOptions::default());
    let error = refusal(fallback);
    assert!(error.contains("EXT_meshopt_compression"), "{error}");
}

#[test]
fn extensions_that_are_not_read_are_named() {
    let error = refusal(read_mesh(&path("mesh_draco.glb")));
    let said = "it requires the extension KHR_draco_mesh_compression, which is not read";
    assert!(error.ends_with(said), "{error}");
    let note = "extensions that are not read: KHR_draco_mesh_compression";
    assert_eq!(clip("mesh_draco.glb").notes, [note]);
    let (mut document, binary) = parts("mesh_vcol.glb");
    document["extensionsUsed"] =
        json!(["EXT_some", "KHR_materials_unlit", "KHR_mesh_quantization"]);
    let mesh = mesh_of(&document, &binary);
    assert_eq!(mesh.notes, ["extensions that are not read: EXT_some"]);
}

/// Positions of the triangles' corners, sorted.
fn corners(mesh: &SkinnedMesh) -> Vec<[i32; 3]> {
    let place = |&corner: &u32| {
        let place = mesh.vertices[corner as usize].position.to_array();
        place.map(|part| (1e4 * part).round() as i32)
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
        let far = vertex.position.distance(joint.position);
        assert!(far < 0.5, "{}", joint.name);
    }
    // A second skin whose mesh is stored in millimetres, lying down.
    let (mut document, mut binary) = parts("mesh_twoskins.glb");
    let turn = Quat::from_rotation_x(-1.5);
    let stored = Affine3A::from_scale_rotation_translation(Vec3::splat(1e3), turn, Vec3::X);
    let [inverses, _] = place_of(&document, 29);
    change_matrices(
        &mut binary[inverses..inverses + 9 * 64],
        Mat4::from(stored.inverse()),
    );
    let [places, _] = place_of(&document, 22);
    let places = floats_of(&binary[places..places + 12 * COUNT]);
    let moved = places.as_chunks::<3>().0.iter();
    let moved = moved.map(|&place| stored.transform_point3(place.into()).to_array());
    let moved = bytes_of(moved.collect::<Vec<_>>().as_flattened());
    let added = append(&mut document, &mut binary, &moved, of_floats("VEC3"));
    document["meshes"][1]["primitives"][0]["attributes"]["POSITION"] = json!(added);
    assert_eq!(corners(&mesh_of(&document, &binary)), corners(&one));
}

/// Multiplies matrices by one on the right.
fn change_matrices(bytes: &mut [u8], by: Mat4) {
    for matrix in bytes.as_chunks_mut::<64>().0 {
        let changed = Mat4::from_cols_slice(&floats_of(matrix)) * by;
        matrix.copy_from_slice(&bytes_of(&changed.to_cols_array()));
    }
}

#[test]
fn quantized_and_filtered_meshes_are_read() {
    let (mut plain, mut binary) = parts("mesh_vcol.glb");
    let ahead: Vec<[f32; 4]> = (0..COUNT)
        .map(|vertex| {
            let turn = Quat::from_rotation_y(0.1 * vertex as f32);
            (turn * Vec3::new(0.6, 0.0, 0.8)).extend(0.0).to_array()
        })
        .collect();
    let three = |vectors: &[[f32; 4]]| -> Vec<[f32; 3]> {
        vectors.iter().map(|&[x, y, z, _]| [x, y, z]).collect()
    };
    let bytes = bytes_of(three(&ahead).as_flattened());
    let normals = append(&mut plain, &mut binary, &bytes, of_floats("VEC3"));
    attributes(&mut plain)["NORMAL"] = json!(normals);
    let wanted = mesh_of(&plain, &binary);
    let places = floats_of(&binary[20736..20736 + 12 * COUNT]);
    let places = places.as_chunks::<3>().0;
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
    let millimetres = places.iter().flat_map(|&[x, y, z]| {
        let parts = [x, y, z, 0.0].map(|part| (1000.0 * part).round() as i16);
        parts.map(i16::to_le_bytes).concat()
    });
    let millimetres: Vec<u8> = millimetres.collect();
    let shorts = json!({ "componentType": 5122, "count": COUNT, "type": "VEC3" });
    let position = append(&mut document, &mut bytes, &millimetres, shorts);
    document["bufferViews"][position]["byteStride"] = json!(8);
    let eighths = meshopt::encode_filter_oct::<i8>(&ahead, 8);
    let eighths = encode_vertex_buffer(&eighths).unwrap();
    let of_bytes =
        json!({ "componentType": 5120, "normalized": true, "count": COUNT, "type": "VEC3" });
    let normal = append(&mut document, &mut bytes, &eighths, of_bytes);
    as_compressed(&mut document, normal, 4, "OCTAHEDRAL");
    attributes(&mut document)["POSITION"] = json!(position);
    attributes(&mut document)["NORMAL"] = json!(normal);
    let millimetre = Mat4::from_scale(Vec3::splat(1e-3));
    change_matrices(&mut bytes[19200..20736], millimetre);
    document["extensionsRequired"] = json!(["KHR_mesh_quantization", "EXT_meshopt_compression"]);
    let found = mesh_of(&document, &bytes);
    assert_eq!(found.vertices.len(), wanted.vertices.len());
    for (found, wanted) in found.vertices.iter().zip(&wanted.vertices) {
        // The mesh is in its own unit, millimetres.
        assert!((1e-3 * found.position).distance(wanted.position) < 1e-3);
        let angle = found.normal.angle_between(wanted.normal);
        assert!(angle < 0.02, "{} {}", found.normal, wanted.normal);
    }

    // Positions with an exponent for each vector.
    let (mut document, mut bytes) = (plain, binary);
    let exponents = meshopt::encode_filter_exp(places, 15, meshopt::EncodeExpMode::SharedVector);
    let exponents = encode_vertex_buffer(&exponents).unwrap();
    let position = append(&mut document, &mut bytes, &exponents, of_floats("VEC3"));
    as_compressed(&mut document, position, 12, "EXPONENTIAL");
    attributes(&mut document)["POSITION"] = json!(position);
    let found = mesh_of(&document, &bytes);
    for (found, wanted) in found.vertices.iter().zip(&wanted.vertices) {
        assert!(found.position.distance(wanted.position) < 2e-4);
    }
}

#[test]
fn a_mirrored_mesh_stands_as_its_nodes_do() {
    let (mut document, binary) = parts("mesh_vcol.glb");
    let plain = mesh_of(&document, &binary);
    let nodes = document["nodes"].as_array_mut().unwrap();
    let armature = nodes.len();
    nodes.push(json!({ "children": [0], "scale": [-1, 1, 1] }));
    document["scenes"][0]["nodes"] = json!([armature, 24]);
    let mirrored = mesh_of(&document, &binary);
    let flip = Vec3::new(-1.0, 1.0, 1.0);
    for (found, wanted) in mirrored.vertices.iter().zip(&plain.vertices) {
        assert!(found.position.distance(flip * wanted.position) < 1e-5);
        let away = found.normal.distance(flip * wanted.normal);
        assert!(away < 1e-4, "as seen from outside");
    }
    // Its joints' frames are those of the clip, so that it is bound exactly.
    let (skeleton, _) = clip_of(&document, &binary);
    for joint in mirrored.joints.iter().skip(1) {
        let parent = &mirrored.joints[joint.parent.unwrap()];
        let own = parent.rotation.conjugate() * (joint.position - parent.position);
        let wanted = skeleton.joint(skeleton.find(&joint.name).unwrap()).offset;
        let away = own.distance(wanted);
        assert!(away < 1e-4, "{}: {own} {wanted}", joint.name);
    }
}

#[test]
fn colours_of_vertices_are_read() {
    let (document, binary) = parts("mesh_vcol.glb");
    let mesh = mesh_of(&document, &binary);
    let [start, _] = place_of(&document, 25);
    let colours = floats_of(&binary[start..start + 12 * mesh.vertices.len()]);
    for (vertex, colour) in mesh.vertices.iter().zip(colours.as_chunks::<3>().0) {
        assert_eq!(vertex.colour[..3], *colour);
    }
    assert!(colours.iter().any(|&part| part < 0.5));
}

#[test]
fn of_more_than_four_joints_the_strongest_stay() {
    let (mut document, mut binary) = parts("mesh_vcol.glb");
    let joints = [5u8, 6, 7, 8].repeat(COUNT);
    let bytes = json!({ "componentType": 5121, "count": COUNT, "type": "VEC4" });
    let joints = append(&mut document, &mut binary, &joints, bytes);
    let weights = bytes_of(&[0.05, 0.04, 0.03, 0.02]).repeat(COUNT);
    let weights = append(&mut document, &mut binary, &weights, of_floats("VEC4"));
    attributes(&mut document)["JOINTS_1"] = json!(joints);
    attributes(&mut document)["WEIGHTS_1"] = json!(weights);
    let mesh = mesh_of(&document, &binary);
    let note = "vertices with more than four joints keep the strongest four: 368";
    assert_eq!(mesh.notes, [note]);
    for vertex in &mesh.vertices {
        assert!((vertex.weights.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        let weights = vertex.weights;
        assert!(weights.is_sorted_by(|a, b| a >= b), "{weights:?}");
        assert!((weights[1] / weights[2] - 1.25).abs() < 1e-4);
    }
}

#[test]
fn a_mesh_may_have_many_textures() {
    const MANY: usize = 12;
    let (mut document, mut binary) = parts("mesh_vcol.glb");
    let image = |shade: u8| {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
        encoder.set_color(png::ColorType::Rgb);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&[255, shade, 0]).unwrap();
        drop(writer);
        let text = base64::Engine::encode(&base64::engine::general_purpose::STANDARD, &bytes);
        json!({ "uri": format!("data:image/png;base64,{text}") })
    };
    let uvs = append(
        &mut document,
        &mut binary,
        &[0; 8 * COUNT],
        of_floats("VEC2"),
    );
    attributes(&mut document)["TEXCOORD_0"] = json!(uvs);
    attributes(&mut document)
        .as_object_mut()
        .unwrap()
        .remove("COLOR_0");
    let mut primitives = vec![document["meshes"][0]["primitives"][0].clone(); MANY];
    for (index, primitive) in primitives.iter_mut().enumerate() {
        primitive["material"] = json!(index);
    }
    // The mesh's own texture is that of most vertices.
    primitives.push(primitives[7].clone());
    document["meshes"][0]["primitives"] = json!(primitives);
    document["materials"] = (0..MANY)
        .map(|index| json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": index } } }))
        .collect();
    document["textures"] = (0..MANY).map(|index| json!({ "source": index })).collect();
    document["images"] = (0..MANY).map(|index| image(20 * index as u8)).collect();
    let mesh = mesh_of(&document, &binary);
    assert_eq!(mesh.texture.as_ref().unwrap().texels, [[255, 140, 0, 255]]);
    let (own, others): (Vec<&SkinVertex>, Vec<_>) =
        mesh.vertices.iter().partition(|vertex| vertex.uv.is_some());
    assert_eq!(own.len(), 2 * COUNT);
    let greens = others.iter().map(|vertex| vertex.colour[1].to_bits());
    let mut greens: Vec<u32> = greens.collect();
    greens.dedup();
    assert_eq!(greens.len(), MANY - 1);
    let note = "textures beside that of most vertices become colours of vertices: 11";
    assert_eq!(mesh.notes, [note]);
}

#[test]
fn concave_polygons_are_the_solid_that_they_bound() {
    let volume = |mesh: &Mesh| -> f32 {
        let of_triangle = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|corner| mesh.positions()[corner as usize]);
            a.dot(b.cross(c)) / 6.0
        };
        mesh.triangles().iter().map(of_triangle).sum()
    };
    let fits = ["concave_ngon.obj", "concave_split.obj"].map(|name| {
        let mesh = read_obj(&path(name)).unwrap();
        let found = volume(&mesh);
        assert!((found - 0.016).abs() < 1e-6, "{name}: {found}");
        fit_prop(JointId::ROOT, &mesh, &FitSettings::HELD).unwrap()
    });
    let [(ngon, a), (split, b)] = fits;
    // The points that the fit covers lie on the triangles, which differ.
    assert_eq!(ngon.spheres.len(), split.spheres.len());
    let most = (a.mesh_out_max - b.mesh_out_max).abs();
    let mean = (a.mesh_out_mean - b.mesh_out_mean).abs();
    assert!(most < 0.003 && mean < 0.0005, "{a:?} {b:?}");
}

#[test]
fn lines_of_obj_files_may_go_on() {
    let text = "# a path C:\\\nv 0 0 0\nv 1 0 \\\r\n 0\nv 0 1 0\nv 0 0 1\nf 1 \\\n 2 \\\n 3\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    let mesh = parse_obj(text.as_bytes()).unwrap();
    assert_eq!(mesh.triangles()[0], [0, 1, 2]);
    assert_eq!(mesh.positions()[1], Vec3::X);
    let error = refusal(parse_obj(text.replace("f 3 1", "f 3 0").as_bytes()));
    assert!(error.starts_with("line 12:"), "{error}");
}

#[test]
fn an_amc_file_may_name_its_rate_and_move_its_bones() {
    assert_eq!(clip("amc_sps/own.amc").clip.frame_rate(), 60.0);
    let moving = clip("amc_tdof/own.amc");
    assert_eq!(moving.clip.frame_rate(), 120.0);
    let arm = moving.skeleton.find("lhumerus").unwrap().index();
    let joints = moving.clip.joints();
    let places = moving.clip.desc().translations;
    let offset = moving.skeleton.joints()[arm].offset;
    let unit = moving.scale.metres_per_unit as f32;
    assert!(places[arm].distance(offset) < 1e-6);
    let moved = places[joints + arm].distance(offset);
    let wanted = 0.199667 * 3f32.sqrt() * unit;
    assert!((moved - wanted).abs() < 1e-6, "{moved}");
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
    let events = written(folder.path(), "events.json", events);
    let paths = [folder.path().to_owned()];
    let set = read_clips(&paths, Some(&events), &ReadOptions::default()).unwrap();
    assert_eq!((set.clips[0].name(), set.events.len()), ("für.glb", 1));
    let said = "files of macOS beside others are passed over: 1";
    let is_said = set.warnings.iter().any(|line| line.starts_with(said));
    assert!(is_said, "{:?}", set.warnings);
}
