//! FBX files are read as glTF is: skeleton, takes and mesh.

use glam::Vec3;
use sabaki_fixtures::clips::joints_at;
use sabaki_import::{ReadOptions, read_mesh, read_motions};

use super::common::{refusal, written};

/// An arm in centimetres: a root, a bone 100 above it that turns about Z by 90 degrees within a second, and one 50 above that; a triangle
/// hangs on the second.
const ARM: &str = include_str!("rigs/arm.fbx");

#[test]
fn skeleton_takes_and_mesh_are_read_in_metres() {
    let folder = tempfile::tempdir().unwrap();
    // With the take's start, which programs may leave out, and without.
    let start = "Properties70: { P: \"LocalStart\", \"KTime\", \"Time\", \"\",0\n P: \"LocalStop\"";
    let with_start = ARM.replace("Properties70: { P: \"LocalStop\"", start);
    let mut path = folder.path().to_owned();
    for text in [&*with_start, ARM] {
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
    for length in [0, 10, ARM.len() / 2] {
        let error = refused(&ARM.as_bytes()[..length]);
        assert!(error.contains("arm.FBX: "), "{error}");
    }
    // The first node of a file by Assimp, which ends with no empty node.
    let mut file = b"Kaydara FBX Binary  \0\x1a\0\x4c\x1d\0\0".to_vec();
    file.extend([0xff; 24]);
    file.extend(b"Open Asset Import Library (Assimp) 5.2.0");
    let error = refused(&file);
    assert!(error.contains("Assimp writes"), "{error}");
}
