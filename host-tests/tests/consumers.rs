//! The lines of other programs that `docs/guide/state-estimators.md` relies on. Each names its commit, so that a reader with
//! clones of these programs can read the lines again.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use host_tests::committed::workspace;

/// Folder with a clone of each program, by the name in the table.
const CLONES: &str = "FOOTFALL_CONSUMERS";

/// A row of the table "What was read".
#[derive(Debug)]
struct Line {
    program: String,
    commit: String,
    file: String,
    /// First and last line, from 1; all lines of the file if the table names none.
    range: Option<(usize, usize)>,
    text: String,
}

impl Line {
    /// Reads the cells of a row.
    ///
    /// # Errors
    /// A cell is missing or malformed.
    fn parse(row: &str) -> Result<Self, String> {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let [program, commit, file, lines, text, meaning] = cells[..] else {
            return Err(format!("six cells are expected: {row}"));
        };
        let code = |cell: &str| cell.trim_matches('`').to_owned();
        let commit = code(commit);
        if commit.len() < 7 || !commit.chars().all(|digit| digit.is_ascii_hexdigit()) {
            return Err(format!("not a commit: {commit:?} in {row}"));
        }
        if file.len() < 3 || text.len() < 3 || meaning.is_empty() {
            return Err(format!("an empty cell: {row}"));
        }
        let number = |text: &str| text.parse::<usize>().map_err(|error| format!("{error}: {row}"));
        let range = match lines.split_once('–') {
            Some((first, last)) => Some((number(first)?, number(last)?)),
            None if lines.is_empty() => None,
            None => Some((number(lines)?, number(lines)?)),
        };
        if range.is_some_and(|(first, last)| first == 0 || last < first) {
            return Err(format!("no range of lines: {row}"));
        }
        Ok(Self { program: program.to_owned(), commit, file: code(file), range, text: code(text) })
    }

    /// Reads the line again, from the clone in `folder`.
    ///
    /// # Errors
    /// The clone does not have the commit or the file, or the text is not in these lines.
    fn check(&self, folder: &Path) -> Result<(), String> {
        let clone = folder.join(&self.program);
        let object = format!("{}:{}", self.commit, self.file);
        let output = Command::new("git").arg("-C").arg(&clone).args(["show", &object]).output();
        let output = output.map_err(|error| format!("git: {error}"))?;
        if !output.status.success() {
            let error = String::from_utf8_lossy(&output.stderr);
            return Err(format!("{}: {object}: {error}", clone.display()));
        }
        let source = String::from_utf8_lossy(&output.stdout).into_owned();
        let (first, last) = self.range.unwrap_or((1, usize::MAX));
        let mut lines = source.lines().skip(first - 1).take(last - first + 1);
        if lines.any(|line| line.contains(&self.text)) {
            return Ok(());
        }
        Err(format!("{object} does not have {:?} in {:?}", self.text, self.range))
    }
}

/// Rows of the table.
fn lines() -> Vec<Line> {
    let page = workspace().join("docs/guide/state-estimators.md");
    let text = fs::read_to_string(page).expect("the page can be read");
    let (_, block) = text.split_once("<!-- begin consumers -->").expect("the block begins");
    let (block, _) = block.split_once("<!-- end consumers -->").expect("the block ends");
    let rows = block.lines().filter(|line| line.starts_with('|')).skip(2);
    rows.map(|row| Line::parse(row).expect("the row is complete")).collect()
}

#[test]
fn each_consumer_names_the_commit_that_was_read() {
    let lines = lines();
    for program in [
        "SERoW",
        "MUSE",
        "DRIFT",
        "Pronto",
        "BLF",
        "Invariant EKF",
        "fuse",
        "common_interfaces",
        "champ",
        "legged_control",
        "bit-bots",
        "DogLegs",
    ] {
        assert!(lines.iter().any(|line| line.program == program), "{program} has no row");
    }
    if let Some(folder) = env::var_os(CLONES).map(PathBuf::from) {
        for line in &lines {
            line.check(&folder).unwrap_or_else(|error| panic!("{error}"));
        }
    }
}

#[test]
fn changed_line_of_a_consumer_is_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let clone = folder.path().join("filter");
    fs::create_dir(&clone).expect("a clone");
    let git = |arguments: &[&str]| {
        let identity = ["-c", "user.name=reader", "-c", "user.email=reader@example.org"];
        let output =
            Command::new("git").current_dir(&clone).args(identity).args(arguments).output();
        let output = output.expect("git runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).expect("text")
    };
    git(&["init", "--quiet"]);
    fs::write(clone.join("filter.cpp"), "a\nstance = force > threshold;\nb\n").expect("a source");
    git(&["add", "filter.cpp"]);
    git(&["commit", "--quiet", "--message", "Add a filter"]);
    let commit = git(&["rev-parse", "HEAD"]);
    let row = |lines: &str, text: &str| {
        let commit = commit.trim();
        Line::parse(&format!(
            "| filter | `{commit}` | `filter.cpp` | {lines} | `{text}` | a threshold |"
        ))
        .expect("a row")
    };
    assert_eq!(row("2", "force > threshold").check(folder.path()), Ok(()));
    assert_eq!(row("", "force > threshold").check(folder.path()), Ok(()));
    assert!(row("3", "force > threshold").check(folder.path()).is_err());
    assert!(row("1–3", "force > limit").check(folder.path()).is_err());
    assert!(Line::parse("| filter | `main` | `filter.cpp` | 2 | `force` | a threshold |").is_err());
}
