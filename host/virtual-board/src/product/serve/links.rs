//! Links with stable names to the terminals, and sockets in lock step, removed when the program ends.

use std::fs;
use std::io::{self, ErrorKind};
use std::os::unix::fs::{FileTypeExt as _, MetadataExt as _, symlink};
use std::os::unix::net::UnixListener;
use std::path::{Path, PathBuf};

use super::ServeError;

/// Links and sockets that are removed on drop.
#[derive(Debug, Default)]
pub struct Links {
    /// Paths and targets of links.
    links: Vec<(PathBuf, PathBuf)>,
    /// Paths of sockets, and their inodes.
    sockets: Vec<(PathBuf, u64)>,
}

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
        self.links.push((path.clone(), target.to_owned()));
        Ok(path)
    }

    /// Creates a socket in a directory, in the same way as a link.
    ///
    /// # Errors
    /// If the socket cannot be created.
    pub fn add_socket(
        &mut self,
        folder: &Path,
        name: &str,
    ) -> Result<(PathBuf, UnixListener), ServeError> {
        let path = folder.join(name);
        let made = fs::create_dir_all(folder)
            .and_then(|()| remove(&path))
            .and_then(|()| UnixListener::bind(&path))
            .and_then(|listener| Ok((listener, fs::symlink_metadata(&path)?.ino())));
        let (listener, inode) = made.map_err(|error| ServeError::Link(path.clone(), error))?;
        self.sockets.push((path.clone(), inode));
        Ok((path, listener))
    }
}

/// Removes a link or a socket, if any.
fn remove(path: &Path) -> io::Result<()> {
    match fs::symlink_metadata(path) {
        Ok(found) if found.is_symlink() || found.file_type().is_socket() => fs::remove_file(path),
        Ok(_) => Err(ErrorKind::AlreadyExists.into()),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        Err(error) => Err(error),
    }
}

impl Drop for Links {
    fn drop(&mut self) {
        for (path, target) in &self.links {
            // Another program may have removed it, or replaced it by its own.
            if fs::read_link(path).is_ok_and(|found| found == *target) {
                let _ = remove(path);
            }
        }
        for (path, inode) in &self.sockets {
            if fs::symlink_metadata(path).is_ok_and(|found| found.ino() == *inode) {
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
        links.add(&folder, "FL.uart", Path::new("/dev/zero")).expect("another");
        assert_eq!(fs::read_link(&path).expect("a link"), Path::new("/dev/zero"));
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
        let mut sockets = Links::default();
        let (path, _listener) = sockets.add_socket(&folder, "FL.uart").expect("a socket");
        assert!(path.exists());
        drop(sockets);
        assert!(!path.exists());
        fs::remove_dir_all(&folder).expect("removed");
    }
}
