//! Feet on USB: boards with a serial port of their own.
//!
//! They are found by the name in their descriptors. An update copies a file to the drive of the loader in their chip.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use serial2::SerialPort;
use thiserror::Error;

/// Folder in which Linux names serial ports by the device that has them.
const PORTS: &str = "/dev/serial/by-id";

/// Start of the name of a foot's port: its manufacturer and product.
const FOOT: &str = "usb-footfall_footfall_foot_";

/// Rate that a port has when it is closed to start the loader, Bd.
const LOADER_BAUD: u32 = 1_200;

/// Timeout for the loader to start and the system to mount its drive, and for the foot to return.
const LONGEST: Duration = Duration::from_secs(30);

/// First words of a UF2 file, and its family of chips, the RP2040, at byte 28.
const UF2: [u8; 8] = *b"UF2\nWQ]\x9E";
const RP2040: [u8; 4] = 0xE48B_FF56_u32.to_le_bytes();

/// Reason a foot on USB was not updated.
#[derive(Debug, Error)]
pub enum CopyError {
    /// The foot's port cannot be opened.
    #[error("{0}: {1}")]
    Port(String, io::Error),
    /// The loader was not seen.
    #[error("no drive RPI-RP2 is mounted {waited} s after {0} was asked for it: press the board's button twice, and copy the file to it", waited = LONGEST.as_secs())]
    NoDrive(String),
    /// The file was not written.
    #[error("{}: {}", .0.display(), .1)]
    NotCopied(PathBuf, io::Error),
    /// The foot is not back.
    #[error("the program was copied, but {0} is not back after {waited} s: plug the board in again", waited = LONGEST.as_secs())]
    NotBack(String),
}

/// Returns whether a file is a program that can be copied to the loader of a foot on USB.
#[must_use]
pub fn is_program(bytes: &[u8]) -> bool {
    bytes.starts_with(&UF2) && bytes.get(28..32) == Some(&RP2040)
}

/// Starts the loader of the foot at a port, copies a program to the loader's drive, and waits for the foot.
///
/// # Errors
/// The port, the drive or the foot afterwards is missing, or the copy fails.
pub fn update(port: &str, program: &[u8]) -> Result<(), CopyError> {
    drop(SerialPort::open(port, LOADER_BAUD).map_err(|e| CopyError::Port(port.to_owned(), e))?);
    let drive = wait(|| loader_drive(mounted()));
    let drive = drive.ok_or_else(|| CopyError::NoDrive(port.to_owned()))?;
    copy(&drive, program).map_err(|error| CopyError::NotCopied(drive, error))?;
    wait(|| Path::new(port).exists().then_some(()))
        .ok_or_else(|| CopyError::NotBack(port.to_owned()))
}

fn copy(drive: &Path, program: &[u8]) -> io::Result<()> {
    let mut file = File::create(drive.join("foot.uf2"))?;
    file.write_all(program)?;
    // The loader removes the drive after the last block, so that this may fail.
    let _ = file.sync_all();
    Ok(())
}

/// Polls until there is an answer; `None` after [`LONGEST`].
fn wait<T>(mut answer: impl FnMut() -> Option<T>) -> Option<T> {
    let start = Instant::now();
    loop {
        if let Some(answer) = answer() {
            return Some(answer);
        }
        if start.elapsed() > LONGEST {
            return None;
        }
        thread::sleep(Duration::from_millis(100));
    }
}

/// Folders in which the system has mounted drives.
fn mounted() -> Vec<PathBuf> {
    let mounts = fs::read_to_string("/proc/mounts").unwrap_or_default();
    let linux = mounts
        .lines()
        .filter_map(|line| line.split(' ').nth(1))
        .map(|folder| PathBuf::from(folder.replace("\\040", " ")));
    let volumes = fs::read_dir("/Volumes").into_iter().flatten().flatten();
    linux.chain(volumes.map(|entry| entry.path())).collect()
}

/// The drive of an RP2040's loader, by the file that describes it.
fn loader_drive(folders: Vec<PathBuf>) -> Option<PathBuf> {
    folders.into_iter().find(|folder| {
        let about = fs::read_to_string(folder.join("INFO_UF2.TXT"));
        about.is_ok_and(|about| about.contains("RPI-RP2"))
    })
}

/// Returns the ports of the feet on USB, in the order of their names.
#[must_use]
pub fn foot_ports() -> Vec<String> {
    foot_ports_in(Path::new(PORTS))
}

fn foot_ports_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let is_foot = |path: &PathBuf| {
        let name = path.file_name().and_then(|name| name.to_str());
        name.is_some_and(|name| name.starts_with(FOOT))
    };
    let ports = entries.map(|entry| entry.path()).filter(is_foot);
    let mut ports: Vec<String> = ports.map(|path| path.display().to_string()).collect();
    ports.sort();
    ports
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_is_copied_to_the_drive_of_the_loader() {
        let folder = std::env::temp_dir().join(format!("footfall-drives-{}", std::process::id()));
        let [other, drive] = ["other", "RPI-RP2"].map(|name| {
            let drive = folder.join(name);
            fs::create_dir_all(&drive).expect("a folder");
            let about = format!("UF2 Bootloader v3.0\r\nBoard-ID: {name}\r\n");
            fs::write(drive.join("INFO_UF2.TXT"), about).expect("a file");
            drive
        });
        assert_eq!(loader_drive(vec![folder.clone(), other.clone()]), None);
        assert_eq!(loader_drive(vec![other, drive.clone()]).as_ref(), Some(&drive));
        let mut program = vec![0; 512];
        program[..8].copy_from_slice(&UF2);
        assert!(!is_program(&program), "of no family");
        program[28..32].copy_from_slice(&RP2040);
        assert!(is_program(&program));
        copy(&drive, &program).expect("room");
        assert_eq!(fs::read(drive.join("foot.uf2")).expect("a file"), program);
        fs::remove_dir_all(&folder).expect("removed");
    }

    #[test]
    fn feet_on_usb_are_found_by_their_names() {
        let folder = std::env::temp_dir().join(format!("footfall-usb-{}", std::process::id()));
        assert_eq!(foot_ports_in(&folder), Vec::<String>::new());
        fs::create_dir(&folder).expect("a folder");
        let add = |name: &str| {
            let path = folder.join(name);
            fs::write(&path, "").expect("a file");
            path.display().to_string()
        };
        add("usb-FTDI_FT232R_A1-if00-port0");
        let first = add("usb-footfall_footfall_foot_1C-if00");
        assert_eq!(foot_ports_in(&folder), [first.as_str()]);
        let second = add("usb-footfall_footfall_foot_2C-if00");
        assert_eq!(foot_ports_in(&folder), [first, second]);
        fs::remove_dir_all(&folder).expect("removed");
    }
}
