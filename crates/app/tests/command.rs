//! Promise: the command's exit codes, streams, files and keys are those that it states.

mod annotate;
#[cfg(unix)]
mod cancel;
mod crowd;
mod duel;
mod embedded;
mod figure;
mod lod;
mod measure;
#[cfg(unix)]
mod names;
mod refused;
mod render;
mod rigs;
pub(crate) mod run;
mod shards;
mod slurm;

use std::fs;
use std::io::{PipeWriter, pipe};
use std::path::Path;

use run::{Png, baked, command, folder, sabaki, text_of, write};
use sabaki_import::read_bvh;
use serde_json::{Value, json};

/// Every key that stands for milliseconds or where a file lies, taken out: what is left is the same in every run.
fn without_times(mut document: Value) -> Value {
    fn strip(value: &mut Value) {
        match value {
            Value::Object(fields) => {
                fields.retain(|name, _| !name.ends_with("ms") && name != "build_seconds");
                fields.values_mut().for_each(strip);
            }
            Value::Array(items) => items.iter_mut().for_each(strip),
            _ => {}
        }
    }
    strip(&mut document);
    document
}

fn assert_is_png(path: &Path) {
    let png = Png::read(path);
    assert!(png.size.into_iter().all(|side| side > 100) && png.colours(0) > 1);
}

#[test]
fn without_a_subcommand_it_shows_what_it_does() {
    let folder = folder();
    let done = sabaki(&folder, "").is(0);
    for word in ["evasions", "avoided", "cpu", "exact", "dodge.bvh"] {
        assert!(done.stdout.contains(word), "{word} in\n{}", done.stdout);
    }
    let out = folder.path().join("out");
    let motion = read_bvh(&out.join("dodge.bvh")).unwrap();
    assert!(motion.frames() > 1);
    let facts: Value = serde_json::from_str(&text_of(&out.join("dodge.json"))).unwrap();
    assert_eq!(facts["avoided"], true);
    assert_is_png(&out.join("maps.png"));
    let inspected = sabaki(&folder, "inspect out/fighter.sabaki --json").json(0);
    assert_eq!(inspected["kind"], "baked");
    assert_eq!(fs::read_dir(&out).unwrap().count(), 4, "nothing else");
}

#[test]
fn bake_writes_a_graph_and_says_what_is_in_it() {
    let folder = folder();
    let told = sabaki(&folder, "bake --clips FEW --out few.sabaki").is(0);
    assert!(told.stdout.contains("evasions") && told.stdout.contains("wrote few.sabaki"));
    let args = "bake --clips CLIPS --events EVENTS --out g.sabaki --draw stencil --json";
    let document = sabaki(&folder, args).json(0);
    let written = fs::read(folder.path().join("g.sabaki")).unwrap();
    // The same without a device.
    assert!(written == fs::read(baked()).unwrap());
    for key in ["clips", "nodes", "edges", "evasions", "report", "warnings"] {
        assert!(!document[key].is_null(), "{key}");
    }
    assert!(document["evasions"].as_u64().unwrap() >= 3);
    assert_eq!(document["out"], "g.sabaki");
    let inspected = sabaki(&folder, "inspect g.sabaki --json").json(0);
    assert_eq!(inspected["kind"], "baked");
    for key in ["clips", "nodes", "edges", "evasions"] {
        assert_eq!(inspected[key], document[key], "{key}");
    }
}

/// A pipe has no neighbour that could take its name.
#[cfg(target_os = "linux")]
#[test]
fn bake_writes_into_a_pipe() {
    let folder = folder();
    let args = "bake --clips FEW --out /proc/self/fd/1";
    let done = command(&folder, args).output().unwrap();
    assert_eq!(done.status.code(), Some(0));
    assert!(done.stdout.starts_with(b"sabaki\r\n"));
}

#[test]
fn dodge_has_the_keys_that_it_promises_and_the_same_answers_for_a_seed() {
    let folder = folder();
    let args = "dodge BAKED --attacks 5 --cull cpu --json --seed";
    let with_seed = |seed| sabaki(&folder, &format!("{args} {seed}")).json(0);
    let document = with_seed("3");
    let count = |key: &str| document[key].as_u64().unwrap_or_else(|| panic!("{key}"));
    assert_eq!(count("attacks"), 5);
    assert_eq!(count("avoided") + count("hit"), 5);
    assert_eq!(count("hit"), count("unavoidable"));
    assert_eq!(count("hit_though_avoidable"), 0);
    assert!(count("grid_answered") <= count("grid_used") && count("grid_used") <= 5);
    let [median, p99] = ["median", "p99"].map(|key| document["query_ms"][key].as_f64().unwrap());
    assert!(0.0 < median && median <= p99);
    let results = document["results"].as_array().unwrap();
    assert_eq!(results.len(), 5);
    let sum = |key: &str| {
        let counts = results.iter().map(|result| &result["counts"][key]);
        counts.map(|count| count.as_f64().unwrap()).sum::<f64>()
    };
    let mapped = sum("with_evasion") - sum("entered") - sum("layered");
    let culled = document["culled_share"].as_f64().unwrap();
    assert!(sum("layered") > 0.0 && sum("culled") > 0.0);
    assert!((culled - sum("culled") / mapped).abs() < 1e-9);
    let avoided = results.iter().filter(|result| result["avoided"] == true);
    assert_eq!(avoided.count() as u64, count("avoided"));
    let [same, other] = ["3", "4"].map(|seed| without_times(with_seed(seed)));
    assert_eq!(same, without_times(document.clone()));
    assert_ne!(same, other);
    // A check adds the exact search of all.
    let checked = with_seed("3 --check");
    let rows = checked["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 2);
    assert_eq!([&rows[1]["cull"], &rows[1]["grid"]], ["exact", "off"]);
    let told = [&checked, &document].map(|said| said["checked_by_exact"] == true);
    assert_eq!(told, [true, false]);
    assert_eq!(checked["avoided"], document["avoided"]);
}

#[test]
fn the_culling_paths_give_the_same_answers_with_the_grid_and_without() {
    let folder = folder();
    let args = "dodge BAKED --attacks 6 --cull exact,cpu --grid on,off --json";
    let document = sabaki(&folder, args).json(0);
    let rows = document["rows"].as_array().unwrap();
    let names = rows.iter().map(|row| [&row["cull"], &row["grid"]]);
    let expected = ["exact", "cpu"].map(|cull| ["on", "off"].map(|grid| [cull, grid]));
    assert_eq!(names.collect::<Vec<_>>(), expected.as_flattened());
    for row in rows {
        assert_eq!(row["avoided"], rows[0]["avoided"]);
        assert_eq!(row["hit_though_avoidable"], 0);
        assert_eq!(row["checked_by_exact"], true);
        assert_eq!(row["grid"] == "off", row["grid_used"] == 0, "{row}");
    }
    assert_eq!(document["results"].as_array().unwrap().len(), 24);
    // One more thread, another order of work, the same answers.
    let threads = format!("{args} --threads 3");
    let by_threads = sabaki(&folder, &threads).json(0);
    assert_eq!(without_times(by_threads), without_times(document));
}

#[test]
fn an_attack_of_a_file_is_answered_with_yes_or_no() {
    let folder = folder();
    let attack = |name: &str, spheres: Value| {
        let file = json!({ "attacks": [{ "spheres": spheres }] });
        write(&folder, name, file.to_string());
    };
    let key = |t: f64, x: f64| json!({ "t": t, "center": [x, 0.9, 0.0], "radius": 0.1 });
    attack("far.json", json!([key(0.5, 50.0), key(1.0, 51.0)]));
    attack("at_once.json", json!([key(0.0, 0.0), key(0.05, 0.0)]));
    let dodge = |file| sabaki(&folder, &format!("dodge BAKED --attack {file} --json"));
    let far = dodge("far.json").json(0);
    assert_eq!((&far["attacks"], &far["avoided"]), (&json!(1), &json!(1)));
    let hit = dodge("at_once.json").json(1);
    assert_eq!((&hit["hit"], &hit["unavoidable"]), (&json!(1), &json!(1)));
    let told = sabaki(&folder, "dodge BAKED --attack at_once.json").is(1);
    assert!(told.stdout.contains("HIT"));
    let inspected = sabaki(&folder, "inspect far.json --json").json(0);
    assert_eq!(inspected["kind"], "attacks");
}

#[test]
fn export_writes_two_files_for_each_attack() {
    let folder = folder();
    let args = "dodge BAKED --attacks 2 --cull cpu --json";
    let exported = format!("{args} --export deep/er");
    let document = sabaki(&folder, &exported).json(0);
    for (index, result) in document["results"].as_array().unwrap().iter().enumerate() {
        let attack = folder.path().join(format!("deep/er/attack_{index:04}"));
        let file = |ending| attack.with_extension(ending);
        let facts: Value = serde_json::from_str(&text_of(&file("json"))).unwrap();
        assert_eq!(facts["clearance"], result["clearance"]);
        assert!(read_bvh(&file("bvh")).unwrap().frames() > 1);
    }
    let written = fs::read_dir(folder.path().join("deep/er")).unwrap();
    assert_eq!(written.count(), 4);
    // The same as glTF, which says when it evades.
    let as_gltf = format!("{args} --export glb --format glb");
    sabaki(&folder, &as_gltf).is(0);
    let inspected = sabaki(&folder, "inspect glb/attack_0001.glb --json").json(0);
    assert_eq!(inspected["unit_found"], "defined by the format");
    assert!(inspected["clips"][0]["events"].is_array());
    let rate = inspected["clips"][0]["frame_rate"].as_f64().unwrap();
    assert!(rate > 0.0 && inspected["frame_rate"] == rate);
}

#[test]
fn a_motion_that_lies_is_stood_up() {
    let folder = folder();
    let motion = include_str!("../../import/tests/corpus/asf/person");
    let (skeleton, motion) = motion.split_once("\n---\n").unwrap();
    write(&folder, "a.asf", skeleton);
    write(&folder, "a.amc", motion);
    let head = |more: &str| {
        let line = format!("inspect a.amc --amc-rate 60 --json {more}");
        let document = sabaki(&folder, &line).json(0);
        assert_eq!(document["kind"], "motion");
        assert_eq!(document["frame_rate"], 60.0);
        document["skeleton"][4]["offset"][1].as_f64().unwrap()
    };
    assert!(head("") > 0.3 && head("--up x").abs() < 1e-6);
    let events = sabaki(&folder, "inspect EVENTS --json").json(0);
    assert_eq!(events["kind"], "events");
}

#[test]
fn doctor_says_whether_there_is_a_device() {
    let folder = folder();
    let document = sabaki(&folder, "doctor --json");
    let usable = document.code == 0;
    let document = document.json(i32::from(!usable));
    assert_eq!(document["paths"]["cpu"], true);
    assert_eq!(document["paths"]["stencil"], usable);
    assert_eq!(document["chosen"].is_string(), usable);
    let told = sabaki(&folder, "doctor").is(i32::from(!usable));
    assert!(told.stdout.contains("stencil"));
}

#[test]
fn a_graph_without_an_evasion_moves_on_and_says_so() {
    let folder = folder();
    let bake = "bake --clips FEW --out g.sabaki --json";
    let document = sabaki(&folder, bake).json(0);
    assert_eq!(document["evasions"], 0);
    let warning = document["warnings"][0].as_str().unwrap();
    assert!(warning.contains("no clip has an evasion"), "{warning}");
    let args = "dodge g.sabaki --attacks 2 --cull cpu --json";
    let document = sabaki(&folder, args).json(0);
    assert_eq!(document["by_evasion"], 0);
}

/// Tables fit a terminal of 100 columns.
#[test]
fn lines_are_at_most_a_hundred_columns_wide() {
    let folder = folder();
    let cases = [
        "",
        "dodge BAKED --attacks 3 --check",
        "compare BAKED --attacks 3 --plot c.png",
        "coverage BAKED --attacks 1 --directions 2",
        "coverage BAKED --by-time --attacks 2",
        "lod",
        "crowd --count 50 --frames 1 --threads 1",
        "duel BAKED --apart 0.8 --rounds 1",
        "inspect BAKED",
    ];
    for args in cases {
        let told = sabaki(&folder, args);
        assert!(told.code < 2, "{args:?}: {}", told.stderr);
        let is_wide = |line: &&str| line.chars().count() > 100;
        let wide: Vec<&str> = told.stdout.lines().filter(is_wide).collect();
        assert!(wide.is_empty(), "{args:?}: {wide:#?}");
    }
}

/// A pipe without a reader.
fn unread() -> PipeWriter {
    let (reader, writer) = pipe().unwrap();
    drop(reader);
    writer
}

#[test]
fn a_reader_that_goes_away_is_no_failure() {
    let folder = folder();
    for args in ["inspect EVENTS", "inspect BAKED --json", "--help"] {
        let mut command = command(&folder, args);
        let done = command.stdout(unread()).output().unwrap();
        assert_eq!(done.status.code(), Some(0), "{args}");
        assert!(done.stderr.is_empty());
    }
    // An error message that nobody reads does not crash the command.
    let mut command = command(&folder, "inspect nowhere.bvh");
    let status = command.stderr(unread()).status().unwrap();
    assert_eq!(status.code(), Some(2));
}
