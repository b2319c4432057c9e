//! Skinned meshes are read as they were written, and damaged ones are refused.

use glam::Vec3;
use sabaki::anim::JointId;
use sabaki_fixtures::captures::mocap;
use sabaki_fixtures::clips::{small_skeleton, swinging_clip};
use sabaki_fixtures::files::{glb, glb_parts};
use sabaki_import::gltf::{self, GltfFile, SkinnedMesh};
use sabaki_import::{FileError, read_mesh};
use serde_json::{Value, json};

use super::common::refusal;

fn parse(bytes: &[u8]) -> Result<SkinnedMesh, FileError> {
    SkinnedMesh::parse(bytes, |file| panic!("{} is not asked for", file.display()))
}

/// A file of a skeleton whose figure is a mesh of thin bones.
fn written() -> Vec<u8> {
    let skeleton = small_skeleton();
    let clip = swinging_clip(&skeleton, 3, 0.0);
    let mut bytes = Vec::new();
    gltf::write(&mut bytes, &skeleton, &[clip], &[]).unwrap();
    bytes
}

/// The file with its JSON changed.
fn changed(change: impl FnOnce(&mut Value)) -> Vec<u8> {
    let (mut root, binary) = glb_parts(&written());
    change(&mut root);
    glb(&root, &binary)
}

#[test]
fn the_figure_of_a_written_file_is_on_its_bones() {
    let skeleton = small_skeleton();
    let mesh = parse(&written()).unwrap();
    let bones = skeleton.joints().iter().skip(1);
    let bones = bones.filter(|joint| joint.offset.length() > 0.0).count();
    assert_eq!(mesh.triangles.len(), 8 * bones);
    assert_eq!(mesh.joints.len(), skeleton.len());
    for (index, joint) in mesh.joints.iter().enumerate() {
        let id = skeleton.find(&joint.name).unwrap();
        let chain: Vec3 = skeleton
            .ancestry(id)
            .filter(|&above| above != JointId::ROOT)
            .map(|above| skeleton.joint(above).offset)
            .sum();
        assert!(joint.position.distance(chain) < 1e-5, "{}", joint.name);
        let parent = skeleton.joint(id).parent;
        let parent = parent.map(|parent| &skeleton.joint(parent).name);
        let found = joint.parent.map(|parent| &mesh.joints[parent].name);
        assert_eq!(found, parent);
        assert!(joint.parent.is_none_or(|parent| parent < index));
    }
    let longest = skeleton.joints().iter().map(|joint| joint.offset.length());
    let longest = longest.fold(0.0, f32::max);
    for vertex in &mesh.vertices {
        assert!((vertex.weights.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        let length = vertex.normal.length();
        assert!((length - 1.0).abs() < 1e-5, "made from the triangles");
        assert!(vertex.uv.is_none() && vertex.colour == [1.0; 4]);
        let joint = &mesh.joints[usize::from(vertex.joints[0])];
        assert!(vertex.position.distance(joint.position) < 1.1 * longest);
    }
}

type Change<'a> = &'a dyn Fn(&mut Value);

#[test]
fn damaged_meshes_are_refused() {
    let attribute = |root: &Value, name: &str| {
        let primitive = &root["meshes"][0]["primitives"][0];
        primitive["attributes"][name].as_u64().unwrap() as usize
    };
    let count = |root: &mut Value, name: &str, count: u64| {
        let accessor = attribute(root, name);
        root["accessors"][accessor]["count"] = json!(count);
    };
    let exchange = |root: &mut Value, name: &str, by: &str| {
        let accessor = attribute(root, by);
        root["meshes"][0]["primitives"][0]["attributes"][name] = json!(accessor);
    };
    let unskinned = |root: &mut Value| {
        root.as_object_mut().unwrap().remove("skins");
        for node in root["nodes"].as_array_mut().unwrap() {
            node.as_object_mut().unwrap().remove("skin");
        }
    };
    let textured = |root: &mut Value| {
        root["materials"] =
            json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
        root["textures"] = json!([{ "source": 0 }]);
        root["images"] = json!([{ "bufferView": 0, "mimeType": "image/png" }]);
        root["meshes"][0]["primitives"][0]["material"] = json!(0);
    };
    let unskinned = parse(&changed(unskinned));
    assert!(matches!(unskinned, Err(FileError::NoMesh)));
    let cases: [(Change<'_>, &str); 5] = [
        (&|root| count(root, "WEIGHTS_0", 1), "different numbers"),
        (
            &|root| exchange(root, "WEIGHTS_0", "JOINTS_0"),
            "not normalised",
        ),
        (
            &|root| exchange(root, "JOINTS_0", "WEIGHTS_0"),
            "unsigned integers",
        ),
        (
            &|root| count(root, "JOINTS_0", 1 << 40),
            "within its buffer",
        ),
        (&textured, "image 0: "),
    ];
    for (change, said) in cases {
        let error = refusal(parse(&changed(change)));
        assert!(error.contains(said), "{error}");
    }
}

#[test]
fn a_file_beside_is_read_once_and_only_if_it_is_used() {
    let (mut root, bytes) = glb_parts(&written());
    let length = root["buffers"][0]["byteLength"].clone();
    let mut buffers = vec![json!({ "byteLength": length, "uri": "mesh.bin" }); 2000];
    buffers.push(json!({ "byteLength": 1, "uri": "unused.bin" }));
    root["buffers"] = json!(buffers);
    // Every view has a buffer of its own.
    let views = root["bufferViews"].as_array_mut().unwrap();
    for (index, view) in views.iter_mut().enumerate() {
        view["buffer"] = json!(index);
    }
    let mut asked = Vec::new();
    let mesh = SkinnedMesh::parse(root.to_string().as_bytes(), |file| {
        asked.push(file.to_owned());
        Ok(bytes.clone())
    });
    assert_eq!(mesh.unwrap(), parse(&written()).unwrap());
    assert_eq!(asked, [std::path::PathBuf::from("mesh.bin")]);
}

/// Reading each primitive again for each node would take minutes.
#[test]
fn many_nodes_may_share_a_mesh_of_many_empty_primitives() {
    const MANY: usize = 30_000;
    let bytes = changed(|root| {
        let mut empty = root["meshes"][0]["primitives"][0].clone();
        for attribute in ["POSITION", "JOINTS_0", "WEIGHTS_0"] {
            let index = empty["attributes"][attribute].as_u64().unwrap() as usize;
            let accessors = root["accessors"].as_array_mut().unwrap();
            let mut accessor = accessors[index].clone();
            accessor["count"] = json!(0);
            empty["attributes"][attribute] = json!(accessors.len());
            accessors.push(accessor);
        }
        empty.as_object_mut().unwrap().remove("indices");
        let meshes = root["meshes"].as_array_mut().unwrap();
        let mesh = meshes.len();
        meshes.push(json!({ "primitives": vec![empty; MANY] }));
        let nodes = root["nodes"].as_array_mut().unwrap();
        nodes.extend(vec![json!({ "mesh": mesh, "skin": 0 }); MANY]);
    });
    assert_eq!(parse(&bytes).unwrap(), parse(&written()).unwrap());
}

#[test]
fn nodes_that_share_a_mesh_each_add_its_triangles() {
    let once = parse(&written()).unwrap();
    let bytes = changed(|root| {
        let nodes = root["nodes"].as_array_mut().unwrap();
        let with_mesh = nodes.iter().find(|node| node.get("mesh").is_some());
        let node = with_mesh.unwrap();
        let copy = json!({ "mesh": node["mesh"], "skin": node["skin"] });
        nodes.extend([copy.clone(), copy]);
    });
    let thrice = parse(&bytes).unwrap();
    assert_eq!(thrice.triangles.len(), 3 * once.triangles.len());
    assert_eq!(thrice.vertices, once.vertices.repeat(3));
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn meshes_of_other_programs_are_read_with_their_textures() {
    let read = |name: &str| read_mesh(&mocap("gltf").join(name)).unwrap();
    let fox = read("Fox.glb");
    assert_eq!((fox.vertices.len(), fox.triangles.len()), (1728, 576));
    assert_eq!(fox.joints.len(), 24);
    let man = read("CesiumMan.glb");
    assert_eq!((man.vertices.len(), man.triangles.len()), (3273, 4672));
    assert_eq!(man.joints.len(), 19);
    for mesh in [fox, man] {
        let texture = mesh.texture.unwrap();
        assert_eq!(texture.texels.len() as u32, texture.width * texture.height);
        assert!(mesh.vertices.iter().all(|vertex| vertex.uv.is_some()));
        // Figures stand upright: their heads are above their feet.
        let height = |part: &str| {
            let joints = mesh.joints.iter();
            let of = joints.filter(|joint| joint.name.to_lowercase().contains(part));
            of.map(|joint| joint.position.y).fold(f32::MIN, f32::max)
        };
        let (head, foot) = (height("neck"), height("foot").max(height("leg_joint_r_5")));
        assert!(head > foot + 0.1, "{head} {foot}");
    }
}

#[test]
fn a_byte_order_mark_does_not_matter() {
    let (mut root, bytes) = glb_parts(&written());
    root["buffers"][0]["uri"] = json!("mesh.bin");
    let (plain, marked) = (root.to_string(), format!("\u{FEFF}{root}"));
    let mesh = |text: &str| SkinnedMesh::parse(text.as_bytes(), |_| Ok(bytes.clone())).unwrap();
    assert_eq!(mesh(&marked), mesh(&plain));
    let motion = |text: &str| GltfFile::parse(text.as_bytes(), |_| Ok(bytes.clone())).unwrap();
    assert_eq!(motion(&marked).animations, motion(&plain).animations);
}
