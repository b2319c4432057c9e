use std::fs::File;
use std::io::{BufWriter, Result, Write};
use std::path::Path;

/// Writes a file that appears whole or not at all: into a neighbour first, which then takes its name. What is there and no file, as a pipe or
/// a device, is written into instead.
///
/// # Errors
/// What the file system refuses; the neighbour is then removed.
pub fn write_whole(
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
        file.flush()?;
        drop(file);
        std::fs::rename(&part, path)
    })();
    if written.is_err() {
        // The first error is the one to report; a part that was never made cannot be removed.
        let _ = std::fs::remove_file(&part);
    }
    written
}
