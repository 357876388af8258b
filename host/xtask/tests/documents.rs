//! The documents: their links are valid, and the code that they name exists.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use xtask::command::root;
use xtask::links::{Link, links};

/// All Markdown files of the repository. Ignored folders, such as a virtual environment, contain third-party documents.
fn documents() -> Vec<PathBuf> {
    let list = ["ls-files", "--cached", "--others", "--exclude-standard", "--", "*.md"];
    let output = Command::new("git").current_dir(root()).args(list).output();
    let output = output.expect("git runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let files = String::from_utf8(output.stdout).expect("text");
    let paths = files.lines().map(|file| root().join(file));
    // The list also has files that were deleted without a commit.
    paths.filter(|path| path.exists()).collect()
}

/// Anchor of a heading: lower case, spaces as hyphens, without punctuation.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().to_lowercase();
    let kept = kept.chars().filter_map(|letter| match letter {
        ' ' => Some('-'),
        '-' | '_' => Some(letter),
        letter if letter.is_alphanumeric() => Some(letter),
        _ => None,
    });
    kept.collect()
}

/// Returns whether a heading has this anchor. Comments in blocks of code are ignored.
fn has_anchor(document: &str, wanted: &str) -> bool {
    let mut is_code = false;
    document.lines().any(|line| {
        is_code ^= line.trim_start().starts_with("```");
        !is_code && line.starts_with('#') && anchor(line.trim_start_matches('#')) == wanted
    })
}

/// Last name of a path of code: `tick` of `Foot::tick`, `Named` of `Named`. `None` for a file or other text.
fn code_name(text: &str) -> Option<&str> {
    let path = text.strip_prefix('`')?.strip_suffix('`')?;
    let name = path.rsplit("::").next()?;
    let is_name = |letter: char| letter.is_alphanumeric() || letter == '_';
    name.chars().all(is_name).then_some(name)
}

/// Error of a link from a document.
fn problem(from: &Path, link: &Link<'_>) -> Option<String> {
    if link.target.starts_with("http") {
        return None;
    }
    let (path, wanted) = link.target.split_once('#').unwrap_or((link.target, ""));
    let to = match path {
        "" => from.to_owned(),
        path => from.parent()?.join(path),
    };
    if !to.exists() {
        return Some("leads nowhere".into());
    }
    if to.is_dir() {
        return None;
    }
    let is_text = to.extension().is_some_and(|kind| kind == "md" || kind == "rs");
    if !is_text {
        return None;
    }
    let text = fs::read_to_string(&to).expect("the file can be read");
    if !wanted.is_empty() && !has_anchor(&text, wanted) {
        return Some(format!("has no heading {wanted}"));
    }
    let is_code = to.extension().is_some_and(|kind| kind == "rs");
    match code_name(link.text) {
        // A file stands for its module, and for the packages and modules that contain it.
        Some(name) if to.with_extension("").iter().any(|part| part == name) => None,
        Some(name) if is_code && !defines(&text, name) => Some(format!("does not define {name}")),
        _ => None,
    }
}

/// Returns whether code defines an item, a method or a field of this name.
fn defines(code: &str, name: &str) -> bool {
    const KEYWORDS: [&str; 8] = ["fn", "struct", "enum", "trait", "type", "const", "static", "mod"];
    let is_name = |letter: char| letter.is_alphanumeric() || letter == '_';
    code.match_indices(name).any(|(at, _)| {
        let (before, after) = (&code[..at], &code[at + name.len()..]);
        let is_whole = !before.ends_with(is_name) && !after.starts_with(is_name);
        let keyword = before.trim_end().rsplit(|letter| !is_name(letter)).next();
        let is_item = keyword.is_some_and(|word| KEYWORDS.contains(&word));
        is_whole && (is_item || after.starts_with(": "))
    })
}

#[test]
fn name_is_defined_by_an_item_and_not_by_its_use() {
    let code = "pub const fn act(&mut self) {\n    exact.store();\n}\n";
    assert!(defines(code, "act"));
    assert!(!defines(code, "exact") && !defines(code, "store"));
}

#[test]
fn comment_in_a_block_of_code_has_no_anchor() {
    let document = "# Start\n```sh\n# Install\n```\n## Next step\n";
    assert!(has_anchor(document, "start") && has_anchor(document, "next-step"));
    assert!(!has_anchor(document, "install"));
}

#[test]
fn links_of_documents_lead_to_files_headings_or_named_code() {
    let found = documents();
    assert!(found.len() > 8, "{found:?}");
    let mut wrong = Vec::new();
    for path in &found {
        let text = fs::read_to_string(path).expect("the document can be read");
        for link in links(&text) {
            if let Some(problem) = problem(path, &link) {
                wrong.push(format!("{}: {} {problem}", path.display(), link.target));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
