//! Pictures without a window.

use std::collections::BTreeMap;
use std::fs;

use sabaki::anim::{Clip, Skeleton};
use sabaki_fixtures::clips::changed;
use sabaki_fixtures::demo;
use sabaki_import::gltf;

use super::run::{Png, folder, sabaki, write};

fn dodge(out: &str, more: &str) -> String {
    format!("render dodge BAKED --size 96x64 --out {out} {more}")
}

#[test]
fn a_moment_is_the_same_picture_each_time_and_maps_show_in_it() {
    let folder = folder();
    let told = sabaki(&folder, &dodge("a.png", "--validation")).is(0);
    assert!(told.stdout.contains("nearest at") && told.stdout.contains("a.png"));
    sabaki(&folder, &dodge("b.png", "")).is(0);
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(read("a.png") == read("b.png"), "the same moment");
    let plain = Png::read(&folder.path().join("a.png"));
    assert_eq!((plain.size, plain.pictures), ([96, 64], 1));
    assert!(plain.colours(2) > 60, "{} colours", plain.colours(2));
    sabaki(&folder, &dodge("c.png", "--at 0.1")).is(0);
    assert!(read("a.png") != read("c.png"), "another moment");
    // Where the answer only moves there are no maps to show.
    let shows = |index: i32| {
        sabaki(&folder, &dodge("m.png", &format!("--maps --index {index}"))).is(0);
        sabaki(&folder, &dodge("n.png", &format!("--index {index}"))).is(0);
        read("m.png") != read("n.png")
    };
    assert!((1..7).any(shows));
}

#[test]
fn a_film_has_many_pictures_and_a_storyboard_eight() {
    let folder = folder();
    let more = "--rate 5 --json";
    let said = sabaki(&folder, &dodge("d.apng", more)).json(0);
    let Png { size, pictures, .. } = Png::read(&folder.path().join("d.apng"));
    assert_eq!(size, [96, 64]);
    assert_eq!(said["pictures"], pictures);
    assert!(pictures > 8, "{pictures}");
    let bytes = fs::metadata(folder.path().join("d.apng")).unwrap().len();
    assert_eq!(said["bytes"], bytes);
    sabaki(&folder, &dodge("d.gif", "--rate 5")).is(0);
    let gif = fs::read(folder.path().join("d.gif")).unwrap();
    assert!(gif.starts_with(b"GIF89a") && gif.ends_with(b"\x3b"));
    sabaki(&folder, &dodge("s.png", "--storyboard")).is(0);
    let [width, height] = Png::read(&folder.path().join("s.png")).size;
    assert!(width > 4 * 96 && height > 2 * 64, "{width} x {height}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
}

#[test]
fn the_device_draws_the_maps_of_an_answer_and_counts_what_they_share() {
    let folder = folder();
    let drawn = |index: i32| {
        let args = format!("render maps BAKED --out m.png --index {index} --json");
        let said = sabaki(&folder, &args);
        let said = (said.code == 0).then(|| said.json(0))?;
        let is_chosen = said["is_chosen"] == true;
        // What was chosen is not hit.
        assert!(!is_chosen || said["body"] == 0, "{said}");
        said["evasion"].as_u64()
    };
    assert!((0..6).filter_map(drawn).any(|evasion| evasion > 0));
    super::assert_is_png(&folder.path().join("m.png"));
}

#[test]
fn an_attack_file_shows_its_first_attack() {
    let folder = folder();
    let attack = r#"{"attacks":[{"spheres":[{"t":0.5,"center":[0,1,0],"radius":0.1}]}]}"#;
    write(&folder, "one.json", attack);
    let of_file = "--attack one.json --mesh capsules";
    sabaki(&folder, &dodge("a.png", of_file)).is(0);
    let second = format!("{of_file} --index 1");
    sabaki(&folder, &dodge("b.png", &second)).is_refused(&["one.json", "no attack 1"]);
}

#[test]
fn a_crowd_is_drawn_in_its_own_colours_or_in_those_of_its_levels() {
    let folder = folder();
    let args = "render crowd --count 200 --size 192x128 --out";
    let said = sabaki(&folder, &format!("{args} a.png --json")).json(0);
    assert_eq!(said["characters"], 200);
    let levels = said["levels"].as_array().unwrap();
    let all: u64 = levels.iter().map(|count| count.as_u64().unwrap()).sum();
    assert_eq!(all, 200);
    assert!(levels[0].as_u64().unwrap() < 200, "levels go by distance");
    let whole = format!("{args} b.png --no-levels --json");
    assert_eq!(sabaki(&folder, &whole).json(0)["levels"][0], 200);
    sabaki(&folder, &format!("{args} c.png --levels")).is(0);
    let one = "render crowd --count 1 --size 32x32 --out";
    let said = sabaki(&folder, &format!("{one} d.png")).is(0);
    assert!(said.stdout.contains("1 character;"), "{}", said.stdout);
    let pixels = |name: &str| Png::read(&folder.path().join(name)).pixels;
    // Levels show as reds, yellows, greens and blues, of which clothes and skin have none.
    let vivid = |pixels: &[u8]| {
        let spread = |pixel: &&[u8]| pixel.iter().max().unwrap() - pixel.iter().min().unwrap() > 70;
        pixels.chunks_exact(3).filter(spread).count()
    };
    let (own, levels) = (vivid(&pixels("a.png")), vivid(&pixels("c.png")));
    assert!(levels > own + 100, "{own} {levels}");
}

#[test]
fn meshes_of_files_are_bound_by_names_or_by_a_map() {
    let folder = folder();
    let write_glb = |name: &str, skeleton: &Skeleton, clip: &Clip| {
        let mut bytes = Vec::new();
        gltf::write(&mut bytes, skeleton, std::slice::from_ref(clip), &[]).unwrap();
        write(&folder, name, bytes);
    };
    let motions = demo::motions().unwrap();
    write_glb("own.glb", &motions.skeleton, &motions.clips[0]);
    // The same figure with names that are no one's.
    let mut name = "bone ".to_owned();
    let other = changed(&motions.skeleton, |joint| {
        name.push('i');
        joint.name.clone_from(&name);
    });
    write_glb("other.glb", &other, &motions.clips[0]);
    let json = |out: &str, more: &str| {
        let more = format!("--json --validation {more}");
        sabaki(&folder, &dodge(out, &more)).json(0)
    };
    let own = json("own.png", "--mesh own.glb");
    assert_eq!(own["mesh"]["exact"], true);
    assert_eq!(own["mesh"]["not_bound"], serde_json::json!([]));
    let refused = |args: &str, word: &str| {
        sabaki(&folder, &dodge("x.png", args)).is_refused(&[word]);
    };
    refused("--mesh other.glb", "at least 2");
    let names: Vec<(String, String)> = other
        .joints()
        .iter()
        .zip(motions.skeleton.joints())
        .filter(|(_, joint)| !joint.name.ends_with("_End") && joint.name != "Neck")
        .map(|(own, joint)| (own.name.clone(), joint.name.clone()))
        .collect();
    let map = |names: &[(String, String)]| {
        let map: BTreeMap<_, _> = names.iter().cloned().collect();
        write(&folder, "map.json", serde_json::to_vec(&map).unwrap());
    };
    map(&names);
    let mapped = "--mesh other.glb --map map.json";
    let said = json("mapped.png", mapped);
    let unbound = said["mesh"]["not_bound"].as_array().unwrap().len();
    assert_eq!(unbound + names.len(), motions.skeleton.len());
    assert!(unbound > 0);
    let said = sabaki(&folder, &dodge("mapped.png", mapped)).is(0);
    assert!(said.stdout.contains("not bound: "), "{}", said.stdout);
    map(&[("bone i".to_owned(), "Tail".to_owned())]);
    refused(mapped, "Tail");
    map(&[("Tail".to_owned(), "Hips".to_owned())]);
    refused(mapped, "Tail");
    refused("--mesh missing.glb", "missing.glb");
    // Capsules, a body and bones are different pictures.
    json("body.png", "");
    json("capsules.png", "--mesh capsules");
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(read("body.png") != read("capsules.png") && read("own.png") != read("body.png"));
}

#[test]
fn the_first_picture_has_its_text() {
    let folder = folder();
    // A moment long before the ball comes near: the time is the only text.
    let at = "--at 0.01";
    sabaki(&folder, &dodge("a.png", at)).is(0);
    sabaki(folder.path(), &dodge("b.png", &format!("{at} --plain"))).is(0);
    let pixels = |name: &str| Png::read(&folder.path().join(name)).pixels;
    let (written, plain) = (pixels("a.png"), pixels("b.png"));
    let differ = written.chunks_exact(3).zip(plain.chunks_exact(3));
    let differ = differ.filter(|(a, b)| a != b).count();
    assert!((30..1500).contains(&differ), "{differ} pixels differ");
}

#[test]
fn a_graph_keeps_the_mesh_of_its_character() {
    let folder = folder();
    let glb = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../import/tests/corpus/cases/mesh_vcol.glb"
    );
    let bake = format!("{glb} --threshold 0.5");
    sabaki(&folder, &format!("bake {bake} --out hero.sabaki")).is(0);
    // Its vertices are red.
    let is_red = |pixel: &[u8]| pixel[0] > 90 && pixel[0] / 2 > pixel[1].max(pixel[2]);
    let reds = |scene: &str| {
        sabaki(
            &folder,
            &format!("render {scene} --size 160x120 --out a.png"),
        )
        .is(0);
        let picture = Png::read(&folder.path().join("a.png"));
        picture
            .pixels
            .chunks_exact(3)
            .filter(|pixel| is_red(pixel))
            .count()
    };
    for scene in ["crowd --count 3", "dodge"] {
        assert!(reds(&format!("{scene} hero.sabaki")) > 50, "{scene}");
    }
    assert_eq!(reds("crowd --count 3 hero.sabaki --mesh body"), 0);
    // Bakes in steps keep it too.
    sabaki(&folder, &format!("bake plan {bake} --shards 1 --out plan")).is(0);
    for _ in 0..2 {
        sabaki(&folder, "bake shard plan 0").is(0);
    }
    sabaki(&folder, "bake join plan --out joined.sabaki").is(0);
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(read("joined.sabaki") == read("hero.sabaki"));
}
