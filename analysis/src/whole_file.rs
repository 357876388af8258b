//! Files and folders that are there whole or not at all: written under a name of their own, then renamed.
//!
//! The name begins with a point and ends in `.part`, so that readers of a folder pass over what is not
//! complete.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What names of unfinished files end in.
const PART: &str = ".part";

/// A file that is being written, next to where it belongs. It is removed unless it is [finished].
///
/// [finished]: Self::finish
pub struct WholeFile {
    to: BufWriter<File>,
    unfinished: Unfinished,
    path: PathBuf,
}

impl WholeFile {
    /// Begins a file, in a folder that is there. What has its name stays until it is finished.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn create(path: &Path) -> io::Result<Self> {
        // Where the name is a link, what it points to is replaced, not the link.
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let unfinished = Unfinished::new(&path);
        Ok(Self {
            to: BufWriter::new(File::create(&unfinished.0)?),
            unfinished,
            path,
        })
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn finish(mut self) -> io::Result<()> {
        self.to.flush()?;
        fs::rename(&self.unfinished.0, &self.path)
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

/// A folder that is being filled, next to where it belongs. It is removed with all that is in it unless it is
/// [finished].
///
/// [finished]: Self::finish
pub struct WholeFolder {
    unfinished: Unfinished,
    path: PathBuf,
}

impl WholeFolder {
    /// Begins a folder, in one that is there.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn create(path: &Path) -> io::Result<Self> {
        let unfinished = Unfinished::new(path);
        fs::create_dir(&unfinished.0)?;
        Ok(Self {
            unfinished,
            path: path.to_owned(),
        })
    }

    /// Where it is filled.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.unfinished.0
    }

    /// Gives the folder its name, which nothing else has.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn finish(self) -> io::Result<()> {
        fs::rename(&self.unfinished.0, &self.path)
    }
}

/// The name of an unfinished file or folder, which is removed with it.
struct Unfinished(PathBuf);

/// Removes a file, or a folder with all that is in it.
fn remove(path: &Path) {
    // After success there is nothing under this name. After a failure the first error counts; that
    // nothing could be tidied up adds nothing to it.
    let _ = if path.is_dir() {
        fs::remove_dir_all(path)
    } else {
        fs::remove_file(path)
    };
}

/// Those that there are. Whoever has them locked keeps others from being begun.
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

/// Whether this is the name of an unfinished file, such as a process has left that was killed.
#[must_use]
pub fn is_unfinished(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.starts_with('.') && name.ends_with(PART)
}

/// Removes the unfinished files of this process, and then ends it with this code. Until then no other
/// is begun.
pub fn remove_unfinished_and_exit(code: i32) -> ! {
    let unfinished = all_unfinished();
    unfinished.iter().for_each(|path| remove(path));
    std::process::exit(code)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_its_name_when_it_is_finished_and_is_gone_where_it_is_not() {
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
        let mut file = WholeFile::create(&path).unwrap();
        file.write_all(b"two").unwrap();
        drop(file);
        assert_eq!(names(), std::slice::from_ref(&path));
        assert_eq!(fs::read(&path).unwrap(), b"one");
        assert!(!is_unfinished(&path));
    }

    #[test]
    fn a_folder_has_its_name_when_it_is_finished_and_is_gone_where_it_is_not() {
        let outer = tempfile::tempdir().unwrap();
        let path = outer.path().join("bag");
        for is_finished in [false, true] {
            let folder = WholeFolder::create(&path).unwrap();
            assert!(is_unfinished(folder.path()) && !path.exists());
            fs::write(folder.path().join("x"), b"one").unwrap();
            if is_finished {
                folder.finish().unwrap();
            } else {
                drop(folder);
            }
            assert_eq!(
                fs::read_dir(outer.path()).unwrap().count(),
                usize::from(is_finished)
            );
        }
        assert_eq!(fs::read(path.join("x")).unwrap(), b"one");
    }
}
