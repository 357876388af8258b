//! Header of a table: whether there is one, and its translation to our column names.

use csv::StringRecord;

use crate::reader::{Cells, Row, Table};
use options::hint::Hint;
use options::names::{
    Found, FoundTime, Triple, choices, find_load, find_time, find_with_units, guess, position,
    split_unit, without_units,
};
use options::{
    AccelerationUnit, Mapping, RateUnit, TableOptions, TimeUnit, Units, is_axis, is_ours,
};
use stored::error::{InputError, Problem, first_of};
use stored::iso8601::micros_since_1970;

/// Name of the nanoseconds of a stamp whose seconds are `t`.
pub const NANOSECONDS: &str = "t.nanosec";

/// Number of words in the first row from which that row is a header, whatever the words.
const LEAST_WORDS: usize = 6;

/// Number of axes of a recording.
const AXES: usize = 6;

/// Checks that a table of no given format is a `csv`: its first row has one of our names, even in a malformed header,
/// or it has a header. The reader reports other errors in the header.
///
/// # Errors
/// The table is empty, or its first row does not show the columns.
pub fn check_is_csv(table: &mut Table) -> Result<(), InputError> {
    let Some(first) = table.peek_row()? else {
        return Err(InputError::empty(&table.file));
    };
    let first = first.clone();
    if has_our_names(&first) || has_header(table)? {
        return Ok(());
    }
    let names: Vec<String> = first.cells().map(str::to_owned).collect();
    let mapping = example(&MAPPED, &names);
    Err(InputError::of_file(&table.file, Problem::UnknownFormat { mapping }))
}

/// Columns in the example of a mapping.
const MAPPED: [&str; 7] = ["t", "ax", "ay", "az", "wx", "wy", "wz"];

/// Returns whether a row is a header, even a malformed one: it contains a known name.
fn has_our_names(row: &Row) -> bool {
    row.cells()
        .flat_map(|cell| cell.split(OTHER_SEPARATORS))
        .any(|name| is_ours(&name.to_lowercase()))
}

/// Characters mistakenly used to separate the names of a header.
pub const OTHER_SEPARATORS: [char; 4] = [';', '\t', ' ', '|'];

/// Returns whether a table has a header in a comment or a first row of words, or whether its first row is a message of
/// `ros2 topic echo --csv`.
fn has_header(table: &mut Table) -> Result<bool, InputError> {
    if table.comment_header().is_some() {
        return Ok(true);
    }
    let Some(first) = table.peek_row()? else {
        return Ok(false);
    };
    let is_word = |cell: &str| !cell.is_empty() && cell.parse::<f64>().is_err();
    let words = first.cells().filter(|cell| is_word(cell)).count();
    // One cell may be blank, because the index column of pandas has no name.
    let are_words = words >= LEAST_WORDS && words + 1 >= first.len();
    Ok(are_words || ros2_header(first).is_some())
}

/// Treatment of blank cells of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blanks {
    /// It is an error, because a table of ours has no blank cells.
    Refused,
    /// The axis is NaN. A row without any other value belongs to another signal and is left out.
    NotANumber,
}

/// Index column that pandas writes before the named columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Index {
    /// There is no index.
    None,
    /// The index is not a time.
    Other,
    /// The table's index is the time. It is in the column with this number.
    Time(usize),
}

/// A header, parsed as far as possible.
pub struct Layout {
    /// Header with our names.
    pub header: Row,
    pub blanks: Blanks,
    /// Unit of the time, if the name of its column defines it.
    pub time_unit: Option<TimeUnit>,
    /// Name of the load, if its column has another than `force`.
    pub load_name: Option<String>,
    /// Columns that were recognised under other names.
    pub notice: Option<String>,
    /// Whether unknown columns are to be listed.
    pub names_ignored: bool,
}

impl Layout {
    /// Reads the header of a table; `None` if the table is empty.
    pub fn of(table: &mut Table, options: &TableOptions) -> Result<Option<Self>, InputError> {
        let comment = table.comment_header();
        let first = table.peek_row()?;
        let message = first.and_then(|first| Some(first.with_cells(ros2_header(first)?)));
        let names_ignored = message.is_none();
        let header = match message.or(comment) {
            Some(header) => Some(header),
            None => table.next_row()?,
        };
        let Some(header) = header else {
            return Ok(None);
        };
        let is_date = |row: &Row| micros_since_1970(row.text(0)).is_some();
        let index = if header.cells().next() != Some("") {
            Index::None
        } else if table.peek_row()?.is_some_and(is_date) {
            Index::Time(0)
        } else {
            Index::Other
        };
        let layout = Self::named(&header, options, index)?;
        Ok(Some(Self { names_ignored, ..layout }))
    }

    /// Finds our columns in a header.
    pub fn named(header: &Row, options: &TableOptions, index: Index) -> Result<Self, InputError> {
        let mut naming = Naming {
            names: header.cells().map(str::to_owned).collect(),
            taken: Vec::new(),
            mapped: 0,
            header,
            time_unit: None,
        };
        naming.map(&options.mapping)?;
        naming.mapped = naming.taken.len();
        naming.recognise(options.units)?;
        if let Index::Time(column) = index
            && !naming.has("t")
        {
            naming.take("t", column);
        }
        // A load has many names, so its name does not tell which program wrote the table.
        let foreign = naming.mapped > 0 || naming.taken.iter().any(|(ours, _)| *ours != "force");
        let notice = (naming.taken.len() > naming.mapped).then(|| naming.notice());
        Ok(Self {
            header: header.with_cells(naming.names.iter().collect()),
            blanks: if foreign || index != Index::None {
                Blanks::NotANumber
            } else {
                Blanks::Refused
            },
            time_unit: naming.time_unit,
            load_name: naming.load_name(),
            notice,
            names_ignored: true,
        })
    }
}

/// Names of a header's columns during their translation into ours.
struct Naming<'a> {
    header: &'a Row,
    names: Vec<String>,
    /// Our names of columns that had others, with the index.
    taken: Vec<(&'static str, usize)>,
    /// Number of columns with an explicit mapping, whose units are not checked.
    mapped: usize,
    time_unit: Option<TimeUnit>,
}

impl Naming<'_> {
    /// An error in the header.
    fn error(&self, problem: Problem) -> InputError {
        InputError::of_row(&self.header.file, self.header.place, problem)
    }

    fn has(&self, name: &str) -> bool {
        self.names.iter().any(|given| given == name)
    }

    /// Gives a column our name; another column of that name loses it.
    fn take(&mut self, ours: &'static str, index: usize) {
        for name in &mut self.names {
            if name == ours {
                *name = format!("{ours} (not used)");
            }
        }
        ours.clone_into(&mut self.names[index]);
        self.taken.push((ours, index));
    }

    /// Applies an explicit mapping.
    fn map(&mut self, mapping: &Mapping) -> Result<(), InputError> {
        let given = self.names.clone();
        for (ours, theirs) in mapping.columns() {
            match position(theirs, &given)[..] {
                [index] => self.take(ours, index),
                [] => {
                    let (name, columns) = (theirs.to_owned(), shortened(&given));
                    return Err(self.error(Problem::NoSuchColumn { name, columns }));
                }
                [one, other, ..] if given[one] == given[other] => {
                    let problem = Problem::DuplicateColumn;
                    return Err(self.header.error(other, &given[other], problem));
                }
                [one, other, ..] => {
                    return Err(self.error(Problem::AmbiguousColumn {
                        name: theirs.to_owned(),
                        candidates: [given[one].clone(), given[other].clone()],
                    }));
                }
            }
        }
        Ok(())
    }

    /// Recognises columns with other usual names if ours are missing. Units in their names must agree with the units
    /// of the options.
    fn recognise(&mut self, units: Units) -> Result<(), InputError> {
        let given = self.names.clone();
        for triple in [Triple::Acceleration, Triple::Rate] {
            let ours = triple.ours();
            if ours.iter().any(|axis| self.has(axis)) {
                continue;
            }
            match find_with_units(triple, &given) {
                Found::At(indices) => {
                    for (axis, index) in ours.into_iter().zip(indices) {
                        self.take(axis, index);
                    }
                }
                Found::Several(several) => {
                    let first_axes = several.iter().map(|[x, ..]| given[*x].clone());
                    return Err(self.error(Problem::SeveralSensors {
                        candidates: first_axes.collect(),
                        mappings: choices(triple, &several, &given),
                    }));
                }
                Found::Nowhere => {}
            }
        }
        self.check_units(units)?;
        let is_own = |triple: Triple| triple.own(&self.names).is_some();
        let complete = is_own(Triple::Acceleration) && is_own(Triple::Rate);
        if complete
            && !self.has("force")
            && let Some(index) = find_load(&given)
        {
            self.take("force", index);
        }
        if complete && !self.has("t") {
            let bare = || find_time(&without_units(&self.names));
            match find_time(&self.names).or_else(bare) {
                Some(FoundTime::Column(index, unit)) => {
                    let (_, in_brackets) = split_unit(&self.names[index]);
                    self.time_unit = unit.or(in_brackets.and_then(TimeUnit::written));
                    self.take("t", index);
                }
                Some(FoundTime::Stamp(seconds, nanoseconds)) => {
                    self.take("t", seconds);
                    NANOSECONDS.clone_into(&mut self.names[nanoseconds]);
                    self.time_unit = Some(TimeUnit::Seconds);
                }
                None => {}
            }
        }
        Ok(())
    }

    /// Checks that the unit in the name of each recognised axis is the one in which it would be read.
    fn check_units(&self, units: Units) -> Result<(), InputError> {
        let mut named = units;
        let mut wrong = None;
        for (ours, index) in &self.taken[self.mapped..] {
            let (_, Some(written)) = split_unit(self.header.text(*index)) else {
                continue;
            };
            let (unit, read_in) = if Triple::Acceleration.ours().contains(ours) {
                let unit = AccelerationUnit::written(written);
                named.acceleration = unit.unwrap_or(named.acceleration);
                let unit = unit.map(AccelerationUnit::name);
                (unit, units.acceleration.name())
            } else {
                let unit = RateUnit::written(written);
                named.rate = unit.unwrap_or(named.rate);
                (unit.map(RateUnit::name), units.rate.name())
            };
            if let Some(unit) = unit.filter(|unit| *unit != read_in) {
                wrong = wrong.or(Some((*index, unit, read_in)));
            }
        }
        wrong.map_or(Ok(()), |(index, unit, read_in)| {
            let name = self.header.text(index).to_owned();
            Err(self.error(Problem::NamedUnit { name, unit, read_in, units: named }))
        })
    }

    /// Name of the column of the load, if it was recognised by a name other than `force`.
    fn load_name(&self) -> Option<String> {
        let mut recognised = self.taken[self.mapped..].iter();
        let (_, index) = recognised.find(|(ours, _)| *ours == "force")?;
        Some(self.header.text(*index).to_owned())
    }

    /// Sentence that lists the recognised columns.
    fn notice(&self) -> String {
        let taken: Vec<_> = self.taken[self.mapped..]
            .iter()
            .map(|(ours, index)| match self.header.text(*index) {
                "" => format!("{ours} is column {}", index + 1),
                theirs => format!("{ours} is {theirs}"),
            })
            .collect();
        format!("{}: {}", self.header.file, taken.join(", "))
    }
}

/// Hint for a header that lacks our names: a mapping if the names allow one, otherwise an example of the
/// syntax.
pub fn suggestion(header: &Row, missing: &[&'static str]) -> Option<Hint> {
    let names: Vec<String> = header.cells().map(str::to_owned).collect();
    let mut wanted: Vec<&'static str> = missing.to_vec();
    if !names.iter().any(|name| name == "t") {
        wanted.insert(0, "t");
    }
    let mut columns: Vec<(&'static str, String)> = Vec::new();
    for ours in &wanted {
        if let Some(index) = guess(ours, &names)
            && !is_ours(&names[index])
            && !columns.iter().any(|(_, theirs)| *theirs == names[index])
        {
            columns.push((ours, names[index].clone()));
        }
    }
    if columns.iter().any(|(ours, _)| is_axis(ours)) {
        return Some(Hint::Map(Mapping { columns }));
    }
    // An example of the syntax does not help if a single axis is missing.
    let example = (missing.len() == AXES).then(|| example(&wanted, &names));
    example.flatten().map(Hint::MapExample)
}

/// Example of a mapping of the first columns of a file, if they have names.
fn example(wanted: &[&'static str], names: &[String]) -> Option<Mapping> {
    let is_name =
        |name: &&String| !name.is_empty() && name.parse::<f64>().is_err() && !is_ours(name);
    let mut theirs: Vec<&String> = Vec::new();
    for name in names.iter().filter(is_name) {
        if !theirs.contains(&name) {
            theirs.push(name);
        }
    }
    if theirs.len() < wanted.iter().filter(|ours| is_axis(ours)).count() {
        return None;
    }
    // If there is one name too few, the time is omitted.
    let wanted = &wanted[wanted.len().saturating_sub(theirs.len())..];
    let columns = wanted.iter().copied().zip(theirs.into_iter().cloned());
    let columns = columns.collect();
    Some(Mapping { columns })
}

/// List of names, shortened to the first ones if there are many.
pub fn shortened(names: &[String]) -> String {
    let names = names.iter().map(|name| if name.is_empty() { "(no name)" } else { name });
    first_of(names, 20)
}

/// Number of cells of a row of `ros2 topic echo --csv` for `sensor_msgs/msg/Imu`: a stamp in two cells, a name, a
/// quaternion and its covariance, two vectors and their covariances. Such a table has no header, and the fields of the
/// message in order.
///
/// Source: `message_to_csv` of `rosidl_runtime_py`, and `sensor_msgs/msg/Imu.msg`.
const CELLS: usize = 40;

/// Tolerance of the length of a quaternion about 1.
const LENGTH_TOLERANCE: f64 = 0.01;

/// Names of these cells.
fn ros2_names() -> impl Iterator<Item = String> {
    let stamp = ["header.stamp.sec", "header.stamp.nanosec", "header.frame_id"];
    let field = |field: &'static str, parts: &'static str| {
        let covariance = (0..9).map(move |k| format!("{field}_covariance[{k}]"));
        let parts = parts.chars().map(move |part| format!("{field}.{part}"));
        parts.chain(covariance)
    };
    stamp
        .into_iter()
        .map(str::to_owned)
        .chain(field("orientation", "xyzw"))
        .chain(field("angular_velocity", "xyz"))
        .chain(field("linear_acceleration", "xyz"))
}

/// Header for a table of such messages, if `first` is one of them: the number of cells matches, a stamp comes
/// first, and the orientation is a unit quaternion or marked as unknown.
fn ros2_header(first: &Row) -> Option<StringRecord> {
    let cells: Vec<&str> = first.cells().collect();
    if cells.len() != CELLS || cells[..2].iter().any(|cell| cell.parse::<i64>().is_err()) {
        return None;
    }
    let number = |cell: &&str| cell.parse::<f64>().ok();
    let numbers: Option<Vec<f64>> = cells[3..].iter().map(number).collect();
    let numbers = numbers?;
    let length = numbers[..4].iter().map(|part| part * part).sum::<f64>().sqrt();
    // A first covariance of -1 marks the orientation as unknown.
    let unknown = length == 0.0 || numbers[4] == -1.0;
    ((length - 1.0).abs() <= LENGTH_TOLERANCE || unknown).then(|| ros2_names().collect())
}
