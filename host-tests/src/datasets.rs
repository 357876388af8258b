//! Location of recorded data, and the handling of missing files.
//!
//! Third-party recordings are not part of this repository. They are expected in the folder that the environment
//! variable `FOOTFALL_DATASETS` names, else in `../shared/datasets` beside the repository. If a file is absent,
//! the test that needs it reports this and how to get the file, and passes, or fails if recordings are required ([`no_recording`]).

use std::env;
use std::path::PathBuf;

use crate::committed::workspace;
use crate::requirements::no_recording;

/// Path of a recorded file, such as `pce/ATLAS_01ground.csv`, or `None` if it is absent.
///
/// # Panics
/// If the file is absent and every check is required.
#[must_use]
pub fn recorded(file: &str) -> Option<PathBuf> {
    let path = path(file);
    if path.is_file() {
        return Some(path);
    }
    no_recording(&format!(
        "{} is not there; {}, then name the folder above it in FOOTFALL_DATASETS",
        path.display(),
        how_to_get(file)
    ));
    None
}

/// Returns whether a recorded file is absent.
#[must_use]
pub fn missing(file: &str) -> bool {
    !path(file).is_file()
}

fn path(file: &str) -> PathBuf {
    let folder = env::var_os("FOOTFALL_DATASETS")
        .map_or_else(|| workspace().join("../shared/datasets"), PathBuf::from);
    folder.join(file)
}

fn how_to_get(file: &str) -> &'static str {
    match file.split('/').next() {
        Some("pce") => {
            "copy offline/data from github.com/MichaelMarav/ProbabilisticContactEstimation into a folder `pce`"
        }
        Some("lcd") => "copy the recordings from github.com/mrsp/lcd into a folder `lcd`",
        Some("pyshoe") => {
            "convert the walks with optical truth of github.com/mtahakoroglu/OpenShoe-PyShoe-DeepShoe-FuseShoe to CSV in a folder `pyshoe`"
        }
        Some("robots") => {
            "convert the recordings of the real robots in the histories of github.com/MichaelMarav/ProbabilisticContactEstimation and github.com/mrsp/gem to CSV in a folder `robots`"
        }
        _ => "convert the trials of github.com/dlaidig/broad to CSV in a folder `broad`",
    }
}

/// Path of a recording made by the simulator and stored in the repository.
#[must_use]
pub fn simulated(file: &str) -> PathBuf {
    workspace().join("host-tests/recordings").join(file)
}
