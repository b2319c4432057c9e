//! What explains and measures: `dodge --explain`, `--replay`, `compare` and `coverage`.

use serde_json::Value;

use super::assert_is_png;
use super::run::{folder, sabaki, text_of, write};

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value}"))
}

fn row_of<'a>(rows: &'a [Value], cull: &str, grid: &str) -> &'a Value {
    let mut rows = rows.iter();
    let found = rows.find(|row| row["cull"] == cull && row["grid"] == grid);
    found.unwrap_or_else(|| panic!("{cull} {grid}"))
}

#[test]
fn an_explanation_lists_every_candidate_in_lines_that_can_be_read() {
    let folder = folder();
    let args = "dodge BAKED --cull cpu --grid off";
    let (mut shortened, mut outscored) = (0, [0; 2]);
    for index in ["0", "1", "2"] {
        let explain = format!("{args} --explain {index}");
        let document = sabaki(&folder, &format!("{explain} --json")).json(0);
        assert_eq!(document["attack_index"].to_string(), index);
        let candidates = document["candidates"].as_array().unwrap();
        let late = |c: &&Value| c["fate"] == "not_in_time";
        let counted = number(&document["counts"]["not_in_time"]);
        assert_eq!(candidates.iter().filter(late).count() as f64, counted);
        let whole = sabaki(&folder, &format!("{explain} --all")).is(0);
        let listed = |text: &str, what: &str| {
            let heading = text.lines().find(|line| line.starts_with(what));
            heading.is_some_and(|line| line.ends_with(')'))
        };
        for (fate, what) in [("chosen", "chosen"), ("culled", "culled"), ("hit", "hit")] {
            let has = candidates.iter().any(|c| c["fate"] == fate);
            assert_eq!(listed(&whole.stdout, what), has, "{fate}\n{}", whole.stdout);
        }
        // What has no clearance was not tested, and is no candidate that lost by its score.
        for (is_tested, what) in [(true, "outscored"), (false, "not tested")] {
            let is = |c: &&Value| c["fate"] == "outscored" && c["clearance"].is_null() != is_tested;
            let count = candidates.iter().filter(is).count();
            let heading = whole.stdout.lines().find(|line| line.starts_with(what));
            assert_eq!(heading.is_some(), count > 0, "{what}\n{}", whole.stdout);
            let ends = |line: &str| line.ends_with(&format!(" ({count})"));
            assert!(heading.is_none_or(ends), "{heading:?}: {count}");
            outscored[usize::from(is_tested)] += count;
        }
        // A line of figures or a reason, and one of the path, for each.
        let paths = whole.stdout.lines().filter(|l| l.starts_with("         "));
        assert_eq!(paths.count(), candidates.len());
        let short = sabaki(&folder, &explain).is(0);
        shortened += usize::from(short.stdout.contains("--all lists them"));
        for line in whole.stdout.lines().chain(short.stdout.lines()) {
            assert!(line.chars().count() <= 100, "{line}");
        }
        assert!(!whole.stdout.contains("--all lists them"));
    }
    assert!(shortened > 0, "nothing was long");
    assert!(outscored.iter().all(|&count| count > 0), "{outscored:?}");
    let attack = r#"{"attacks":[{"spheres":[{"t":1,"center":[0,1,0],"radius":0.1}]}]}"#;
    write(&folder, "one.json", attack);
    let beyond = "dodge BAKED --attack one.json --explain 1";
    sabaki(&folder, beyond).is_refused(&["one.json", "no attack 1"]);
}

#[test]
fn an_exported_answer_is_replayed_to_the_bit() {
    let folder = folder();
    let args = "dodge BAKED --attacks 4 --export out";
    sabaki(&folder, args).is(0);
    let explain = "dodge BAKED --explain 7 --cull exact";
    sabaki(folder.path(), &format!("{explain} --export out")).is(0);
    let replay = |file: &str| sabaki(&folder, &format!("dodge BAKED --replay {file} --json"));
    for index in [0, 1, 2, 3, 7] {
        let told = replay(&format!("out/attack_{index:04}.json")).json(0);
        assert_eq!(told["same"], true);
        assert_eq!(told["expected"], told["found"]);
    }
    let text = text_of(&folder.path().join("out/attack_0001.json"));
    let mut facts: Value = serde_json::from_str(&text).unwrap();
    facts["answer"]["clearance"] = (number(&facts["answer"]["clearance"]) + 1e-6).into();
    write(&folder, "other.json", facts.to_string());
    assert_eq!(replay("other.json").json(1)["same"], false);
    facts["query"]["graph"] = 1.into();
    write(&folder, "graph.json", facts.to_string());
    replay("graph.json").is_refused(&["graph.json", "the graph 00000001"]);
    write(&folder, "cut.json", &text[..100]);
    replay("cut.json").is_refused(&["cut.json", "line"]);
    replay("none.json").is_refused(&["none.json"]);
}

#[test]
fn what_is_recorded_is_measured_beside_the_clips() {
    let folder = folder();
    let document = sabaki(&folder, "play BAKED --threats 1 --record out --json").json(0);
    let quality = &document["quality"];
    assert_eq!(quality["clips"]["centre_above_clips"], 0.0);
    let most = |kind: &str| number(&quality[kind]["centre_acceleration_most"]);
    for (kind, minutes) in [("steering", 10), ("threats", 10), ("idle", 4)] {
        assert!(most(kind) > 0.0 && most("idle") <= most(kind), "{quality}");
        for minute in 0..minutes {
            let name = format!("out/{kind}/{kind}_{minute:02}.bvh");
            let text = text_of(&folder.path().join(&name));
            assert!(text.contains("Frames: 3600\n"), "{name}");
        }
    }
}

#[test]
fn compare_holds_all_paths_to_the_exact_one() {
    let folder = folder();
    let args = "compare BAKED --attacks 12";
    let json = format!("{args} --json --plot plot.png");
    let document = sabaki(&folder, &json).json(0);
    let rows = document["rows"].as_array().unwrap();
    let lazy = rows.iter().filter(|row| row["evaluation"] == "lazy");
    let lazy: Vec<Value> = lazy.cloned().collect();
    for row in rows {
        assert_eq!(row["attacks"], 12);
        for key in ["candidates", "kept", "weak", "wrong", "undecided"] {
            assert!(number(&row[key]) >= 0.0, "{key}");
        }
        for times in [&row["query_ms"], &row["cull_ms"]] {
            assert!(number(&times["median"]) <= number(&times["p99"]));
        }
        assert_eq!(row["hit_though_avoidable"], 0);
        assert_eq!(row["wrong"], 0.0, "the default maps are certain");
        assert!(number(&row["kept"]) <= number(&row["candidates"]));
        assert_eq!(row["tally"]["hits_proven_clean"], 0);
        // Whoever counts: the same attacks, the same candidates, the same counts.
        let none = row_of(&lazy, "none", row["grid"].as_str().unwrap());
        assert_eq!(row["tally"], none["tally"]);
        assert_eq!(row["avoided"], none["avoided"]);
        assert!(number(&row["gain"]) > 0.0);
    }
    let (none, cpu) = (row_of(&lazy, "none", "off"), row_of(&lazy, "cpu", "off"));
    assert_eq!(number(&none["gain"]), 1.0);
    assert!(number(&cpu["tally"]["hits"]) > 0.0 && number(&cpu["tally"]["clean"]) > 0.0);
    assert!(number(&cpu["weak"]) < 1.0, "nothing is culled");
    let kept = number(&cpu["tally"]["hits_kept"]) + number(&cpu["tally"]["clean"]);
    assert!((number(&cpu["kept"]) * 12.0 - kept).abs() < 1e-6);
    assert!(number(&document["grid_answered"]) <= number(&document["grid_used"]));
    let crossover = document["crossover"].as_array().unwrap();
    assert!(crossover.iter().any(|line| line["cull"] == "cpu"));
    // Lazy and exhaustive, each path with the grid and without, and once more without culling.
    assert_eq!((crossover.len() + 1) * 4, rows.len());
    assert_is_png(&folder.path().join("plot.png"));
    let told = sabaki(&folder, args).is(0).stdout;
    for word in ["exhaustive", "lazy", "undecided", "none", "cpu", "gain"] {
        assert!(told.contains(word), "{word}");
    }
}

#[test]
fn compare_repeats_the_papers_table() {
    let folder = folder();
    let document = sabaki(&folder, "compare BAKED --paper --attacks 12 --json").json(0);
    let rows = document["rows"].as_array().unwrap();
    let row = |cull: &str, grid: &str| row_of(rows, cull, grid);
    for grid in ["off", "on"] {
        let (none, cpu) = (row("none", grid), row("cpu", grid));
        assert_eq!(none["avoided"], cpu["avoided"]);
        assert!(number(&cpu["kept"]) < number(&cpu["candidates"]));
        // The paper's maps know no time, and keep many hits.
        assert!(number(&cpu["weak"]) > 0.1, "{cpu}");
        for ms in ["ms_of_6", "ms_of_all"] {
            assert!(number(&cpu[ms]) > 0.0);
        }
    }
    assert_eq!(row("none", "off")["paper_ms"], 496);
    let told = sabaki(&folder, "compare BAKED --paper --attacks 2").is(0);
    assert!(told.stdout.contains("paper ms") && told.stdout.contains("2:40"));
}

#[test]
fn coverage_says_where_the_gaps_are() {
    let folder = folder();
    let args = "coverage BAKED --attacks 1 --directions 4";
    let json = format!("{args} --json");
    let document = sabaki(&folder, &json).json(0);
    let cells = document["cells"].as_array().unwrap();
    assert_eq!(cells.len(), 4 * 5 * 7);
    let sum = |key: &str| cells.iter().map(|cell| number(&cell[key])).sum::<f64>();
    assert_eq!(sum("attacks"), number(&document["attacks"]));
    assert_eq!(sum("avoided"), number(&document["avoided"]));
    assert!(sum("avoided") > 0.0 && sum("avoided") < sum("attacks"));
    let gaps = document["gaps"].as_array().unwrap();
    assert_eq!(gaps.len(), 4 * 5);
    let shares: Vec<f64> = gaps.iter().map(|gap| number(&gap["share"])).collect();
    assert!(shares.is_sorted());
    let is_certain = document["gaps"][0]["beyond_chance"].as_bool().unwrap();
    assert_eq!(document["capture_next"].is_string(), is_certain);
    let one_thread = format!("{args} --json --threads 1");
    let again = sabaki(&folder, &one_thread).json(0);
    assert_eq!(again["cells"], document["cells"]);
    let told = sabaki(&folder, args).is(0).stdout;
    assert_eq!(told.contains("Capture next"), is_certain);
    assert!(told.contains("ankle"));
}

#[test]
fn coverage_by_time_counts_balls_that_would_hit() {
    let folder = folder();
    let args = "coverage BAKED --by-time --attacks 12 --seed 3";
    let document = sabaki(&folder, &format!("{args} --json")).json(0);
    let rows = document["by_time"].as_array().unwrap();
    let contacts: Vec<f64> = rows.iter().map(|row| number(&row["contact_s"])).collect();
    assert_eq!(contacts, [0.3, 0.4, 0.5, 0.65, 0.8, 1.0, 1.5, 2.0]);
    for row in rows {
        let [avoided, low, high] = ["avoided", "low", "high"].map(|key| number(&row[key]));
        let walking = &row["walking"];
        for key in ["avoided", "low", "high", "walks_on"] {
            assert_eq!(walking[key].is_null(), walking["attacks"] == 0, "{row}");
        }
        let thrown = row["parts_attacks"].as_object().unwrap().values();
        assert_eq!(thrown.map(number).sum::<f64>(), number(&row["attacks"]));
        assert!((1.0..=12.0).contains(&number(&row["attacks"])), "{row}");
        assert!(low <= avoided && avoided <= high && high <= 1.0, "{row}");
        for part in ["head", "chest", "hip", "leg"] {
            let share = row["parts"][part].as_f64();
            assert_eq!(share.is_none(), row["parts_attacks"][part] == 0, "{row}");
            assert!((0.0..=1.0).contains(&share.unwrap_or(0.0)), "{row}");
        }
        let reasons = ["no_plausible_entry", "no_time", "feet", "too_short"];
        let hits: f64 = reasons.iter().map(|why| number(&row["hits"][why])).sum();
        assert_eq!((number(&row["attacks"]) * (1.0 - avoided)).round(), hits);
    }
    let late = number(&rows[7]["avoided"]);
    assert!(late > number(&rows[0]["avoided"]), "{document}");
    let one_thread = format!("{args} --json --threads 1");
    let again = sabaki(&folder, &one_thread).json(0);
    assert_eq!(again["by_time"], document["by_time"]);
    let told = sabaki(&folder, args).is(0).stdout;
    assert!(told.contains("contact after") && told.contains("walking"));
}
