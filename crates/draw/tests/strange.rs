//! Input that makes no sense is refused by name or drawn within bounds. Nothing panics, and validation is silent.

use glam::Vec3;
use sabaki::gpu::GpuError;
use sabaki::math::F32x16;
use sabaki_app::Painter;
use sabaki_draw::scene::{
    CrowdMember, CrowdShot, Detail, Dodge, DodgeSettings, Look, MemberGroup, Mesh, MeshTexture,
    standing_pose,
};
use sabaki_draw::{Offscreen, Picture, Stage, StageDesc, Target, human_body};
use sabaki_fixtures::clips::changed;
use sabaki_fixtures::demo;
use sabaki_fixtures::with;

use super::framing::dodge;
use super::{SIZE, empty, end, skin_on, vertex};
use sabaki_fixtures::throw::key;
use sabaki_fixtures::{device, finish};

pub(super) fn limit_of<T>(result: Result<T, GpuError>) -> &'static str {
    match result {
        Err(GpuError::Limit { limit, .. }) => limit,
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("nothing was refused"),
    }
}

/// A window that is minimised has no pixels.
#[test]
fn a_target_without_pixels_is_drawn_as_nothing() {
    let mut device = device();
    let desc = StageDesc {
        size: [0; 2],
        shadow_side: 0,
        ..StageDesc::default()
    };
    let mut stage = device
        .make(|context, memory| Stage::new(context, memory, &desc))
        .unwrap();
    let offscreen = device
        .make(|context, memory| Offscreen::new(context, memory, [0, 5]))
        .unwrap();
    let shot = empty();
    for size in [[0, 0], [64, 0], [64, 64]] {
        device.make(|_, memory| stage.resize(memory, size)).unwrap();
        let picture = |size| Picture {
            shot: &shot,
            crowd: None,
            target: Target {
                size,
                ..offscreen.target()
            },
        };
        for target in [[0, 0], [0, size[1]], [size[0], 0]] {
            // SAFETY: `run` gives a buffer that is being recorded and waits for it.
            device
                .run(|cmd| unsafe { stage.record(cmd, 0, &picture(target)) })
                .unwrap();
        }
    }
    // SAFETY: as above.
    device
        .run(|cmd| unsafe {
            offscreen.record_start(cmd);
            offscreen.record_end(cmd);
            Ok(())
        })
        .unwrap();
    let memory = device.memory().unwrap();
    stage.destroy(memory);
    offscreen.destroy(memory);
    let wide = device.make(|context, memory| Offscreen::new(context, memory, [1 << 20, 1]));
    assert_eq!(limit_of(wide), "side of a target");
    finish(device);
}

/// Two triangles around the origin.
fn sheet() -> Mesh {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let vertices = corners.map(|[x, y]| vertex(Vec3::new(x, y, 0.0), Vec3::Z, [x, y]));
    Mesh::new(vertices.to_vec(), vec![[0, 1, 2], [0, 2, 3]], None)
}

#[test]
fn a_mesh_whose_parts_do_not_fit_each_other_is_refused_by_name() {
    let mut device = device();
    let mut stage = |mesh: Mesh| {
        let desc = StageDesc {
            meshes: &[mesh],
            ..StageDesc::default()
        };
        device.make(|context, memory| {
            let stage = Stage::new(context, memory, &desc)?;
            stage.destroy(memory);
            Ok(())
        })
    };
    let mut mesh = sheet();
    mesh.details[2] = vec![[0, 1, 4]];
    assert_eq!(limit_of(stage(mesh)), "vertices of a Mesh");
    let texture = |width, height, texels| MeshTexture {
        width,
        height,
        texels: vec![[200; 4]; texels],
    };
    let textured = |texture| Mesh {
        texture: Some(texture),
        ..sheet()
    };
    for (width, height, texels) in [(4, 4, 15), (1 << 20, 1 << 20, 4), (u32::MAX, 2, 9)] {
        let refused = stage(textured(texture(width, height, texels)));
        assert_eq!(limit_of(refused), "texels of a MeshTexture");
    }
    // Texels that are too many are left out, and those of a texture without a side are none.
    for (width, height, texels) in [(2, 2, 9), (0, 3, 9), (3, 0, 9), (0, 0, 0), (4, 4, 0)] {
        stage(textured(texture(width, height, texels))).unwrap();
    }
    finish(device);
}

#[test]
fn a_member_of_a_crowd_whose_pose_is_not_in_the_memory_is_refused() {
    let desc = StageDesc {
        max_members: 2,
        max_crowd_len: 24,
        meshes: &[sheet()],
        ..StageDesc::default()
    };
    let mut painter = Painter::new(device(), SIZE, &desc).unwrap();
    // 24 lines of 16 numbers are the poses of 16 characters with 2 joints.
    let crowd = |joint, (first, stride)| {
        let member = |first, stride| CrowdMember {
            first,
            stride,
            tint: [0.0; 4],
        };
        CrowdShot {
            skins: vec![skin_on(joint)],
            members: vec![member(0, 16), member(first, stride)],
            groups: vec![MemberGroup {
                skin: 0,
                members: 0..2,
                detail: Detail::Fine,
                casts: true,
            }],
        }
    };
    painter.poses().unwrap().fill(F32x16([0.0; 16]));
    let mut paint = |joint, member| {
        let crowd = crowd(joint, member);
        painter.paint(&empty(), Some(&crowd))
    };
    paint(1, (15, 16)).unwrap();
    let outside = [
        (1, (16, 16)),
        (2, (0, 16)),
        (1, (0, 17)),
        (1, (u32::MAX, 16)),
        (0, (0, u32::MAX)),
        (u16::MAX, (0, 1)),
    ];
    for (joint, member) in outside {
        assert_eq!(limit_of(paint(joint, member)), "StageDesc::max_crowd_len");
    }
    end(painter);
}

#[test]
fn sizes_beyond_all_memory_are_refused() {
    let mut device = device();
    type Change = fn(&mut StageDesc<'_>);
    let changes: [Change; 4] = [
        |desc| desc.max_members = u32::MAX,
        |desc| desc.max_skinned = u32::MAX,
        |desc| desc.max_crowd_len = u32::MAX,
        |desc| desc.max_skinned_joints = u32::MAX,
    ];
    for change in changes {
        let mut desc = StageDesc::default();
        change(&mut desc);
        let made = device.make(|context, memory| {
            Stage::new(context, memory, &desc).map(|stage| stage.destroy(memory))
        });
        assert_eq!(limit_of(made), "maxStorageBufferRange");
    }
    finish(device);
}

/// A ball that crosses the middle of the world, and its playback.
fn playback(half: Vec3, settings: &DodgeSettings, check: impl FnOnce(&Dodge<'_>)) {
    let ball = vec![key(0.6, Vec3::Y - half, 0.1), key(1.4, Vec3::Y + half, 0.1)];
    dodge(vec![ball], settings, |_, dodge| check(dodge));
}

#[test]
fn the_map_of_an_attack_from_kilometres_away_is_as_large_as_what_is_shown() {
    let half = Vec3::new(7000.0, 0.0, 7000.0);
    playback(half, &DodgeSettings::default(), |dodge| {
        let mut shot = empty();
        dodge.add_maps(1.0, &mut shot);
        assert!(!shot.layers.is_empty());
        let texels = |side: u32| side <= 2048;
        for layer in &shot.layers {
            let rect = layer.map.rect();
            assert!(texels(rect.width) && texels(rect.height), "{rect:?}");
        }
        assert!(shot.layers.iter().any(|layer| layer.map.count() > 0));
    });
}

#[test]
fn a_film_ends_whatever_its_settings() {
    let half = Vec3::new(0.0, 0.0, 3.0);
    let numbers = [0.0, -1.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 1e9];
    for number in numbers {
        let settings = with(|s: &mut DodgeSettings| s.slowest = number);
        playback(half, &settings, |dodge| {
            let pictures = dodge.moments(25.0).len();
            assert!((1..60_000).contains(&pictures), "{settings:?}: {pictures}");
        });
        playback(half, &DodgeSettings::default(), |dodge| {
            let pictures = dodge.moments(number).len();
            assert!((1..60_000).contains(&pictures), "{number}: {pictures}");
        });
    }
}

#[test]
fn a_skeleton_with_arms_of_a_kilometre_has_no_human_body() {
    let skeleton = demo::motions().unwrap().skeleton;
    for (factor, is_made) in [(1.5, true), (1000.0, false)] {
        let skeleton = changed(&skeleton, |joint| {
            if ["Arm", "Hand"].iter().any(|part| joint.name.contains(part)) {
                joint.offset *= factor;
            }
        });
        let body = human_body(&skeleton, &standing_pose(&skeleton, &[]), &Look::default());
        assert_eq!(body.is_some(), is_made, "arms {factor} times as long");
    }
}
