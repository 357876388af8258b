//! Use of the wire formats from Python: `footfall.eds` by python-canopen and by Lely's tools, `footfall.dbc`
//! by cantools. The packages are installed into a virtual environment under `target`, in the versions of
//! `python/requirements.txt`. With python-canopen as master, the virtual board runs a foot.

mod python {
    pub mod environment;
    pub mod truth;
}

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use std::{env, fs, io};

use estimator_core::Phase;
use proptest::strategy::{Strategy as _, ValueTree as _};
use proptest::test_runner::TestRunner;
use python::truth::truth;
use wire::dictionary::{self, Role, Shape, index};
use wire::{Address, BootCause, Fault, Foot, Node, Pdo, Settings, Value};

const HERE: &str = env!("CARGO_MANIFEST_DIR");

/// Does the same as in host-tests if something is missing.
fn unmet(missing: &str) {
    let required = env::var_os("FOOTFALL_REQUIRE_EVERYTHING").is_some_and(|value| value != "0");
    assert!(!required, "{missing}");
    let _ = writeln!(io::stderr(), "not checked: {missing}");
}

/// Interpreter of the virtual environment, which is created on first use.
fn interpreter() -> Option<&'static Path> {
    static INTERPRETER: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    match INTERPRETER.get_or_init(python::environment::make) {
        Ok(path) => Some(path),
        Err(missing) => {
            unmet(missing);
            None
        }
    }
}

/// Runs a script of `tests/python`, which prints a line if everything agrees.
fn script(name: &str, arguments: &[&Path]) {
    let Some(interpreter) = interpreter() else {
        return;
    };
    let output = Command::new(interpreter)
        .arg(Path::new(HERE).join("tests/python").join(name))
        .args(arguments)
        .output()
        .expect("the interpreter runs");
    let (stdout, stderr) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{name}:\n{stdout}{stderr}");
    println!("{name}: {stdout}");
}

fn scratch(name: &str, contents: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::write(&path, contents).expect("the target folder is writable");
    path
}

fn plain(value: Value) -> String {
    match value {
        Value::I16(value) => value.to_string(),
        Value::U8(value) => value.to_string(),
        Value::U16(value) => value.to_string(),
        Value::U32(value) => value.to_string(),
        Value::F32(value) => value.to_string(),
        Value::Text(text) => text.to_string(),
    }
}

/// The dictionary as a table for the scripts.
fn objects() -> String {
    let mut table = String::from(
        "index\tsubindex\tname\ttype\taccess\trole\tdefault\tdefault_is_text\tlow\thigh\tmappable\n",
    );
    for object in dictionary::OBJECTS {
        for entry in object.entries {
            let name = match object.shape {
                Shape::Var => object.name,
                Shape::Array | Shape::Record => entry.name,
            };
            let access = match entry.role {
                Role::Input => "rww",
                _ => entry.access.name(),
            };
            let role = match entry.role {
                Role::CobId | Role::PdoCobId => "cob_id",
                _ => "other",
            };
            let (low, high) = entry.limits().range().unzip();
            let _ = writeln!(
                table,
                "{}\t{}\t{name}\t{}\t{access}\t{role}\t{}\t{}\t{}\t{}\t{}",
                object.index,
                entry.subindex,
                entry.data_type().index(),
                plain(entry.default),
                u8::from(matches!(entry.default, Value::Text(_))),
                low.map(plain).unwrap_or_default(),
                high.map(plain).unwrap_or_default(),
                u8::from(entry.is_mappable()),
            );
        }
    }
    table
}

#[test]
fn python_canopen_reads_the_eds_like_the_dictionary() {
    let table = scratch("objects.tsv", &objects());
    script("eds.py", &[&Path::new(HERE).join("footfall.eds"), &table]);
}

#[test]
fn lelys_tools_read_the_eds_and_readme_bus_without_warnings() {
    let table = scratch("objects-lely.tsv", &objects());
    let [eds, readme] = ["footfall.eds", "README.md"].map(|name| Path::new(HERE).join(name));
    script("lely.py", &[&eds, &table, &readme]);
}

/// Number of estimates whose frames are decoded.
const ESTIMATES: usize = 1_000;

#[test]
fn cantools_decodes_every_signal_as_it_was_encoded() {
    let mut table = String::from("id\tmessage\tdata\tsignal\tvalue\ttolerance\tname\n");
    let mut row =
        |id: u16, message: String, data: &[u8], signal: &str, expected: (f64, f64), name: &str| {
            let data: String = data.iter().map(|byte| format!("{byte:02x}")).collect();
            let (value, tolerance) = expected;
            let _ =
                writeln!(table, "{id}\t{message}\t{data}\t{signal}\t{value}\t{tolerance}\t{name}");
        };
    let mut runner = TestRunner::deterministic();
    for foot in Foot::ALL.into_iter().cycle().take(ESTIMATES) {
        let truth = truth().new_tree(&mut runner).expect("a truth").current();
        for pdo in Pdo::ALL {
            let (id, data) = (pdo.cob_id(foot.default_node_id()), truth.frame(pdo));
            for (_, signal) in pdo.signals() {
                let expected = truth.expected(signal.name);
                let phase =
                    Phase::ALL.into_iter().find(|phase| f64::from(*phase as u8) == expected.0);
                let name = phase.filter(|_| signal.name == "State").map_or("", Phase::name);
                row(
                    id,
                    format!("{}_{}", foot.name(), pdo.name()),
                    &data,
                    signal.name,
                    expected,
                    name,
                );
            }
        }
    }
    for foot in Foot::ALL {
        let mut settings = Settings::default();
        let node_id = Value::U8(foot.default_node_id().get());
        assert_eq!(settings.set(Address::new(index::NODE_ID, 0), node_id), Ok(()));
        let mut node = Node::new(settings, 0);
        let boot = node.boot(BootCause::PowerUp).expect("a boot-up message");
        let heartbeat = format!("{}_Heartbeat", foot.name());
        row(boot.id(), heartbeat, boot.data(), "NodeState", (0.0, 0.0), "boot_up");
        for fault in Fault::ALL {
            let frame = node.raise(fault, 0x1234_5678).expect("an emergency");
            for (signal, value, name) in [
                ("EmergencyCode", u32::from(fault.code()), fault.name()),
                ("ErrorRegister", u32::from(node.faults().register()), ""),
                ("FaultNumber", u32::from(fault.number()), fault.name()),
                ("Detail", 0x1234_5678, ""),
            ] {
                let message = format!("{}_Emergency", foot.name());
                row(frame.id(), message, frame.data(), signal, (value.into(), 0.0), name);
            }
        }
    }
    let table = scratch("frames.tsv", &table);
    script("dbc.py", &[&Path::new(HERE).join("footfall.dbc"), &table]);
}
