//! Decoded output of feet: rows as arrays, and the report.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use estimator_core::Flag;
use feet::FootHint;
use feet::decode::known_feet::{Name, NamedFoot};
use feet::decode::row::CommonClock;
use feet::decode::{ContactRow, DecodeError, FileOutcome, KnownFeet};
use numpy::{IntoPyArray, PyArray1};
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tables::output::seconds;
use wire::NodeId;

use crate::result::CommonColumns;
use crate::words::value_error;

/// Flags of frames, which follow the flags of the estimator.
const OF_FRAMES: [&str; 4] = ["starting", "fault", "doubtful", "time_not_known"];

/// Number of the estimator's flags.
const ESTIMATORS: usize = Flag::ALL.len();

/// Returns the names of all flags of a row, in the order of their bits.
pub(crate) fn flag_names() -> [&'static str; ESTIMATORS + OF_FRAMES.len()] {
    std::array::from_fn(|k| match Flag::ALL.get(k) {
        Some(flag) => flag.name(),
        None => OF_FRAMES[k - ESTIMATORS],
    })
}

/// Column of texts, each of which is kept once.
#[derive(Default)]
struct Names {
    places: BTreeMap<Arc<str>, i16>,
    names: Vec<String>,
    /// Index into `names` for each row; -1 without a text.
    column: Vec<i16>,
}

impl Names {
    fn push(&mut self, name: Option<&Arc<str>>) {
        let place = match name {
            None => -1,
            Some(name) => *self.places.entry(Arc::clone(name)).or_insert_with(|| {
                let place = i16::try_from(self.names.len()).unwrap_or(-1);
                self.names.push(name.to_string());
                place
            }),
        };
        self.column.push(place);
    }
}

/// Columns of rows, filled without the interpreter lock.
#[derive(Default)]
struct RowColumns {
    time_s: Vec<f64>,
    received_s: Vec<f64>,
    common_s: Vec<f64>,
    by_sync: Vec<bool>,
    interface: Names,
    foot: Names,
    node: Vec<u8>,
    segment: Vec<u32>,
    sequence: Vec<u16>,
    common: CommonColumns,
    temperature: Vec<f32>,
    flags: Vec<u16>,
}

impl RowColumns {
    fn push(&mut self, row: &ContactRow, flags: &[&str]) {
        let time = |time| seconds(time, 0);
        self.time_s.push(time(row.timestamp));
        self.received_s.push(row.received.map_or(f64::NAN, time));
        let (common, clock) = row.common.unzip();
        self.common_s.push(common.map_or(f64::NAN, time));
        self.by_sync.push(clock == Some(CommonClock::Sync));
        self.interface.push(row.interface.as_ref());
        self.foot.push(row.foot.as_ref());
        self.node.push(row.node.map_or(0, NodeId::get));
        self.segment.push(row.segment);
        self.sequence.push(row.sequence);
        let values = [row.stable, row.tangential, row.vertical];
        let (phase, decision) = (row.status.phase(), row.status.decision());
        self.common.push(values, phase, decision);
        let vectors = [row.acceleration, row.rate, row.bias];
        self.common.push_vectors(row.axes, row.orientation, vectors);
        self.temperature.push(row.temperature.unwrap_or(f32::NAN));
        let names = row.flag_names();
        let raised = flags.iter().map(|flag| names.contains(flag));
        let bits = raised.enumerate().map(|(k, is)| u16::from(is) << k);
        self.flags.push(bits.sum());
    }

    /// Returns the arrays by the names of `footfall.Decoded`.
    fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("t", self.time_s.into_pyarray(py))?;
        dict.set_item("t_received", self.received_s.into_pyarray(py))?;
        dict.set_item("t_common", self.common_s.into_pyarray(py))?;
        dict.set_item("by_sync", PyArray1::from_vec(py, self.by_sync))?;
        dict.set_item("interface", self.interface.column.into_pyarray(py))?;
        dict.set_item("interfaces", self.interface.names)?;
        dict.set_item("foot", self.foot.column.into_pyarray(py))?;
        dict.set_item("feet", self.foot.names)?;
        dict.set_item("node", self.node.into_pyarray(py))?;
        dict.set_item("segment", self.segment.into_pyarray(py))?;
        dict.set_item("sequence", self.sequence.into_pyarray(py))?;
        self.common.add_to(&dict)?;
        dict.set_item("temperature", self.temperature.into_pyarray(py))?;
        dict.set_item("flags", self.flags.into_pyarray(py))?;
        Ok(dict)
    }
}

fn node(id: i64) -> PyResult<NodeId> {
    let node = u8::try_from(id).ok().and_then(NodeId::new);
    let expected = || value_error(format!("node is {id}, but a node id, 1 to 127, is expected"));
    node.ok_or_else(expected)
}

/// Decodes the output of feet; see `footfall.decode`. Returns the arrays, and the report as JSON.
#[pyfunction]
pub(crate) fn decode_file<'py>(
    py: Python<'py>,
    path: PathBuf,
    nodes: Vec<i64>,
    names: BTreeMap<i64, String>,
) -> PyResult<(Bound<'py, PyDict>, String)> {
    let mut feet = KnownFeet::default();
    for id in nodes {
        feet.add(node(id)?);
    }
    let mut named = Vec::new();
    for (id, name) in names {
        let refused = |error| value_error(format!("{name:?} of node {id}: {error}"));
        named.push((NamedFoot::Node(node(id)?), Name::new(&name).map_err(refused)?));
    }
    feet.give_names(&named).map_err(value_error)?;
    let mut columns = RowColumns::default();
    let flags = flag_names();
    let decoded = py.detach(|| {
        feet::decode::read(&path, &feet, &mut |row| {
            columns.push(&row, &flags);
            Ok(())
        })
    });
    let FileOutcome { file, report, notices } = decoded.map_err(|error| match error {
        DecodeError::Unreadable { .. } => PyOSError::new_err(error.to_string()),
        other => value_error(other),
    })?;
    let report = serde_json::to_string(&report)
        .map_err(|error| value_error(format!("the report cannot be written: {error}")))?;
    let dict = columns.into_dict(py)?;
    let notices = notices.iter().map(|notice| match notice.hint() {
        Some(FootHint::NameNodeAsFoot(node)) => {
            format!("{}: nodes=[{node}]", notice.sentence(&file))
        }
        _ => notice.sentence(&file),
    });
    dict.set_item("notices", notices.collect::<Vec<_>>())?;
    Ok((dict, report))
}
