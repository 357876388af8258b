//! Generated files in the repository: checked to be current, or written again.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::{env, fs};

/// Checks that the file at `path` has exactly the content `expected`. With `FOOTFALL_UPDATE=1` in the environment
/// it is written instead.
///
/// # Panics
/// If the file is absent or has other content, with the first line that differs.
pub fn assert_current(path: &Path, expected: &str) {
    let committed = fs::read_to_string(path).unwrap_or_default();
    if committed == expected {
        return;
    }
    if env::var_os("FOOTFALL_UPDATE").is_some_and(|value| value == "1") {
        fs::write(path, expected).expect("the file can be written");
        return;
    }
    let committed = committed.lines().chain([""]);
    let mut lines = (1..).zip(committed.zip(expected.lines().chain([""])));
    let differing = lines.find(|(_, (was, is))| was != is);
    let (line, (was, is)) = differing.unwrap_or((0, ("", "")));
    let [was, is] = shown(was, is);
    panic!(
        "{} is not current from line {line} on: it says\n  {was}\nand should say\n  {is}\nFOOTFALL_UPDATE=1 in the environment writes it again",
        path.display()
    );
}

/// Returns the parts of two lines around their first difference, because a path in a picture is one line of many thousand
/// characters.
fn shown(was: &str, is: &str) -> [String; 2] {
    const BEFORE: usize = 40;
    const LONGEST: usize = 300;
    let same = was.chars().zip(is.chars()).take_while(|(was, is)| was == is).count();
    [was, is].map(|line| line.chars().skip(same.saturating_sub(BEFORE)).take(LONGEST).collect())
}

/// Checks that a block of a Markdown file in the repository has exactly this content.
///
/// # Panics
/// If the content differs, or the file or the block is missing.
pub fn assert_block(file: &str, name: &str, content: &str) {
    // Tests of one program run in parallel, but only one at a time may rewrite a file.
    static REWRITING: Mutex<()> = Mutex::new(());
    let _turn = REWRITING.lock().unwrap_or_else(PoisonError::into_inner);
    let path = workspace().join(file);
    let text = fs::read_to_string(&path).expect("the file can be read");
    let expected = with_block(&text, name, content);
    assert_current(&path, &expected.unwrap_or_else(|| panic!("{file} has no block `{name}`")));
}

/// Checks that the block `report` of a Markdown file has the report of a foot. Numbers and the version may differ, because
/// the number and the costs of a program change with the program.
///
/// # Panics
/// As [`assert_block`].
pub fn assert_report(file: &str, report: &str) {
    let page = fs::read_to_string(workspace().join(file)).expect("the file can be read");
    let block = format!("```text\n{report}```\n");
    let is_shown = page.contains("<!-- begin report -->")
        && without_numbers(&page).contains(&without_numbers(&block));
    if !is_shown {
        assert_block(file, "report", &block);
    }
}

/// A report with `#` for each number, and without the line of its version.
fn without_numbers(report: &str) -> String {
    let mut shape = String::new();
    let lines = report.split_inclusive('\n').filter(|line| !line.starts_with("version "));
    let report: String = lines.collect();
    for word in report.split_inclusive(|letter: char| !letter.is_ascii_alphanumeric()) {
        let is_number = word.contains(|letter: char| letter.is_ascii_digit());
        shape.push_str(if is_number { "#" } else { word });
    }
    shape
}

/// Replaces the text between the lines `<!-- begin NAME -->` and `<!-- end NAME -->` of a Markdown text. `None` if the
/// text has no such block.
fn with_block(text: &str, name: &str, content: &str) -> Option<String> {
    let begin = format!("<!-- begin {name} -->\n");
    let from = text.find(&begin)? + begin.len();
    let to = from + text[from..].find(&format!("<!-- end {name} -->"))?;
    Some(format!("{}{content}{}", &text[..from], &text[to..]))
}

/// The root of the repository.
#[must_use]
pub fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lines_are_shown_around_their_first_difference() {
        let line = |end: &str| "7".repeat(1_000) + end + &"8".repeat(1_000);
        let [was, is] = shown(&line("a"), &line("b"));
        assert!(was.contains('a') && is.contains('b'), "{was} {is}");
        assert!(was.len() <= 300 && is.len() <= 300);
        assert_eq!(shown("one", "two"), ["one", "two"]);
    }
}
