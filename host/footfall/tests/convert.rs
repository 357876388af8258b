//! Tests of `footfall convert` as a program: estimates from the output equal those from the source.

use std::fs;
use std::path::Path;

use crate::common::{Bench, cases, read, standing, text};
use serde_json::Value;

/// All output formats.
const TARGETS: [&str; 3] = ["b.csv", "b.parquet", "b.mcap"];

/// Returns a recording without header, clock and units: 13 columns, 1 kHz, gravity removed.
fn atlas() -> String {
    let row = |k: u32| {
        let shake = if k % 800 > 500 {
            (f64::from(k) * 0.9).sin()
        } else {
            0.01 * (f64::from(k) * 3.1).cos()
        };
        let axis = |scale: f64| format!("{:.7}", scale * shake);
        // The default thresholds of this format differ from those of a table.
        let wrench = format!("0,0,{},0,0,0", (k * 7) % 300);
        let label = u32::from(k % 800 <= 500);
        let [a, b, c, d, e, f] = [3.0, -2.0, 1.0, 0.5, -0.25, 0.125].map(axis);
        format!("{wrench},{a},{b},{c},{d},{e},{f},{label}\n")
    };
    (0..4000).map(row).collect()
}

/// Returns recordings of each kind, with the options to read them.
fn sources(bench: &Bench) -> Vec<(&'static str, &'static str)> {
    bench.stdout("demo --output demo");
    bench.stdout("record demo:feet=2,line=uart,seconds=4,speed=max -o feet.mcap");
    fs::write(bench.path("atlas.txt"), atlas()).expect("a file");
    let indexed = "stamp;imu_acc_x;imu_acc_y;imu_acc_z;imu_gyro_x;imu_gyro_y;imu_gyro_z\n"
        .to_owned()
        + &(0..900)
            .map(|k| {
                format!(
                    "2024-05-01 10:00:{:09.6};0.1;0;9.8;0;0.0{};0\n",
                    f64::from(k) * 0.004,
                    k % 9
                )
            })
            .collect::<String>();
    fs::write(bench.path("others.csv"), indexed).expect("a file");
    vec![
        ("demo/samples.csv", ""),
        ("demo/samples.csv", "--axes y,-x,z"),
        ("atlas.txt", "--format pce-atlas"),
        ("others.csv", "--map t=stamp --sample-rate 250.5"),
        ("feet.mcap", "--topic /footfall/L/imu"),
        ("feet.mcap", "--topic all"),
    ]
}

/// Returns the rows of a table of estimates as time, µs, and all other cells as text.
fn rows(table: &str) -> Vec<(i64, String)> {
    let mut lines = table.lines();
    let header = lines.next().expect("a header");
    let column = header.split(',').position(|name| name == "t");
    let column = column.expect("times");
    let row = |line: &str| {
        let mut cells: Vec<&str> = line.split(',').collect();
        // The name of a foot includes the name of its file, which differs between the tables.
        if header.starts_with("foot,") {
            cells[0] = cells[0].rsplit(' ').next().expect("a name");
        }
        let time: f64 = cells.remove(column).parse().expect("a time");
        ((time * 1.0e6).round() as i64, cells.join(","))
    };
    lines.map(row).collect()
}

/// Checks that two tables have the same rows, with times shifted by whole seconds only.
fn assert_same(found: &str, expected: &str, what: &str) {
    let (found, expected) = (rows(found), rows(expected));
    assert_eq!(found.len(), expected.len(), "{what}");
    let shift = found[0].0 - expected[0].0;
    assert!(shift % 1_000_000 == 0 && shift >= 0, "{what}: {shift}");
    for (found, expected) in found.iter().zip(&expected) {
        assert_eq!(found.0, expected.0 + shift, "{what}");
        assert_eq!(found.1, expected.1, "{what}");
    }
}

/// Returns the metrics and sample counts of all feet.
fn metrics(bench: &Bench, arguments: &str) -> Vec<(Value, Value)> {
    let json = bench.stdout(&format!("--quiet replay --estimate-again {arguments} --json"));
    let json: Value = serde_json::from_str(&json).expect("JSON");
    let feet = json["recordings"].as_array().expect("recordings");
    feet.iter().map(|foot| (foot["metrics"].clone(), foot["samples"].clone())).collect()
}

/// Returns the options that a conversion suggests for reading its output.
fn suggested_options(bench: &Bench, said: &str) -> String {
    let line = said.lines().find_map(|line| line.strip_prefix("read it with "));
    let options = line.unwrap_or_default().to_owned();
    match said.split_once("and a configuration file with\n") {
        None => options,
        Some((_, configuration)) => {
            fs::write(bench.path("suggested.toml"), configuration).expect("a file");
            options + " --config suggested.toml"
        }
    }
}

#[test]
fn estimates_from_output_match_those_from_source() {
    let bench = Bench::new();
    for (source, options) in sources(&bench) {
        let expected =
            bench.stdout(&format!("--quiet replay --estimate-again {source} {options} --output -"));
        let scores = metrics(&bench, &format!("{source} {options}"));
        let is_alone = scores.len() == 1;
        for target in TARGETS {
            let what = format!("{source} {options}, {target}");
            if !is_alone && !target.contains("mcap") && !target.contains("rosbag2") {
                bench.refuses(
                    &format!("--quiet convert {source} {target} {options} --overwrite"),
                    "choose one with --topic, or write .mcap",
                );
                continue;
            }
            let said =
                bench.stdout(&format!("--quiet convert {source} {target} {options} --overwrite"));
            let name = target.split_whitespace().next().expect("a name");
            let reading = format!("{name} {}", suggested_options(&bench, &said));
            assert_eq!(reading.contains("suggested.toml"), source == "atlas.txt", "{said}");
            let found =
                bench.stdout(&format!("--quiet replay --estimate-again {reading} --output -"));
            assert_same(&found, &expected, &what);
            assert_eq!(metrics(&bench, &reading), scores, "{what}");
            if is_alone {
                // Converting back gives the same table as the source itself.
                let table = |arguments: &str| {
                    let said = bench.stdout(&format!("--quiet convert {arguments} - "));
                    assert!(said.starts_with("t,ax,"), "{said}");
                    said
                };
                let direct = table(&format!("{source} {options}"));
                let reading = reading.replace("--config suggested.toml", "");
                assert_same(&table(&reading), &direct, &what);
            }
        }
    }
}

#[test]
fn span_keeps_the_times_of_the_recording() {
    let bench = Bench::with("walk.csv", standing());
    bench.stdout("convert walk.csv part.csv --from 0.25 --to 0.5");
    let part = read(&bench.path("part.csv"));
    let mut rows = part.lines();
    assert_eq!(rows.next(), Some("t,ax,ay,az,wx,wy,wz,force,label,validity"));
    assert_eq!(rows.next(), Some("0.250000,0,0,9.81,0,0,0,50,1,"));
    assert_eq!(rows.next_back(), Some("0.499000,0,0,9.81,0,0,0,50,1,"));
    assert_eq!(part.lines().count(), 251);
    bench.refuses("convert walk.csv late.csv --from 5", "--from 5 is after its end");
    bench.refuses("convert walk.csv none.csv --from 0.5 --to 0.5", "is not after");
}

#[test]
fn unwritable_output_is_rejected_before_writing() {
    let bench = Bench::with("walk.csv", standing());
    fs::write(bench.path("there.mcap"), "precious").expect("a file");
    fs::create_dir(bench.path("folder")).expect("a folder");
    fs::write(bench.path("g.csv"), standing().replace("9.81", "1")).expect("a file");
    let late = standing().lines().last().expect("a row").to_owned();
    let (_, values) = late.split_once(',').expect("a time");
    let gap = format!("{}20,{values}\n20.001,{values}\n", standing());
    fs::write(bench.path("gap.csv"), gap).expect("a file");
    let before = bench.files();
    for (arguments, expected) in cases(
        "
        walk.csv there.mcap => there.mcap is there already: name another file, or add --overwrite
        gap.csv part.mcap --from 5 --to 15 => gap.csv: there is no sample from --from to --to
        walk.csv folder/x/y.csv => there is no directory folder/x
        walk.csv walk.csv --overwrite => it is the recording itself
        walk.csv walk.db3 => must end in .csv, .parquet or .mcap
        g.csv strict.csv --strict => --strict rejects 1 of the findings above
        absent.csv x.csv => absent.csv cannot be read
        ",
    ) {
        bench.refuses(&format!("convert {arguments}"), expected);
        assert_eq!(bench.files(), before, "{arguments}");
    }
    assert_eq!(read(&bench.path("there.mcap")), "precious");
    bench.stdout("convert walk.csv there.mcap --overwrite");
    assert!(fs::read(bench.path("there.mcap")).expect("a bag").starts_with(b"\x89MCAP0"));
    assert!(!bench.files().iter().any(|name| name.ends_with(".part")));
    let piped = bench.run("convert walk.csv - --as mcap").stdout;
    assert!(piped == fs::read(bench.path("there.mcap")).expect("a bag"));
}

#[test]
fn clock_shift_of_a_bag_is_reported() {
    let bench = Bench::with("walk.csv", standing());
    let output = bench.run("convert walk.csv walk.mcap");
    let shift =
        "times of a bag begin after 1970-01-01 00:00:00, so all are 1 s later than in walk.csv";
    assert!(text(&output.stderr).contains(shift), "{output:?}");
    let late = "t,ax,ay,az,wx,wy,wz\n3000000000,0,0,9.8,0,0,0\n3000000000.01,0,0,9.8,0,0,0\n";
    fs::write(bench.path("late.csv"), late).expect("a file");
    bench.refuses("convert late.csv late.mcap", "no times after 2038");
    assert!(!Path::new(&bench.path("late.mcap")).exists());
}
