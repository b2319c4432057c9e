use std::fs::File;
use std::io::{BufWriter, IntoInnerError, Result, Write};
use std::path::Path;

/// Writes a file that appears whole or not at all: into a neighbour first, which is on the disk before it takes the file's name. Whoever
/// is killed while writing, or loses power, leaves the old file or the new one, and perhaps the neighbour (`NAME.PROCESS.part`). What is
/// there and no file, as a pipe or a device, is written into instead.
///
/// # Errors
/// What the file system refuses; the neighbour is then removed.
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
        // The first error is the one to report; a part that was never made cannot be removed.
        let _ = std::fs::remove_file(&part);
    }
    written
}

/// Brings a file's new name onto the disk. Where the system does not let folders be opened, it sees to that itself.
fn sync_folder(path: &Path) {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    if let Ok(folder) = File::open(folder.unwrap_or(Path::new("."))) {
        // The file is there, whole, under its name: what cannot be done better is no error.
        let _ = folder.sync_all();
    }
}
