//! Lists the places of a program that can still panic, and fails if `panics.txt` of its package lacks one.
//!
//! It finds each branch to a panicking function of the core library in the machine code. Debug information then names the
//! function whose source contains the branch, even if it was inlined, and the line. `panics.txt` lists these functions, each
//! under the reason why the panic is not reached, with the number of its lines that can panic if they are several. One more
//! line needs a reason, too. `nm` and `addr2line` are GNU's.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use object::{Object as _, ObjectSection as _};

use xtask::command::{Step, root};

/// Parts of the mangled names of functions that end in the panic handler, in the order in which they are tried, with
/// their meaning. A name must contain all parts of a row. The linker keeps one of several functions with the same code:
/// that of `panic_already_borrowed` is also that of a future polled after its end, of a division by zero, and others.
const ENTRIES: [(&[&str], &str); 13] = [
    (&["core9panicking18panic_bounds_check"], "index"),
    (&["core9panicking", "assert_failed"], "assert"),
    (&["core9panicking5panic17h"], "panic"),
    (&["core9panicking9panic_fmt"], "message"),
    (&["core9panicking"], "panic"),
    (&["core4cell", "panic_already"], BORROWED_OR_ENDED),
    (&["core6option13unwrap_failed"], "unwrap"),
    (&["core6option13expect_failed"], "unwrap"),
    (&["core6result13unwrap_failed"], "unwrap"),
    (&["core5slice5index"], "slice"),
    (&["core3str", "slice_error"], "slice"),
    (&["len_mismatch_fail"], "length"),
    (&["rust_begin_unwind"], "handler"),
];

/// Meaning of a function that several causes share. The frames of the branch identify the cause.
const BORROWED_OR_ENDED: &str = "borrowed or ended";

/// Checks the places of an ELF against the list, or prints them with `print`.
///
/// # Errors
/// A place is missing in the list, or the ELF cannot be read.
pub fn run(elf: &Path, print: bool) -> Result<()> {
    let found = places(elf).with_context(|| elf.display().to_string())?;
    if print {
        found.iter().for_each(|(place, lines)| println!("{}", entry(place, lines.len())));
        return Ok(());
    }
    let is_bootloader =
        elf.file_name().is_some_and(|name| name.display().to_string().starts_with("bootloader"));
    let list = if is_bootloader {
        "firmware/boards/stm32f405/bootloader/panics.txt"
    } else {
        "firmware/panics.txt"
    };
    let text = fs::read_to_string(root().join(list)).context(list)?;
    let listed = listed(&text);
    for gone in listed.keys().filter(|place| !found.contains_key(**place)) {
        println!("not in the program any more: {gone}");
    }
    let new = unlisted(&found, &listed);
    for place in &new {
        eprintln!("can panic and is not in {list}: {place}");
    }
    if !new.is_empty() {
        bail!("{}: {} places can panic and are not in {list}", elf.display(), new.len());
    }
    println!("{}: {} places can panic by the code, each is in {list}", elf.display(), found.len());
    Ok(())
}

/// Lines of source at which each place can panic.
type Places = BTreeMap<String, BTreeSet<String>>;

/// Entry of the list for a place that can panic at this number of lines.
fn entry(place: &str, lines: usize) -> String {
    if lines > 1 { format!("{place} ×{lines}") } else { place.to_owned() }
}

/// Places of a list, with the number of lines at which each can panic.
fn listed(text: &str) -> BTreeMap<&str, usize> {
    let entries = text.lines().filter(|line| line.starts_with("  ")).map(str::trim);
    let counted = entries.map(|entry| match entry.rsplit_once(" ×") {
        Some((place, lines)) => (place, lines.parse().unwrap_or(0)),
        None => (entry, 1),
    });
    counted.collect()
}

/// Places that a list lacks, or lists with fewer lines.
fn unlisted(found: &Places, listed: &BTreeMap<&str, usize>) -> Vec<String> {
    let is_new = |(place, lines): &(&String, &BTreeSet<String>)| {
        listed.get(place.as_str()).is_none_or(|listed| lines.len() > *listed)
    };
    let new = found.iter().filter(is_new);
    new.map(|(place, lines)| {
        let lines_of: Vec<&str> = lines.iter().map(String::as_str).collect();
        format!("{}: {}", entry(place, lines.len()), lines_of.join(", "))
    })
    .collect()
}

/// Places that branch to a function that panics: crate, function and meaning.
fn places(elf: &Path) -> Result<Places> {
    let name = elf.display().to_string();
    let symbols = Step::program("nm").with([&name]).output()?;
    let bytes = fs::read(elf)?;
    let file = object::File::parse(&*bytes)?;
    let text = file.section_by_name(".text").context("it has no .text")?;
    let calls = calls(&symbols, text.address() as u32, text.data()?)?;
    let addresses: Vec<String> = calls.iter().map(|(at, _)| format!("{at:#x}")).collect();
    let trace = Step::program("addr2line").with(["-aCfi", "-e", &name]).with(addresses).output()?;
    let traced = frames(&trace);
    ensure!(traced.len() == calls.len(), "{} of {} addresses traced", traced.len(), calls.len());
    let mut places = Places::new();
    for ((_, meaning), frames) in calls.into_iter().zip(traced) {
        if let Some((place, line)) = place(meaning, &frames) {
            places.entry(place).or_default().insert(line);
        }
    }
    Ok(places)
}

/// Branches to functions that panic, from the output of `nm` and the code. None at all is an error, because an ELF without
/// symbols would otherwise pass the check.
fn calls(symbols: &str, start: u32, code: &[u8]) -> Result<Vec<(u32, &'static str)>> {
    let calls = branches(start, code, &entries(symbols));
    ensure!(!calls.is_empty(), "no branch to a function that panics: is the ELF stripped?");
    Ok(calls)
}

/// Addresses of the functions that panic, from the output of `nm`, with their meaning.
fn entries(symbols: &str) -> BTreeMap<u32, &'static str> {
    let mut entries = BTreeMap::new();
    for line in symbols.lines() {
        let mut words = line.splitn(3, ' ');
        let (Some(address), Some(kind), Some(name)) = (words.next(), words.next(), words.next())
        else {
            continue;
        };
        let is_code = matches!(kind, "t" | "T" | "w" | "W");
        let mut rows = ENTRIES.iter();
        let row = rows.find(|(parts, _)| parts.iter().all(|part| name.contains(part)));
        if let (true, Some((_, meaning)), Ok(address)) =
            (is_code, row, u32::from_str_radix(address, 16))
        {
            entries.insert(address & !1, *meaning);
        }
    }
    entries
}

/// Address of each BL and B.W to one of the functions, with its meaning (Armv7-M manual, A7.7.12 and A7.7.18).
fn branches(
    start: u32,
    code: &[u8],
    entries: &BTreeMap<u32, &'static str>,
) -> Vec<(u32, &'static str)> {
    let mut branches = Vec::new();
    for (at, bytes) in (start..).step_by(2).zip(code.windows(4).step_by(2)) {
        let half = |at: usize| u32::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]));
        let (first, second) = (half(0), half(2));
        if first & 0xF800 != 0xF000 || second & 0x9000 != 0x9000 {
            continue;
        }
        let sign = first >> 10 & 1;
        let inverted = |bit: u32| !(second >> bit ^ sign) & 1;
        let offset =
            inverted(13) << 23 | inverted(11) << 22 | (first & 0x3FF) << 12 | (second & 0x7FF) << 1;
        let target = at.wrapping_add(4).wrapping_add(offset).wrapping_sub(sign << 24);
        if let Some(meaning) = entries.get(&target) {
            branches.push((at, *meaning));
        }
    }
    branches
}

/// Function and source file of one level of inlining.
type Frame<'a> = (&'a str, &'a str);

/// Frames of each address in the output of `addr2line`, the innermost first.
fn frames(trace: &str) -> Vec<Vec<Frame<'_>>> {
    let mut all: Vec<Vec<Frame<'_>>> = Vec::new();
    let mut lines = trace.lines();
    while let Some(line) = lines.next() {
        if line.starts_with("0x") {
            all.push(Vec::new());
        } else if let (Some(frames), Some(file)) = (all.last_mut(), lines.next()) {
            frames.push((line, file));
        }
    }
    all
}

/// Crate, function and meaning of a branch, and its line of source; `None` for one within the functions that panic.
fn place(meaning: &str, frames: &[Frame<'_>]) -> Option<(String, String)> {
    let (innermost, _) = frames.first()?;
    let is_of_panics = ["_fail", "_failed", "_fail_inner", "_failed_inner"]
        .iter()
        .any(|end| innermost.ends_with(end));
    if is_of_panics || innermost.contains("panicking") || innermost.contains("already_borrowed") {
        return None;
    }
    let meaning = if meaning != BORROWED_OR_ENDED {
        meaning
    } else if innermost.contains("RefCell") {
        "borrowed"
    } else if innermost.contains('{') {
        "ended"
    } else {
        "arithmetic"
    };
    // The innermost frame outside the core library and the locks around what is called.
    let is_lock =
        |owner: &str, file: &str| owner == "critical-section" || file.contains("blocking_mutex");
    let outside = frames.iter().find_map(|(name, file)| {
        let owner = owner(file).filter(|owner| !is_lock(owner, file))?;
        Some((owner, *name, *file))
    });
    let (name, file) = *frames.last()?;
    let (owner, name, file) = outside.unwrap_or(("core", name, file));
    // A discriminator may follow the line.
    let line = file.split(" (").next().unwrap_or(file);
    let line = line.rsplit_once('/').map_or(line, |(_, line)| line);
    Some((format!("{owner} {} {meaning}", function(name)), line.to_owned()))
}

/// Crate of a source file; `None` for the core library.
fn owner(file: &str) -> Option<&str> {
    if let Some((_, path)) = file.split_once("/registry/src/") {
        let folder = path.split('/').nth(1)?;
        return Some(without_version(folder));
    }
    if let Some((before, _)) = file.split_once("/out/")
        && let Some((_, folder)) = before.rsplit_once("/build/")
    {
        return folder.rsplit_once('-').map(|(name, _)| name);
    }
    if file.contains("/rustc/") || file.starts_with("??") {
        return None;
    }
    let (folder, _) = file.rsplit_once("/src/")?;
    folder.rsplit('/').next()
}

/// Name of a package without the version at its end.
fn without_version(folder: &str) -> &str {
    let is_version = |at: usize| folder[at + 1..].starts_with(|first: char| first.is_ascii_digit());
    let end = folder.match_indices('-').map(|(at, _)| at).find(|at| is_version(*at));
    &folder[..end.unwrap_or(folder.len())]
}

/// The last two parts of a function's path, without its crate's hash, parameters and closures.
fn function(name: &str) -> String {
    let (name, hash) = name.rsplit_once("::h").unwrap_or((name, ""));
    let is_hash = hash.len() == 16 && hash.bytes().all(|byte| byte.is_ascii_hexdigit());
    let name =
        if is_hash || hash.is_empty() { name.to_owned() } else { format!("{name}::h{hash}") };
    let mut name = without_closures(&name);
    while let Some(simpler) = without_one_parameter(&name) {
        name = simpler;
    }
    let parts: Vec<&str> = name.split("::").collect();
    parts[parts.len().saturating_sub(2)..].join("::")
}

/// A path without parts such as `{{closure}}` and `{async_fn#0}`.
fn without_closures(name: &str) -> String {
    let mut rest = name;
    let mut kept = String::new();
    while let Some((before, after)) = rest.split_once('{') {
        kept.push_str(before.strip_suffix("::").unwrap_or(before));
        let after = after.split_once('}').map_or("", |(_, after)| after);
        rest = after.strip_prefix('}').unwrap_or(after);
    }
    kept + rest
}

/// A path with the innermost angle brackets taken out: those at its beginning name the trait of a method, or its type,
/// and stay; all others are parameters.
fn without_one_parameter(name: &str) -> Option<String> {
    let end = name.find('>')?;
    let start = name[..end].rfind('<')?;
    let (before, inner, after) = (&name[..start], &name[start + 1..end], &name[end + 1..]);
    if before.is_empty() {
        let of_trait = inner.rsplit_once(" as ").map_or(inner, |(_, of_trait)| of_trait);
        return Some(format!("{of_trait}{after}"));
    }
    Some(format!("{}{after}", before.strip_suffix("::").unwrap_or(before)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn function_names_lose_hash_parameters_and_closures() {
        for (name, expected) in [
            ("firmware::foot::Foot::tick::h0123456789abcdef", "Foot::tick"),
            ("firmware::run::{async_fn#0}::{closure_env#1}", "firmware::run"),
            ("wire::node::Node<T, heapless::Vec<u8, 4>>::write", "Node::write"),
            ("<wire::sdo::Sdo as core::fmt::Debug>::fmt", "Debug::fmt"),
            ("core::ops::function::FnOnce::call_once{{vtable.shim}}", "FnOnce::call_once"),
        ] {
            assert_eq!(function(name), expected);
        }
    }

    #[test]
    fn source_files_name_their_crates() {
        for (file, expected) in [
            (
                "/home/me/.cargo/registry/src/index-1/embassy-sync-0.8.0/src/pipe.rs:12",
                Some("embassy-sync"),
            ),
            (
                "/footfall/target/firmware/build/stm32-metapac-0123456789abcdef/out/src/chip.rs:1",
                Some("stm32-metapac"),
            ),
            ("/rustc/abcdef/library/core/src/slice/index.rs:3", None),
            ("??:0", None),
            ("/footfall/firmware/src/foot.rs:99", Some("firmware")),
            ("/footfall/firmware/boards/stm32f405/src/can.rs:99", Some("stm32f405")),
        ] {
            assert_eq!(owner(file), expected, "{file}");
        }
    }

    #[test]
    fn branches_to_functions_that_panic_are_found() {
        let entries = BTreeMap::from([(0x0800_0100, "index"), (0x0800_0000, "slice")]);
        // At 0x0800_0010 a BL forward; behind a NOP a B.W back.
        let code = [0x00, 0xF0, 0x76, 0xF8, 0x00, 0xBF, 0xFF, 0xF7, 0xF3, 0xBF];
        let found = branches(0x0800_0010, &code, &entries);
        assert_eq!(found, [(0x0800_0010, "index"), (0x0800_0016, "slice")]);
    }

    #[test]
    fn second_panic_of_a_listed_function_is_not_listed() {
        let lines = |lines: &[&str]| lines.iter().map(|line| (*line).to_owned()).collect();
        let found = |of: &[&str]| Places::from([("wire encode index".to_owned(), lines(of))]);
        let once = listed("Why.\n  wire encode index\n");
        assert!(unlisted(&found(&["a.rs:7"]), &once).is_empty());
        let new = unlisted(&found(&["a.rs:7", "a.rs:9"]), &once);
        assert_eq!(new, ["wire encode index ×2: a.rs:7, a.rs:9"]);
        let twice = listed("  wire encode index ×2\n");
        assert!(unlisted(&found(&["a.rs:7", "a.rs:9"]), &twice).is_empty());
        assert_eq!(unlisted(&found(&["a.rs:7"]), &BTreeMap::new()).len(), 1);
    }

    #[test]
    fn frame_names_the_line_of_the_first_source_outside_the_core_library() {
        let frames = [
            ("core::slice::index", "/rustc/ab/library/core/src/slice/index.rs:3"),
            ("wire::sdo::Sdo::read", "/footfall/wire/src/sdo.rs:41 (discriminator 2)"),
        ];
        let expected = ("wire Sdo::read index".to_owned(), "sdo.rs:41".to_owned());
        assert_eq!(place("index", &frames), Some(expected));
    }

    #[test]
    fn elf_without_symbols_is_an_error() {
        let symbols = "08000101 T _ZN4core9panicking18panic_bounds_check17h0123456789abcdefE\n";
        let code = [0x00, 0xF0, 0x76, 0xF8];
        let found = calls(symbols, 0x0800_0010, &code).expect("a branch");
        assert_eq!(found, [(0x0800_0010, "index")]);
        calls("", 0x0800_0010, &code).expect_err("no symbol");
    }
}
