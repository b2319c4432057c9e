//! Runs the built command, on files that are made once.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use sabaki::anim::{Clip, Event, Skeleton};
use sabaki_fixtures::demo;
use sabaki_import::{EventsFile, bvh};
use serde_json::Value;
use tempfile::TempDir;

/// How the command ended.
pub struct Ended {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Ended {
    /// It ended with `code`, and said nothing on stderr.
    pub fn is(self, code: i32) -> Self {
        assert_eq!(self.code, code, "{}{}", self.stdout, self.stderr);
        assert!(self.stderr.is_empty(), "{}", self.stderr);
        self
    }

    /// It ended with `code` and one JSON document.
    pub fn json(self, code: i32) -> Value {
        serde_json::from_str(&self.is(code).stdout).unwrap()
    }

    /// Its arguments are wrong: it said so, with all of `words`, and did nothing else.
    pub fn is_misused(&self, words: &[&str]) {
        let Self {
            code,
            stdout,
            stderr,
        } = self;
        assert_eq!(*code, 2, "{words:?}: {stdout}{stderr}");
        assert!(stdout.is_empty(), "{words:?}: {stdout}");
        for word in words {
            assert!(stderr.contains(word), "{word:?} is not in: {stderr}");
        }
        assert!(!stderr.contains("panicked"), "{stderr}");
    }

    /// It refused what it was given in one line with all of `words` in it, and did nothing else.
    pub fn is_refused(&self, words: &[&str]) {
        self.is_misused(words);
        let stderr = &self.stderr;
        assert_eq!(stderr.lines().count(), 1, "{words:?}: {stderr}");
        assert!(stderr.starts_with("sabaki: "), "{stderr}");
    }
}

/// The command with these words, of which `CLIPS`, `EVENTS` and `BAKED` stand for the files that are made once, and `FEW` for two of the
/// clips.
pub fn command(folder: impl AsRef<Path>, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sabaki"));
    let line = line.replace("FEW", "CLIPS/bounce.bvh CLIPS/duck.bvh");
    command.args(line.split_whitespace().map(|word| match word {
        "EVENTS" => made().events.clone(),
        "BAKED" => made().baked.clone(),
        word if word.starts_with("CLIPS") => word.replace("CLIPS", &made().clips),
        word => word.to_owned(),
    }));
    command.current_dir(folder).stdin(Stdio::null());
    // Commands of this build share what they bake, and leave the user's folder alone.
    command.env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"));
    command
}

pub fn sabaki(folder: impl AsRef<Path>, line: &str) -> Ended {
    ended(command(&folder, line))
}

pub fn ended(mut command: Command) -> Ended {
    let output = command.output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    Ended {
        code: output.status.code().expect("it was not killed"),
        stdout: text(output.stdout),
        stderr: text(output.stderr),
    }
}

pub fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

pub fn text_of(path: &Path) -> String {
    fs::read_to_string(path).unwrap()
}

/// Writes a file to a folder.
pub fn write(folder: impl AsRef<Path>, name: &str, contents: impl AsRef<[u8]>) {
    fs::write(folder.as_ref().join(name), contents).unwrap();
}

/// Writes a clip as a BVH file.
pub fn write_bvh(path: &Path, skeleton: &Skeleton, clip: &Clip) {
    let mut file = fs::File::create(path).unwrap();
    bvh::write(&mut file, skeleton, clip, 0.01).unwrap();
}

/// A PNG file, by its first picture.
pub struct Png {
    pub size: [u32; 2],
    pub pictures: u32,
    /// Three bytes each.
    pub pixels: Vec<u8>,
}

impl Png {
    pub fn read(path: &Path) -> Self {
        let file = std::io::BufReader::new(fs::File::open(path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let animation = reader.info().animation_control();
        let pictures = animation.map_or(1, |control| control.num_frames);
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        Self {
            size: [info.width, info.height],
            pictures,
            pixels,
        }
    }

    /// How many different colours there are, the last `bits` of each channel left out.
    pub fn colours(&self, bits: u32) -> usize {
        let pixels = self.pixels.chunks_exact(3);
        let mut all: Vec<_> = pixels
            .map(|pixel| [0, 1, 2].map(|at| pixel[at] >> bits))
            .collect();
        all.sort_unstable();
        all.dedup();
        all.len()
    }
}

struct Made {
    clips: String,
    events: String,
    baked: String,
}

/// Embedded motions as files: a few with evasions and a few to walk on with.
fn made() -> &'static Made {
    static MADE: OnceLock<Made> = OnceLock::new();
    MADE.get_or_init(|| {
        // One folder for all runs, since nothing is dropped at a test's end; but clones may share a target folder.
        let clone = Path::new(env!("CARGO_MANIFEST_DIR")).file_name().unwrap();
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("command");
        let folder = folder.join(clone);
        let clips_folder = folder.join("clips");
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&clips_folder).unwrap();
        let motions = demo::motions().unwrap();
        let evades = |clip: usize| motions.events.iter().any(|event| event.clip == clip);
        let all = 0..motions.clips.len();
        let (with, without): (Vec<usize>, Vec<usize>) = all.partition(|&clip| evades(clip));
        let with = with.into_iter().step_by(6);
        let chosen: Vec<usize> = with.chain(without.into_iter().take(4)).collect();
        let named = |&clip: &usize| {
            let mut desc = motions.clips[clip].desc();
            desc.name = format!("{}.bvh", desc.name.replace(' ', "_"));
            Clip::new(&motions.skeleton, desc).unwrap()
        };
        let clips: Vec<Clip> = chosen.iter().map(named).collect();
        let renumbered = |event: &Event| {
            let clip = chosen.iter().position(|&clip| clip == event.clip)?;
            Some(Event {
                clip,
                ..event.clone()
            })
        };
        let events: Vec<Event> = motions.events.iter().filter_map(renumbered).collect();
        for clip in &clips {
            write_bvh(&clips_folder.join(clip.name()), &motions.skeleton, clip);
        }
        let file = EventsFile::of(&events, &clips, &motions.skeleton).unwrap();
        let events = folder.join("events.json");
        fs::write(&events, serde_json::to_vec_pretty(&file).unwrap()).unwrap();
        let text = |path: &Path| path.to_str().unwrap().to_owned();
        let made = Made {
            clips: text(&clips_folder),
            events: text(&events),
            baked: text(&folder.join("made.sabaki")),
        };
        let args = "bake --clips clips --events events.json --out made.sabaki";
        ended(command(&folder, args)).is(0);
        made
    })
}

/// A folder of BVH files, and the events file that goes with it.
pub fn clips() -> (&'static str, &'static str) {
    (&made().clips, &made().events)
}

/// A graph that was baked of them.
pub fn baked() -> &'static str {
    &made().baked
}
