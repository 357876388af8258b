//! Results of measurements. `laboratory/results/NAME.json` holds the figures of one measurement, and the documents show them in
//! generated blocks.
//!
//! # Add a result
//!
//! 1. The test that measures describes its result and compares it. Units stand in the keys. Figures are rounded to the
//!    digits that are meant, so that two machines write the same file:
//!
//!    ```no_run
//!    use results::{Measurement, rounded};
//!
//!    let mut result = Measurement::new("bus-load", "Load of the CAN bus by the number of feet.")
//!        .measured_by("cargo test -p virtual-board bus_of_each_wiring_carries_all_contacts")
//!        .on_elf("foot", "1c6cc2a9e1fa1490".to_owned())
//!        .value("bit_rate_kbit_s", 1000);
//!    for (feet, load) in [(1, 13.02), (4, 52.11)] {
//!        result.row([("feet", feet.into()), ("load_percent", rounded(load, 1).into())]);
//!    }
//!    result.assert_reproduced();
//!    ```
//!
//! 2. A document gets the lines `<!-- begin NAME -->` and `<!-- end NAME -->`, and [`tables`] the function that renders
//!    the text between them.
//! 3. `FOOTFALL_UPDATE=1` in the environment of the test writes the file and the block.
//!
//! Use [`Measurement::assert_current`] in tests of the default run, whose figures are compared on every program. Use
//! [`Measurement::assert_reproduced`] in tests that take longer, whose result may belong to an older program until they
//! run again.

pub mod tables;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};
use std::{env, fs};

use anyhow::{Context, Result, bail};
use bootloader::flash::Slot;
use bootloader::image::HEADER;
use bootloader::verify::Hash;
use program_images::segments;
use serde_json::{Map, Value};

/// A measurement that has just been made.
#[derive(Debug)]
pub struct Measurement {
    name: &'static str,
    what: &'static str,
    command: String,
    elf: BTreeMap<String, String>,
    machine: Option<String>,
    values: Vec<(&'static str, Value)>,
    rows: Vec<Vec<(&'static str, Value)>>,
    /// Keys whose numbers may differ, and by which share of the stored number.
    tolerances: Vec<(&'static str, f64)>,
}

impl Measurement {
    /// Creates a measurement without figures. `name` is the name of its file without `.json`. `what` describes the
    /// measured quantity in one sentence.
    #[must_use]
    pub fn new(name: &'static str, what: &'static str) -> Self {
        Self {
            name,
            what,
            command: String::new(),
            elf: BTreeMap::new(),
            machine: None,
            values: Vec::new(),
            rows: Vec::new(),
            tolerances: Vec::new(),
        }
    }

    /// Sets the command that measures again.
    #[must_use]
    pub fn measured_by(mut self, command: &str) -> Self {
        self.command = command.to_owned();
        self
    }

    /// Adds a program on which it was measured, with its [`digest`].
    #[must_use]
    pub fn on_elf(mut self, program: &str, digest: String) -> Self {
        self.elf.insert(program.to_owned(), digest);
        self
    }

    /// Adds the machine on which it was measured, for figures that depend on it.
    #[must_use]
    pub fn on_this_machine(mut self) -> Self {
        self.machine = Some(machine());
        self
    }

    /// Adds a figure.
    #[must_use]
    pub fn value(mut self, key: &'static str, value: impl Into<Value>) -> Self {
        self.values.push((key, value.into()));
        self
    }

    /// Adds a row of figures.
    pub fn row(&mut self, figures: impl IntoIterator<Item = (&'static str, Value)>) {
        self.rows.push(figures.into_iter().collect());
    }

    /// Lets the numbers under a key, in values and rows, differ by a share of the stored number. An infinite share
    /// excludes them from the comparison.
    #[must_use]
    pub fn tolerance(mut self, key: &'static str, share: f64) -> Self {
        self.tolerances.push((key, share));
        self
    }

    /// Checks that the stored figures are these, on whatever program they were measured. With `FOOTFALL_UPDATE=1` in
    /// the environment they are written instead, if they differ or if their commit is not in the history.
    ///
    /// # Panics
    /// If figures differ by more than their tolerance, or a file cannot be read or written.
    pub fn assert_current(&self) {
        if let Err(problem) = self.compare(true) {
            panic!("{problem:#}");
        }
    }

    /// Checks the same if the stored figures belong to this program. For another program, prints the differences. With
    /// `FOOTFALL_UPDATE=1` in the environment the figures are written instead.
    ///
    /// # Panics
    /// If figures of this program differ by more than their tolerance, or a file cannot be read or written.
    pub fn assert_reproduced(&self) {
        if let Err(problem) = self.compare(false) {
            panic!("{problem:#}");
        }
    }

    fn compare(&self, on_every_program: bool) -> Result<()> {
        // Tests run in parallel, and several results are in one document.
        static TURN: Mutex<()> = Mutex::new(());
        let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let stored = Stored::read(self.name);
        let differences = match &stored {
            Ok(stored) => self.differences(stored),
            Err(problem) => vec![format!("{problem:#}")],
        };
        let is_same_elf = stored.as_ref().is_ok_and(|stored| stored.elf() == self.elf);
        if env::var_os("FOOTFALL_UPDATE").is_some_and(|value| value == "1") {
            // Without its commit, nobody can measure the same program again.
            let is_lost = stored.is_ok_and(|stored| stored.is_lost());
            if differences.is_empty() && is_same_elf && !is_lost {
                return Ok(());
            }
            return self.write();
        }
        if differences.is_empty() {
            return Ok(());
        }
        let differences = differences.join("\n  ");
        if on_every_program || is_same_elf {
            bail!(
                "{} has other figures:\n  {differences}\nFOOTFALL_UPDATE=1 in the environment writes it again",
                file(self.name)
            );
        }
        println!("{} is of another program:\n  {differences}", file(self.name));
        Ok(())
    }

    /// Writes the file, and the blocks of the documents.
    ///
    /// # Errors
    /// A file cannot be read or written.
    pub fn write(&self) -> Result<()> {
        fs::create_dir_all(folder())?;
        fs::write(path(self.name), self.text(&Origin::now()?))?;
        render()
    }

    /// Figures that differ from the stored ones, in words.
    fn differences(&self, stored: &Stored) -> Vec<String> {
        let object = |fields: &[(&'static str, Value)]| -> Value {
            let fields = fields.iter().map(|(key, value)| ((*key).to_owned(), value.clone()));
            Value::Object(fields.collect())
        };
        let rows: Vec<Value> = self.rows.iter().map(|row| object(row)).collect();
        let measured = Map::from_iter([
            ("values".to_owned(), object(&self.values)),
            ("rows".to_owned(), Value::Array(rows)),
        ]);
        let mut found = Vec::new();
        for (key, measured) in measured {
            let nothing =
                if measured.is_array() { Value::Array(vec![]) } else { Value::Object(Map::new()) };
            let stored = stored.json.get(&key).unwrap_or(&nothing);
            self.compare_values(&key, "", stored, &measured, &mut found);
        }
        found
    }

    fn compare_values(
        &self,
        place: &str,
        key: &str,
        stored: &Value,
        measured: &Value,
        found: &mut Vec<String>,
    ) {
        match (stored, measured) {
            (Value::Object(was), Value::Object(is)) if was.keys().eq(is.keys()) => {
                for (key, is) in is {
                    self.compare_values(&format!("{place}.{key}"), key, &was[key], is, found);
                }
            }
            (Value::Array(was), Value::Array(is)) if was.len() == is.len() => {
                for (index, (was, is)) in was.iter().zip(is).enumerate() {
                    let place = format!("{place}[{}]", self.row_name(place, index));
                    self.compare_values(&place, key, was, is, found);
                }
            }
            (Value::Array(was), Value::Array(is)) if place == "rows" => {
                found.push(format!("there are {} rows, not {}", is.len(), was.len()));
            }
            (Value::Number(was), Value::Number(is)) => {
                let [was, is] = [was, is].map(|number| number.as_f64().unwrap_or(f64::NAN));
                let share = self.tolerances.iter().find(|(of, _)| *of == key);
                let tolerance = share.map_or(0.0, |(_, share)| share * was.abs());
                if was != is && (is - was).abs() > tolerance {
                    found.push(format!("{place} is {is}, not {was}"));
                }
            }
            (was, is) if was != is => {
                found.push(format!("{place} is {}, not {}", in_line(is), in_line(was)));
            }
            _ => {}
        }
    }

    /// Name of an entry in a difference: of a row the text that it begins with, else the index.
    fn row_name(&self, place: &str, index: usize) -> String {
        let row = self.rows.get(index).filter(|_| place == "rows");
        let first = row.and_then(|row| row.first()?.1.as_str());
        first.map_or_else(|| index.to_string(), str::to_owned)
    }

    /// Content of the file.
    fn text(&self, origin: &Origin) -> String {
        let quoted = |text: &str| Value::from(text).to_string();
        let object = |fields: &[(&'static str, Value)]| {
            let fields =
                fields.iter().map(|(key, value)| format!("{}: {}", quoted(key), in_line(value)));
            fields.collect::<Vec<String>>()
        };
        let mut text = format!(
            "{{\n  \"what\": {},\n  \"command\": {},\n  \"commit\": {},\n  \"date\": {}",
            quoted(self.what),
            quoted(&self.command),
            quoted(&origin.commit),
            quoted(&origin.date)
        );
        if let Some(machine) = &self.machine {
            text += &format!(",\n  \"machine\": {}", quoted(machine));
        }
        let elf = self.elf.iter();
        let elf = elf.map(|(name, digest)| format!("{}: {}", quoted(name), quoted(digest)));
        let rows = self.rows.iter().map(|row| format!("{{{}}}", object(row).join(", ")));
        for (key, [open, close], lines) in [
            ("elf", ["{", "}"], elf.collect::<Vec<String>>()),
            ("values", ["{", "}"], object(&self.values)),
            ("rows", ["[", "]"], rows.collect()),
        ] {
            if !lines.is_empty() {
                text +=
                    &format!(",\n  \"{key}\": {open}\n    {}\n  {close}", lines.join(",\n    "));
            }
        }
        text + "\n}\n"
    }
}

/// A value in one line.
fn in_line(value: &Value) -> String {
    match value {
        Value::Array(values) => {
            let values: Vec<String> = values.iter().map(in_line).collect();
            format!("[{}]", values.join(", "))
        }
        Value::Object(fields) => {
            let field = |(key, value): (&String, &Value)| {
                format!("{}: {}", Value::from(key.as_str()), in_line(value))
            };
            let fields: Vec<String> = fields.iter().map(field).collect();
            format!("{{{}}}", fields.join(", "))
        }
        value => value.to_string(),
    }
}

/// Commit and day of a measurement.
struct Origin {
    commit: String,
    date: String,
}

impl Origin {
    /// The commit that is checked out, with a remark if sources differ from it, and today.
    fn now() -> Result<Self> {
        let commit = output("git", &["rev-parse", "--short=8", "HEAD"])?;
        let sources = ["status", "--porcelain", "--", ".", ":!*.json", ":!*.md"];
        let remark = if output("git", &sources)?.is_empty() { "" } else { " and changes" };
        let date = output("date", &["--utc", "+%F"])?;
        Ok(Self { commit: commit + remark, date })
    }
}

/// Output of a program that runs in the root of the repository, without its last line break.
fn output(program: &str, arguments: &[&str]) -> Result<String> {
    let output = Command::new(program).current_dir(root()).args(arguments).output();
    let output = output.with_context(|| format!("{program} does not start"))?;
    if !output.status.success() {
        bail!("{program}: {}", String::from_utf8_lossy(&output.stderr).trim());
    }
    Ok(String::from_utf8(output.stdout)?.trim_end().to_owned())
}

/// Processor and number of cores of this machine.
fn machine() -> String {
    let info = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    let name = name.map_or("an unknown processor", |(_, name)| name);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{name}, {cores} cores")
}

/// Rounds a figure to a number of decimals.
///
/// # Panics
/// Never: a formatted number is a number.
#[must_use]
pub fn rounded(figure: f64, decimals: usize) -> f64 {
    format!("{figure:.decimals$}").parse().expect("a number")
}

/// A result in the repository.
#[derive(Clone, Debug)]
pub struct Stored {
    name: String,
    json: Value,
}

impl Stored {
    /// Reads the result of this name.
    ///
    /// # Errors
    /// The file is missing or is not JSON.
    pub fn read(name: &str) -> Result<Self> {
        let text = fs::read_to_string(path(name)).with_context(|| file(name))?;
        let json = serde_json::from_str(&text).with_context(|| file(name))?;
        Ok(Self { name: name.to_owned(), json })
    }

    /// Reads all results, in the order of their names.
    ///
    /// # Errors
    /// The folder or a file cannot be read.
    pub fn all() -> Result<Vec<Self>> {
        let entries = fs::read_dir(folder()).context("results")?;
        let mut names = vec![IN_THE_PRODUCT.0.to_owned()];
        for entry in entries {
            let path = entry?.path();
            if path.extension().is_some_and(|extension| extension == "json") {
                names.extend(path.file_stem().map(|name| name.display().to_string()));
            }
        }
        names.sort();
        names.iter().map(|name| Self::read(name)).collect()
    }

    /// The values.
    #[must_use]
    pub fn values(&self) -> Figures<'_> {
        Figures { place: format!("{}: values", file(&self.name)), json: &self.json["values"] }
    }

    /// The rows.
    #[must_use]
    pub fn rows(&self) -> Vec<Figures<'_>> {
        let rows = self.json["rows"].as_array().map_or(&[][..], Vec::as_slice);
        let place = |index| format!("{}: row {index}", file(&self.name));
        let rows = rows.iter().enumerate();
        rows.map(|(index, json)| Figures { place: place(index + 1), json }).collect()
    }

    /// Programs on which it was measured, and their digests.
    fn elf(&self) -> BTreeMap<String, String> {
        let programs = self.json["elf"].as_object().into_iter().flatten();
        let programs = programs
            .map(|(name, digest)| (name.clone(), digest.as_str().unwrap_or_default().to_owned()));
        programs.collect()
    }

    /// A text beside the figures: `commit`, `date`, `machine`.
    fn text(&self, key: &str) -> Result<&str> {
        let text = self.json[key].as_str();
        text.with_context(|| format!("{} has no text `{key}`", file(&self.name)))
    }

    /// Programs that are built now with another digest than when it was measured.
    ///
    /// # Errors
    /// An ELF cannot be read.
    fn older_programs(&self) -> Result<Vec<String>> {
        let mut older = Vec::new();
        for (name, measured) in self.elf() {
            let elf = root().join("target/thumbv7em-none-eabihf/firmware").join(&name);
            if !elf.is_file() {
                continue;
            }
            let built = digest(&fs::read(&elf)?)?;
            if built != measured {
                older.push(format!("`{name}` was {measured}, is {built}"));
            }
        }
        Ok(older)
    }

    /// Returns whether its commit is not in the history, as after a rebase. Always false in a clone without all commits, and
    /// outside a repository.
    fn is_lost(&self) -> bool {
        // A remark may follow.
        let commit = self.json["commit"].as_str().unwrap_or_default();
        let hash = commit.split(' ').next().unwrap_or_default();
        has_all_commits() && output("git", &["merge-base", "--is-ancestor", hash, "HEAD"]).is_err()
    }
}

/// Returns whether this is a repository with its whole history.
fn has_all_commits() -> bool {
    output("git", &["rev-parse", "--is-shallow-repository"]).ok().as_deref() == Some("false")
}

/// Figures of a result by their keys.
#[derive(Clone, Debug)]
pub struct Figures<'a> {
    place: String,
    json: &'a Value,
}

impl<'a> Figures<'a> {
    /// A text.
    ///
    /// # Errors
    /// There is no text under this key.
    pub fn text(&self, key: &str) -> Result<&'a str> {
        self.json[key].as_str().with_context(|| format!("{} has no text `{key}`", self.place))
    }

    /// A number.
    ///
    /// # Errors
    /// There is not a number under this key.
    pub fn number(&self, key: &str) -> Result<f64> {
        self.json[key].as_f64().with_context(|| format!("{} has no number `{key}`", self.place))
    }

    /// A number, or `None` if it is null.
    ///
    /// # Errors
    /// The key has neither.
    pub fn optional(&self, key: &str) -> Result<Option<f64>> {
        match self.json.get(key) {
            Some(Value::Null) => Ok(None),
            _ => self.number(key).map(Some),
        }
    }

    /// A condition.
    ///
    /// # Errors
    /// There is none under this key.
    pub fn flag(&self, key: &str) -> Result<bool> {
        self.json[key].as_bool().with_context(|| format!("{} has no condition `{key}`", self.place))
    }

    /// A list of texts.
    ///
    /// # Errors
    /// The key is missing, or its value is not an array of texts.
    pub fn texts(&self, key: &str) -> Result<Vec<&'a str>> {
        let texts = self.json[key].as_array();
        let texts = texts.and_then(|texts| texts.iter().map(Value::as_str).collect());
        texts.with_context(|| format!("{} has no texts `{key}`", self.place))
    }

    /// A list of numbers, each of which may be null.
    ///
    /// # Errors
    /// The key is missing, or its value is not an array.
    pub fn numbers(&self, key: &str) -> Result<Vec<Option<f64>>> {
        let numbers = self.json[key].as_array();
        let numbers = numbers.with_context(|| format!("{} has no numbers `{key}`", self.place))?;
        Ok(numbers.iter().map(Value::as_f64).collect())
    }

    /// Figures below this key.
    ///
    /// # Errors
    /// The key is missing, or its value is not an object.
    pub fn figures(&self, key: &str) -> Result<Self> {
        let json = self.json.get(key).filter(|json| json.is_object());
        let json = json.with_context(|| format!("{} has no figures `{key}`", self.place))?;
        Ok(Self { place: format!("{}.{key}", self.place), json })
    }

    /// Rows of figures below this key.
    ///
    /// # Errors
    /// The key is missing, or its value is not an array.
    pub fn rows(&self, key: &str) -> Result<Vec<Self>> {
        let rows = self.json[key].as_array();
        let rows = rows.with_context(|| format!("{} has no rows `{key}`", self.place))?;
        let place = |index| format!("{}.{key}[{index}]", self.place);
        let rows = rows.iter().enumerate();
        Ok(rows.map(|(index, json)| Self { place: place(index), json }).collect())
    }
}

/// Digest of an ELF: the first bytes of the SHA-256 of the addresses and contents that are loaded. It excludes the
/// header in front of a program, because that contains the commit.
///
/// # Errors
/// The file is not an ELF for Arm.
pub fn digest(elf: &[u8]) -> Result<String> {
    let mut segments = segments(elf)?;
    segments.sort_unstable();
    let header = Slot::Running.start()..Slot::Running.start() + HEADER as u32;
    let mut hash = Hash::new();
    for (start, bytes) in segments {
        let loaded = (start..).zip(bytes);
        for (address, byte) in loaded.filter(|(address, _)| !header.contains(address)) {
            hash.update(&address.to_le_bytes());
            hash.update(&[*byte]);
        }
    }
    let mut text = String::new();
    for byte in hash.finish().into_iter().take(8) {
        write!(text, "{byte:02x}")?;
    }
    Ok(text)
}

/// Root of the repository.
#[must_use]
pub fn root() -> &'static Path {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.ancestors().nth(2).unwrap_or(package)
}

/// Writes all generated blocks of the documents that show results.
///
/// # Errors
/// A result lacks a figure, or a document lacks a block.
pub fn render() -> Result<()> {
    for (page, text) in pages()? {
        let path = root().join(&page);
        if fs::read_to_string(&path).with_context(|| page.clone())? != text {
            fs::write(&path, text).with_context(|| page.clone())?;
            println!("wrote {page}");
        }
    }
    Ok(())
}

/// Checks that the generated blocks show the results.
///
/// # Errors
/// A document differs, a result lacks a figure, or a document lacks a block.
pub fn check() -> Result<()> {
    for (page, text) in pages()? {
        let committed = fs::read_to_string(root().join(&page)).with_context(|| page.clone())?;
        let mut lines = (1..).zip(committed.lines().zip(text.lines()));
        if let Some((line, (was, is))) = lines.find(|(_, (was, is))| was != is) {
            bail!(
                "{page}:{line} does not show the results: it says\n  {was}\nand should say\n  {is}\n`cargo laboratory results` writes it"
            );
        }
        if committed != text {
            bail!("{page} does not show the results: `cargo laboratory results` writes it");
        }
    }
    Ok(())
}

/// Documents with blocks that show results, and their text as it should be.
fn pages() -> Result<Vec<(String, String)>> {
    let mut pages: Vec<(String, String)> = Vec::new();
    for block in tables::blocks()? {
        let at = match pages.iter().position(|(page, _)| page == block.page) {
            Some(at) => at,
            None => {
                let text = fs::read_to_string(root().join(block.page));
                pages.push((block.page.to_owned(), text.context(block.page)?));
                pages.len() - 1
            }
        };
        let (page, text) = &mut pages[at];
        *text = with_block(text, block.name, &block.text).with_context(|| page.clone())?;
    }
    Ok(pages)
}

/// Replaces the text between the lines `<!-- begin NAME -->` and `<!-- end NAME -->` of a Markdown text.
///
/// # Errors
/// The text has no such block.
pub fn with_block(text: &str, name: &str, content: &str) -> Result<String> {
    let begin = format!("<!-- begin {name} -->\n");
    let end = format!("<!-- end {name} -->");
    let from = text.find(&begin).map(|at| at + begin.len());
    let from = from.with_context(|| format!("there is no block `{name}`"))?;
    let to = text[from..].find(&end).map(|at| from + at);
    let to = to.with_context(|| format!("the block `{name}` has no end"))?;
    Ok(format!("{}{content}{}", &text[..from], &text[to..]))
}

/// Prints the results that were measured on other programs than are built now, and results whose commit is
/// not in the history.
///
/// # Errors
/// A result or an ELF cannot be read.
pub fn print_older() -> Result<()> {
    for result in older()? {
        println!("measured on an older program: {result}");
    }
    for result in lost()? {
        println!("measured at a commit that is not in the history: {result}");
    }
    Ok(())
}

/// Results whose commit is [not in the history](Stored::is_lost): names, commits, and the command that repeats the
/// measurement.
fn lost() -> Result<Vec<String>> {
    let mut lost = Vec::new();
    for result in Stored::all()? {
        if result.is_lost() {
            let [commit, command] = [result.text("commit")?, result.text("command")?];
            lost.push(format!("{}: {commit}; {command}", result.name));
        }
    }
    Ok(lost)
}

/// Refuses results that were measured on other programs than are built now.
///
/// # Errors
/// Such a result exists, or a file cannot be read.
pub fn refuse_older() -> Result<()> {
    let older = older()?;
    if !older.is_empty() {
        bail!(
            "measured on other programs:\n  {}\n`.ci/run` and `.ci/full` with FOOTFALL_UPDATE=1 in the environment measure them again",
            older.join("\n  ")
        );
    }
    Ok(())
}

/// Results that were measured on other programs than the present builds: names, digests, and the command that repeats
/// the measurement.
fn older() -> Result<Vec<String>> {
    let mut older = Vec::new();
    for result in Stored::all()? {
        let programs = result.older_programs()?;
        if !programs.is_empty() {
            let command = result.text("command")?;
            older.push(format!("{}: {}; {command}", result.name, programs.join(", ")));
        }
    }
    Ok(older)
}

/// Folder of the results, relative to the root.
const FOLDER: &str = "laboratory/results";

/// Result that the product contains: `footfall accept` shows its figures.
const IN_THE_PRODUCT: (&str, &str) = ("acceptance", "host/footfall/src/commands/acceptance.json");

/// Folder of the results.
fn folder() -> PathBuf {
    root().join(FOLDER)
}

/// File of a result, relative to the root.
fn file(name: &str) -> String {
    let (in_the_product, file) = IN_THE_PRODUCT;
    if name == in_the_product { file.to_owned() } else { format!("{FOLDER}/{name}.json") }
}

/// File of a result.
fn path(name: &str) -> PathBuf {
    root().join(file(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measurement(load_percent: f64) -> Measurement {
        let mut measurement = Measurement::new("made", "Load of the bus.")
            .measured_by("cargo test bus")
            .on_elf("foot", "00".to_owned())
            .value("frames", 7);
        measurement.row([("wiring", "a star".into()), ("load_percent", load_percent.into())]);
        measurement
    }

    fn stored(measurement: &Measurement) -> Stored {
        let origin = Origin { commit: "0123abcd".to_owned(), date: "2026-11-29".to_owned() };
        let json = serde_json::from_str(&measurement.text(&origin)).expect("JSON");
        Stored { name: measurement.name.to_owned(), json }
    }

    #[test]
    fn file_has_a_line_for_each_figure_and_each_row() {
        let origin = Origin { commit: "0123abcd".to_owned(), date: "2026-11-29".to_owned() };
        let expected = r#"{
  "what": "Load of the bus.",
  "command": "cargo test bus",
  "commit": "0123abcd",
  "date": "2026-11-29",
  "elf": {
    "foot": "00"
  },
  "values": {
    "frames": 7
  },
  "rows": [
    {"wiring": "a star", "load_percent": 13.5}
  ]
}
"#;
        assert_eq!(measurement(13.5).text(&origin), expected);
    }

    #[test]
    fn other_figure_is_reported_with_its_place() {
        let stored = stored(&measurement(13.5));
        assert!(measurement(13.5).differences(&stored).is_empty());
        let differences = measurement(13.6).differences(&stored);
        assert_eq!(differences, ["rows[a star].load_percent is 13.6, not 13.5"]);
    }

    #[test]
    fn other_keys_and_other_numbers_of_rows_are_reported() {
        let stored = stored(&measurement(13.5));
        let with_value = measurement(13.5).value("drops", 0);
        assert_eq!(with_value.differences(&stored).len(), 1);
        let mut with_row = measurement(13.5);
        with_row.row([("wiring", "two lines".into())]);
        assert_eq!(with_row.differences(&stored), ["there are 2 rows, not 1"]);
    }

    #[test]
    fn number_may_differ_by_its_tolerance() {
        let stored = stored(&measurement(10.0));
        let within = |load| measurement(load).tolerance("load_percent", 0.05).differences(&stored);
        assert!(within(10.4).is_empty());
        assert_eq!(within(10.6).len(), 1);
        let excluded = measurement(99.0).tolerance("load_percent", f64::INFINITY);
        assert!(excluded.differences(&stored).is_empty());
    }

    #[test]
    fn missing_figure_is_named_with_its_file_and_row() {
        let stored = stored(&measurement(13.5));
        let problem = stored.rows()[0].number("drops").expect_err("missing");
        assert_eq!(
            problem.to_string(),
            "laboratory/results/made.json: row 1 has no number `drops`"
        );
    }

    #[test]
    fn block_is_replaced_between_its_lines() {
        let text = "a\n<!-- begin x -->\nold\n<!-- end x -->\nb\n";
        let replaced = with_block(text, "x", "new\n").expect("a block");
        assert_eq!(replaced, "a\n<!-- begin x -->\nnew\n<!-- end x -->\nb\n");
        assert!(with_block(text, "y", "").is_err());
    }

    #[test]
    fn result_is_lost_if_its_commit_is_not_in_the_history() {
        let at = |commit: &str| {
            let text = format!(r#"{{"commit": "{commit} and changes"}}"#);
            let json = serde_json::from_str(&text).expect("JSON");
            Stored { name: "made".to_owned(), json }.is_lost()
        };
        assert!(!at("HEAD"));
        assert_eq!(at("0000000000000000000000000000000000000001"), has_all_commits());
    }

    #[test]
    fn documents_show_the_results() {
        if let Err(problem) = check() {
            panic!("{problem:#}");
        }
    }
}
