use std::fs::{File, Metadata};
use std::io::{BufWriter, IntoInnerError, Result, Write};
use std::path::{Path, PathBuf};

/// Writes a file atomically: its contents appear completely or not at all. They are first written
/// and synced to a neighbouring file (`NAME.PROCESS.part`), which is then renamed. If the process
/// is killed or the power fails, either the old or the new file remains, and possibly the
/// neighbouring file. If `path` is a symbolic link, the file that it names is written. An existing file keeps its permissions. A target that
/// is not a regular file, for example a pipe or a device, is written directly.
///
/// # Errors
/// An error of the file system. The neighbouring file is removed.
pub fn write_atomically(
    path: &Path,
    contents: impl FnOnce(&mut BufWriter<File>) -> Result<()>,
) -> Result<()> {
    let there = std::fs::metadata(path).ok();
    if there
        .as_ref()
        .is_some_and(|it| !it.is_file() && !it.is_dir())
    {
        let mut file = BufWriter::new(File::options().write(true).open(path)?);
        contents(&mut file)?;
        return file.flush();
    }
    let path = &linked(path);
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(name);
    let written = (|| {
        let file = File::create(&part)?;
        if let Some(there) = there.filter(Metadata::is_file) {
            file.set_permissions(there.permissions())?;
        }
        let mut file = BufWriter::new(file);
        contents(&mut file)?;
        let file = file.into_inner().map_err(IntoInnerError::into_error)?;
        file.sync_all()?;
        drop(file);
        std::fs::rename(&part, path)?;
        sync_folder(path);
        Ok(())
    })();
    if written.is_err() {
        // The first error is reported. The neighbouring file may not exist, so an error of its
        // removal is ignored.
        let _ = std::fs::remove_file(&part);
    }
    written
}

/// Resolves the symbolic links of a path. The file may not exist.
fn linked(path: &Path) -> PathBuf {
    /// Maximum number of links that are followed.
    const MOST: usize = 40;
    let mut path = path.to_owned();
    for _ in 0..MOST {
        let Ok(target) = std::fs::read_link(&path) else {
            break;
        };
        path = path.parent().unwrap_or(Path::new("")).join(target);
    }
    path
}

/// Syncs a folder, so that a renamed file's entry reaches the disk. Systems on which folders cannot
/// be opened do this on their own.
fn sync_folder(path: &Path) {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    if let Ok(folder) = File::open(folder.unwrap_or(Path::new("."))) {
        // The file is complete under its name, so an error here is ignored.
        let _ = folder.sync_all();
    }
}
