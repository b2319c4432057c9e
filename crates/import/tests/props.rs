//! A prop attacks as far as it reaches, can be hit only if it is part of the body, and is stored in
//! baked files.

use std::path::Path;
use std::sync::OnceLock;

use glam::{Quat, Vec3};
use sabaki::anim::{JointId, JointTransform, Pose, forward_kinematics};
use sabaki::archive::{from_bytes, to_bytes};
use sabaki::maps::{BakeError, BakeSettings, BakedGraph, Baker, Prop};
use sabaki::math::Sphere;
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::shapes::Shape;
use sabaki_fixtures::with;
use sabaki_import::fit::{FitSettings, Mesh};
use sabaki_import::parse_obj;

/// The ends of a staff along its own Y.
const ENDS: [f32; 2] = [-1.6 / 3.0, 1.6 * 2.0 / 3.0];

/// A staff along its own Y, its origin a third from one end, in centimetres.
fn staff() -> Mesh {
    let mut shape = Shape::default();
    let [low, high] = ENDS.map(|along| Vec3::Y * along);
    shape.capsule(low, high, 0.015, 10);
    parse_obj(shape.obj(0.01).as_bytes()).unwrap()
}

fn hand(name: &str) -> JointId {
    embedded().graph().skeleton().find(name).unwrap()
}

/// Held across the palm, forwards.
fn held(joint: JointId) -> Prop {
    let grip = JointTransform {
        rotation: Quat::from_rotation_x(std::f32::consts::FRAC_PI_2),
        translation: Vec3::new(0.06, 0.0, 0.0),
    };
    let mesh = staff().placed(0.01, grip).unwrap();
    let (prop, fit) = sabaki_import::fit::fit_prop(joint, &mesh, &FitSettings::HELD).unwrap();
    assert!(!fit.limited && fit.mesh_out_max <= 0.02 + 1e-5, "{fit:?}");
    let is_thin = prop.spheres.iter().all(|sphere| sphere.radius < 0.03);
    assert!(is_thin, "{prop:?}");
    prop
}

fn baked(props: Vec<Prop>) -> Result<BakedGraph, BakeError> {
    let settings = with(|s: &mut BakeSettings| s.props = props);
    Baker::new(embedded().graph().clone(), settings)?.finish_on_cpu()
}

/// The embedded fighter with a staff in its right hand, and one that counts as a shield in its left hand.
fn armed() -> &'static BakedGraph {
    static BAKED: OnceLock<BakedGraph> = OnceLock::new();
    BAKED.get_or_init(|| {
        let [staff, mut shield] = ["RightHand", "LeftHand"].map(|name| held(hand(name)));
        shield.is_body = true;
        baked(vec![staff, shield]).unwrap()
    })
}

/// The ends of the staff in every frame of a strike, in the character's frame at its start, by hand.
fn tips(baked: &BakedGraph, strike: usize, joint: JointId) -> Vec<Vec3> {
    let (graph, strike) = (baked.graph(), &baked.attack_moves()[strike]);
    let event = graph.event(graph.edge(strike.edge).event.unwrap());
    let (mut pose, mut joints, mut tips) = (Pose::default(), Vec::new(), Vec::new());
    for frame in event.first..=event.last {
        graph.clip(event.clip).pose(frame as usize, &mut pose);
        forward_kinematics(graph.skeleton(), &pose, &mut joints);
        for along in ENDS {
            let tip = joints[joint.index()].point(Vec3::new(0.06, 0.0, along));
            tips.push(strike.placement.inverse().point(tip));
        }
    }
    tips
}

#[test]
fn a_staff_strikes_where_it_passes_and_a_shield_is_hit_as_the_body_is() {
    let joint = hand("RightHand");
    let (plain, armed) = (embedded(), armed());
    // A staff is no part of the body.
    let [staff, shield] = [0, 1].map(|prop| armed.body().props[prop].spheres.len());
    let spheres = [armed, plain].map(|baked| baked.body().spheres.len());
    assert_eq!(spheres[0], spheres[1] + shield);
    assert!(armed.reach() > plain.reach());
    let (mut with, mut without) = (0, 0);
    for (index, strike) in armed.attack_moves().iter().enumerate() {
        let graph = armed.graph();
        let event = graph.event(graph.edge(strike.edge).event.unwrap());
        let bare = plain.attack_spheres(&plain.attack_moves()[index]);
        let now = armed.attack_spheres(strike);
        let maps = [armed, plain].map(|baked| &baked.atlas().attacks()[index]);
        if !event.joints.contains(&joint) {
            // Another limb strikes without the staff, and once with the shield.
            match now.len() == bare.len() {
                true => assert!(now == bare && maps[0] == maps[1]),
                false => assert_eq!(now.len(), bare.len() + shield),
            }
            without += 1;
            continue;
        }
        with += 1;
        assert_eq!(now.len(), bare.len() + staff);
        let mut far = 0;
        for tip in tips(armed, index, joint) {
            let near = |spheres: &[sabaki::maps::MovingSphere]| {
                let keys = spheres.iter().flat_map(|sphere| sphere.keys());
                keys.map(|key| key.center.distance(tip) - key.radius)
                    .fold(f32::INFINITY, f32::min)
            };
            assert!(near(&now) <= 0.03, "its end at {tip} strikes nothing");
            far += usize::from(near(&bare) > 0.3);
        }
        assert!(far > 5, "the staff reaches no further than the hand");
        let texels = maps.map(|maps| maps.slabs.iter().map(|map| map.count()).sum::<u32>());
        assert!(texels[0] > texels[1] + 50, "the maps do not hold the staff");
    }
    assert!(with >= 2 && without >= 2, "{with}, {without}");
}

#[test]
fn a_prop_takes_part_with_the_joints_above_and_below_it() {
    let skeleton = embedded().graph().skeleton();
    let prop = held(hand("RightHand"));
    for (names, takes_part) in [
        ("RightHand", true),
        ("RightForeArm", true),
        ("RightHand_End", true),
        ("Hips", true),
        ("", true),
        ("LeftHand RightHand", true),
        ("LeftHand", false),
        ("LeftForeArm", false),
        ("Head", false),
        ("LeftHand_End RightFoot", false),
    ] {
        let joints = names.split_whitespace();
        let joints: Vec<JointId> = joints.map(|name| skeleton.find(name).unwrap()).collect();
        assert_eq!(prop.takes_part(skeleton, &joints), takes_part, "{names}");
    }
}

#[test]
fn props_are_kept_in_baked_files_and_checked() {
    let armed = armed();
    let bytes = to_bytes(armed).unwrap();
    assert_eq!(&from_bytes(&bytes, Path::new("armed")).unwrap(), armed);
    let whole = serde_json::to_value(armed).unwrap();
    let spoil = |place: &str, value: serde_json::Value| {
        let mut spoilt = whole.clone();
        *spoilt.pointer_mut(place).unwrap() = value;
        let spoilt: BakedGraph = serde_json::from_value(spoilt).unwrap();
        assert!(spoilt.restored().is_err(), "{place}");
    };
    spoil("/body/props/0/joint", 999.into());
    spoil("/body/props/0/spheres/1/radius", (-1.0).into());
    spoil("/body/props/0/spheres", serde_json::json!([]));
}

#[test]
fn a_prop_that_is_none_is_refused_by_number() {
    let sphere = |radius| Sphere::new(Vec3::ZERO, radius);
    let prop = |joint, spheres| Prop {
        joint: JointId(joint),
        spheres,
        is_body: false,
    };
    for bad in [
        prop(999, vec![sphere(0.1)]),
        prop(1, Vec::new()),
        prop(1, vec![sphere(0.1), sphere(0.0)]),
        prop(1, vec![sphere(f32::NAN)]),
    ] {
        let props = vec![prop(1, vec![sphere(0.1)]), bad];
        assert_eq!(baked(props).unwrap_err(), BakeError::Prop(1));
    }
}
