//! Two fighters.

use sabaki_fixtures::baked::embedded_file;
use sabaki_import::read_bvh;

use super::run::{folder, sabaki};

#[test]
fn a_duel_has_the_keys_that_it_promises_and_is_the_same_for_a_seed() {
    let folder = folder();
    let file = embedded_file(folder.path());
    let fight = |motions: &str, seed| {
        let args = format!("duel {motions} --rounds 3 --json --seed {seed} --export played");
        sabaki(&folder, &args).json(0)
    };
    let baked = file.to_str().unwrap();
    let other = fight(baked, 2);
    let document = fight(baked, 1);
    assert!(document["exchanges"] != other["exchanges"], "another seed");
    let unbaked = fight("", 1);
    assert_eq!(document["exchanges"], unbaked["exchanges"]);
    assert_eq!(document["rounds"], 3);
    let exchanges = document["exchanges"].as_array().unwrap();
    assert_eq!(exchanges.len(), 3);
    let mut hits = 0;
    for (index, exchange) in exchanges.iter().enumerate() {
        assert_eq!(exchange["attacker"], ["white", "blue"][index % 2]);
        for key in ["attack", "edge", "announced", "lead", "nearest_at"] {
            assert!(!exchange[key].is_null(), "{key}");
        }
        let clearance = exchange["clearance"].as_f64();
        let is_hit = clearance.is_some_and(|metres| metres < 0.0);
        assert_eq!(exchange["avoided"], !is_hit);
        hits += u64::from(is_hit);
    }
    let score = &document["score"];
    let of =
        |what: &str| score[what]["white"].as_u64().unwrap() + score[what]["blue"].as_u64().unwrap();
    assert_eq!((of("hits"), of("hits") + of("dodges")), (hits, 3));
    // What both played, a frame 60 times a second.
    let seconds = document["seconds"].as_f64().unwrap();
    for name in ["white", "blue"] {
        let file = folder.path().join(format!("played/{name}.bvh"));
        let frames = read_bvh(&file).unwrap().frames();
        assert!((frames as f64 - 60.0 * seconds - 1.0).abs() < 0.5);
    }
}

#[test]
fn a_duel_that_cannot_be_fought_says_why() {
    let folder = folder();
    // There is no walk in these clips, so the characters do not approach.
    let far = sabaki(&folder, "duel BAKED --rounds 1 --apart 6").is(1);
    let words = "ended early: no fighter comes within reach";
    assert!(far.stdout.contains(words), "{}", far.stdout);
}

#[test]
fn a_film_and_a_sheet_are_drawn() {
    let folder = folder();
    let args = "render duel BAKED --apart 0.8 --rounds 1 --size 128x112 --json --out";
    let film = format!("{args} d.gif --rate 5");
    let said = sabaki(&folder, &film).json(0);
    let gif = std::fs::read(folder.path().join("d.gif")).unwrap();
    assert!(gif.starts_with(b"GIF89a"));
    assert_eq!(said["bytes"], gif.len());
    assert!(said["pictures"].as_u64().unwrap() > 6);
    assert_eq!(said["duel"]["rounds"], 1);
    sabaki(&folder, &format!("{args} d.png")).is(0);
    super::assert_is_png(&folder.path().join("d.png"));
    let later = format!("{args} d.png --from 3");
    sabaki(&folder, &later).is_refused(&["no exchange 3"]);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}
