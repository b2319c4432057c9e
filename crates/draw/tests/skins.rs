//! Skinned meshes are drawn where their joints are, and the body made by code holds together.

use std::sync::Arc;

use glam::{Quat, Vec3};
use sabaki::anim::{Joint, JointId, JointTransform, Skeleton};
use sabaki::lod::{LevelSettings, Levels};
use sabaki_draw::human_body;
use sabaki_draw::scene::{
    BoundMesh, JointNames, Look, Mesh, MeshBone, MeshJoint, MeshTexture, MeshVertex, RiggedMesh,
    Skin, SkinnedBody, skinned_positions, standing_pose,
};
use sabaki_fixtures::clips::joints_at;
use sabaki_fixtures::demo;

use super::{SIZE, camera, empty, end, is_red, paint, painter, skin_on, vertex};

/// A box of half a metre around the origin, moved by bone 0.
fn cube(colour: [u16; 4], texture: Option<MeshTexture>) -> Mesh {
    let corner = |index: u32| {
        let part = |bit: u32| if index >> bit & 1 == 1 { 0.25 } else { -0.25 };
        let position = Vec3::new(part(0), part(1), part(2));
        MeshVertex {
            colour,
            ..vertex(position, position.normalize(), [position.x, position.y])
        }
    };
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles = quads
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    Mesh::new((0..8).map(corner).collect(), triangles.collect(), texture)
}

fn skin_of(bones: Vec<MeshBone>) -> Arc<Skin> {
    Arc::new(Skin { mesh: 0, bones })
}

fn at(translation: Vec3) -> JointTransform {
    JointTransform {
        rotation: Quat::from_rotation_y(0.7),
        translation,
    }
}

#[test]
fn skinned_meshes_are_where_their_joints_are() {
    let red = [60_000, 3000, 2000, 0];
    let texel = [20, 240, 30, 255];
    let texture = MeshTexture {
        width: 2,
        height: 2,
        texels: vec![texel; 4],
    };
    let white = [u16::MAX; 4];
    let meshes = [cube(red, None), cube(white, Some(texture))];
    let mut painter = painter(&meshes);
    let floor = paint(&mut painter, &empty());
    let (a, b) = (Vec3::new(0.8, 1.2, 0.0), Vec3::new(-0.8, 0.9, 0.0));
    let seen = |place| camera().pixel(place, SIZE).unwrap();
    let skin = skin_on(1);
    let mut shot = empty();
    let mut body = SkinnedBody::new(&skin, &[at(Vec3::ZERO), at(a)]);
    shot.skinned.push(body.clone());
    let picture = paint(&mut painter, &shot);
    assert!(is_red(picture.at(seen(a))), "{:?}", picture.at(seen(a)));
    assert!(!picture.differs(&floor, seen(b)));
    // Of two bodies the second is a ghost: red and floor are mixed.
    let mut ghost = SkinnedBody::new(&skin, &[at(Vec3::ZERO), at(b)]);
    ghost.alpha = 0.4;
    shot.skinned.push(ghost);
    let both = paint(&mut painter, &shot);
    let (solid, thin, ground) = (both.at(seen(a)), both.at(seen(b)), floor.at(seen(b)));
    assert!(
        is_red(solid) && !is_red(thin) && thin[1] < ground[1] - 10,
        "{thin:?}"
    );
    // The tint of joint 1 alone.
    shot.skinned.clear();
    body.tint = [0.0, 0.0, 1.0, 1.0];
    for (tinted, is_blue) in [
        (vec![1.0, 0.0], false),
        (vec![0.0, 1.0], true),
        (vec![], true),
    ] {
        body.tinted = tinted;
        shot.skinned = vec![body.clone()];
        let [red, _, blue] = paint(&mut painter, &shot).at(seen(a));
        assert_eq!(blue > red, is_blue);
    }
    // The second mesh has a green texture.
    let textured = Arc::new(Skin {
        mesh: 1,
        ..(*skin).clone()
    });
    shot.skinned = vec![SkinnedBody::new(&textured, &[at(Vec3::ZERO), at(a)])];
    let [red, green, blue] = paint(&mut painter, &shot).at(seen(a));
    assert!(green > 2 * red && green > 2 * blue);
    // A mesh that the stage does not have is an error.
    let missing = Arc::new(Skin {
        mesh: 2,
        ..(*skin).clone()
    });
    shot.skinned = vec![SkinnedBody::new(&missing, &[at(Vec3::ZERO), at(a)])];
    assert!(painter.paint(&shot, None).is_err());
    end(painter);
}

/// The embedded skeleton's body and standing pose.
fn human() -> (demo::Motions, BoundMesh, Vec<JointTransform>) {
    let motions = demo::motions().unwrap();
    let standing = standing_pose(&motions.skeleton, &motions.clips);
    let body = human_body(&motions.skeleton, &standing, &Look::default()).unwrap();
    (motions, body, standing)
}

/// Vertices whose largest weight is that of a joint.
fn mainly<'a>(mesh: &'a Mesh, joint: JointId) -> impl Iterator<Item = usize> + 'a {
    let vertices = mesh.vertices.iter().enumerate();
    let own = vertices.filter(move |(_, vertex)| vertex.bones[0] == joint.0);
    own.map(|(index, _)| index)
}

#[test]
fn the_body_stands_on_the_floor_and_does_not_collapse_where_it_twists() {
    let (motions, body, standing) = human();
    let skeleton = &motions.skeleton;
    let counts = body.mesh.details.each_ref().map(Vec::len);
    assert!(counts[0] <= 7000 && counts[1] <= 800 && counts[2] <= 260 && counts[3] <= 80);
    assert!(counts[0] > 4000 && counts[3] > 30, "{counts:?}");
    let skin = skin_of(body.bones.clone());
    let places = skinned_positions(&body.mesh, &skin, &standing);
    let lowest = places.iter().map(|place| place.y).fold(f32::MAX, f32::min);
    assert!(lowest.abs() < 0.03, "{lowest}");
    // The hand turned by 120 degrees about the forearm: the wrist keeps its width.
    let find = |name: &str| skeleton.find(name).unwrap();
    for name in ["LeftHand", "RightHand"] {
        let hand = find(name);
        let elbow = skeleton.joint(hand).parent.unwrap();
        let [from, to] = [elbow, hand].map(|id| standing[id.index()].translation);
        let axis = (to - from).normalize();
        let mut twisted = standing.clone();
        for id in skeleton.ids() {
            if skeleton.carries(hand, id) {
                let joint = &mut twisted[id.index()];
                let turn = Quat::from_axis_angle(axis, 2.1);
                joint.rotation = turn * joint.rotation;
                joint.translation = to + turn * (joint.translation - to);
            }
        }
        let turned = skinned_positions(&body.mesh, &skin, &twisted);
        let aside = |place: Vec3| (place - to).reject_from(axis).length();
        let near = |index: &usize| (places[*index] - to).dot(axis).abs() < 0.04;
        let ring: Vec<usize> = mainly(&body.mesh, hand)
            .chain(mainly(&body.mesh, elbow))
            .filter(near)
            .collect();
        assert!(ring.len() > 10, "{name}: {}", ring.len());
        for index in ring {
            let (before, after) = (aside(places[index]), aside(turned[index]));
            assert!(after > 0.85 * before, "{name}: {before} {after}");
        }
    }
}

#[test]
fn the_collar_is_at_the_shoulders_however_high_the_joint_of_the_neck_is() {
    let motions = demo::motions().unwrap();
    let mut joints: Vec<Joint> = motions.skeleton.joints().to_vec();
    let neck = joints.iter_mut().find(|joint| joint.name == "Neck");
    neck.unwrap().offset.y += 0.1;
    let skeleton = Skeleton::new(joints).unwrap();
    let look = Look::default();
    let body = human_body(&skeleton, &standing_pose(&skeleton, &motions.clips), &look).unwrap();
    let clothes = look.clothes.to_array().map(|part| (part * 65_535.0) as u16);
    let dressed = body.mesh.vertices.iter();
    let dressed = dressed.filter(|vertex| vertex.colour[..3] == clothes);
    let top = dressed.map(|vertex| vertex.position[1]).fold(0.0, f32::max);
    let shoulder = skeleton.find("LeftArm").unwrap();
    let bind = body.bones[shoulder.index()].bind;
    let shoulder = (bind.rotation.conjugate() * -bind.translation).y;
    assert!((0.03..0.14).contains(&(top - shoulder)), "{top} {shoulder}");
}

#[test]
fn the_body_is_drawn_where_its_positions_are_computed() {
    let (motions, body, _) = human();
    let joints = joints_at(&motions.skeleton, &motions.clips[0], 10);
    let skin = skin_of(body.bones);
    let places = skinned_positions(&body.mesh, &skin, &joints);
    let mut painter = painter(&[body.mesh]);
    let floor = paint(&mut painter, &empty());
    let mut shot = empty();
    let red = [1.0, 0.0, 0.0, 1.0];
    shot.skinned.push(SkinnedBody {
        tint: red,
        ..SkinnedBody::new(&skin, &joints)
    });
    let picture = paint(&mut painter, &shot);
    let pixels = places
        .iter()
        .map(|&place| camera().pixel(place, SIZE).unwrap());
    let hit = pixels
        .filter(|&pixel| picture.differs(&floor, pixel))
        .count();
    // Vertices on the silhouette may lie in the pixel beside it.
    assert!(hit * 100 > places.len() * 95, "{hit} of {}", places.len());
    end(painter);
}

#[test]
fn the_order_of_a_vertex_s_influences_does_not_matter() {
    let (motions, body, _) = human();
    let joints = joints_at(&motions.skeleton, &motions.clips[0], 10);
    let skin = skin_of(body.bones);
    let mut turned = body.mesh.clone();
    // Most vertices have fewer than four influences: now the first one has no weight.
    for vertex in &mut turned.vertices {
        vertex.bones.rotate_right(1);
        vertex.weights.rotate_right(1);
    }
    let mut painter = painter(&[body.mesh, turned]);
    let [own, turned] = [0, 1].map(|mesh| {
        let skin = Arc::new(Skin {
            mesh,
            ..(*skin).clone()
        });
        let mut shot = empty();
        shot.skinned.push(SkinnedBody::new(&skin, &joints));
        paint(&mut painter, &shot)
    });
    let pairs = own.0.chunks_exact(4).zip(turned.0.chunks_exact(4));
    let apart = |(a, b): (&[u8], &[u8])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 20);
    let changed = pairs.filter(|&pair| apart(pair)).count();
    assert!(changed < 20, "{changed} pixels differ");
    end(painter);
}

/// A flat sheet of `side` by `side` squares with a seam of the texture in its middle: left of it U is less by 5.
fn sheet_with_seam(side: u32) -> Mesh {
    let mut vertices = Vec::new();
    for (half, shift) in [(0.0, -5.0), (1.0, 0.0)] {
        for index in 0..(side + 1) * (side / 2 + 1) {
            let (row, column) = (index / (side / 2 + 1), index % (side / 2 + 1));
            let x = (column as f32 - (1.0 - half) * (side / 2) as f32) / side as f32;
            let y = row as f32 / side as f32;
            let position = Vec3::new(x, y, 0.1 * (7.0 * x + 3.0 * y).sin());
            vertices.push(vertex(position, Vec3::Z, [x + shift, y]));
        }
    }
    let mut triangles = Vec::new();
    let wide = side / 2 + 1;
    for half in 0..2 {
        let first = half * (side + 1) * wide;
        for index in 0..side * (side / 2) {
            let (row, column) = (index / (side / 2), index % (side / 2));
            let at = |row: u32, column: u32| first + row * wide + column;
            let [a, b] = [at(row, column), at(row, column + 1)];
            let [c, d] = [at(row + 1, column), at(row + 1, column + 1)];
            triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    Mesh::new(vertices, triangles, None)
}

#[test]
fn coarser_resolutions_keep_the_seams_of_a_texture() {
    let mesh = sheet_with_seam(40);
    let counts = mesh.details.each_ref().map(Vec::len);
    assert!(counts[0] == 3200 && counts[1] <= 800 && counts[2] <= 260 && counts[3] <= 80);
    for corner in mesh.details.iter().flatten() {
        let corners = corner.map(|at| &mesh.vertices[at as usize]);
        let [a, b, c] = corners.map(|vertex| vertex.position[0] - vertex.uv[0]);
        assert!((a - b).abs().max((a - c).abs()) < 1e-3, "{corners:?}");
        // Nor does a triangle of one side cover a part of the other.
        let is_left = a > 2.5;
        let beyond = corners.iter().filter(|vertex| match is_left {
            true => vertex.position[0] > 1e-3,
            false => vertex.position[0] < -1e-3,
        });
        assert_eq!(beyond.count(), 0, "{corners:?}");
    }
}

#[test]
fn bones_of_removed_joints_ride_on_kept_ones() {
    let (motions, body, _) = human();
    let (skeleton, clips) = (&motions.skeleton, &motions.clips[..1]);
    let levels = Levels::build(skeleton, clips, &LevelSettings::default()).unwrap();
    let skin = skin_of(body.bones);
    let joints = joints_at(skeleton, &motions.clips[0], 5);
    for level in &levels.levels {
        let kept: Vec<JointTransform> = level
            .kept
            .iter()
            .map(|joint| joints[joint.index()])
            .collect();
        // Removed joints move with the kept joints that they are attached to.
        let attached: Vec<JointTransform> = level
            .attachments
            .iter()
            .map(|attachment| {
                let carrier = &kept[usize::from(attachment.carrier)];
                JointTransform {
                    rotation: carrier.rotation * attachment.offset.rotation,
                    translation: carrier.point(attachment.offset.translation),
                }
            })
            .collect();
        let whole = skinned_positions(&body.mesh, &skin, &attached);
        let coarse = skinned_positions(&body.mesh, &skin.attached(level), &kept);
        let apart = whole.iter().zip(&coarse).map(|(a, b)| a.distance(*b));
        let most = apart.fold(0.0, f32::max);
        assert!(most < 1e-4, "{} joints: {most} m", level.kept.len());
    }
}

/// A mesh of two boxes in centimetres, with joints of other names than the skeleton's.
fn foreign(skeleton: &Skeleton) -> RiggedMesh {
    let bind = |place: Vec3| JointTransform {
        rotation: Quat::from_rotation_x(0.4),
        translation: place * 100.0,
    };
    let joint = |name: &str, parent, place| MeshJoint {
        name: name.to_owned(),
        parent,
        bind: bind(place),
    };
    let offset = skeleton.joint(skeleton.find("LeftForeArm").unwrap()).offset;
    let mut mesh = cube([u16::MAX; 4], None);
    for vertex in &mut mesh.vertices {
        vertex.position = vertex.position.map(|part| 100.0 * part);
    }
    RiggedMesh {
        mesh,
        joints: vec![
            joint("mixamorig:LeftArm", None, Vec3::Y),
            joint("elbow", Some(0), Vec3::Y + offset.length() * Vec3::NEG_Y),
            joint("sleeve", Some(1), Vec3::ZERO),
        ],
    }
}

#[test]
fn meshes_are_bound_by_names_and_what_is_not_bound_is_said() {
    let motions = demo::motions().unwrap();
    let skeleton = &motions.skeleton;
    let standing = standing_pose(skeleton, &motions.clips);
    let rigged = foreign(skeleton);
    let error = rigged
        .bind(skeleton, &standing, &JointNames::new())
        .unwrap_err();
    assert_eq!(error.bound, 1);
    let names = JointNames::from([("elbow".to_owned(), "LeftForeArm".to_owned())]);
    let bound = rigged.bind(skeleton, &standing, &names).unwrap();
    assert_eq!(bound.unbound, ["sleeve"]);
    assert!(!bound.is_exact);
    let find = |name: &str| skeleton.find(name).unwrap();
    assert_eq!(bound.bones[0].joint, find("LeftArm"));
    assert_eq!(bound.bones[1], bound.bones[2], "it moves with the elbow");
    // In metres, and the elbow of the mesh is at the skeleton's.
    let side = bound.mesh.vertices[1].position[0] - bound.mesh.vertices[0].position[0];
    assert!((side - 0.5).abs() < 1e-3, "{side}");
    let elbow = rigged.joints[1].bind.translation / 100.0;
    assert!(bound.bones[1].bind.point(elbow).length() < 1e-3);
}
