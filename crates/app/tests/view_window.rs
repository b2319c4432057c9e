//! Promise: a click in the window throws a ball that the fighter dodges; the window can be resized, hidden and closed at any moment,
//! shows what is drawn without a window, and leaves validation nothing to say.
// The screen and the hand are those of X11.
#![cfg(target_os = "linux")]

use sabaki_fixtures::screen;
use sabaki_fixtures::with;

use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;

use sabaki::graph::MotionGraph;
use sabaki_app::window::{
    Click, CrowdScene, DuelScene, Scene, ThrowScene, ThrowSettings, WindowDesc, picture,
};
use sabaki_draw::scene::{Formation, FormationSettings, Outfit};
use sabaki_fixtures::baked::{embedded, embedded_file};
use sabaki_fixtures::demo;
use screen::{Screen, Shown};
use serde_json::Value;

use super::command::run::Png;

const TITLE: &str = "sabaki";
const SIZE: [u32; 2] = [320, 240];

fn program() -> &'static Path {
    Path::new(env!("CARGO_BIN_EXE_sabaki"))
}

#[test]
fn a_click_is_dodged_and_the_window_is_resized_hidden_and_closed() {
    let (screen, folder) = (Screen::new(), tempfile::tempdir().unwrap());
    let mut command = screen.command(program());
    command.current_dir(folder.path());
    let args = "dodge --size 480x320 --plain --cull stencil";
    let mut shown = Shown::start(command, args);
    let opened = shown.wait("opened");
    assert!(opened["device"].as_str().unwrap().contains("llvmpipe"));
    assert_eq!(opened["size"], serde_json::json!([480, 320]));
    let window = screen.window(TITLE);

    screen.click([240, 150]);
    let throw = shown.wait("throw");
    assert_eq!(throw["number"], 1);
    assert_eq!(throw["at_body"], true, "{throw:#}");
    // A second click while the ball is on its way throws none.
    screen.click([240, 150]);
    let answer = shown.wait("answer");
    assert_eq!(answer["number"], 1);
    assert_eq!(answer["cull"], "stencil");
    assert!(answer["query_ms"].as_f64().unwrap() > 0.0);
    let passed = shown.wait("passed");
    assert!(shown.has_heard("ignored"));
    let number = |event: &serde_json::Value, key: &str| event[key].as_f64().unwrap();
    assert!(number(&passed, "pictures") >= 1.0, "{passed:#}");
    // Pictures are moments of the flight: in none of them the ball is nearer than in the whole of it.
    let (nearest, clearance) = (number(&passed, "nearest"), number(&answer, "clearance"));
    assert!(nearest > clearance - 0.005, "{nearest} {clearance}");
    assert_eq!(answer["avoided"], clearance > 0.0);
    screen.hand(&["windowsize", &window, "640", "400"]);
    let resized = shown.wait("resized");
    assert_eq!(resized["size"], serde_json::json!([640, 400]));
    screen.hand(&["windowunmap", &window]);
    std::thread::sleep(std::time::Duration::from_millis(400));
    screen.hand(&["windowmap", &window]);
    screen.focus(&window);
    screen.key("F12");
    let file = shown.wait("screenshot");
    let path = folder.path().join(file["file"].as_str().unwrap());
    let shown_first = Png::read(&path);
    assert_eq!(shown_first.size, [640, 400]);
    assert!(shown_first.colours(0) > 200);
    // Panels, help, pause, step and the other keys.
    for key in ["p", "h", "space", "period", "s", "m", "g", "r"] {
        screen.key(key);
    }
    screen.key("F12");
    let file = shown.wait("screenshot");
    let with_panels = Png::read(&folder.path().join(file["file"].as_str().unwrap()));
    assert!(with_panels.pixels != shown_first.pixels);
    screen.key("Escape");
    let closed = shown.end();
    assert!(number(&closed, "median_frame_ms") > 0.0);
}

#[test]
fn a_window_manager_minimises_the_window_and_closes_it() {
    let folder = tempfile::tempdir().unwrap();
    let screen = Screen::managed(folder.path());
    let mut command = screen.command(program());
    command.current_dir(folder.path());
    let baked = embedded_file(folder.path());
    let args = format!("dodge {} --size 320x240 --plain", baked.display());
    let mut shown = Shown::start(command, &args);
    shown.wait("opened");
    let window = screen.window(TITLE);
    screen.hand(&["windowminimize", &window]);
    shown.wait("hidden");
    screen.hand(&["windowactivate", "--sync", &window]);
    shown.wait("shown");
    screen.key("F12");
    let file = shown.wait("screenshot");
    let path = folder.path().join(file["file"].as_str().unwrap());
    let png = Png::read(&path);
    assert!(png.size == SIZE && png.colours(0) > 200);

    screen.key("alt+F4");
    shown.end();
}

/// The bodies that the command draws fighters with.
fn outfit(graph: &MotionGraph) -> Arc<Outfit> {
    Arc::new(Outfit::human(graph.skeleton(), graph.clips()).unwrap())
}

#[test]
fn what_the_window_shows_is_what_is_drawn_without_one() {
    let (screen, folder) = (Screen::new(), tempfile::tempdir().unwrap());
    let (baked, file) = (embedded(), embedded_file(folder.path()));
    // Before the throw, and while the ball flies by.
    for (frames, name) in [(10u64, "walk.png"), (48, "dodge.png")] {
        let png = folder.path().join(name);
        let args = format!(
            "dodge {} --size 320x240 --plain --step 0.03125 --frames {frames} --click 0.5,0.45,0.5 --screenshot {}",
            file.display(),
            png.display()
        );
        let mut shown = Shown::start(screen.command(program()), &args);
        shown.wait("screenshot");
        assert_eq!(shown.has_heard("throw"), frames > 20);
        assert_eq!(shown.end()["frames"], frames);

        let outfit = outfit(baked.graph());
        let mut scene = ThrowScene::new(baked, Some(outfit), ThrowSettings::default(), 1);
        let click = Click {
            at: [0.5, 0.45],
            seconds: 0.5,
        };
        let mut desc = stepped(0.03125, frames);
        desc.clicks = vec![click];
        assert_same(&png, &mut scene, &desc, name);
    }
}

/// The settings of a window in which every picture is the same in every run.
fn stepped(step: f32, frames: u64) -> WindowDesc {
    WindowDesc {
        size: SIZE,
        validation: true,
        step: Some(step),
        frames: Some(frames),
        ..WindowDesc::default()
    }
}

#[test]
fn a_crowd_marches_past_cameras_posed_into_the_memory_that_is_drawn() {
    let (screen, folder) = (Screen::new(), tempfile::tempdir().unwrap());
    let png = folder.path().join("crowd.png");
    let args = "crowd --count 400 --size 320x240 --plain --step 0.0625 --frames 12 --levels";
    let args = format!("{args} --screenshot {}", png.display());
    let mut shown = Shown::start(screen.command(program()), &args);
    shown.wait("screenshot");
    let closed = shown.end();
    assert_eq!(closed["frames"], 12);
    assert!(closed["median_pose_ms"].as_f64().unwrap() > 0.0);

    let motions = demo::motions().unwrap();
    let clip = motions
        .clips
        .iter()
        .find(|clip| clip.name() == "front_kick");
    let settings = with(|s: &mut FormationSettings| s.count = 400);
    let outfit = Outfit::human(&motions.skeleton, &motions.clips).unwrap();
    let formation = Formation::new(
        &motions.skeleton,
        clip.unwrap(),
        &outfit.skins[0],
        &settings,
    )
    .unwrap();
    let mut scene = CrowdScene::new(formation, Arc::new(outfit));
    scene.tinted = true;
    assert_same(&png, &mut scene, &stepped(0.0625, 12), "crowd");

    // Both cameras, and the keys of the crowd, by hand.
    let args = "crowd --count 300 --size 320x240";
    let mut shown = Shown::start(screen.command(program()), args);
    shown.wait("opened");
    let window = screen.window(TITLE);
    // Beside the panel there is always something of the scene.
    for width in ["1", "320"] {
        screen.hand(&["windowsize", &window, width, "240"]);
        shown.wait("resized");
        std::thread::sleep(std::time::Duration::from_millis(150));
    }
    screen.hand(&["mousemove", "20", "120"]);
    for key in ["c", "c", "l", "t", "h", "Escape"] {
        screen.key(key);
        std::thread::sleep(std::time::Duration::from_millis(150));
    }
    shown.end();
}

#[test]
fn a_duel_in_the_window_is_what_is_fought_and_drawn_without_one() {
    let (screen, folder) = (Screen::new(), tempfile::tempdir().unwrap());
    let png = folder.path().join("duel.png");
    let baked = embedded_file(folder.path());
    let args = format!(
        "duel {} --size 320x240 --plain --step 0.05 --frames 120 --screenshot {}",
        baked.display(),
        png.display()
    );
    let mut shown = Shown::start(screen.command(program()), &args);
    let first = shown.wait("exchange");
    shown.wait("screenshot");
    shown.end();

    let outfit = outfit(embedded().graph());
    let baked = Arc::new(embedded().clone());
    let mut scene = DuelScene::new(baked, Some(outfit), 1).unwrap();
    assert_same(&png, &mut scene, &stepped(0.05, 120), "duel");
    let events = scene.take_events();
    let line = serde_json::to_string(&events[0]).unwrap();
    assert_eq!(serde_json::from_str::<Value>(&line).unwrap(), first);
    assert_eq!(scene.seen().len(), events.len());
}

#[test]
fn without_a_window_system_it_says_so_and_ends_with_2() {
    let mut command = Command::new(program());
    for name in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(name);
    }
    command.args(["view", "crowd", "--count", "10"]);
    // Nor where the one that is named does not answer.
    for display in [None, Some(":12345")] {
        command.envs(display.map(|display| ("DISPLAY", display)));
        let output = command.stdin(Stdio::null()).output().unwrap();
        let words = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{words}");
        assert!(output.stdout.is_empty());
        assert!(words.contains("there is no window system"), "{words}");
        assert!(display.is_some() || words.lines().count() == 1, "{words}");
    }
}

/// Whether a screenshot shows what is drawn without a window, without a word of validation.
fn assert_same(path: &Path, scene: &mut dyn Scene, desc: &WindowDesc, what: &str) {
    let (drawn, heard) = picture(scene, desc).unwrap();
    assert!(heard.is_empty(), "{heard:?}");
    let png = Png::read(path);
    assert_eq!(png.size, SIZE);
    assert!(png.colours(0) > 100, "{what}: {}", png.colours(0));
    let mut same = png.pixels.chunks_exact(3).zip(drawn.chunks_exact(4));
    assert!(same.all(|(one, other)| one == &other[..3]), "{what}");
}
