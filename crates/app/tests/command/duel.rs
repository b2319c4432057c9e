//! Two fighters.

use sabaki_fixtures::baked::embedded_file;

use super::run::{baked, folder, sabaki};
use super::without_times;

#[test]
fn a_duel_has_the_keys_that_it_promises_and_is_the_same_for_a_seed() {
    let folder = folder();
    let file = embedded_file(folder.path());
    let args = ["--rounds", "3", "--json", "--seed"];
    let fight = |motions: &[&str], seed, threads| {
        let more = [seed, "--threads", threads];
        let args = [&["duel"], motions, &args, &more].concat();
        let mut document = sabaki(folder.path(), &args).json(0);
        document["attack_grid"]["build_seconds"] = serde_json::Value::Null;
        without_times(document)
    };
    let baked = [file.to_str().unwrap()];
    let document = fight(&baked, "1", "1");
    assert_eq!(document, fight(&baked, "1", "3"), "any number of threads");
    assert!(document != fight(&baked, "2", "1"), "another seed");
    let unbaked = fight(&[], "1", "1");
    assert_eq!(
        document["exchanges"], unbaked["exchanges"],
        "without a file"
    );
    assert_eq!(document["rounds"], 3);
    let exchanges = document["exchanges"].as_array().unwrap();
    assert_eq!(exchanges.len(), 3);
    let mut hits = 0;
    for (index, exchange) in exchanges.iter().enumerate() {
        assert_eq!(exchange["attacker"], ["white", "blue"][index % 2]);
        for key in [
            "attack",
            "path",
            "announced",
            "lead",
            "candidates",
            "clearance",
            "source",
        ] {
            assert!(!exchange[key].is_null(), "{key}");
        }
        let clearance = exchange["clearance"].as_f64().unwrap();
        assert_eq!(exchange["avoided"], clearance >= 0.0);
        assert!(exchange["clearance_without"].as_f64().unwrap() < 0.0);
        hits += u64::from(clearance < 0.0);
    }
    let score = &document["score"];
    let of =
        |what: &str| score[what]["white"].as_u64().unwrap() + score[what]["blue"].as_u64().unwrap();
    assert_eq!((of("hits"), of("hits") + of("dodges")), (hits, 3));
    assert!(document["attack_grid"]["size"]["blows"].as_u64().unwrap() > 1000);
}

#[test]
fn a_duel_that_cannot_be_fought_says_why() {
    let folder = folder();
    let none = sabaki(folder.path(), &["duel", "--rounds", "0"]);
    assert_eq!(none.code, 2);
    let apart = sabaki(folder.path(), &["duel", baked(), "--apart", "nan"]);
    apart.is_refused(&["--apart NaN"]);
    // What is wrong with the film is said before the graph is looked for.
    let film = |more: &[&str], words: &[&str]| {
        let args = [&["duel", "no_such.sabaki", "--rounds", "2"], more].concat();
        sabaki(folder.path(), &args).is_refused(words);
    };
    film(
        &["--out", "a.gif", "--from", "3"],
        &["--from 3", "--rounds is 2"],
    );
    film(&["--out", "no/a.gif"], &["--out no/a.gif", "no folder no"]);
    film(&["--mesh", "capsules"], &["--mesh needs --out"]);
    // There is no walk in these clips, so the characters do not approach.
    let far = sabaki(folder.path(), &["duel", baked(), "--rounds", "1"]).is(1);
    assert!(
        far.stdout
            .contains("ended early: nobody comes within reach"),
        "{}",
        far.stdout
    );
}

#[test]
fn a_film_and_a_sheet_are_drawn() {
    let folder = folder();
    let args = [
        "duel",
        baked(),
        "--apart",
        "0.8",
        "--rounds",
        "1",
        "--size",
        "128x112",
        "--json",
        "--out",
    ];
    let film = [&args[..], &["d.gif", "--rate", "5"]].concat();
    let said = sabaki(folder.path(), &film).json(0);
    let gif = std::fs::read(folder.path().join("d.gif")).unwrap();
    assert!(gif.starts_with(b"GIF89a"));
    assert_eq!(said["film"]["bytes"], gif.len());
    assert!(said["film"]["pictures"].as_u64().unwrap() > 6);
    sabaki(folder.path(), &[&args[..], &["d.png"]].concat()).is(0);
    super::assert_is_png(&folder.path().join("d.png"));
    sabaki(folder.path(), &[&args[..], &["d.bmp"]].concat()).is_refused(&[".png"]);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}
