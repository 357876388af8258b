//! Feet on USB: boards with a serial port of their own.
//!
//! They are found by the names in their descriptors. An update copies a file to the drive of the loader in their chip.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use serial2::SerialPort;
use thiserror::Error;

use crate::decode::live::LiveDecoder;
use crate::foot::scan;
use crate::link::serial::SerialLine;
use crate::remedy::FootHint;
use crate::source::DEFAULT_BAUD;

/// Folder in which Linux names serial ports by the device that has them. systemd 252 and containers lack it.
const BY_ID: &str = "/dev/serial/by-id";

/// Folder in which Linux describes the serial ports.
#[cfg(target_os = "linux")]
const SYSFS: &str = "/sys/class/tty";

/// Folder of the devices.
#[cfg(target_os = "linux")]
const DEVICES: &str = "/dev";

/// Manufacturer and product of a foot, in its descriptors.
const MANUFACTURER: &str = "footfall";
const PRODUCT: &str = "footfall foot";

/// Numbers of vendor and product of a foot on USB. Each program that is built with the Pico SDK has them.
#[cfg(windows)]
const NUMBERS: (u16, u16) = (0x2E8A, 0x000A);

/// Start and end of the name of a foot's port in [`BY_ID`], around its serial number.
const FOOT: &str = "usb-footfall_footfall_foot_";
const INTERFACE: &str = "-if";

/// Rate that a port has when it is closed to start the loader, Bd.
const LOADER_BAUD: u32 = 1_200;

/// Timeout for the loader to start and the system to mount its drive, and for the foot to return.
const LONGEST: Duration = Duration::from_secs(30);

/// Timeout for the system to remove the drive of a loader that has started the program.
const REMOVAL: Duration = Duration::from_secs(5);

/// File by which a loader's drive describes itself.
const ABOUT: &str = "INFO_UF2.TXT";

/// First words of a UF2 file. Its family of chips is at byte 28.
const UF2: [u8; 8] = *b"UF2\nWQ]\x9E";

/// Chip of a foot on USB, and the loader in its ROM.
#[derive(Debug, PartialEq, Eq)]
struct Chip {
    name: &'static str,
    /// Family of its programs.
    family: u32,
    /// Name of the loader's drive, which is also in the file that describes it.
    drive: &'static str,
    /// Way to start the loader by hand.
    by_hand: &'static str,
}

const CHIPS: [Chip; 2] = [
    Chip {
        name: "RP2040",
        family: 0xE48B_FF56,
        drive: "RPI-RP2",
        by_hand: "press the board's button twice",
    },
    Chip {
        name: "RP2350",
        family: 0xE48B_FF59,
        drive: "RP2350",
        by_hand: "hold the button BOOT while you press RESET",
    },
];

/// Reason a foot on USB was not updated.
#[derive(Debug, Error)]
pub enum CopyError {
    /// The foot's port cannot be opened.
    #[error("{0}: {1}")]
    Port(String, io::Error),
    /// The loader's drive did not appear.
    #[error("no new drive {drive} is mounted {waited} s after {port} was asked for it: {by_hand}, and copy the file to the drive that appears", waited = LONGEST.as_secs())]
    NoDrive {
        /// Port of the foot.
        port: String,
        /// Name of the drive.
        drive: &'static str,
        /// Way to start the loader by hand.
        by_hand: &'static str,
    },
    /// The program is for another chip.
    #[error(
        "the program is for an {program}, and the board has an {board}: plug the board in again, and take the file for it"
    )]
    OtherChip {
        /// Chip of the program.
        program: &'static str,
        /// Chip of the board.
        board: &'static str,
    },
    /// The file was not written.
    #[error("{}: {}", .0.display(), .1)]
    NotCopied(PathBuf, io::Error),
    /// The foot is not back.
    #[error("the program was copied, but {0} is not back after {waited} s: plug the board in again", waited = LONGEST.as_secs())]
    NotBack(String),
}

impl CopyError {
    /// Returns the remedy, if it depends on the program. Other systems than Linux mount the drive by themselves.
    #[must_use]
    pub const fn hint(&self) -> Option<FootHint> {
        match self {
            Self::NoDrive { drive, .. } if cfg!(target_os = "linux") => {
                Some(FootHint::MountDrive(drive))
            }
            _ => None,
        }
    }
}

/// Returns whether a file is a program that can be copied to the loader of a foot on USB.
#[must_use]
pub fn is_program(bytes: &[u8]) -> bool {
    chip_of(bytes).is_some()
}

/// Chip of a program; `None` if the file is not a program for one of them.
fn chip_of(bytes: &[u8]) -> Option<&'static Chip> {
    let family = bytes.starts_with(&UF2).then(|| bytes.get(28..32))??;
    CHIPS.iter().find(|chip| chip.family.to_le_bytes() == family)
}

/// Starts the loader of the foot at a port, copies a program to the loader's drive, and waits for the foot.
///
/// # Errors
/// The port, the drive or the foot afterwards is missing, the program is for another chip, or the copy fails.
pub fn update(port: &str, program: &[u8]) -> Result<(), CopyError> {
    let start_loader = || {
        let opened = SerialPort::open(port, LOADER_BAUD);
        opened.map(drop).map_err(|error| CopyError::Port(port.to_owned(), error))
    };
    let times = Times { drive: LONGEST, foot: LONGEST };
    update_by(port, program, start_loader, mounted, times)
}

/// Timeouts of an update: for the drive to appear, and for the foot to return.
#[derive(Clone, Copy)]
struct Times {
    drive: Duration,
    foot: Duration,
}

/// Updates a foot as [`update`] does. `start_loader` starts its loader, and `mounted` lists the folders of drives.
fn update_by(
    port: &str,
    program: &[u8],
    start_loader: impl FnOnce() -> Result<(), CopyError>,
    mounted: impl Fn() -> Vec<PathBuf>,
    times: Times,
) -> Result<(), CopyError> {
    // Loaders that run already belong to other boards, because this board's program still runs and has a port.
    let others = loader_drives(mounted());
    start_loader()?;
    let Chip { name, drive, by_hand, .. } = *chip_of(program).unwrap_or(&CHIPS[0]);
    let is_new = |drive: &LoaderDrive| !others.contains(drive);
    let found = wait(times.drive, || loader_drives(mounted()).into_iter().find(is_new));
    let no_drive = || CopyError::NoDrive { port: port.to_owned(), drive, by_hand };
    let LoaderDrive { chip, folder } = found.ok_or_else(no_drive)?;
    if chip.name != name {
        return Err(CopyError::OtherChip { program: name, board: chip.name });
    }
    let copied = copy(&folder, program);
    finish(port, folder, copied, times.foot)
}

/// Waits for the foot after a copy. The loader removes the drive as soon as it has the last block, and macOS then reports
/// that the copy failed. So an error counts only if the drive is still there, or if the foot is not back.
fn finish(
    port: &str,
    drive: PathBuf,
    copied: io::Result<()>,
    longest: Duration,
) -> Result<(), CopyError> {
    let is_back = || is_there(port).then_some(());
    match copied {
        Ok(()) => wait(longest, is_back).ok_or_else(|| CopyError::NotBack(port.to_owned())),
        Err(error) => {
            let is_removed = || (!drive.join(ABOUT).exists()).then_some(());
            let back = wait(REMOVAL.min(longest), is_removed).and_then(|()| wait(longest, is_back));
            back.ok_or(CopyError::NotCopied(drive, error))
        }
    }
}

/// Returns whether a port exists. Ports are files, except on Windows.
fn is_there(port: &str) -> bool {
    Path::new(port).exists() || cfg!(windows) && foot_ports().iter().any(|foot| foot.port == port)
}

fn copy(drive: &Path, program: &[u8]) -> io::Result<()> {
    let mut file = File::create(drive.join("foot.uf2"))?;
    file.write_all(program)?;
    // An error is ignored, because the loader removes the drive after the last block.
    let _ = file.sync_all();
    Ok(())
}

/// Polls until there is an answer; `None` after `longest`.
fn wait<T>(longest: Duration, mut answer: impl FnMut() -> Option<T>) -> Option<T> {
    let start = Instant::now();
    loop {
        if let Some(answer) = answer() {
            return Some(answer);
        }
        if start.elapsed() > longest {
            return None;
        }
        thread::sleep(Duration::from_millis(100));
    }
}

/// Drives of the system.
#[cfg(windows)]
fn mounted() -> Vec<PathBuf> {
    ('A'..='Z').map(|letter| PathBuf::from(format!("{letter}:\\"))).collect()
}

/// Folders in which the system has mounted drives.
#[cfg(not(windows))]
fn mounted() -> Vec<PathBuf> {
    let mounts = fs::read_to_string("/proc/mounts").unwrap_or_default();
    let linux = mounts
        .lines()
        .filter_map(|line| line.split(' ').nth(1))
        .map(|folder| PathBuf::from(folder.replace("\\040", " ")));
    let volumes = fs::read_dir("/Volumes").into_iter().flatten().flatten();
    linux.chain(volumes.map(|entry| entry.path())).collect()
}

/// Drive of a loader.
#[derive(Debug, PartialEq, Eq)]
struct LoaderDrive {
    /// Chip of its board.
    chip: &'static Chip,
    folder: PathBuf,
}

/// Finds the drives of loaders by the file with which each describes itself.
fn loader_drives(folders: Vec<PathBuf>) -> Vec<LoaderDrive> {
    let drives = folders.into_iter().filter_map(|folder| {
        let about = fs::read_to_string(folder.join(ABOUT)).ok()?;
        let id = about.lines().find_map(|line| line.strip_prefix("Board-ID: "))?.trim();
        let chip = CHIPS.iter().find(|chip| chip.drive == id)?;
        Some(LoaderDrive { chip, folder })
    });
    drives.collect()
}

/// Port of a foot on USB.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct UsbPort {
    /// Serial number of the board, as in its descriptors.
    pub serial: String,
    /// Name of the port.
    pub port: String,
}

/// Returns the ports of the feet on USB, in the order of their serial numbers.
#[must_use]
pub fn foot_ports() -> Vec<UsbPort> {
    ports_of_system()
}

/// Finds the feet by the names of their ports, and by the kernel's description of each port.
#[cfg(target_os = "linux")]
fn ports_of_system() -> Vec<UsbPort> {
    joined(named_ports(Path::new(BY_ID)), described_ports(Path::new(SYSFS), Path::new(DEVICES)))
}

/// Finds the feet among the ports that the system lists with their descriptors.
#[cfg(not(target_os = "linux"))]
fn ports_of_system() -> Vec<UsbPort> {
    let ports = serialport::available_ports().unwrap_or_default();
    let feet = ports.into_iter().filter_map(|found| {
        let serialport::SerialPortType::UsbPort(usb) = found.port_type else {
            return None;
        };
        // Windows calls each port "USB Serial Device", whatever its device is called.
        #[cfg(windows)]
        let is_foot = (usb.vid, usb.pid) == NUMBERS && sends_as_foot(&found.port_name);
        #[cfg(not(windows))]
        let is_foot = usb.manufacturer.as_deref() == Some(MANUFACTURER)
            && usb.product.as_deref() == Some(PRODUCT);
        // macOS lists each port twice. A port named tty waits for a carrier when it is opened.
        let is_second = found.port_name.starts_with("/dev/tty.");
        let serial = usb.serial_number.unwrap_or_default();
        (is_foot && !is_second).then_some(UsbPort { serial, port: found.port_name })
    });
    let mut feet: Vec<UsbPort> = feet.collect();
    feet.sort();
    feet
}

/// Listens to a board that may have any program, and returns whether it sends as a foot does. Sends nothing, because
/// the bytes could be commands to another program. A port that cannot be opened counts, because it may belong to a foot
/// in use.
#[cfg_attr(not(any(windows, test)), expect(dead_code, reason = "others know names"))]
fn sends_as_foot(port: &str) -> bool {
    let Ok(mut line) = SerialLine::open(port, DEFAULT_BAUD) else {
        return true;
    };
    scan::feet(&mut line, &mut LiveDecoder::default(), scan::SCAN)
        .is_ok_and(|feet| !feet.is_empty())
}

/// Serial number of the board on USB at a port; `None` for another port.
#[must_use]
pub fn serial_number(port: &str) -> Option<String> {
    if let Some(named) = port.strip_prefix(BY_ID).and_then(|name| name.strip_prefix('/')) {
        return serial_in_name(named).map(str::to_owned);
    }
    let ports = foot_ports();
    let found = ports.into_iter().find(|found| found.port == port);
    found.map(|found| found.serial)
}

/// Returns whether a text is this serial number of a board on USB: as in its descriptors, or object 0x1018:4, which is
/// computed from it.
#[must_use]
pub fn is_serial_number(text: &str, serial: &str) -> bool {
    let folded = text.strip_prefix("0x").and_then(|digits| u32::from_str_radix(digits, 16).ok());
    text.eq_ignore_ascii_case(serial)
        || folded
            .is_some_and(|number| unique_id(serial).map(wire::foot::serial_number) == Some(number))
}

/// Unique id of the chip, which its serial number on USB has in hexadecimal.
fn unique_id(serial: &str) -> Option<Vec<u8>> {
    let digits = serial.as_bytes().chunks(2);
    let byte = |pair: &[u8]| u8::from_str_radix(str::from_utf8(pair).ok()?, 16).ok();
    digits.map(byte).collect()
}

/// Serial number in the name of a foot's port.
fn serial_in_name(name: &str) -> Option<&str> {
    let (serial, _) = name.strip_prefix(FOOT)?.rsplit_once(INTERFACE)?;
    Some(serial)
}

fn entries(folder: &Path) -> impl Iterator<Item = PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.map(|entry| entry.path())
}

/// Feet among the ports that a folder names by their devices.
#[cfg_attr(not(target_os = "linux"), expect(dead_code, reason = "Linux has the folder"))]
fn named_ports(folder: &Path) -> Vec<UsbPort> {
    let feet = entries(folder).filter_map(|path| {
        let serial = serial_in_name(path.file_name()?.to_str()?)?.to_owned();
        Some(UsbPort { serial, port: path.display().to_string() })
    });
    let mut feet: Vec<UsbPort> = feet.collect();
    feet.sort();
    feet
}

/// Named ports, then the described ports that have no name. Boards with one serial number have one name, and udev may not
/// have named a board that was just plugged in.
#[cfg_attr(not(target_os = "linux"), expect(dead_code, reason = "Linux has both"))]
fn joined(named: Vec<UsbPort>, described: Vec<UsbPort>) -> Vec<UsbPort> {
    let place =
        |found: &UsbPort| fs::canonicalize(&found.port).unwrap_or(found.port.clone().into());
    let places: Vec<PathBuf> = named.iter().map(place).collect();
    let unnamed = described.into_iter().filter(|found| !places.contains(&place(found)));
    let mut feet: Vec<UsbPort> = named.into_iter().chain(unnamed).collect();
    feet.sort();
    feet
}

/// Feet among the ports that the kernel describes: `device` of a port is an interface of a device on USB, whose folder is
/// the next one up.
#[cfg_attr(not(target_os = "linux"), expect(dead_code, reason = "Linux has the folder"))]
fn described_ports(sysfs: &Path, devices: &Path) -> Vec<UsbPort> {
    let feet = entries(sysfs).filter_map(|path| {
        let device = path.join("device").canonicalize().ok()?.parent()?.to_owned();
        let read = |name| fs::read_to_string(device.join(name)).ok();
        let is = |name, value: &str| read(name).is_some_and(|text| text.trim_end() == value);
        if !is("manufacturer", MANUFACTURER) || !is("product", PRODUCT) {
            return None;
        }
        let serial = read("serial").unwrap_or_default().trim_end().to_owned();
        let port = devices.join(path.file_name()?).display().to_string();
        Some(UsbPort { serial, port })
    });
    let mut feet: Vec<UsbPort> = feet.collect();
    feet.sort();
    feet
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_is_copied_to_the_drive_of_the_loader() {
        let folder = std::env::temp_dir().join(format!("footfall-drives-{}", std::process::id()));
        let [other, first, second] = ["other", "RPI-RP2", "RP2350"].map(|name| {
            let drive = folder.join(name);
            fs::create_dir_all(&drive).expect("a folder");
            let about = format!("UF2 Bootloader v3.0\r\nBoard-ID: {name}\r\n");
            fs::write(drive.join("INFO_UF2.TXT"), about).expect("a file");
            drive
        });
        assert_eq!(loader_drives(vec![folder.clone(), other.clone()]), []);
        for (chip, drive) in CHIPS.iter().zip([&first, &second]) {
            let found = loader_drives(vec![other.clone(), drive.clone()]);
            assert_eq!(found, [LoaderDrive { chip, folder: drive.clone() }]);
            let mut program = vec![0; 512];
            program[..8].copy_from_slice(&UF2);
            assert!(!is_program(&program), "of no family");
            program[28..32].copy_from_slice(&chip.family.to_le_bytes());
            assert_eq!(chip_of(&program), Some(chip));
            copy(drive, &program).expect("room");
            assert_eq!(fs::read(drive.join("foot.uf2")).expect("a file"), program);
        }
        fs::remove_dir_all(&folder).expect("removed");
    }

    /// The loader of the other board runs before this board's does, and its drive is listed first.
    #[test]
    fn update_leaves_another_board_in_its_loader_alone() {
        let folder = std::env::temp_dir().join(format!("footfall-loaders-{}", std::process::id()));
        let [other, asked] = ["RPI-RP2", "RPI-RP2 1"].map(|name| folder.join(name));
        let add = |drive: &Path| {
            fs::create_dir_all(drive).expect("a folder");
            fs::write(drive.join(ABOUT), "Board-ID: RPI-RP2\r\n").expect("a file");
        };
        add(&other);
        let port = folder.join("ttyACM0").display().to_string();
        let mut program = [0; 512];
        program[..8].copy_from_slice(&UF2);
        program[28..32].copy_from_slice(&CHIPS[0].family.to_le_bytes());
        let update = |start_loader: &dyn Fn()| {
            let start_loader = || {
                start_loader();
                Ok(())
            };
            let times = Times { drive: Duration::ZERO, foot: Duration::ZERO };
            let mounted = || vec![other.clone(), asked.clone()];
            update_by(&port, &program, start_loader, mounted, times)
        };
        let error = update(&|| ()).expect_err("no drive has appeared");
        assert!(matches!(error, CopyError::NoDrive { .. }), "{error}");
        let updated = update(&|| {
            add(&asked);
            fs::write(&port, "").expect("a file");
        });
        assert!(updated.is_ok(), "{updated:?}");
        assert_eq!(fs::read(asked.join("foot.uf2")).expect("a file"), program);
        assert!(!other.join("foot.uf2").exists());
        fs::remove_dir_all(&folder).expect("removed");
    }

    #[test]
    fn feet_on_usb_are_found_by_the_names_of_their_ports() {
        let folder = std::env::temp_dir().join(format!("footfall-usb-{}", std::process::id()));
        assert_eq!(named_ports(&folder), []);
        fs::create_dir(&folder).expect("a folder");
        let add = |name: &str| {
            let path = folder.join(name);
            fs::write(&path, "").expect("a file");
            path.display().to_string()
        };
        let found = |serial: &str, port: String| UsbPort { serial: serial.to_owned(), port };
        add("usb-FTDI_FT232R_A1-if00-port0");
        let second = found("2C", add("usb-footfall_footfall_foot_2C-if00"));
        assert_eq!(named_ports(&folder), std::slice::from_ref(&second));
        let first = found("1C", add("usb-footfall_footfall_foot_1C-if00"));
        assert_eq!(named_ports(&folder), [first, second]);
        fs::remove_dir_all(&folder).expect("removed");
        let port = format!("{BY_ID}/usb-footfall_footfall_foot_1C-if00");
        assert_eq!(serial_number(&port).as_deref(), Some("1C"));
        assert_eq!(serial_number("/dev/there-is-none"), None);
    }

    /// As with systemd 252 and in containers: `/dev/serial` is missing, and the kernel describes the ports.
    #[cfg(unix)]
    #[test]
    fn feet_are_found_without_names_of_ports() {
        use std::os::unix::fs::symlink;
        let folder = std::env::temp_dir().join(format!("footfall-sysfs-{}", std::process::id()));
        let sysfs = folder.join("class/tty");
        let add = |port: &str, descriptors: &[(&str, &str)]| {
            let device = folder.join("devices").join(port);
            fs::create_dir_all(device.join("1-1:1.0")).expect("a folder");
            for (name, value) in descriptors {
                fs::write(device.join(name), format!("{value}\n")).expect("a file");
            }
            fs::create_dir_all(sysfs.join(port)).expect("a folder");
            symlink(device.join("1-1:1.0"), sysfs.join(port).join("device")).expect("a link");
        };
        let foot = |serial| {
            [("manufacturer", "footfall"), ("product", "footfall foot"), ("serial", serial)]
        };
        add("ttyACM1", &foot("1C"));
        add("ttyACM0", &foot("2C"));
        add("ttyUSB0", &[("manufacturer", "FTDI"), ("product", "FT232R"), ("serial", "A1")]);
        fs::create_dir_all(sysfs.join("tty0")).expect("a port of no device");
        let found = described_ports(&sysfs, Path::new("/dev"));
        let found: Vec<_> = found.iter().map(|found| (&*found.serial, &*found.port)).collect();
        assert_eq!(found, [("1C", "/dev/ttyACM1"), ("2C", "/dev/ttyACM0")]);
        fs::remove_dir_all(&folder).expect("removed");
    }

    /// Boards with one serial number share the name of a port, and another board has none yet.
    #[cfg(unix)]
    #[test]
    fn feet_without_a_name_are_added_to_the_named_ones() {
        use std::os::unix::fs::symlink;
        let folder = std::env::temp_dir().join(format!("footfall-joined-{}", std::process::id()));
        fs::create_dir_all(folder.join("by-id")).expect("a folder");
        let foot = |serial: &str, name: &str| {
            let port = folder.join(name).display().to_string();
            UsbPort { serial: serial.to_owned(), port }
        };
        let described = ["ttyACM0", "ttyACM1", "ttyACM2"].map(|name| {
            fs::write(folder.join(name), "").expect("a file");
            foot(if name == "ttyACM2" { "2C" } else { "1C" }, name)
        });
        let named = foot("1C", "by-id/usb-footfall_footfall_foot_1C-if00");
        symlink("../ttyACM1", &named.port).expect("a link");
        let found = joined(vec![named.clone()], described.to_vec());
        let [first, _, third] = described;
        assert_eq!(found, [named, first, third]);
        fs::remove_dir_all(&folder).expect("removed");
    }

    #[test]
    fn udev_rule_names_the_descriptors_of_a_foot() {
        let rule = include_str!("../../footfall/60-footfall.rules");
        for key in ["ATTR", "ATTRS"] {
            let names = format!(
                "{key}{{manufacturer}}==\"{MANUFACTURER}\", {key}{{product}}==\"{PRODUCT}\", "
            );
            assert!(rule.contains(&names), "{names}");
        }
    }

    #[test]
    fn copy_that_ends_with_the_drive_counts_if_the_foot_is_back() {
        let folder = std::env::temp_dir().join(format!("footfall-copied-{}", std::process::id()));
        let (drive, port) = (folder.join("RPI-RP2"), folder.join("ttyACM0"));
        fs::create_dir_all(&drive).expect("a folder");
        fs::write(drive.join(ABOUT), "").expect("a file");
        let refused = || Err(io::Error::from(io::ErrorKind::BrokenPipe));
        let finished =
            |copied| finish(&port.display().to_string(), drive.clone(), copied, Duration::ZERO);
        fs::write(&port, "").expect("a file");
        assert!(finished(Ok(())).is_ok());
        assert!(matches!(finished(refused()), Err(CopyError::NotCopied(..))), "a drive");
        fs::remove_dir_all(&drive).expect("removed");
        assert!(finished(refused()).is_ok(), "the foot is back");
        fs::remove_file(&port).expect("removed");
        assert!(matches!(finished(refused()), Err(CopyError::NotCopied(..))), "no foot");
        assert!(matches!(finished(Ok(())), Err(CopyError::NotBack(_))));
        fs::remove_dir_all(&folder).expect("removed");
    }

    /// Programs with the numbers of the Pico SDK: one that sends text, and a foot.
    #[cfg(unix)]
    #[test]
    fn board_is_a_foot_if_it_sends_as_one() {
        use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
        use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
        use std::sync::atomic::{AtomicBool, Ordering};
        use wire::uart::{LogMessage, Message, encode};

        let sends = |bytes: &[u8]| {
            let board = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a terminal");
            grantpt(&board).expect("granted");
            unlockpt(&board).expect("unlocked");
            let mut settings = tcgetattr(&board).expect("its settings");
            settings.make_raw();
            tcsetattr(&board, OptionalActions::Now, &settings).expect("set");
            let port = ptsname(&board, Vec::new()).expect("a name").into_string().expect("text");
            let is_asked = AtomicBool::new(true);
            thread::scope(|scope| {
                scope.spawn(|| {
                    let mut board = File::from(board);
                    while is_asked.load(Ordering::Relaxed) {
                        board.write_all(bytes).expect("sent");
                        thread::sleep(Duration::from_millis(10));
                    }
                });
                let is_foot = sends_as_foot(&port);
                is_asked.store(false, Ordering::Relaxed);
                is_foot
            })
        };
        assert!(!sends(b"Hello from a Pico\r\n"));
        let log = Message::Log(LogMessage::new(3, "running"));
        assert!(sends(encode(0, &log).as_bytes()));
        // A port that another program has open.
        assert!(sends_as_foot("/dev/there-is-none"));
    }

    #[test]
    fn board_is_known_by_both_of_its_serial_numbers() {
        assert!(is_serial_number("e66164084332a925", "E66164084332A925"));
        let folded = wire::foot::serial_number([0xE6, 0x61]);
        assert!(is_serial_number(&format!("0x{folded:08X}"), "E661"));
        assert!(!is_serial_number("0x00000001", "E661"));
        assert!(!is_serial_number("E6", "E661"));
    }
}
