//! The `metadata.yaml` of a rosbag2: which files its folder should have.

use std::fs;
use std::path::Path;

/// Name of the file.
const NAME: &str = "metadata.yaml";

/// Key of the list of files.
const FILES: &str = "relative_file_paths:";

/// Largest file that is read, bytes.
const LARGEST: u64 = 16 << 20;

/// Sentence about the files that the folder of a bag should have, and has not.
pub(super) fn missing_notice(folder: &Path) -> Option<String> {
    let path = folder.join(NAME);
    let about = path.metadata().ok()?;
    if !about.is_file() || about.len() > LARGEST {
        return None;
    }
    let text = fs::read_to_string(&path).ok()?;
    let missing: Vec<&str> = files(&text)
        .filter(|name| !is_there(folder, name))
        .collect();
    (!missing.is_empty()).then(|| {
        format!(
            "{}: {NAME} lists {}, and no such file is in the folder",
            folder.display(),
            missing.join(", ")
        )
    })
}

/// Files that a `metadata.yaml` lists, in the form in which rosbag2 writes it.
fn files(text: &str) -> impl Iterator<Item = &str> {
    let lines = text.lines().map(str::trim);
    let list = lines.skip_while(|line| *line != FILES).skip(1);
    list.map_while(|line| line.strip_prefix("- "))
        .map(|name| name.trim().trim_matches(['"', '\'']))
}

/// Returns whether a file is there by its name in any folder, also compressed or decompressed since.
fn is_there(folder: &Path, listed: &str) -> bool {
    let name = listed.rsplit('/').next().unwrap_or(listed);
    let bare = name.strip_suffix(".zstd").unwrap_or(name);
    [bare.to_owned(), format!("{bare}.zstd")]
        .iter()
        .any(|name| folder.join(name).exists())
}
