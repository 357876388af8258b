//! Files that are generated and committed: checked to be current, or written anew.

use std::path::Path;
use std::{env, fs};

/// Checks that the file at `path` holds just `expected`. With `FOOTFALL_UPDATE=1` in the
/// environment it is written instead.
///
/// # Panics
/// Where the file is absent or holds something else, with the first line that differs.
pub fn assert_current(path: &Path, expected: &str) {
    let committed = fs::read_to_string(path).unwrap_or_default();
    if committed == expected {
        return;
    }
    if env::var_os("FOOTFALL_UPDATE").is_some_and(|value| value == "1") {
        fs::write(path, expected).expect("the file can be written");
        return;
    }
    let (line, (was, is)) = (1..)
        .zip(
            committed
                .lines()
                .chain([""])
                .zip(expected.lines().chain([""])),
        )
        .find(|(_, (was, is))| was != is)
        .unwrap_or((0, ("", "")));
    panic!(
        "{} is not current from line {line} on: it says\n  {was}\nand should say\n  {is}\nFOOTFALL_UPDATE=1 in the environment writes it anew",
        path.display()
    );
}

/// Replaces what stands between the lines `<!-- begin NAME -->` and `<!-- end NAME -->` of a
/// Markdown text.
///
/// # Panics
/// Where the text has no such block.
#[must_use]
pub fn with_block(text: &str, name: &str, content: &str) -> String {
    let (begin, end) = (
        format!("<!-- begin {name} -->\n"),
        format!("<!-- end {name} -->"),
    );
    let from = text.find(&begin).map(|at| at + begin.len());
    let from = from.unwrap_or_else(|| panic!("there is no block `{name}`"));
    let to = text[from..].find(&end).map(|at| from + at);
    let to = to.unwrap_or_else(|| panic!("the block `{name}` has no end"));
    format!("{}{content}{}", &text[..from], &text[to..])
}
