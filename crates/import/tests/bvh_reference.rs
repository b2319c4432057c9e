//! Joint positions of real captures equal those of an independent reader, and the unit of every file is found.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DVec3;
use sabaki::anim::{Clip, Event, EventKind, Pose};
use sabaki_fixtures::captures::mocap;
use sabaki_fixtures::clips::{clips_apart, joints_at};
use sabaki_import::{
    ChannelFile, EventsFile, LoadedClip, ReadOptions, ScaleSource, read_bvh, read_clip, read_clips,
    stature,
};

fn bvh_files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = ["fight", "walk", "dialects"]
        .iter()
        .flat_map(|sub| std::fs::read_dir(folder.join(sub)).unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "bvh"))
        .collect();
    files.sort();
    assert!(files.len() > 60);
    files
}

/// File, then frame, then joint and place.
type Reference = BTreeMap<String, BTreeMap<usize, Vec<(String, DVec3)>>>;

fn reference(folder: &Path) -> Reference {
    let text = std::fs::read_to_string(folder.join("reference-positions.csv")).unwrap();
    let mut reference = Reference::new();
    for line in text.lines().skip(1) {
        // A joint's name may hold commas, the other fields cannot.
        let mut from_end = line.rsplitn(4, ',');
        let [z, y, x] = [(); 3].map(|()| from_end.next().unwrap().parse().unwrap());
        let mut from_start = from_end.next().unwrap().splitn(3, ',');
        let [file, frame, joint] = [(); 3].map(|()| from_start.next().unwrap());
        reference
            .entry(file.to_owned())
            .or_default()
            .entry(frame.parse().unwrap())
            .or_default()
            .push((joint.to_owned(), DVec3::new(x, y, z)));
    }
    reference
}

/// Largest distance from the reference, and the size of the figure, in the file's unit.
fn largest_difference(
    file: &ChannelFile,
    frames: &BTreeMap<usize, Vec<(String, DVec3)>>,
) -> (f64, f64) {
    let (skeleton, clip) = file.motion("reference", 1.0).unwrap();
    assert!(frames.contains_key(&0) && frames.contains_key(&(clip.frames() - 1)));
    let (mut largest, mut far) = (0.0_f64, 0.0_f64);
    for (&frame, places) in frames {
        let joints = joints_at(&skeleton, &clip, frame);
        for (name, expected) in places {
            let id = skeleton.find(name).unwrap_or_else(|| panic!("{name}"));
            let found = joints[id.index()].translation.as_dvec3();
            largest = largest.max(found.distance(*expected));
            far = far.max(expected.length());
        }
    }
    (largest, far)
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn positions_are_those_of_an_independent_reader() {
    let folder = mocap("");
    let reference = reference(&folder);
    assert_eq!(reference.len(), bvh_files(&folder).len());
    for (name, frames) in &reference {
        let file = read_bvh(&folder.join(name)).unwrap();
        let (difference, far) = largest_difference(&file, frames);
        // Single precision along a dozen bones; the reference has five decimals.
        let tolerance = 2e-5 + 2e-6 * far;
        assert!(difference < tolerance, "{name}: {difference} > {tolerance}");
    }
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn every_file_is_a_person_high_in_the_unit_that_is_found() {
    let folder = mocap("");
    for path in bvh_files(&folder) {
        let loaded = read_clip(&path, &ReadOptions::default()).unwrap();
        let mut pose = Pose::default();
        loaded.clip.pose(0, &mut pose);
        let metres = stature(&loaded.skeleton, &pose);
        assert!((1.2..2.3).contains(&metres), "{}: {metres}", path.display());
    }
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn units_of_known_captures_are_found() {
    use sabaki_import::LengthUnit::{Centimetre, Cmu, Decimetre, Inch};
    let folder = mocap("");
    let known = [
        ("fight/Male2_E1_JabLeft.bvh", Centimetre),
        ("walk/walk-03-sneak-yokoyama.bvh", Centimetre),
        ("walk/fighting-01-provocation-takiguchi.bvh", Inch),
        ("walk/cmu_12_01_walk.bvh", Cmu),
        ("walk/02_01.bvh", Centimetre),
        ("dialects/131_01.bvh", Cmu),
        ("dialects/tpose.bvh", Decimetre),
        ("dialects/test_freebvh.bvh", Centimetre),
        ("dialects/Brekel_03_11_2016_15_47_42_body1.bvh", Centimetre),
    ];
    for (name, unit) in known {
        let read = read_clip(&folder.join(name), &ReadOptions::default()).unwrap();
        assert_eq!(read.scale.found, ScaleSource::Unit(unit), "{name}");
    }
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn the_fight_clips_are_one_set_with_their_events() {
    let folder = mocap("");
    let fight = folder.join("fight");
    let events = fight.join("events.json");
    let set = read_clips(&[fight], Some(&events), &ReadOptions::default()).unwrap();
    assert_eq!(set.clips.len(), 53);
    assert_eq!(set.skeleton.len(), 27);
    assert_eq!(set.warnings, Vec::<String>::new());
    let seconds: f64 = set.clips.iter().map(Clip::duration).sum();
    assert!((195.0..215.0).contains(&seconds), "{seconds}");
    let is_evasion = |event: &&Event| event.kind == EventKind::Evasion;
    assert_eq!(set.events.iter().filter(is_evasion).count(), 8);
    assert!(set.scales.iter().all(|scale| scale.metres_per_unit == 0.01));
    let again = EventsFile::of(&set.events, &set.clips, &set.skeleton).unwrap();
    let resolved = again.resolve(&set.clips, &set.skeleton);
    assert_eq!(resolved.unwrap(), set.events);
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn what_is_written_again_is_where_it_was() {
    let folder = mocap("");
    for path in bvh_files(&folder) {
        let LoadedClip {
            skeleton,
            clip,
            scale,
            ..
        } = read_clip(&path, &ReadOptions::default()).unwrap();
        let mut text = Vec::new();
        sabaki_import::bvh::write(&mut text, &skeleton, &clip, scale.metres_per_unit).unwrap();
        let file = sabaki_import::bvh::parse(&text).unwrap();
        let (skeleton_again, again) = file.motion(clip.name(), scale.metres_per_unit).unwrap();
        assert_eq!(skeleton.differences(&skeleton_again), Vec::<String>::new());
        let moved = clips_apart((&skeleton, &clip), (&skeleton_again, &again));
        assert!(moved < 1e-5, "{}: {moved} m", path.display());
    }
}
