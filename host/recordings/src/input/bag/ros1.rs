//! Bags of ROS 1, converted to a rosbag2 by the program of <https://gitlab.com/ternaris/rosbags>.

use std::io;
use std::path::Path;
use std::process::{Command, Stdio};

use tempfile::TempDir;

use crate::input::error::InputError;
use crate::input::refusal::ContainerError;
use crate::samples::foreign::Foreign;

/// Program that converts.
const PROGRAM: &str = "rosbags-convert";

/// Name of the rosbag2 in its temporary folder.
pub(in crate::input) const BAG: &str = "bag";

/// Converts a bag to a rosbag2, the folder [`BAG`] in a temporary folder that is returned.
///
/// # Errors
/// The program is not installed, cannot be run, or refuses the bag.
pub(in crate::input) fn converted(path: &Path) -> Result<TempDir, InputError> {
    let file = path.display().to_string();
    let unusable = |source| InputError::spool(&file, source);
    let folder = tempfile::tempdir().map_err(unusable)?;
    // An absolute path cannot be taken for an option.
    let source = path.canonicalize().map_err(unusable)?;
    let ran = Command::new(PROGRAM)
        .arg("--src")
        .arg(source)
        .arg("--dst")
        .arg(folder.path().join(BAG))
        .stdin(Stdio::null())
        .output();
    let reason = match ran {
        Ok(output) if output.status.success() => return Ok(folder),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let kind = Foreign::Ros1Bag;
            return Err(ContainerError::Foreign { file, kind }.into());
        }
        Err(error) => error.to_string(),
        Ok(output) => {
            let said = [output.stderr, output.stdout].concat();
            let said = String::from_utf8_lossy(&said);
            let last = said.lines().rfind(|line| !line.trim().is_empty());
            last.unwrap_or("it failed").trim().to_owned()
        }
    };
    Err(ContainerError::NotConverted { file, reason }.into())
}
