//! Renders the documents as a book with search, and checks its links.
//!
//! The book's source is a copy of the repository's documents at their own paths, so that links among them stay valid.
//! `docs/SUMMARY.md` lists the pages. Links to other files of the repository become links to its address.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::{Component, Path, PathBuf};

use anyhow::{Context, Result, bail};

use xtask::command::{Step, remove_folder, root};
use xtask::links::{links, with_targets};

/// Name of the renderer on crates.io, and its version.
const MDBOOK: [&str; 2] = ["mdbook", "0.5.4"];

/// Address of the repository's files.
const FILES: &str = concat!(env!("CARGO_PKG_REPOSITORY"), "/blob/main/");

/// List of the pages.
const SUMMARY: &str = "docs/SUMMARY.md";

/// No preprocessors, because they would rename `README.md`, and take braces in the documents for commands.
const CONFIGURATION: &str = r#"[book]
title = "footfall"
language = "en"

[build]
build-dir = "../book"
use-default-preprocessors = false

[output.html]
smart-punctuation = false
"#;

/// Renders the book in `target/book`, and returns its first page.
///
/// # Errors
/// The renderer cannot be installed, a page is missing, or a link of the book leads nowhere.
pub fn run() -> Result<PathBuf> {
    let source = root().join("target/book-source");
    let book = root().join("target/book");
    remove_folder(&source)?;
    remove_folder(&book)?;
    let summary = read(SUMMARY)?;
    let pages: HashSet<String> = pages(&summary).collect();
    for page in &pages {
        let text = with_targets(&read(page)?, |target| Some(resolve(target, page, &pages)));
        write(&source.join("src").join(page), text.as_bytes())?;
    }
    for picture in pictures()? {
        write(&source.join("src").join(&picture), &fs::read(root().join(&picture))?)?;
    }
    let moved = with_targets(&summary, |target| Some(join(SUMMARY, target)));
    write(&source.join("src/SUMMARY.md"), moved.as_bytes())?;
    write(&source.join("book.toml"), CONFIGURATION.as_bytes())?;

    let mdbook = install()?;
    Step::program(&mdbook.display().to_string())
        .with(["build".to_owned(), source.display().to_string()])
        .run()?;
    check(&book)?;
    Ok(book.join("index.html"))
}

/// Installs the renderer beside the tools of a release, and returns the path of its program.
fn install() -> Result<PathBuf> {
    let tools = root().join("target/release-tools");
    let [name, version] = MDBOOK;
    Step::cargo(&["install", "--locked", "--quiet", "--root", &tools.display().to_string()])
        .with(["--no-default-features", "--features", "search"])
        .with(["--version", version, name])
        .run()?;
    Ok(tools.join("bin").join(name))
}

/// Documents of the summary, relative to the root.
fn pages(summary: &str) -> impl Iterator<Item = String> + '_ {
    links(summary).map(|link| join(SUMMARY, link.target))
}

/// Pictures that documents can show, relative to the root.
fn pictures() -> Result<Vec<String>> {
    let kinds = ["*.svg", "*.png"];
    let list = ["ls-files", "--cached", "--others", "--exclude-standard", "--"];
    let files = Step::program("git").with(list).with(kinds).output()?;
    Ok(files.lines().map(str::to_owned).collect())
}

/// Path that a link from `page` leads to, relative to the root, without `.` and `..`.
fn join(page: &str, target: &str) -> String {
    let mut path = PathBuf::from(page);
    path.pop();
    for part in Path::new(target).components() {
        match part {
            Component::ParentDir => drop(path.pop()),
            Component::CurDir => {}
            part => path.push(part),
        }
    }
    path.display().to_string().replace('\\', "/")
}

/// Target in the book of a link from `page`: unchanged to a page or picture, the repository's address to another file.
fn resolve(target: &str, page: &str, pages: &HashSet<String>) -> String {
    let (path, _) = target.split_once('#').unwrap_or((target, ""));
    if target.contains("://") || path.is_empty() {
        return target.to_owned();
    }
    let to = join(page, path);
    let is_picture = ["svg", "png"].iter().any(|kind| to.ends_with(kind));
    if pages.contains(&to) || is_picture {
        return target.to_owned();
    }
    format!("{FILES}{}", join(page, target))
}

/// Checks that each link of the book leads to a file of it, and to a place on that page.
fn check(book: &Path) -> Result<()> {
    let mut pages = HashMap::new();
    collect(book, &mut pages)?;
    let mut wrong = Vec::new();
    for (page, text) in &pages {
        for link in values(text, " href=\"").chain(values(text, " src=\"")) {
            let (path, place) = link.split_once('#').unwrap_or((link, ""));
            if link.contains("://") || link.starts_with("data:") {
                continue;
            }
            let name = page.display().to_string();
            let to = if path.is_empty() { name.clone() } else { join(&name, path) };
            let to = PathBuf::from(to);
            let is_place =
                || pages.get(&to).is_none_or(|text| values(text, "id=\"").any(|id| id == place));
            if !book.join(&to).exists() || !(place.is_empty() || is_place()) {
                wrong.push(format!("{name}: {link}"));
            }
        }
    }
    wrong.sort();
    if !wrong.is_empty() {
        bail!("links of the book lead nowhere:\n{}", wrong.join("\n"));
    }
    println!("{} pages, all links lead somewhere", pages.len());
    Ok(())
}

/// Reads the pages below a folder, by their paths in the book. The page of all pages, which is for printing, repeats them.
fn collect(book: &Path, pages: &mut HashMap<PathBuf, String>) -> Result<()> {
    let mut folders = vec![book.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder)? {
            let path = entry?.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|kind| kind == "html")
                && !["print.html", "404.html", "toc.html"].iter().any(|name| path.ends_with(name))
            {
                let text = fs::read_to_string(&path)?;
                pages.insert(path.strip_prefix(book)?.to_owned(), text);
            }
        }
    }
    Ok(())
}

/// Values of an attribute, which `start` begins.
fn values<'a>(text: &'a str, start: &'a str) -> impl Iterator<Item = &'a str> {
    text.split(start).skip(1).filter_map(|rest| rest.split_once('"')).map(|(value, _)| value)
}

fn read(path: &str) -> Result<String> {
    fs::read_to_string(root().join(path)).with_context(|| path.to_owned())
}

fn write(path: &Path, content: &[u8]) -> Result<()> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    fs::write(path, content).with_context(|| path.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rewritten(text: &str) -> String {
        let pages = HashSet::from(["README.md".to_owned(), "docs/guide/watch.md".to_owned()]);
        let page = "docs/guide/watch.md";
        with_targets(text, |target| Some(resolve(target, page, &pages)))
    }

    #[test]
    fn links_to_pages_and_pictures_stay() {
        let text = "[a](../../README.md#install) ![b](../pictures/demo.svg) [c](#sources) [d](https://x.org)\n";
        assert_eq!(rewritten(text), text);
    }

    #[test]
    fn links_to_code_lead_to_the_repository() {
        let text = "[a](../../wire/src/lib.rs#L1), [b](../../wire)\n";
        let expected = format!("[a]({FILES}wire/src/lib.rs#L1), [b]({FILES}wire)\n");
        assert_eq!(rewritten(text), expected);
    }

    #[test]
    fn link_to_a_missing_place_fails() {
        let folder = root().join("target/tmp/book-test");
        let page = |text: &str| {
            write(&folder.join("a.html"), text.as_bytes()).expect("a page");
            check(&folder)
        };
        page(r#"<a href="a.html#here"></a><p id="here"></p>"#).expect("a valid link");
        page(r#"<a href="a.html#there"></a>"#).expect_err("no such place");
        page(r#"<a href="b.html"></a>"#).expect_err("no such page");
    }

    #[test]
    fn summary_lists_each_page_of_the_documents() {
        let summary = read(SUMMARY).expect("the summary");
        let listed: HashSet<String> = pages(&summary).collect();
        let files = Step::program("git").with(["ls-files", "docs/*.md"]).output().expect("files");
        let missing = files.lines().filter(|file| *file != SUMMARY && !listed.contains(*file));
        let missing: Vec<&str> = missing.collect();
        assert!(missing.is_empty(), "not in {SUMMARY}: {missing:?}");
    }
}
