//! Links with stable names to the terminals, removed when the program ends.

use std::fs;
use std::io::{self, ErrorKind};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use super::ServeError;

/// Links that are removed on drop: their paths and targets.
#[derive(Debug, Default)]
pub struct Links(Vec<(PathBuf, PathBuf)>);

impl Links {
    /// Creates a link in a directory, which is created if missing. An existing link is replaced, an existing file
    /// is not.
    ///
    /// # Errors
    /// If the link cannot be created.
    pub fn add(&mut self, folder: &Path, name: &str, target: &Path) -> Result<PathBuf, ServeError> {
        let path = folder.join(name);
        let made = fs::create_dir_all(folder)
            .and_then(|()| remove(&path))
            .and_then(|()| symlink(target, &path));
        made.map_err(|error| ServeError::Link(path.clone(), error))?;
        self.0.push((path.clone(), target.to_owned()));
        Ok(path)
    }
}

/// Removes a link, if any.
fn remove(path: &Path) -> io::Result<()> {
    match fs::symlink_metadata(path) {
        Ok(found) if found.is_symlink() => fs::remove_file(path),
        Ok(_) => Err(ErrorKind::AlreadyExists.into()),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        Err(error) => Err(error),
    }
}

impl Drop for Links {
    fn drop(&mut self) {
        for (path, target) in &self.0 {
            // Another program may have removed it, or replaced it by its own.
            if fs::read_link(path).is_ok_and(|found| found == *target) {
                let _ = remove(path);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_replaces_a_link_but_no_file_and_is_removed() {
        let folder = std::env::temp_dir().join(format!("footfall-links-{}", std::process::id()));
        let mut links = Links::default();
        let path = links.add(&folder, "FL.uart", Path::new("/dev/null"));
        let path = path.expect("a link");
        links
            .add(&folder, "FL.uart", Path::new("/dev/zero"))
            .expect("another");
        assert_eq!(
            fs::read_link(&path).expect("a link"),
            Path::new("/dev/zero")
        );
        fs::write(folder.join("file"), "x").expect("a file");
        let error = links.add(&folder, "file", Path::new("/dev/null"));
        assert!(error.is_err_and(|error| error.to_string().contains("file")));
        drop(links);
        assert!(fs::symlink_metadata(&path).is_err());
        let mut links = Links::default();
        let path = links.add(&folder, "FL.uart", Path::new("/dev/null"));
        let path = path.expect("a link");
        let mut of_another = Links::default();
        let taken = of_another.add(&folder, "FL.uart", Path::new("/dev/zero"));
        assert!(taken.is_ok());
        drop(links);
        assert!(fs::symlink_metadata(&path).is_ok(), "it is of another now");
        drop(of_another);
        fs::remove_dir_all(&folder).expect("removed");
    }
}
