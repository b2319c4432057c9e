//! The rules, each a function from what it reads to its complaints: none where the rule is kept.

use super::source::{Source, block_end, name_at, words};

/// Each room, and the rooms that it may use beside itself. A room that is not here has no place
/// yet.
const ARROWS: &[(&str, &[&str])] = &[
    ("math", &[]),
    // Pages, no code.
    ("guide", &[]),
    ("anim", &["math"]),
    ("graph", &["anim", "math"]),
    ("lod", &["anim", "math"]),
    ("region", &["graph", "anim", "math"]),
    ("crowd", &["lod", "anim", "math"]),
    ("avoid", &["region", "graph", "anim", "math"]),
    ("troupe", &["crowd", "lod", "graph", "anim", "math"]),
    (
        "io",
        &["avoid", "crowd", "region", "lod", "graph", "anim", "math"],
    ),
    (
        "gpu",
        &["avoid", "crowd", "region", "lod", "graph", "anim", "math"],
    ),
    (
        "demo",
        &["avoid", "crowd", "region", "lod", "graph", "anim", "math"],
    ),
    (
        "capi",
        &[
            "io", "gpu", "avoid", "crowd", "region", "lod", "graph", "anim", "math",
        ],
    ),
    (
        "view",
        &[
            "io", "gpu", "demo", "avoid", "crowd", "region", "lod", "graph", "anim", "math",
        ],
    ),
];

/// Rooms that may use all others, and that only they may use.
const COMMAND: &str = "cli";

const LONGEST_FILE: usize = 500;

/// What may stand at the top of the repository.
const TOP_LEVEL: &[&str] = &[
    "Cargo.toml",
    "Cargo.lock",
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "deny.toml",
    "LICENSE-APACHE",
    "LICENSE-MIT",
    ".gitignore",
    ".ci",
    "src",
    "shaders",
    "vendor-notes",
    "tests",
    "benches",
    "examples",
];

/// What git and cargo put there: the last three in a published package.
const NOT_OURS: &[&str] = &[
    ".git",
    "target",
    "out",
    "Cargo.toml.orig",
    ".cargo_vcs_info.json",
    ".cargo-ok",
];

/// A room uses what the arrows allow, and names it by its room. Unit tests are held to it as well.
pub(crate) fn arrows(source: &Source) -> Vec<String> {
    let module = source.module();
    let Some(&room) = module.first() else {
        return Vec::new();
    };
    if room == COMMAND {
        return Vec::new();
    }
    let Some((_, may_use)) = ARROWS.iter().find(|(name, _)| *name == room) else {
        return vec![format!(
            "{}: the room `{room}` has no place among the arrows",
            source.path
        )];
    };
    names_from_the_root(source)
        .into_iter()
        .filter(|(_, name)| name != room && !may_use.contains(&name.as_str()))
        .map(|(at, name)| source.complaint(at, &format!("`{room}` may not use `crate::{name}`")))
        .collect()
}

/// The first name of every path that starts at the crate's root, by `crate::` or by enough
/// `super::`.
fn names_from_the_root(source: &Source) -> Vec<(usize, String)> {
    let code = &source.code;
    let mut names = Vec::new();
    for at in words(code, "crate") {
        if let Some(path) = code[at + "crate".len()..].strip_prefix("::") {
            names.extend(first_names(path).into_iter().map(|name| (at, name)));
        }
    }
    for at in words(code, "super").filter(|&at| !code[..at].ends_with("super::")) {
        let path = code[at..].trim_start_matches("super::");
        let steps = (code.len() - at - path.len()) / "super::".len();
        if steps > 0 && steps == source.module().len() + inline_modules_around(code, at) {
            names.extend(first_names(path).into_iter().map(|name| (at, name)));
        }
    }
    names
}

/// `math::Rigid2` names `math`; `{anim::{Clip, Pose}, math}` names `anim` and `math`; `*` names
/// itself.
fn first_names(path: &str) -> Vec<String> {
    let path = path.trim_start();
    if path.starts_with('*') {
        return vec!["*".to_owned()];
    }
    if !path.starts_with('{') {
        return vec![name_at(path).to_owned()];
    }
    let group = &path[..block_end(path, 0)];
    let mut depth = 0;
    let mut names = Vec::new();
    for (at, letter) in group.char_indices() {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if matches!(letter, '{' | ',')
            && depth == 1
            && !group[at + 1..].trim_start().starts_with('}')
        {
            names.extend(first_names(&group[at + 1..]));
        }
    }
    names
}

fn inline_modules_around(code: &str, at: usize) -> usize {
    words(&code[..at], "mod")
        .filter(|&start| {
            let after = &code[start + "mod".len()..];
            let open = start + "mod".len() + after.find(['{', ';']).unwrap_or(0);
            code[open..].starts_with('{') && open < at && at < block_end(code, open)
        })
        .count()
}

/// `ash` and its `vk` stand in gpu/ and view/ alone.
pub(crate) fn device_names(source: &Source) -> Vec<String> {
    if is_under(source, &["src/gpu/", "src/view/"]) {
        return Vec::new();
    }
    let code = &source.code;
    let vk = words(code, "vk").filter(|&at| code[at + 2..].starts_with("::"));
    words(code, "ash")
        .chain(vk)
        .map(|at| source.complaint(at, "Vulkan's names stand in gpu/ and view/ alone"))
        .collect()
}

/// `unsafe` stands in gpu/, in capi/ (what C hands over is a pointer), in the SIMD dispatch file, in the lanes (registers
/// have no safe face), in the crew (nor have threads that outlive what they are lent) and in what of view/ records into a
/// caller's command buffer, as gpu/ does (its scenes are plain data); a block or impl has its SAFETY line, a function its
/// `# Safety`.
pub(crate) fn unsafe_code(source: &Source) -> Vec<String> {
    let code = &source.code;
    let may = is_under(
        source,
        &[
            "src/gpu/",
            "src/capi/",
            "src/math/isa.rs",
            "src/math/lanes/",
            "src/math/crew.rs",
            "src/view/offscreen.rs",
            "src/view/painter.rs",
            "src/view/present/",
            "src/view/stage/",
        ],
    );
    let mut complaints = Vec::new();
    for at in words(code, "unsafe") {
        let after = code[at + "unsafe".len()..].trim_start();
        let (wanted, what) = match unsafe_kind(after) {
            UnsafeKind::Claim => ("SAFETY:", "no SAFETY line above"),
            UnsafeKind::Function => ("# Safety", "no `# Safety` section above"),
            UnsafeKind::Other => ("", ""),
        };
        if !may {
            complaints.push(source.complaint(
                at,
                "`unsafe` stands in gpu/, capi/, math/{isa,lanes,crew} and view/{stage,offscreen,painter,present} alone",
            ));
        } else if !comment_above(source, source.line_of(at)).contains(wanted) {
            complaints.push(source.complaint(at, what));
        }
    }
    complaints
}

enum UnsafeKind {
    /// A block or impl: the writer says that something holds.
    Claim,
    /// A named function: the caller has to see to it.
    Function,
    /// A function pointer's type, a trait, an attribute.
    Other,
}

fn unsafe_kind(after: &str) -> UnsafeKind {
    if after.starts_with('{') || name_at(after) == "impl" {
        return UnsafeKind::Claim;
    }
    // The ABI's name is a text literal, blank by now.
    let function = after.strip_prefix("extern").unwrap_or(after).trim_start();
    match function.strip_prefix("fn ") {
        Some(name) if !name_at(name).is_empty() => UnsafeKind::Function,
        _ => UnsafeKind::Other,
    }
}

/// The comments on the line, and those above it up to the statement before.
fn comment_above(source: &Source, line: usize) -> String {
    let code: Vec<&str> = source.code.lines().collect();
    let comments: Vec<&str> = source.comments.lines().collect();
    let mut text = comments[line - 1].to_owned();
    for above in (0..line - 1).rev() {
        if code[above].trim_end().ends_with([';', '{', '}', ','])
            || comments[above].trim().is_empty() && code[above].trim().is_empty()
        {
            break;
        }
        text.push_str(comments[above]);
    }
    text
}

/// The library answers with errors: it does not unwrap.
pub(crate) fn unwraps(source: &Source) -> Vec<String> {
    let library = &source.library;
    let unwrap = words(library, "unwrap").filter(|&at| library[at..].starts_with("unwrap()"));
    let expect = words(library, "expect").filter(|&at| library[at..].starts_with("expect("));
    unwrap
        .chain(expect)
        .filter(|&at| library[..at].ends_with('.'))
        .map(|at| source.complaint(at, "the library does not unwrap"))
        .collect()
}

/// A file is read in one sitting.
pub(crate) fn length(source: &Source) -> Vec<String> {
    let lines = source.code.lines().count();
    (lines > LONGEST_FILE)
        .then(|| format!("{}: {lines} lines, {LONGEST_FILE} at most", source.path))
        .into_iter()
        .collect()
}

/// A stranger finds a thing where its name says: nothing stands at the top that the layout does not
/// name.
pub(crate) fn top_level(names: &[String]) -> Vec<String> {
    names
        .iter()
        .filter(|name| !TOP_LEVEL.contains(&name.as_str()) && !NOT_OURS.contains(&name.as_str()))
        .map(|name| format!("{name}: the layout has no such place"))
        .collect()
}

/// `NAME.STAGE.glsl` has its `NAME.STAGE.spv`, and the other way round.
pub(crate) fn shaders(glsl: &[String], spirv: &[String]) -> Vec<String> {
    let name = |file: &String| {
        file.trim_end_matches(".glsl")
            .trim_end_matches(".spv")
            .to_owned()
    };
    let sources: Vec<String> = glsl.iter().map(name).collect();
    let compiled: Vec<String> = spirv.iter().map(name).collect();
    let uncompiled = sources.iter().filter(|name| !compiled.contains(name));
    let orphans = compiled.iter().filter(|name| !sources.contains(name));
    uncompiled
        .map(|name| format!("shaders/{name}.glsl has no spirv/{name}.spv"))
        .chain(orphans.map(|name| format!("shaders/spirv/{name}.spv has no {name}.glsl")))
        .collect()
}

/// One file a promise, and the promise stands at its head.
pub(crate) fn promise(path: &str, text: &str) -> Vec<String> {
    let kept = text
        .lines()
        .next()
        .is_some_and(|line| line.starts_with("//! "));
    (!kept)
        .then(|| format!("{path}: the first line is no `//!` promise"))
        .into_iter()
        .collect()
}

fn is_under(source: &Source, places: &[&str]) -> bool {
    places.iter().any(|place| source.path.starts_with(place))
}
