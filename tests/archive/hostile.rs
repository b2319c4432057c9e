//! Baked files with a valid checksum and manipulated numbers and lists.

use sabaki::anim::{Event, EventKind, JointId};
use sabaki::archive::to_bytes;
use sabaki::maps::{BakedGraph, PathSettings};
use serde::Deserialize;
use serde_json::{Value, json};

use super::{is_accepted, read};
use sabaki_fixtures::small::{small, small_bake, small_evasion};
use sabaki_fixtures::with;

/// The places of all numbers; of long lists those at the ends and a few between.
fn numbers(value: &Value, path: &str, out: &mut Vec<String>) {
    match value {
        Value::Object(fields) => {
            for (name, field) in fields {
                numbers(field, &format!("{path}/{name}"), out);
            }
        }
        Value::Array(items) => {
            let step = items.len().div_ceil(6).max(1);
            let last = items.len().saturating_sub(1);
            for index in (0..items.len()).filter(|i| i % step == 0 || *i == last) {
                numbers(&items[index], &format!("{path}/{index}"), out);
            }
        }
        Value::Number(_) => out.push(path.to_owned()),
        _ => {}
    }
}

#[test]
fn numbers_may_be_any_numbers() {
    // As small as a graph with an evasion and an attack can be: it is read thousands of times.
    let attack = Event {
        kind: EventKind::Attack,
        joints: vec![JointId(8)],
        ..small_evasion(1, 1.4)
    };
    let paths = with(|s: &mut PathSettings| s.most = 4);
    let tiny = small_bake(90, &[0.3, 0.4], &[small_evasion(0, 1.2), attack], paths);
    assert_eq!((tiny.evasions().len(), tiny.attack_moves().len()), (1, 1));
    let mut hostile = serde_json::to_value(&tiny).unwrap();
    let mut places = Vec::new();
    numbers(&hostile, "", &mut places);
    assert!(places.len() > 300, "{}", places.len());
    let extremes = [
        json!(0),
        json!(1),
        json!(-1),
        json!(-1e-6),
        json!(65_535),
        json!(i32::MIN),
        json!(i32::MAX),
        json!(u32::MAX),
        json!(1e9),
        json!(-3.4e38),
        json!(1e-38),
    ];
    let (mut sound, mut refused) = (0, 0);
    for (at, place) in places.iter().enumerate() {
        let number = hostile.pointer(place).unwrap().clone();
        // Neighbours in a list are alike: four of the numbers each, so that every list gets all of them.
        let some = (0..4).map(|step| &extremes[(4 * at + 3 * step) % extremes.len()]);
        for extreme in some {
            *hostile.pointer_mut(place).unwrap() = extreme.clone();
            // What the type itself refuses no file can hold.
            let Ok(baked) = BakedGraph::deserialize(&hostile) else {
                continue;
            };
            let bytes = to_bytes(&baked).unwrap();
            match is_accepted(&format!("{place} = {extreme}"), &bytes) {
                true => sound += 1,
                false => refused += 1,
            }
        }
        *hostile.pointer_mut(place).unwrap() = number;
    }
    assert!(sound > 50 && refused > 400, "{sound}, {refused}");
}

#[test]
fn a_graph_that_is_none_is_refused_with_the_reason() {
    let whole = serde_json::to_value(small()).unwrap();
    let edges = whole["graph"]["edges"].as_array().unwrap();
    let evasion = whole["evasions"][0]["edge"].as_u64().unwrap() as usize;
    let joint = &whole["graph"]["skeleton"]["joints"][0];
    // The graph falls into two where no edge leads into the first node.
    let looped: Vec<Value> = edges.iter().map(|edge| looped(edge.clone())).collect();
    let (texels, words) = ("the maps' texels", "a map's words");
    let (no_fit, no_evasion) = ("an edge does not fit", "an evasion names an edge");
    let other_edge = (evasion + 1) % edges.len();
    let cases = [
        ("/graph/nodes", json!([]), "no nodes"),
        ("/graph/clips", json!([]), "a node names a frame"),
        ("/graph/frame_rate", json!(1e9), "the frame rate"),
        ("/graph/frame_rate", json!(16.0), "another frame rate"),
        ("/graph/events", json!([]), no_fit),
        ("/graph/edges", json!(looped), no_fit),
        (
            "/graph/skeleton/joints",
            json!([joint]),
            "a clip is damaged",
        ),
        ("/body/spheres", json!([]), "a body sphere"),
        ("/atlas/regions", json!([]), no_evasion),
        ("/atlas/grid/texel", json!(1e-9), texels),
        ("/retimable", json!([]), "one entry an edge"),
        ("/paths/links/0/rest", json!(65_535), "leads nowhere"),
        ("/evasions/0/edge", json!(other_edge), no_evasion),
        ("/atlas/regions/0/first_slab", json!(-2_000_000_000), words),
        ("/atlas/grid/slices", json!(65), texels),
        ("/atlas/grid/slices", json!(33), words),
        ("/atlas/grid/slice_seconds", json!(0.0), texels),
        ("/atlas/regions/0/seconds", json!(-1.0), words),
        (
            "/atlas/regions/0/slabs/0/outer/rect/u",
            json!(16_385),
            words,
        ),
        ("/atlas/regions/0/slabs/0/outer/masks", json!([]), words),
    ];
    for (place, hostile, reason) in cases {
        let mut value = whole.clone();
        *value.pointer_mut(place).unwrap() = hostile;
        let error = refused(value);
        assert!(error.starts_with("some.sabaki: not sound: "), "{error}");
        assert!(error.contains(reason), "{place}: {error}");
    }
}

fn bytes_of(value: &Value) -> Vec<u8> {
    to_bytes(&BakedGraph::deserialize(value).unwrap()).unwrap()
}

fn refused(value: Value) -> String {
    read(&bytes_of(&value)).unwrap_err().to_string()
}

/// The edge that leads back to where it starts.
fn looped(mut edge: Value) -> Value {
    edge["to"] = edge["from"].clone();
    edge
}

#[test]
fn a_graph_without_a_node_or_in_two_parts_is_refused() {
    let whole = serde_json::to_value(small()).unwrap();
    let mut empty = whole.clone();
    for list in ["nodes", "edges", "events"] {
        empty["graph"][list] = json!([]);
    }
    empty["graph"]["first_edge"] = json!([0]);
    empty["retimable"] = json!([]);
    empty["paths"]["first"] = json!([0]);
    empty["paths"]["links"] = json!([]);
    empty["evasions"] = json!([]);
    empty["strikes"] = json!([]);
    empty["atlas"]["attacks"] = json!([]);
    let moments = whole["entries"]["entries"]["ends"].as_array().unwrap();
    let lists = json!({ "ends": vec![0; moments.len()], "entries": [] });
    empty["entries"]["entries"] = lists.clone();
    empty["entries"]["targets"] = json!([]);
    empty["entries"]["exit_targets"] = json!([]);
    empty["entries"]["exits"] = lists;
    // Two postures, and from each only a way to itself.
    let mut parted = empty.clone();
    parted["graph"]["nodes"] = json!([{ "clip": 0, "frame": 5 }, { "clip": 0, "frame": 20 }]);
    let edges = whole["graph"]["edges"].as_array().unwrap().iter();
    let mut aligned = edges.filter_map(|edge| edge["motion"]["Transition"]["align"].as_object());
    let align = aligned.next().unwrap();
    let edge = |node: u32| {
        let motion = json!({ "Transition": { "align": align, "distance": 0.1 } });
        json!({ "from": node, "to": node, "frames": 5, "motion": motion, "event": null })
    };
    parted["graph"]["edges"] = json!([edge(0), edge(1)]);
    parted["graph"]["first_edge"] = json!([0, 1, 2]);
    parted["paths"]["first"] = json!([0, 0, 0]);
    let retimable = json!({ "faster": true, "slower": true });
    parted["retimable"] = json!([retimable, retimable]);
    for (value, reason) in [(empty, "no nodes"), (parted.clone(), "cannot be reached")] {
        let error = refused(value);
        assert!(error.contains(reason), "{error}");
    }
    // With a way from the one to the other there is still none back.
    parted["graph"]["edges"][0]["to"] = json!(1);
    assert!(read(&bytes_of(&parted)).is_err());
    // The same with ways between them is a graph, without an evasion.
    parted["graph"]["edges"][1]["to"] = json!(0);
    assert!(is_accepted("a graph of two nodes", &bytes_of(&parted)));
    // Two paths that go on with each other, one to an evasion that is none, and one by an edge that is none.
    let link = |edge: u32, rest: u32| json!({ "edge": edge, "rest": rest });
    parted["paths"]["first"] = json!([0, 1, 2]);
    for links in [
        [link(1, 0), link(1, 0)],
        [link(0, 0), link(1, 0)],
        [link(2, 0), link(1, 0)],
        [link(1, 1), link(1, 0)],
    ] {
        parted["paths"]["links"] = json!(links);
        let error = refused(parted.clone());
        let words = "a path leads nowhere, or to itself";
        assert!(error.contains(words), "{error}");
    }
}
