//! Validation of every command's JSON against its schema, by a third-party validator.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::feet::{csv, image, lying};
use crate::common::{AXES, Bench, standing, unmet};
use crate::packages;
use clap::ValueEnum;
use footfall::schema::SchemaKind;
use gait::GaitName;
use serde_json::Value;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python");
const REQUIREMENTS: &str = include_str!("python/requirements.txt");

/// Output objects with the schema of their kind, in files.
struct Objects {
    bench: Bench,
    files: Vec<PathBuf>,
}

impl Objects {
    fn new() -> Self {
        let bench = Bench::new();
        for &kind in SchemaKind::value_variants() {
            let schema = bench.stdout(&format!("schema {}", kind.name()));
            fs::write(bench.path(&schema_file(kind)), schema).expect("a file");
        }
        Self {
            bench,
            files: Vec::new(),
        }
    }

    fn add(&mut self, kind: SchemaKind, json: &str) {
        let schema = self.bench.path(&schema_file(kind));
        let object = self.bench.path(&format!("{}.json", self.files.len()));
        fs::write(&object, json).expect("a file");
        self.files.extend([schema, object]);
    }

    fn has(&self, kind: SchemaKind) -> bool {
        self.files.contains(&self.bench.path(&schema_file(kind)))
    }

    /// Validates the objects; missing prerequisites are returned as one line.
    fn check(&self) -> Result<(), String> {
        let packages = packages::install("python-jsonschema", REQUIREMENTS)?;
        let output = Command::new(packages.interpreter)
            .arg(Path::new(FOLDER).join("schemas.py"))
            .args(&self.files)
            .env("PYTHONPATH", packages.folder)
            .output()
            .map_err(|error| error.to_string())?;
        // Any failure after this point is not due to missing packages.
        assert!(
            output.status.success(),
            "{}",
            crate::common::text(&output.stdout) + &crate::common::text(&output.stderr)
        );
        Ok(())
    }
}

fn schema_file(kind: SchemaKind) -> String {
    format!("{}.schema.json", kind.name())
}

/// Returns the kind named by an object.
fn kind_of(object: &Value) -> SchemaKind {
    let named = SchemaKind::value_variants()
        .iter()
        .copied()
        .find(|kind| object["schema"] == kind.id());
    named.expect("a schema")
}

/// Returns recordings that cover the range of values.
fn benches() -> Bench {
    let bench = Bench::with("stand.csv", standing());
    // In g, with non-finite samples and without labels.
    let in_g: String = (0..2000)
        .map(|k| match k % 500 {
            7 => format!("{},nan,inf,1,0,-inf,1e300\n", f64::from(k) * 0.002),
            _ => format!("{},0,0.0{},1,0,0,0\n", f64::from(k) * 0.002, k % 10),
        })
        .collect();
    for (name, content) in [
        ("g.csv", format!("t,{AXES}\n{in_g}")),
        (
            "nan.csv",
            format!(
                "t,{AXES},label\n0,nan,nan,nan,nan,nan,nan,1\n0.01,nan,nan,nan,nan,nan,nan,0\n"
            ),
        ),
        (
            "go1.csv",
            "250,0,0,1,0,0,0\n".repeat(40) + &"250,,,,,,\n".repeat(60),
        ),
        ("level.csv", level()),
        ("rests.csv", lying(6, 9.81)),
        (
            "robot.toml",
            "attitude.gyro_timing = '1.5ms'\nlearning = 'frozen'\ngyroscope.bias_rad_s.wx = 0.01\n"
                .to_owned(),
        ),
    ] {
        fs::write(bench.path(name), content).expect("a file");
    }
    fs::write(bench.path("walk.csv"), csv(GaitName::Walk, 12.0)).expect("a file");
    bench
}

/// Returns a level sensor with its true orientation, which is missing once.
fn level() -> String {
    let row = |k: u32| {
        let truth = if k == 150 { ",,," } else { "1,0,0,0" };
        format!("{:.2},0,0,9.81,0,0,0,{truth}\n", f64::from(k) * 0.01)
    };
    format!(
        "t,{AXES},qw,qx,qy,qz\n{}",
        (0..200).map(row).collect::<String>()
    )
}

#[test]
fn every_object_matches_its_schema() {
    let bench = benches();
    let mut objects = Objects::new();
    bench.stdout("calibrate walk.csv --output learnt.toml");
    for arguments in [
        "stand.csv",
        "stand.csv walk.csv g.csv",
        "walk.csv --config learnt.toml",
        "walk.csv --config robot.toml --from 3 --to 4",
        "walk.csv --from 0.0001 --to 0.0002",
        "stand.csv --preset paper --gravity included --window 20ms",
        "go1.csv --format pce-go1 --preset paper",
        "nan.csv",
    ] {
        objects.add(
            SchemaKind::Replay,
            &bench.stdout(&format!("replay {arguments} --json")),
        );
    }
    fs::write(bench.path("broken.csv"), "t,ax\n0,0\n").expect("a file");
    let all = "batch . --out out --json";
    objects.add(
        SchemaKind::Batch,
        &bench.stdout(&format!("{all} --dry-run")),
    );
    // Some recordings fail; their rows are still in the report.
    for _ in 0..2 {
        objects.add(
            SchemaKind::Batch,
            &crate::common::text(&bench.run(all).stdout),
        );
    }
    objects.add(
        SchemaKind::Calibrate,
        &bench.stdout("calibrate walk.csv --json"),
    );
    objects.add(
        SchemaKind::CalibrateRests,
        &bench.stdout("calibrate --rests rests.csv --json"),
    );
    objects.add(
        SchemaKind::Attitude,
        &bench.stdout("attitude level.csv --json"),
    );
    bench.stdout("demo --out demo");
    for log in ["can.log", "uart.bin"] {
        objects.add(
            SchemaKind::Decode,
            &bench.stdout(&format!("decode demo/{log} --json")),
        );
    }
    // Frames with damage and a fault.
    let damaged = "(1.000000) can0 091#0170010100000000\n(1.000000) can0 191#FF\nnonsense\n";
    fs::write(bench.path("damaged.log"), damaged).expect("a file");
    objects.add(
        SchemaKind::Decode,
        &bench.stdout("decode damaged.log --json"),
    );
    for source in [
        "demo:feet=2,speed=max,seconds=3",
        "demo:line=uart,speed=max,seconds=3",
        "file:demo/can.log@max",
        "file:damaged.log@max",
    ] {
        for line in bench.stdout(&format!("monitor {source} --json")).lines() {
            let object: Value = serde_json::from_str(line).expect("JSON");
            objects.add(kind_of(&object), line);
        }
    }
    fs::write(bench.path("foot.img"), image()).expect("a file");
    for (kind, arguments) in [
        (SchemaKind::FootScan, "demo:feet=2,speed=10 scan"),
        (SchemaKind::FootInfo, "demo:speed=10 info"),
        (SchemaKind::FootInfo, "demo:speed=10,line=uart info"),
        (SchemaKind::FootGet, "demo:speed=10 get"),
        (
            SchemaKind::FootGet,
            "demo:speed=10 get manufacturer_software_version stage",
        ),
        (SchemaKind::FootChanges, "demo:speed=10 diff"),
        (
            SchemaKind::FootChanges,
            "demo:speed=10 set decision.threshold=0.6 tpdo2_communication_parameter.cob_id=off",
        ),
    ] {
        let json = bench.stdout(&format!("foot {arguments} --json"));
        objects.add(kind, &json);
    }
    let update = "foot demo:speed=10 --node 99 update foot.img --json";
    objects.add(
        SchemaKind::FootUpdate,
        &crate::common::text(&bench.run(update).stdout),
    );
    let kinds = [SchemaKind::Monitor, SchemaKind::MonitorEvent];
    assert!(kinds.map(|kind| objects.has(kind)) == [true, true]);
    if let Err(missing) = objects.check() {
        unmet(&missing);
    }
}

#[test]
fn replay_json_states_its_parameters() {
    let bench = benches();
    let replay = |arguments: &str| -> Value {
        let json = bench.stdout(&format!("replay stand.csv {arguments} --json"));
        serde_json::from_str(&json).expect("JSON")
    };
    let json = replay("--config robot.toml");
    assert_eq!(json["schema"], "urn:footfall:replay:1");
    assert_eq!(json["version"], env!("CARGO_PKG_VERSION"));
    let recording = &json["recordings"][0];
    assert_eq!(recording["input"]["file"], "stand.csv");
    assert_eq!(recording["input"]["format"], "csv");
    let estimation = &recording["estimation"];
    let parameters = &estimation["parameters"];
    for (found, expected) in [
        (&estimation["preset"], Value::from("default")),
        (
            &estimation["correction"]["gyroscope_bias_rad_s"][0],
            0.01.into(),
        ),
        (&parameters["learning"], "frozen".into()),
        (&parameters["gravity"], "included".into()),
        (&parameters["gyro_timing"]["delay_s"], 0.0015.into()),
        (&parameters["numbers"]["sample_rate_hz"], 1000.0.into()),
        (&parameters["numbers"]["decision.threshold"], 0.5.into()),
        (&parameters["learnt_before"], Value::Null),
    ] {
        assert_eq!(*found, expected);
    }
    assert!(estimation["learnt"]["still_seconds"].is_number());
    let paper = replay("--preset paper --gravity included --window 20ms");
    let parameters = &paper["recordings"][0]["estimation"]["parameters"];
    assert_eq!(parameters["method"], "half_widths");
    assert_eq!(parameters["window"]["duration_s"], 0.02);
}

#[test]
fn failed_command_prints_no_json() {
    let bench = benches();
    for arguments in [
        "replay absent.csv --json",
        "replay g.csv --strict --json",
        "calibrate stand.csv --json",
        "decode stand.csv --json",
    ] {
        assert!(
            bench.error(arguments).starts_with("footfall: "),
            "{arguments}"
        );
    }
}
