//! Imports between the source files of a crate, read from their text, and the circles that they form.
//!
//! A file imports the file that defines an item which it names; re-exports are followed. Three relations are not
//! imports: the declaration of a module, the re-export of an item, and the use of an item of a module above, of
//! which the file is a part. Tests are left out.

mod text;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use text::Use;

/// Most re-exports of an item on its way; ends a re-export of itself.
const MOST_REEXPORTS: usize = 8;

/// Path of a module from the root of its crate.
type Module = Vec<String>;

/// Modules that a file imports, with the names of the items.
type Edges = BTreeMap<Module, BTreeSet<String>>;

/// One source file.
struct Source {
    /// Path from the `src` folder.
    file: String,
    tokens: Vec<String>,
    uses: Vec<Use>,
}

/// Source files of a crate, by their modules.
pub struct Imports {
    sources: BTreeMap<Module, Source>,
}

impl Imports {
    /// Reads the files below a `src` folder, without separate test files.
    ///
    /// # Panics
    /// A file cannot be read.
    #[must_use]
    pub fn read(src: &Path) -> Self {
        let mut texts = BTreeMap::new();
        read_folder(src, "", &mut texts);
        // A program beside a library is a crate of its own.
        if texts.contains_key("lib.rs") {
            texts.retain(|file, _| file != "main.rs" && !file.starts_with("bin/"));
        }
        Self::of(texts)
    }

    /// Takes the texts of a crate's files, by their path from the `src` folder.
    #[must_use]
    pub fn of(texts: BTreeMap<String, String>) -> Self {
        let source = |(file, text): (String, String)| {
            let tokens = text::tokens(&text);
            let uses = text::uses(&tokens);
            (module(&file), Source { file, tokens, uses })
        };
        Self {
            sources: texts.into_iter().map(source).collect(),
        }
    }

    /// Returns a line for each import that is part of a circle.
    #[must_use]
    pub fn circles(&self) -> Vec<String> {
        let modules = self.sources.keys();
        let edges: BTreeMap<&Module, Edges> = modules.map(|of| (of, self.edges(of))).collect();
        let mut lines = Vec::new();
        for (from, imported) in &edges {
            for (to, names) in imported {
                if reaches(to, from, &edges) {
                    let names: Vec<&str> = names.iter().map(String::as_str).collect();
                    let [from, to] = [*from, to].map(|module| &self.sources[module].file);
                    lines.push(format!("{from} -> {to}: {}", names.join(", ")));
                }
            }
        }
        lines
    }

    /// Returns the imports of a file.
    fn edges(&self, of: &Module) -> Edges {
        let source = &self.sources[of];
        let outside = text::outside_uses(&source.tokens);
        // A name that is only re-exported does not occur again.
        let is_used = |import: &&Use| !import.is_public || outside.contains(&import.name);
        let imported = source.uses.iter().filter(is_used);
        let mut paths = text::paths(&outside);
        paths.extend(imported.map(|import| import.path.clone()));
        let mut edges = Edges::new();
        for path in paths {
            if let Some((to, name)) = self.definition(of, &path, 0)
                && !of.starts_with(&to)
            {
                edges.entry(to).or_default().insert(name);
            }
        }
        edges
    }

    /// Returns the module that defines the item at a path as a file writes it, and the item's name; `None` for a
    /// module, and for an item of another crate.
    fn definition(&self, from: &Module, path: &[String], depth: usize) -> Option<(Module, String)> {
        let mut module = from.clone();
        let mut rest = path;
        while let Some((first, after)) = rest.split_first() {
            match first.as_str() {
                "crate" => module.clear(),
                "super" => {
                    module.pop()?;
                }
                "self" => {}
                _ => break,
            }
            rest = after;
        }
        let is_local = rest.len() == path.len();
        while let Some((next, after)) = rest.split_first() {
            let deeper = [&module[..], std::slice::from_ref(next)].concat();
            if !self.sources.contains_key(&deeper) {
                break;
            }
            (module, rest) = (deeper, after);
        }
        let (item, after) = rest.split_first()?;
        let source = self.sources.get(&module)?;
        if source.defines(item) || depth == MOST_REEXPORTS {
            return Some((module, item.clone()));
        }
        for import in &source.uses {
            let path = if import.name == *item {
                [&import.path[..], after].concat()
            } else if import.name == "*" {
                [&import.path[..], rest].concat()
            } else {
                continue;
            };
            let found = self.definition(&module, &path, depth + 1);
            let is_there = |(at, name): &(Module, String)| self.sources[at].defines(name);
            if import.name == *item || found.as_ref().is_some_and(is_there) {
                return found;
            }
        }
        // A name that the file neither defines nor imports is another crate or a local variable.
        (!is_local || module != *from).then(|| (module, item.clone()))
    }
}

impl Source {
    /// Returns whether the file defines an item of this name.
    fn defines(&self, name: &str) -> bool {
        const KINDS: [&str; 7] = ["fn", "struct", "enum", "trait", "type", "const", "static"];
        let mut pairs = self.tokens.windows(2);
        pairs.any(|pair| pair[1] == name && KINDS.contains(&pair[0].as_str()))
    }
}

/// Returns whether imports lead from a module to another.
fn reaches(from: &Module, to: &Module, edges: &BTreeMap<&Module, Edges>) -> bool {
    let mut reached = BTreeSet::new();
    let mut left = vec![from];
    while let Some(module) = left.pop() {
        if module == to {
            return true;
        }
        if reached.insert(module) {
            left.extend(edges[module].keys());
        }
    }
    false
}

fn read_folder(folder: &Path, prefix: &str, texts: &mut BTreeMap<String, String>) {
    for entry in fs::read_dir(folder).expect("the folder can be read") {
        let path = entry.expect("the entry can be read").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if path.is_dir() {
            if name != "tests" {
                read_folder(&path, &format!("{prefix}{name}/"), texts);
            }
        } else if name.ends_with(".rs") && name != "tests.rs" {
            let text = fs::read_to_string(&path).expect("the file can be read");
            texts.insert(format!("{prefix}{name}"), text);
        }
    }
}

/// Returns the module of a file: `a::b` of `a/b.rs` and of `a/b/mod.rs`.
fn module(file: &str) -> Module {
    let parts = file.trim_end_matches(".rs").split('/');
    let mut parts: Module = parts.map(str::to_owned).collect();
    parts.pop_if(|last| ["mod", "lib", "main"].contains(&last.as_str()));
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circles(files: &[(&str, &str)]) -> Vec<String> {
        let text = |(file, text): &(&str, &str)| ((*file).to_owned(), (*text).to_owned());
        Imports::of(files.iter().map(text).collect()).circles()
    }

    #[test]
    fn circle_is_found_through_reexports_and_paths() {
        let found = circles(&[
            (
                "lib.rs",
                "mod a;\nmod b;\npub use b::{first, Second as Third};",
            ),
            (
                "a.rs",
                "use crate::Third;\npub fn helper() -> Third { crate::first() }",
            ),
            (
                "b/mod.rs",
                "mod inner;\npub struct Second;\npub use inner::*;",
            ),
            ("b/inner.rs", "pub fn first() { crate::a::helper() }"),
        ]);
        assert_eq!(
            found,
            ["a.rs -> b/inner.rs: first", "b/inner.rs -> a.rs: helper"]
        );
    }

    #[test]
    fn parts_reexports_and_tests_are_excluded() {
        let found = circles(&[
            ("lib.rs", "pub mod a;\nmod b;\npub use a::Item;"),
            (
                "a.rs",
                "mod part;\npub struct Item;\nfn act() { part::act() } // crate::b::other",
            ),
            (
                "a/part.rs",
                "use super::Item;\npub fn act() -> &'static str { \"crate::b::other\" }",
            ),
            (
                "b.rs",
                "use crate::a::Item;\nfn other(_: char) { other('\"') }\n#[cfg(test)]\nmod tests { use crate::a::part; }",
            ),
        ]);
        assert_eq!(found, [""; 0]);
    }
}
