//! Use of the wire formats from Python: `footfall.eds` by python-canopen and by Lely's tools, `footfall.dbc`
//! by cantools, and python-canopen as master of a foot over slcan on a pseudo-terminal. The packages
//! are installed into a virtual environment under `target`, in the versions of
//! `python/requirements.txt`.
#![cfg(unix)]

mod python {
    pub mod environment;
    pub mod foot;
}

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use std::{env, fs};

use estimator_core::{
    AngularRate, ContactEstimate, Decision, Flags, LinearAcceleration, PerAxis, Phase,
    Probabilities, Quaternion, Timestamp, Vec3,
};
use wire::dictionary::{self, Role, Shape};
use wire::pdo::{Acceleration, Attitude, Axes, Bias, ClockReading, Contact, Health, Rate};
use wire::{Faults, Foot, Pdo, Value};

const HERE: &str = env!("CARGO_MANIFEST_DIR");

/// Does the same as in host-tests if something is missing.
fn unmet(missing: &str) {
    let required = env::var_os("FOOTFALL_REQUIRE_EVERYTHING").is_some_and(|value| value == "1");
    assert!(!required, "{missing}");
    eprintln!("not checked: {missing}");
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
    let (stdout, stderr) = (
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr),
    );
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

#[test]
fn cantools_decodes_frames_like_the_codec() {
    let mut table = String::from("id\tdata\tsignal\tvalue\n");
    // Few frames: `dbc.rs` compares many with the same file by another reader.
    for i in 0..20_u32 {
        let share = i as f32 / 19.0;
        let vector = |scale: f32| Vec3::new(share * scale, -share * scale, (0.5 - share) * scale);
        let estimate = ContactEstimate {
            timestamp: Timestamp::from_micros(u64::from(i) * 98_765),
            probabilities: Probabilities {
                axes: PerAxis::from_array([share; 6]),
                tangential: share,
                vertical: 1.0 - share,
                stable: share * (1.0 - share),
            },
            decision: if i % 3 == 0 {
                Decision::Stable
            } else {
                Decision::NotStable
            },
            phase: Phase::ALL[i as usize % 5],
            flags: Flags::NONE,
            orientation: Quaternion {
                w: share,
                x: -share,
                y: 1.0 - share,
                z: 0.5,
            },
            linear_acceleration: LinearAcceleration(vector(300.0)),
            angular_rate: AngularRate(vector(40.0)),
            gyro_bias: AngularRate(vector(0.3)),
            ..ContactEstimate::default()
        };
        for foot in Foot::ALL {
            for pdo in Pdo::ALL {
                for (data, signal, value) in decoded(pdo, &estimate, i) {
                    let id = pdo.cob_id(foot.default_node_id());
                    let data: String = data.iter().map(|byte| format!("{byte:02x}")).collect();
                    let _ = writeln!(table, "{id}\t{data}\t{signal}\t{value}");
                }
            }
        }
    }
    let table = scratch("frames.tsv", &table);
    script("dbc.py", &[&Path::new(HERE).join("footfall.dbc"), &table]);
}

/// Frames and their values decoded by the codec.
fn decoded(pdo: Pdo, estimate: &ContactEstimate, i: u32) -> Vec<([u8; 8], &'static str, f64)> {
    let faults = Faults::NONE;
    let vector = |bytes, names: [&'static str; 3], vector: Vec3| {
        let values = [vector.x, vector.y, vector.z].map(f64::from);
        names
            .into_iter()
            .zip(values)
            .map(|(name, value)| (bytes, name, value))
            .collect()
    };
    match pdo {
        Pdo::Contact => {
            let bytes = Contact::new(estimate, i as u8, faults).encode();
            let contact = Contact::decode(&bytes);
            [
                (
                    "StableContactProbability",
                    contact.stable.probability().into(),
                ),
                (
                    "TangentialProbability",
                    contact.tangential.probability().into(),
                ),
                ("VerticalProbability", contact.vertical.probability().into()),
                ("Timestamp", f64::from(contact.timestamp.0) / 100.0),
                ("Sequence", contact.sequence.into()),
                ("State", f64::from(contact.status.phase() as u8)),
                (
                    "Decision",
                    f64::from(u8::from(contact.status.decision() == Decision::Stable)),
                ),
                ("Valid", f64::from(u8::from(contact.status.is_valid()))),
            ]
            .map(|(name, value)| (bytes, name, value))
            .to_vec()
        }
        Pdo::Axes => {
            let bytes = Axes::new(estimate, faults).encode();
            let axes = Axes::decode(&bytes).probabilities;
            vec![(bytes, "ProbabilityWz", axes.wz.probability().into())]
        }
        Pdo::Attitude => {
            let bytes = Attitude::new(estimate, faults).encode();
            let Quaternion { w, x, y, z } = Attitude::decode(&bytes).orientation();
            let mut values = vec![(bytes, "QuaternionW", w.into())];
            let names = ["QuaternionX", "QuaternionY", "QuaternionZ"];
            values.extend::<Vec<_>>(vector(bytes, names, Vec3::new(x, y, z)));
            values
        }
        Pdo::Acceleration => {
            let bytes = Acceleration::new(estimate, faults).encode();
            let names = ["AccelerationX", "AccelerationY", "AccelerationZ"];
            vector(bytes, names, Acceleration::decode(&bytes).acceleration())
        }
        Pdo::Rate => {
            let bytes = Rate::new(estimate, faults).encode();
            vector(
                bytes,
                ["RateX", "RateY", "RateZ"],
                Rate::decode(&bytes).rate(),
            )
        }
        Pdo::Bias => {
            let bytes = Bias::new(estimate, i as f32 - 40.0, faults).encode();
            let bias = Bias::decode(&bytes);
            let mut values = vec![(bytes, "Temperature", bias.temperature().into())];
            values.extend::<Vec<_>>(vector(bytes, ["BiasX", "BiasY", "BiasZ"], bias.bias()));
            values
        }
        Pdo::Health => {
            let bytes = {
                let clock = ClockReading {
                    sync: (i % 240 + 1) as u8,
                    time: estimate.timestamp.into(),
                };
                Health::new(estimate.flags, i as u8, i, clock).encode()
            };
            let health = Health::decode(&bytes);
            vec![
                (bytes, "ErrorRegister", health.register.into()),
                (bytes, "Dropped", health.dropped.into()),
                (bytes, "SyncCounter", health.clock.sync.into()),
                (bytes, "Clock", f64::from(health.clock.time.0) / 100.0),
            ]
        }
    }
}

#[test]
fn python_canopen_is_master_of_a_foot_over_slcan() {
    if interpreter().is_none() {
        return;
    }
    let foot = match python::foot::start() {
        Ok(foot) => foot,
        Err(error) => {
            unmet(&format!("no pseudo-terminal: {error}"));
            return;
        }
    };
    script(
        "master.py",
        &[foot.tty(), &Path::new(HERE).join("footfall.eds")],
    );
}
