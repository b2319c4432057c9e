//! Plots in files and in letters; colours for terminals alone.

use std::process::Stdio;

use super::assert_is_png;
use super::run::{baked, clips, command, folder, sabaki};

/// What is plotted, each in one way.
fn plots() -> Vec<(Vec<&'static str>, &'static str)> {
    let (clips, events) = clips();
    vec![
        (
            vec![
                "bake", "--clips", clips, "--events", events, "--out", "g.sabaki",
            ],
            "blank where a clip's end is not compared",
        ),
        (
            vec!["annotate", "--clips", clips, "--against", events],
            "Proposed events",
        ),
        (vec!["lod"], "mean energy of the joints"),
        (
            vec!["coverage", baked(), "--attacks", "1"],
            "columns: lead; 1 attack a cell",
        ),
        (vec!["compare", baked(), "--attacks", "6"], "powers of ten"),
    ]
}

/// Shapes and texts inside of one element that states its size, and not a byte for each pixel.
fn assert_is_svg(path: &std::path::Path) {
    let text = std::fs::read_to_string(path).unwrap();
    assert!(text.starts_with("<svg width=") && text.trim_end().ends_with("</svg>"));
    assert!(text.matches("<text").count() > 10, "{}", path.display());
    assert!(text.matches("<rect").count() > 10 || text.contains("<polyline"));
    assert!(text.len() < 4_000_000, "{} bytes", text.len());
}

#[test]
fn every_plot_is_a_picture_or_letters() {
    let folder = folder();
    for (args, words) in plots() {
        let file = [&args[..], &["--plot", "p.png"]].concat();
        let told = sabaki(folder.path(), &file).is(0);
        assert_is_png(&folder.path().join("p.png"));
        assert!(!told.stdout.contains(words), "{args:?}");
        sabaki(folder.path(), &[&args[..], &["--plot", "p.svg"]].concat()).is(0);
        assert_is_svg(&folder.path().join("p.svg"));
        let gif = [&args[..], &["--plot", "p.gif"]].concat();
        let refused = sabaki(folder.path(), &gif);
        assert_eq!(refused.code, 2);
        assert!(
            refused.stderr.contains(".png or .svg"),
            "{}",
            refused.stderr
        );
        let letters = sabaki(folder.path(), &[&args[..], &["--plot", "-"]].concat()).is(0);
        assert!(
            letters.stdout.contains(words),
            "{args:?}\n{}",
            letters.stdout
        );
        let drawn = letters
            .stdout
            .chars()
            .filter(|c| "█▓▒░·●▲■◆".contains(*c))
            .count();
        assert!(drawn > 40, "{args:?}\n{}", letters.stdout);
        assert!(!letters.stdout.contains('\x1b') && !letters.stderr.contains('\x1b'));
        let both = [&args[..], &["--plot", "-", "--json"]].concat();
        sabaki(folder.path(), &both).is_refused(&["--plot", "--json"]);
    }
}

/// All that the command says on a terminal: `script` makes one.
#[cfg(target_os = "linux")]
fn on_a_terminal(args: &[&str], no_color: bool) -> String {
    let folder = folder();
    let inner = command(folder.path(), args);
    let quoted = |word: &std::ffi::OsStr| format!("'{}'", word.to_str().unwrap());
    let words = std::iter::once(inner.get_program()).chain(inner.get_args());
    let line: Vec<String> = words.map(quoted).collect();
    let mut script = std::process::Command::new("script");
    script.args(["-qec", &line.join(" "), "/dev/null"]);
    script
        .current_dir(folder.path())
        .env("TERM", "xterm-256color");
    script.env_remove("NO_COLOR").stdin(Stdio::null());
    if no_color {
        script.env("NO_COLOR", "1");
    }
    String::from_utf8_lossy(&script.output().unwrap().stdout).into_owned()
}

/// Whether a text asks a terminal for colours or weights: ESC [ numbers m.
#[cfg(target_os = "linux")]
fn is_painted(text: &str) -> bool {
    text.split("\x1b[").skip(1).any(|rest| {
        let end = rest.find(|c: char| c.is_ascii_alphabetic());
        end.is_some_and(|end| rest[end..].starts_with('m'))
    })
}

#[cfg(target_os = "linux")]
#[test]
fn colours_are_for_terminals_that_want_them() {
    let args = ["lod", "--plot", "-"];
    assert!(is_painted(&on_a_terminal(&args, false)), "a terminal");
    // Charts, tables, bars of progress; what clap says; what is logged.
    for args in [
        &args[..],
        &["--help"],
        &["lod", "--wrong"],
        &["-vv", "lod", "nowhere.bvh"],
    ] {
        let said = on_a_terminal(args, true);
        assert!(said.len() > 20, "{args:?}: {said:?}");
        assert!(!is_painted(&said), "{args:?}: {said:?}");
    }
}
