//! Atomic files and folders: written under a temporary name, then renamed.
//!
//! The temporary name begins with a dot and ends in `.part`, so that readers of a folder skip incomplete files.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::TempPath;

/// Suffix of unfinished files.
const PART: &str = ".part";

/// File being written, next to its final path. It is removed unless it is [finished].
///
/// [finished]: Self::finish
pub struct WholeFile {
    to: BufWriter<File>,
    unfinished: Unfinished,
    path: PathBuf,
}

impl WholeFile {
    /// Starts a file in an existing folder. An older file of that name stays until the new file is finished. The new file
    /// gets the permissions of the older one.
    ///
    /// # Errors
    /// An error of the operating system.
    pub fn create(path: &Path) -> io::Result<Self> {
        // A link is resolved, so that its target is replaced and not the link.
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let before = match File::options().append(true).open(&path) {
            Ok(before) => Some(before.metadata()?.permissions()),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            // Without this check, a write-protected file would be replaced, because a rename ignores its permissions.
            Err(error) => return Err(error),
        };
        let unfinished = Unfinished::new(&path);
        let file = File::create(&unfinished.0)?;
        if let Some(permissions) = before {
            file.set_permissions(permissions)?;
        }
        Ok(Self { to: BufWriter::new(file), unfinished, path })
    }

    /// Renames the file to its final name. It replaces a file of this name.
    ///
    /// # Errors
    /// An error of the operating system.
    pub fn finish(mut self) -> io::Result<()> {
        self.to.flush()?;
        fs::rename(&self.unfinished.0, &self.path)
    }

    /// Renames the file to its final name unless a file has this name, even if that appeared only while this one was
    /// written.
    ///
    /// # Errors
    /// [`io::ErrorKind::AlreadyExists`] if a file has this name, or another error of the operating system.
    pub fn finish_new(mut self) -> io::Result<()> {
        self.to.flush()?;
        let part = TempPath::try_from_path(&self.unfinished.0)?;
        match part.persist_noclobber(&self.path) {
            Ok(()) => Ok(()),
            Err(failed) if failed.error.kind() == io::ErrorKind::AlreadyExists => Err(failed.error),
            // Otherwise the file system has neither an exclusive rename nor links, so a file that appears right after this
            // check is replaced.
            Err(failed) if self.path.exists() => Err(failed.error),
            Err(failed) => fs::rename(&failed.path, &self.path),
        }
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.to.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

/// Name of an unfinished file or folder, which is removed on drop.
struct Unfinished(PathBuf);

/// Removes a file, or a folder with its content.
fn remove(path: &Path) {
    // An error is ignored. After success nothing has this name, and after a failure the first error is reported.
    let _ = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
}

/// Unfinished files and folders of this process. No other can be started while they are locked.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn all_unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Unfinished {
    fn new(path: &Path) -> Self {
        let mut name = std::ffi::OsString::from(".");
        name.push(path.file_name().unwrap_or_default());
        name.push(format!(".{}{PART}", std::process::id()));
        let unfinished = path.with_file_name(name);
        all_unfinished().push(unfinished.clone());
        Self(unfinished)
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        remove(&self.0);
        all_unfinished().retain(|path| *path != self.0);
    }
}

/// Removes the unfinished files of this process and exits with this code. No file can be started meanwhile.
pub fn remove_unfinished_and_exit(code: i32) -> ! {
    let unfinished = all_unfinished();
    unfinished.iter().for_each(|path| remove(path));
    std::process::exit(code)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns whether this is the name of an unfinished file.
    fn is_unfinished(path: &Path) -> bool {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with('.') && name.ends_with(PART)
    }

    #[test]
    fn file_appears_when_finished_and_is_removed_otherwise() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.parquet");
        let names = || -> Vec<PathBuf> {
            let entries = fs::read_dir(folder.path()).unwrap();
            entries.map(|entry| entry.unwrap().path()).collect()
        };
        let mut file = WholeFile::create(&path).unwrap();
        file.write_all(b"one").unwrap();
        assert!(names().iter().all(|name| is_unfinished(name)) && names().len() == 1);
        file.finish().unwrap();
        assert_eq!(names(), std::slice::from_ref(&path));
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = || fs::metadata(&path).unwrap().permissions().mode() & 0o777;
            fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
            let mut file = WholeFile::create(&path).unwrap();
            file.write_all(b"one").unwrap();
            file.finish().unwrap();
            assert_eq!(mode(), 0o640);
        }
        let mut file = WholeFile::create(&path).unwrap();
        file.write_all(b"two").unwrap();
        drop(file);
        assert_eq!(names(), std::slice::from_ref(&path));
        assert_eq!(fs::read(&path).unwrap(), b"one");
        assert!(!is_unfinished(&path));
    }

    #[test]
    fn new_file_does_not_replace_one_that_appeared_meanwhile() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.csv");
        let write = |before_the_end: &dyn Fn()| {
            let mut file = WholeFile::create(&path).unwrap();
            file.write_all(b"own").unwrap();
            before_the_end();
            file.finish_new()
        };
        let refused = write(&|| fs::write(&path, "of another program").unwrap()).unwrap_err();
        assert_eq!(refused.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(fs::read(&path).unwrap(), b"of another program");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        write(&|| fs::remove_file(&path).unwrap()).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"own");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
