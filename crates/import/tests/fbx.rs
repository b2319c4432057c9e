//! FBX files are read as glTF is: skeleton, takes and mesh.

use glam::Vec3;
use sabaki_fixtures::clips::joints_at;
use sabaki_import::{ReadOptions, read_mesh, read_motions};

use super::common::{refusal, written};

/// An arm in centimetres: a root, a bone 100 above it that turns about Z by 90 degrees within a second, and one 50 above that; a triangle
/// hangs on the second.
fn arm() -> String {
    let model = |id: u32, name: &str, kind: &str, height: f64| {
        format!(
            "Model: {id}, \"Model::{name}\", \"{kind}\" {{ Version: 232\n Properties70: {{ P: \"Lcl Translation\", \"Lcl Translation\", \"\", \"A\",0,{height},0 }}\n }}\n"
        )
    };
    let attribute = |id: u32| {
        format!(
            "NodeAttribute: {id}, \"NodeAttribute::\", \"LimbNode\" {{ TypeFlags: \"Skeleton\" }}\n"
        )
    };
    let unit = |height: f64| format!("*16 {{ a: 1,0,0,0,0,1,0,0,0,0,1,0,0,{height},0,1 }}");
    let objects = [
        model(10, "Base", "LimbNode", 0.0),
        model(11, "Arm", "LimbNode", 100.0),
        model(12, "Hand", "LimbNode", 50.0),
        model(13, "Skin", "Mesh", 0.0),
        attribute(20),
        attribute(21),
        attribute(22),
        "Geometry: 30, \"Geometry::\", \"Mesh\" {\n Vertices: *9 { a: 0,100,0, 10,150,0, -10,150,0 }\n PolygonVertexIndex: *3 { a: 0,1,-3 }\n }\n".to_owned(),
        "Deformer: 40, \"Deformer::\", \"Skin\" { Version: 101 }\n".to_owned(),
        format!("Deformer: 41, \"SubDeformer::\", \"Cluster\" {{ Version: 100\n Indexes: *3 {{ a: 0,1,2 }}\n Weights: *3 {{ a: 1,1,1 }}\n Transform: {}\n TransformLink: {}\n }}\n", unit(-100.0), unit(100.0)),
        "AnimationStack: 50, \"AnimStack::Wave\", \"\" { Properties70: { P: \"LocalStop\", \"KTime\", \"Time\", \"\",46186158000\n P: \"ReferenceStop\", \"KTime\", \"Time\", \"\",46186158000 }\n }\n".to_owned(),
        "AnimationLayer: 51, \"AnimLayer::\", \"\" { }\n".to_owned(),
        "AnimationCurveNode: 52, \"AnimCurveNode::R\", \"\" { Properties70: { P: \"d|X\", \"Number\", \"\", \"A\",0\n P: \"d|Y\", \"Number\", \"\", \"A\",0\n P: \"d|Z\", \"Number\", \"\", \"A\",0 }\n }\n".to_owned(),
        "AnimationCurve: 53, \"AnimCurve::\", \"\" { Default: 0\n KeyVer: 4008\n KeyTime: *2 { a: 0,46186158000 }\n KeyValueFloat: *2 { a: 0,90 }\n KeyAttrFlags: *1 { a: 4 }\n KeyAttrDataFloat: *4 { a: 0,0,0,0 }\n KeyAttrRefCount: *1 { a: 2 }\n }\n".to_owned(),
    ];
    let links = "10,0 11,10 12,11 13,0 20,10 21,11 22,12 30,13 40,30 41,40 11,41 51,50 52,51";
    let links = links.split(' ').map(|link| format!("C: \"OO\",{link}\n"));
    let links: String = links.collect();
    format!(
        "; FBX 7.4.0 project file\nFBXHeaderExtension: {{ FBXHeaderVersion: 1003\n FBXVersion: 7400\n }}\n\
         GlobalSettings: {{ Version: 1000\n Properties70: {{ P: \"UpAxis\", \"int\", \"Integer\", \"\",1\n P: \"UpAxisSign\", \"int\", \"Integer\", \"\",1\n \
         P: \"FrontAxis\", \"int\", \"Integer\", \"\",2\n P: \"FrontAxisSign\", \"int\", \"Integer\", \"\",1\n P: \"CoordAxis\", \"int\", \"Integer\", \"\",0\n \
         P: \"CoordAxisSign\", \"int\", \"Integer\", \"\",1\n P: \"UnitScaleFactor\", \"double\", \"Number\", \"\",1\n P: \"TimeMode\", \"enum\", \"\", \"\",6 }}\n }}\n\
         Objects: {{\n{}}}\nConnections: {{\n{links}C: \"OP\",52,11, \"Lcl Rotation\"\nC: \"OP\",53,52, \"d|Z\"\n}}\n",
        objects.concat()
    )
}

#[test]
fn skeleton_takes_and_mesh_are_read_in_metres() {
    let folder = tempfile::tempdir().unwrap();
    // With the take's start, which programs may leave out, and without.
    let start = "Properties70: { P: \"LocalStart\", \"KTime\", \"Time\", \"\",0\n P: \"LocalStop\"";
    let with_start = arm().replace("Properties70: { P: \"LocalStop\"", start);
    let mut path = folder.path().to_owned();
    for text in [with_start, arm()] {
        path = written(folder.path(), "arm.fbx", text);
        let motions = read_motions(&path, &ReadOptions::default()).unwrap();
        let [motion] = &motions[..] else {
            panic!("{motions:?}")
        };
        let names = motion.skeleton.joints().iter().map(|joint| &joint.name[..]);
        assert!(names.eq(["Base", "Arm", "Hand"]));
        assert_eq!(motion.clip.name(), "arm.fbx");
        assert!((motion.clip.duration() - 1.0).abs() < 1e-4);
        for (frame, hand) in [
            (0, Vec3::new(0.0, 1.5, 0.0)),
            (motion.clip.frames() - 1, Vec3::new(-0.5, 1.0, 0.0)),
        ] {
            let found = joints_at(&motion.skeleton, &motion.clip, frame)[2].translation;
            assert!(found.distance(hand) < 1e-4, "{frame}: {found}");
        }
    }
    let mesh = read_mesh(&path).unwrap();
    assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (3, 1));
    for vertex in &mesh.vertices {
        assert_eq!(mesh.joints[usize::from(vertex.joints[0])].name, "Arm");
    }
    let first = mesh.vertices[0].position;
    assert!(first.distance(Vec3::Y) < 1e-5, "{first}");
    let hand = mesh.joints.iter().find(|joint| joint.name == "Hand");
    let hand = hand.unwrap().position;
    assert!(hand.distance(1.5 * Vec3::Y) < 1e-5, "{hand}");
}

#[test]
fn what_is_no_fbx_file_is_refused_with_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |bytes: &[u8]| {
        let path = written(folder.path(), "arm.FBX", bytes);
        refusal(read_motions(&path, &ReadOptions::default()))
    };
    let whole = arm();
    for length in [0, 10, whole.len() / 2] {
        let error = refused(&whole.as_bytes()[..length]);
        assert!(error.contains("arm.FBX: "), "{error}");
    }
    // The first node of a file by Assimp, which ends with no empty node.
    let mut file = b"Kaydara FBX Binary  \0\x1a\0\x4c\x1d\0\0".to_vec();
    file.extend([0xff; 24]);
    file.extend(b"Open Asset Import Library (Assimp) 5.2.0");
    let error = refused(&file);
    assert!(error.contains("Assimp writes"), "{error}");
}
