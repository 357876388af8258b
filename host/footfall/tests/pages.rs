//! Commands on the pages of the documents: the program takes their options, and prints the output that the pages show.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use clap::Parser;
use footfall::commands::Arguments;

use crate::common::{Bench, read, text};

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

/// Blocks of code of a page, in order: language and content.
fn blocks(page: &str) -> impl Iterator<Item = (&str, &str)> {
    page.split("\n```").skip(1).step_by(2).map(|block| block.split_once('\n').expect("a line"))
}

/// Rows of the events about the stance with the first slip, below the header.
fn first_slip(events: &str) -> String {
    let rows: Vec<&str> = events.lines().collect();
    let slip = rows.iter().position(|row| row.contains(",slip_start,")).expect("a slip");
    [rows[0], rows[slip - 1], rows[slip], rows[slip + 1], rows[slip + 2]].join("\n")
}

/// Runs the commands of a page from its first one on, and returns the page with the output that they print now. A text
/// below a command is its whole output or the first lines of it.
fn with_present_output(bench: &Bench, page: &str) -> String {
    let mut present = page.to_owned();
    let mut output = String::new();
    for (language, content) in blocks(page) {
        if language == "sh" {
            let line = format!("set -e; footfall() {{ \"$0\" \"$@\"; }}\n{content}");
            let run = bench.shell("sh", &line).expect("a shell");
            assert!(run.status.success(), "{content}\n{}", text(&run.stderr));
            output = text(&run.stdout);
        } else if content.starts_with("t,event,") {
            present = present.replacen(content, &first_slip(&read(&bench.path("events.csv"))), 1);
        } else if language == "text" && !output.is_empty() && !content.starts_with("t,") {
            let lines: Vec<&str> = output.lines().take(content.lines().count()).collect();
            present = present.replacen(content, &lines.join("\n"), 1);
        }
    }
    present
}

#[cfg(unix)]
#[test]
fn pages_show_the_output_of_their_commands() {
    for (name, end) in [
        ("docs/start/first-recording.md", None),
        ("docs/guide/calibrate.md", Some("## Calibrate a walking foot")),
    ] {
        let path = root().join(name);
        let page = fs::read_to_string(&path).expect("the page can be read");
        let end = end.map_or(page.len(), |end| page.find(end).expect("a heading"));
        let (typed, rest) = page.split_at(end);
        let bench = Bench::new();
        let demo = bench.shell("sh", "\"$0\" && cp footfall-demo/samples.csv walk.csv");
        assert!(demo.expect("a shell").status.success());
        fs::remove_dir_all(bench.path("footfall-demo")).expect("the demo's folder");
        let present = with_present_output(&bench, typed) + rest;
        if env::var_os("FOOTFALL_UPDATE").is_some_and(|value| value == "1") {
            fs::write(&path, present).expect("the page can be written");
        } else {
            assert!(page == present, "{name}: FOOTFALL_UPDATE=1 writes\n{present}");
        }
    }
}
