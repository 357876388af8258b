//! Feet on USB: boards that are a serial port by themselves, found by the name in their descriptors.

use std::fs;
use std::path::{Path, PathBuf};

use crate::source::SourceError;

/// Folder in which Linux names serial ports by the device that has them.
const PORTS: &str = "/dev/serial/by-id";

/// Start of the name of a foot's port: its manufacturer and product.
const FOOT: &str = "usb-footfall_footfall_foot_";

/// Returns the port of the foot on USB.
///
/// # Errors
/// There is none, or more than one.
pub fn only_foot() -> Result<String, SourceError> {
    only_foot_in(Path::new(PORTS))
}

fn only_foot_in(folder: &Path) -> Result<String, SourceError> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let is_foot = |path: &PathBuf| {
        let name = path.file_name().and_then(|name| name.to_str());
        name.is_some_and(|name| name.starts_with(FOOT))
    };
    let ports = entries.map(|entry| entry.path()).filter(is_foot);
    let mut ports: Vec<String> = ports.map(|path| path.display().to_string()).collect();
    ports.sort();
    match ports.as_slice() {
        [port] => Ok(port.clone()),
        [] => Err(SourceError::NoneOnUsb),
        _ => Err(SourceError::SeveralOnUsb(ports.join(", uart:"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_foot_on_usb_is_found_by_its_name() {
        let folder = std::env::temp_dir().join(format!("footfall-usb-{}", std::process::id()));
        assert_eq!(only_foot_in(&folder), Err(SourceError::NoneOnUsb));
        fs::create_dir(&folder).expect("a folder");
        let add = |name: &str| {
            let path = folder.join(name);
            fs::write(&path, "").expect("a file");
            path.display().to_string()
        };
        add("usb-FTDI_FT232R_A1-if00-port0");
        let first = add("usb-footfall_footfall_foot_1C-if00");
        assert_eq!(only_foot_in(&folder).as_ref(), Ok(&first));
        let second = add("usb-footfall_footfall_foot_2C-if00");
        let both = SourceError::SeveralOnUsb(format!("{first}, uart:{second}"));
        assert_eq!(only_foot_in(&folder), Err(both));
        fs::remove_dir_all(&folder).expect("removed");
    }
}
