//! The folder that answers are written to, which may hold the answers of an earlier run.

use std::path::{Path, PathBuf};

use super::Failure;

/// Whether a file's name is one that [`super::answer_files`] gives: `attack_`, a number of four digits or more, and an ending.
fn is_answer(path: &Path) -> bool {
    let ending = path.extension().and_then(|ending| ending.to_str());
    let stem = path.file_stem().and_then(|stem| stem.to_str());
    let number = stem.and_then(|stem| stem.strip_prefix("attack_"));
    matches!(ending, Some("bvh" | "glb" | "json"))
        && number.is_some_and(|number| {
            number.len() >= 4 && number.bytes().all(|digit| digit.is_ascii_digit())
        })
}

/// Refuses a folder in which answers would take the place of a file to read: the attack file, or another one with the name of an answer.
pub(crate) fn check_holds_no_input(
    folder: &Path,
    attack: Option<&Path>,
    others: &[&Path],
) -> Result<(), Failure> {
    // A folder that is not there yet holds nothing.
    let Ok(place) = folder.canonicalize() else {
        return Ok(());
    };
    // A link lies where it is, and its file where it leads to.
    let lies_in = |path: &Path| {
        let beside = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let folders = [
            beside.canonicalize().ok(),
            path.canonicalize()
                .ok()
                .and_then(|file| file.parent().map(Path::to_owned)),
        ];
        folders.contains(&Some(place.clone()))
    };
    let others = others.iter().copied().filter(|path| is_answer(path));
    match attack.into_iter().chain(others).find(|path| lies_in(path)) {
        None => Ok(()),
        Some(input) => Err(Failure::Usage(format!(
            "--export {}: an input lies in this folder ({}); choose another folder",
            folder.display(),
            input.display()
        ))),
    }
}

/// The files of an earlier run in a folder. They are an error unless they may be removed.
pub(crate) fn earlier(folder: &Path, may_be_removed: bool) -> Result<Vec<PathBuf>, Failure> {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Ok(Vec::new());
    };
    let files = entries.flatten().map(|entry| entry.path());
    let mut earlier: Vec<PathBuf> = files.filter(|path| is_answer(path)).collect();
    earlier.sort();
    match earlier.first() {
        Some(first) if !may_be_removed => Err(Failure::Usage(format!(
            "--export {}: it holds the answers of an earlier run ({} and so on, {} files); choose another folder, or --force removes them",
            folder.display(),
            first.file_name().unwrap_or_default().to_string_lossy(),
            earlier.len()
        ))),
        _ => Ok(earlier),
    }
}

/// Makes the folder, and removes the files of an earlier run.
pub(crate) fn make(folder: &Path, earlier: &[PathBuf]) -> Result<(), Failure> {
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| Failure::Write { path, source }
    };
    std::fs::create_dir_all(folder).map_err(failed(folder))?;
    earlier
        .iter()
        .try_for_each(|path| std::fs::remove_file(path).map_err(failed(path)))
}
