//! Fuzz targets, shared by the fuzzers of `tests/fuzz` and the replay of their corpora.
//!
//! A target may refuse its input; it may not panic, hang or fill the memory, and what it accepts must hold what is said of it.

use std::path::Path;

use sabaki::anim::{Clip, Skeleton};
use sabaki::archive;
use sabaki::graph::{EdgeId, Playhead};
use sabaki::math::Rigid2;
use sabaki::query::{Answer, Query, QueryContext, QuerySettings, Request};
use sabaki_import::asf::AsfFile;
use sabaki_import::bvh;
use sabaki_import::fit::{BindPose, FitSettings, fit_body};
use sabaki_import::gltf::{GltfFile, SkinnedMesh};
use sabaki_import::{AttackFile, EventsFile, parse_obj};

use sabaki_fixtures::clips::{small_skeleton, swinging_clip};
use sabaki_fixtures::small::{small, use_it};
use sabaki_fixtures::with;

/// What is done with bytes.
pub type Target = fn(&[u8]);

/// Name, as corpora and fuzzers are called, and what it does.
pub const TARGETS: [(&str, Target); 7] = [
    ("bvh", bvh_file),
    ("gltf", gltf_file),
    ("events", events_file),
    ("attack", attack_file),
    ("baked", baked_file),
    ("obj", obj_file),
    ("asf", asf_file),
];

pub fn of_name(name: &str) -> Target {
    let mut targets = TARGETS.into_iter();
    targets.find(|(own, _)| *own == name).unwrap().1
}

/// Frames times joints that a target goes on with: a fuzzer is to try many inputs, not large ones.
const SMALL: usize = 1 << 14;

pub fn bvh_file(bytes: &[u8]) {
    let Ok(file) = bvh::parse(bytes) else {
        return;
    };
    let Ok((skeleton, clip)) = file.motion("fuzzed", 0.01) else {
        return;
    };
    if clip.frames() * skeleton.len() > SMALL {
        return;
    }
    let mut written = Vec::new();
    bvh::write(&mut written, &skeleton, &clip, 0.01).unwrap();
    // What is written has digits enough for single precision, which a clip of a strange unit may exceed.
    if let Ok(again) = bvh::parse(&written)
        && let Ok((same, _)) = again.motion("fuzzed", 0.01)
    {
        assert_eq!(same.len(), skeleton.len());
        assert_eq!(again.frames(), clip.frames());
    }
}

/// A skeleton, and after a line of `---` a motion of it.
pub fn asf_file(bytes: &[u8]) {
    const BETWEEN: &[u8] = b"\n---\n";
    let cut = bytes
        .windows(BETWEEN.len())
        .position(|part| part == BETWEEN);
    let (skeleton, motion) = match cut {
        Some(at) => (&bytes[..at], &bytes[at + BETWEEN.len()..]),
        None => (bytes, &[][..]),
    };
    let Ok(asf) = AsfFile::parse(skeleton) else {
        return;
    };
    let Ok(file) = asf.motion(motion) else {
        return;
    };
    if let Ok((skeleton, clip)) = file.motion("fuzzed", 0.05) {
        assert_eq!(skeleton.len(), file.joints.len());
        assert_eq!(clip.frames(), file.frames());
    }
}

pub fn gltf_file(bytes: &[u8]) {
    if let Ok(mesh) = SkinnedMesh::parse(bytes, |_| Err("there is none".to_owned())) {
        let mut corners = mesh.triangles.as_flattened().iter();
        assert!(corners.all(|&corner| (corner as usize) < mesh.vertices.len()));
        let mut joints = mesh.vertices.iter().flat_map(|vertex| vertex.joints);
        assert!(joints.all(|joint| usize::from(joint) < mesh.joints.len()));
    }
    let Ok(file) = GltfFile::parse(bytes, |_| Err("there is none".to_owned())) else {
        return;
    };
    for animation in &file.animations {
        let Ok((skeleton, clip)) = file.motion(animation, "fuzzed", 1.0) else {
            continue;
        };
        if clip.frames() * skeleton.len() <= SMALL {
            let mut written = Vec::new();
            sabaki_import::gltf::write(&mut written, &skeleton, &[clip], &[]).unwrap();
            let again = GltfFile::parse(&written, |_| Err("there is none".to_owned()));
            assert_eq!(again.unwrap().skeleton.len(), skeleton.len());
        }
    }
}

/// Two clips of five seconds.
fn clips() -> &'static (Skeleton, Vec<Clip>) {
    static CLIPS: std::sync::OnceLock<(Skeleton, Vec<Clip>)> = std::sync::OnceLock::new();
    CLIPS.get_or_init(|| {
        let skeleton = small_skeleton();
        let clips = [0.25, 0.5].map(|seed| swinging_clip(&skeleton, 151, seed));
        (skeleton, clips.into())
    })
}

pub fn events_file(bytes: &[u8]) {
    let Ok(file) = EventsFile::parse(bytes) else {
        return;
    };
    let (skeleton, clips) = clips();
    let Ok(events) = file.resolve(clips, skeleton) else {
        return;
    };
    let again = EventsFile::of(&events, clips, skeleton).unwrap();
    assert_eq!(again.resolve(clips, skeleton).unwrap(), events);
}

pub fn attack_file(bytes: &[u8]) {
    let Ok(file) = AttackFile::parse(bytes) else {
        return;
    };
    let baked = small();
    let settings = QuerySettings::default();
    let playhead = Playhead::at(baked.graph(), EdgeId(0), 0.0, Rigid2::IDENTITY);
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    for attack in file.attacks.iter().take(2) {
        let request = Request::new(playhead, attack);
        Query::new(baked, &settings).answer(request, &mut context, &mut answer);
        assert!(!answer.candidates.is_empty());
        assert!(!answer.clearance().metres.is_nan());
    }
}

/// The input is what follows a sound header; so that a fuzzer gets behind the checksum.
pub fn baked_file(bytes: &[u8]) {
    let Ok(baked) = archive::from_bytes(&with_header(bytes), Path::new("fuzzed")) else {
        return;
    };
    use_it(&baked);
    let written = archive::to_bytes(&baked).unwrap();
    let again = archive::from_bytes(&written, Path::new("fuzzed")).unwrap();
    assert_eq!(again, baked);
}

/// Offset of the graph in a baked file, after magic, version, checksum and the writer's name.
const HEADER: usize = 32;

/// A baked file without its header.
pub fn without_header(bytes: &[u8]) -> &[u8] {
    &bytes[HEADER..]
}

fn with_header(body: &[u8]) -> Vec<u8> {
    static START: std::sync::OnceLock<Vec<u8>> = std::sync::OnceLock::new();
    let start = START.get_or_init(|| archive::to_bytes(small()).unwrap()[..HEADER].to_vec());
    let mut bytes = [start, body].concat();
    let checksum = crc32fast::hash(&bytes[16..]);
    bytes[12..16].copy_from_slice(&checksum.to_le_bytes());
    bytes
}

pub fn obj_file(bytes: &[u8]) {
    let Ok(mesh) = parse_obj(bytes) else {
        return;
    };
    let mut corners = mesh.triangles().iter().flatten();
    let vertices = mesh.positions().len() as u32;
    assert!(corners.all(|&corner| corner < vertices));
    assert!(mesh.positions().iter().all(|place| place.is_finite()));
    if mesh.triangles().len() <= 40 {
        let (skeleton, _) = clips();
        let coarse = with(|s: &mut FitSettings| s.cover = 0.25);
        if let Ok((body, report)) = fit_body(&BindPose::rest(skeleton), &mesh, &coarse) {
            assert!(body.is_sound(skeleton), "{body:?}");
            assert!(report.worst().mesh_out_max.is_finite(), "{report:?}");
        }
    }
}
