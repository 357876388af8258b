//! Commands on the pages of the documents: the program takes their options.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Parser;
use footfall::commands::Arguments;

/// Root of the repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Pages with commands to be typed.
fn pages() -> Vec<PathBuf> {
    let folders = ["docs/start", "docs/guide", "docs/reference", "docs/reference/boards"];
    let files = folders.iter().flat_map(|folder| {
        let entries = fs::read_dir(root().join(folder)).expect("the folder can be read");
        entries.map(|entry| entry.expect("the entry can be read").path())
    });
    let others = ["README.md", "firmware/README.md"].map(|file| root().join(file));
    files.chain(others).filter(|path| path.extension().is_some_and(|kind| kind == "md")).collect()
}

/// Commands of this program in the blocks of a page that a shell runs, as words.
fn commands(page: &str) -> Vec<Vec<&str>> {
    let mut found = Vec::new();
    let mut is_shell = false;
    for line in page.lines().map(str::trim) {
        match line.strip_prefix("```") {
            Some(language) => is_shell = language == "sh",
            None if is_shell && line.starts_with("footfall ") => {
                let words = line.split_whitespace();
                let end = |word: &&str| !["#", ">", "|", "&&"].contains(word);
                found.push(words.take_while(end).collect());
            }
            None => {}
        }
    }
    found
}

#[test]
fn program_takes_the_commands_of_the_pages() {
    let mut count = 0;
    let mut refused = Vec::new();
    for path in pages() {
        let page = fs::read_to_string(&path).expect("the page can be read");
        for command in commands(&page) {
            count += 1;
            if let Err(error) = Arguments::try_parse_from(&command) {
                refused.push(format!("{}: {}\n{error}", path.display(), command.join(" ")));
            }
        }
    }
    assert!(count > 60, "{count} commands");
    assert!(refused.is_empty(), "{}", refused.join("\n"));
}
