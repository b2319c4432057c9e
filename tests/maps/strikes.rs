//! The attacks of a graph are baked where their fists and feet pass, and queries can avoid them
//! like any other attack.

use sabaki::anim::JointTransform;
use sabaki_fixtures::answer::{answer_request, first_counts};
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::clips::joints_at;

use sabaki::maps::{AttackMaps, AttackMove, MovingSphere, SphereKey};
use sabaki::math::{Rigid2, Sphere};
use sabaki::query::{Attack, Query, QuerySettings, Request};
use sabaki_fixtures::throw::{key, throws};

fn set_at(maps: &AttackMaps, place: glam::Vec3) -> bool {
    let grid = embedded().atlas().grid();
    let slab = (place.y / grid.slab_height).floor() as i32;
    let index = usize::try_from(slab - maps.first_slab.0).ok();
    let Some(map) = index.and_then(|index| maps.slabs.get(index)) else {
        return false;
    };
    let texel = |metres: f32| (metres / grid.texel).floor() as i32;
    map.get(texel(place.x) - map.rect().u, texel(place.z) - map.rect().v)
}

/// The places of the attacking joints in every frame, in the character's frame at the attack's
/// start, by hand.
fn joint_places(strike: &AttackMove) -> Vec<glam::Vec3> {
    let graph = embedded().graph();
    let event = graph.event(graph.edge(strike.edge).event.unwrap());
    let clip = graph.clip(event.clip);
    let frames =
        (event.first..=event.last).map(|frame| joints_at(graph.skeleton(), clip, frame as usize));
    let of_event = |joints: Vec<JointTransform>| {
        let places = event
            .joints
            .iter()
            .map(move |joint| joints[joint.index()].translation);
        places.map(|place| strike.placement.inverse().point(place))
    };
    frames.flat_map(of_event).collect()
}

#[test]
fn attack_maps_lie_under_the_attacking_joints() {
    let baked = embedded();
    assert!(baked.attack_moves().len() >= 6);
    for (strike, maps) in baked.attack_moves().iter().zip(baked.atlas().attacks()) {
        let places = joint_places(strike);
        assert!(places.len() > 5);
        for place in places {
            assert!(set_at(maps, place), "{place} is passed, and not in the map");
        }
        let behind_the_back = glam::Vec3::new(0.0, 0.9, -1.0);
        assert!(!set_at(maps, behind_the_back));
    }
}

#[test]
fn an_attack_passes_without_gaps() {
    let baked = embedded();
    for strike in baked.attack_moves() {
        for sphere in baked.attack_spheres(strike) {
            let mut before: Option<glam::Vec3> = None;
            sphere.for_each_step(|Sphere { centre, radius }| {
                let gap = before.map_or(0.0, |before| before.distance(centre));
                let is_small = gap <= 0.5 * radius + 1e-5;
                assert!(is_small, "a step of {gap} m with a radius of {radius} m");
                before = Some(centre);
            });
        }
    }
}

/// A fighter stands in front, an arm's length away, and strikes: some of it is avoided, some hits,
/// and both are told apart.
#[test]
fn an_attack_of_the_graph_is_answered() {
    let (baked, settings) = (embedded(), QuerySettings::default());
    let in_front = Rigid2::new(std::f32::consts::PI, 0.0, 0.8);
    let (mut avoided, mut met) = (0, 0);
    let moments = throws(baked, 3, baked.attack_moves().len() as u64);
    for (strike, throw) in baked.attack_moves().iter().zip(moments) {
        let keys = |sphere: &MovingSphere| {
            let placed = sphere.placed(in_front);
            let later = |at: &SphereKey| key(at.t + 0.9, at.center, at.radius);
            placed.keys().iter().map(later).collect()
        };
        let spheres = baked.attack_spheres(strike);
        let attack = Attack::new(spheres.iter().map(keys).collect()).unwrap();
        assert!((attack.start() - 0.9).abs() < 1e-5 && attack.end() > 0.9);
        let query = Query::new(baked, &settings);
        let request = Request::new(throw.playhead, &attack);
        let overlaps = first_counts(&query, request);
        let answer = answer_request(&query, request);
        assert_eq!(answer.avoided, answer.clearance().metres >= 0.0);
        avoided += usize::from(answer.avoided);
        met += usize::from(overlaps.iter().any(|overlap| overlap.evasion > 0));
    }
    let half = baked.attack_moves().len() / 2;
    assert!(avoided > half, "only {avoided} avoided");
    assert!(met > 0, "no strike passes through any evasion region");
}
