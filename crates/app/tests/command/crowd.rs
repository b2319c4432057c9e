//! `sabaki crowd`.

use sabaki::math::Isa;

use super::run::{clips, folder, sabaki};

#[test]
fn crowd_json_has_its_keys() {
    let folder = folder();
    let (path, _) = clips();
    for more in [&[][..], &["--rotations"]] {
        let args = [
            "crowd",
            path,
            "--count",
            "200",
            "--frames",
            "2",
            "--threads",
            "2",
            "--json",
        ];
        let document = sabaki(folder.path(), &[&args, more].concat()).json(0);
        assert!(document["clips"].as_u64().unwrap() > 0);
        assert!(document["key_bytes"].as_u64().unwrap() > 0);
        assert_eq!(document["error_pixels"], 2.0);
        let levels = document["levels"].as_u64().unwrap() as usize;
        let rows = document["rows"].as_array().unwrap();
        // Poses without levels and by distance, and frames of four cameras, on all registers and one thread or two; frames with hold; rows and
        // instances; 1, 8 and 200 clips; a fade and a layer; one thread and two beside a busy one; each level.
        let everywhere = 6 * 2 * Isa::available().count();
        assert_eq!(rows.len(), everywhere + 6 + 2 + 3 + 2 + 2 + levels - 1);
        let busy = rows.iter().filter(|row| row["busy_threads"] == 1);
        let threads: Vec<u64> = busy.map(|row| row["threads"].as_u64().unwrap()).collect();
        assert_eq!(threads, [1, 2]);
        for (key, values) in [
            ("what", &["pose", "frame"][..]),
            ("camera", &["still", "walk", "run", "jump"]),
            ("layout", &["blocks", "rows", "instances"]),
            ("mixed", &["nothing", "fade", "layer"]),
        ] {
            for value in values {
                assert!(rows.iter().any(|row| row[key] == *value), "{key} {value}");
            }
        }
        for row in rows {
            let is_held = row["hold_frames"].as_u64().unwrap() > 0;
            assert_eq!(row["hold_error_pixels"].is_null(), !is_held, "{row}");
            if is_held {
                let error = &row["hold_error_pixels"];
                assert!(error["greatest"].as_f64().unwrap() >= 0.0, "{row}");
                assert!(
                    error["mean"].as_f64() <= error["greatest"].as_f64(),
                    "{row}"
                );
            }
        }
        let beginning = &document["beginning"];
        for time in [
            &beginning["first_frame_ms"],
            &beginning["read_value_ns"]["blocks"],
            &beginning["read_value_ns"]["rows"],
        ] {
            assert!(time.as_f64().unwrap() > 0.0, "{beginning}");
        }
        let budget = &document["budget"];
        assert_eq!(budget["frames"], 2000);
        let share = budget["share_over_budget"].as_f64().unwrap();
        assert!((0.0..=1.0).contains(&share));
        for key in ["frame_ms", "plan_ms", "error_pixels"] {
            let times = &budget[key];
            // Null: any error is allowed.
            let at = |share: &str| match &times[share] {
                null if null.is_null() && key == "error_pixels" => f64::INFINITY,
                number => number.as_f64().unwrap(),
            };
            assert!(at("median") <= at("p99"), "{times}");
            assert!(at("p99") <= at("greatest"), "{times}");
        }
        for clips in [1, 8, 200] {
            assert!(
                rows.iter().any(|row| row["clips"] == clips),
                "{clips} clips"
            );
        }
        for row in rows {
            assert_eq!(row["count"], 200);
            assert!(row["ms"].as_f64().unwrap() > 0.0);
            assert!(row["against_plain"].as_f64().unwrap() > 0.0);
            let form = if more.is_empty() {
                "matrices"
            } else {
                "rotations"
            };
            assert_eq!(row["form"], form);
            assert!(row["ns_per_joint"].as_f64().unwrap() > 0.0);
            assert!(["portable", "avx2", "avx512"].contains(&row["isa"].as_str().unwrap()));
            let threads = row["threads"].as_u64().unwrap();
            assert!(threads == 1 || threads == 2);
            let joints = row["joints"].as_f64().unwrap();
            match row["lod"].as_str().unwrap() {
                "off" => assert_eq!(joints, 24.0),
                "distance" => assert!((6.0..=24.0).contains(&joints)),
                level => assert_eq!(joints, 24.0 - level.parse::<f64>().unwrap()),
            }
        }
    }
}

/// The camera runs into the column, and more and more characters are near.
#[test]
fn joints_are_those_of_the_measured_frames() {
    let folder = folder();
    let args = [
        "crowd",
        "--count",
        "320",
        "--frames",
        "40",
        "--threads",
        "1",
        "--json",
    ];
    let document = sabaki(folder.path(), &args).json(0);
    let rows = document["rows"].as_array().unwrap();
    let joints = |camera: &str| {
        let is = |row: &&serde_json::Value| row["what"] == "frame" && row["camera"] == camera;
        let row = rows.iter().find(is).unwrap();
        let (joints, ms) = (row["joints"].as_f64().unwrap(), row["ms"].as_f64().unwrap());
        let per_joint = row["ns_per_joint"].as_f64().unwrap();
        assert!((per_joint * joints * 320.0 - ms * 1e6).abs() < 1.0, "{row}");
        joints
    };
    let [still, walk, run] = ["still", "walk", "run"].map(joints);
    assert!(still < walk && walk < run, "{still} {walk} {run}");
}

#[test]
fn crowd_tells_what_it_measures() {
    let folder = folder();
    let told = sabaki(folder.path(), &["crowd", "--count", "50", "--frames", "1"]).is(0);
    for word in [
        "50 characters",
        "levels",
        "distance",
        "ns a joint",
        "against all joints",
        "first frame of a new crowd",
    ] {
        assert!(told.stdout.contains(word), "{word} in\n{}", told.stdout);
    }
}

#[test]
fn a_budget_that_nothing_meets_allows_any_error() {
    let folder = folder();
    let args = [
        "crowd", "--count", "50", "--frames", "1", "--budget", "1e-6",
    ];
    let document = sabaki(folder.path(), &[&args[..], &["--json"]].concat()).json(0);
    let pixels = document["budget"]["error_pixels"].as_object().unwrap();
    assert!(pixels["greatest"].is_null(), "{pixels:?}");
    let told = sabaki(folder.path(), &args).is(0);
    assert!(told.stdout.contains("without limit"), "{}", told.stdout);
}

#[test]
fn crowd_refuses_what_makes_no_sense() {
    let folder = folder();
    for (args, word) in [
        (
            ["crowd", "--json", "--error=0"],
            "--error 0: must be above 0 pixels",
        ),
        (
            ["crowd", "--json", "--error=NaN"],
            "--error NaN: must be above 0 pixels",
        ),
        (
            ["crowd", "--json", "--budget=NaN"],
            "--budget NaN: must be 0 milliseconds or more",
        ),
        (["crowd", "--json", "nowhere.bvh"], "nowhere.bvh"),
    ] {
        sabaki(folder.path(), &args).is_refused(&[word]);
    }
    for setting in ["--count", "--frames"] {
        let ended = sabaki(folder.path(), &["crowd", setting, "0"]);
        assert_eq!(ended.code, 2);
        assert!(ended.stdout.is_empty() && ended.stderr.contains(setting));
    }
}
