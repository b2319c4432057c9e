use std::fs::File;
use std::io::{BufWriter, IntoInnerError, Result, Write};
use std::path::Path;

/// Writes a file atomically: its contents appear completely or not at all. They are first written
/// and synced to a neighbouring file (`NAME.PROCESS.part`), which is then renamed. If the process
/// is killed or the power fails, either the old or the new file remains, and possibly the
/// neighbouring file. A target that is not a regular file, for example a pipe or a device, is
/// written directly.
///
/// # Errors
/// An error of the file system. The neighbouring file is removed.
pub fn write_atomically(
    path: &Path,
    contents: impl FnOnce(&mut BufWriter<File>) -> Result<()>,
) -> Result<()> {
    if std::fs::metadata(path).is_ok_and(|there| !there.is_file() && !there.is_dir()) {
        let mut file = BufWriter::new(File::options().write(true).open(path)?);
        contents(&mut file)?;
        return file.flush();
    }
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(name);
    let written = (|| {
        let mut file = BufWriter::new(File::create(&part)?);
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
