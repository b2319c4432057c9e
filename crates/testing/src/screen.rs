//! A virtual screen (Xvfb), simulated input (xdotool), and optionally a window manager (jwm).

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use serde_json::Value;

/// A machine without them fails the test: `.ci/run` installs them.
pub struct Screen {
    server: Child,
    display: String,
    manager: Option<Child>,
}

/// Long enough for a slow machine that is busy with other tests.
const PATIENCE: Duration = Duration::from_secs(240);

impl Screen {
    /// A screen of its own, 1,280 by 800.
    pub fn new() -> Self {
        let mut server = Command::new("Xvfb")
            .args([
                "-displayfd",
                "1",
                "-screen",
                "0",
                "1280x800x24",
                "-nolisten",
                "tcp",
            ])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb (Debian: xvfb)");
        let mut line = String::new();
        let stdout = server.stdout.as_mut().unwrap();
        BufReader::new(stdout).read_line(&mut line).unwrap();
        let display = format!(":{}", line.trim());
        assert!(display.len() > 1, "Xvfb did not start");
        Self {
            server,
            display,
            manager: None,
        }
    }

    /// One whose windows a window manager keeps: Alt and F4 close them. `folder` takes its settings.
    pub fn managed(folder: &Path) -> Self {
        let settings = folder.join("jwmrc");
        let words = r#"<?xml version="1.0"?><JWM><Key mask="A" key="F4">close</Key></JWM>"#;
        std::fs::write(&settings, words).unwrap();
        let mut screen = Self::new();
        let manager = screen
            .command(Path::new("jwm"))
            .arg("-f")
            .arg(settings)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("jwm (Debian: jwm)");
        screen.manager = Some(manager);
        screen
    }

    /// A program that opens a window here.
    pub fn command(&self, program: &Path) -> Command {
        let mut command = Command::new(program);
        command
            .env("DISPLAY", &self.display)
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET");
        command
    }

    /// Simulates input: the arguments of xdotool.
    pub fn hand(&self, words: &[&str]) -> String {
        let output = Command::new("xdotool")
            .args(words)
            .env("DISPLAY", &self.display)
            .output()
            .expect("xdotool (Debian: xdotool)");
        let text = |bytes| String::from_utf8(bytes).unwrap();
        let (said, wrong) = (text(output.stdout), text(output.stderr));
        assert!(output.status.success(), "xdotool {words:?}: {wrong}");
        said.trim().to_owned()
    }

    /// The window whose title is `title`, as xdotool calls it.
    pub fn window(&self, title: &str) -> String {
        let window = self.hand(&["search", "--sync", "--onlyvisible", "--name", title]);
        self.focus(&window);
        window
    }

    /// Keys go there from now on: what a window manager does where there is one.
    pub fn focus(&self, window: &str) {
        self.hand(&["windowfocus", "--sync", window]);
    }

    /// Clicks there.
    pub fn click(&self, [x, y]: [u32; 2]) {
        self.hand(&["mousemove", &x.to_string(), &y.to_string(), "click", "1"]);
    }

    /// Presses a key.
    pub fn key(&self, key: &str) {
        self.hand(&["key", key]);
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        for child in self.manager.iter_mut().chain([&mut self.server]) {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// `sabaki view --json` at work.
pub struct Shown {
    child: Child,
    events: Receiver<Value>,
    heard: Vec<Value>,
}

impl Shown {
    /// Starts it.
    pub fn start(mut command: Command, args: &[&str]) -> Self {
        command.args(["view", "--json", "--validation", "--device", "llvmpipe"]);
        let mut child = command
            .args(args)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let stdout = child.stdout.take().unwrap();
        let (send, events) = channel();
        let read = move |stdout: ChildStdout| {
            for line in BufReader::new(stdout).lines() {
                let line = line.unwrap();
                let event = serde_json::from_str(&line).unwrap_or_else(|_| panic!("{line}"));
                if send.send(event).is_err() {
                    return;
                }
            }
        };
        std::thread::spawn(move || read(stdout));
        Self {
            child,
            events,
            heard: Vec::new(),
        }
    }

    /// The next event of that name; those before it are passed over.
    pub fn wait(&mut self, name: &str) -> Value {
        let until = Instant::now() + PATIENCE;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let event = match self.events.recv_timeout(left) {
                Ok(event) => event,
                Err(error) => {
                    let _ = self.child.kill();
                    let mut words = String::new();
                    let stderr = self.child.stderr.as_mut().unwrap();
                    let _ = stderr.read_to_string(&mut words);
                    panic!("{name}: {error}, after {:?}; {words}", self.heard);
                }
            };
            self.heard.push(event.clone());
            if event["event"] == name {
                return event;
            }
        }
    }

    /// Whether an event of that name has come so far.
    pub fn has_heard(&self, name: &str) -> bool {
        self.heard.iter().any(|event| event["event"] == name)
    }

    /// Waits for the end: the last event, exit code 0, nothing on stderr, and nothing from validation.
    pub fn end(mut self) -> Value {
        let closed = self.wait("closed");
        assert!(
            self.events.recv_timeout(PATIENCE).is_err(),
            "the closing is the last event"
        );
        let output = self.child.wait_with_output().unwrap();
        let words = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(0), "{words}");
        assert!(words.is_empty(), "{words}");
        assert_eq!(closed["validation"], serde_json::json!([]), "{closed:#}");
        closed
    }
}
