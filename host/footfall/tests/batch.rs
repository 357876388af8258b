//! Tests of `footfall batch`: output, unchanged files, and recovery from a killed run.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::common::feet::csv;
use crate::common::{AXES, Bench, standing};
use gait::GaitName;
use serde_json::Value;

/// Returns a tree of two robots with three valid recordings and an invalid one.
fn lab() -> Bench {
    let bench = Bench::new();
    for folder in ["logs/spot/monday", "logs/go2"] {
        fs::create_dir_all(bench.path(folder)).expect("a folder");
    }
    for (name, content) in [
        ("logs/spot/monday/fl.csv", csv(GaitName::Walk, 6.0)),
        ("logs/spot/fr.csv", standing().into_bytes()),
        ("logs/go2/walk.csv", csv(GaitName::Trot, 4.0)),
        ("logs/go2/broken.csv", b"t,ax\n0,0\n".to_vec()),
        ("logs/README.md", b"# Walks".to_vec()),
        ("logs/.hidden.csv", b"t".to_vec()),
    ] {
        fs::write(bench.path(name), content).expect("a file");
    }
    bench
}

/// File of notes on the recordings, in the folder of results.
const NOTES: &str = ".inputs.json";

/// Returns the files below a directory with their content, but for the notes, which have times of files.
fn tree(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    fn collect(folder: &Path, top: &Path, files: &mut BTreeMap<PathBuf, Vec<u8>>) {
        for entry in fs::read_dir(folder).into_iter().flatten() {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                collect(&path, top, files);
            } else if !path.ends_with(NOTES) {
                let name = path.strip_prefix(top).expect("below").to_owned();
                files.insert(name, fs::read(path).expect("a file"));
            }
        }
    }
    let mut files = BTreeMap::new();
    collect(folder, folder, &mut files);
    files
}

/// Returns the report, for any exit code.
fn report(bench: &Bench, arguments: &str) -> Value {
    let output = bench.run(&format!("batch {arguments} --json"));
    serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{output:?}"))
}

fn counts(report: &Value) -> [u64; 3] {
    ["done", "up_to_date", "failed"].map(|name| report[name].as_u64().expect("a count"))
}

/// Returns name, action and reason of each recording.
fn actions(report: &Value) -> Vec<String> {
    let recordings = report["recordings"].as_array().expect("a list");
    let of = |recording: &Value| {
        let word = |name: &str| recording[name].as_str().unwrap_or("-").to_owned();
        [word("recording"), word("action"), word("reason")].join(" ")
    };
    recordings.iter().map(of).collect()
}

#[test]
fn invalid_recording_is_a_row_and_does_not_stop_the_batch() {
    let bench = lab();
    let output = bench.run("batch logs --out out");
    assert_eq!(output.status.code(), Some(1));
    let said = crate::common::text(&output.stderr);
    assert!(
        said.contains("footfall: logs/go2/broken.csv, line 1: missing"),
        "{said}"
    );
    assert!(
        said.ends_with("footfall: 1 of 4 recordings failed\n"),
        "{said}"
    );
    assert_eq!(
        crate::common::text(&output.stdout),
        "batch    3 done, 0 up to date, 1 failed\n\
         passed over 1 that are no recordings (-v lists them)\n\
         written  out\n"
    );
    let files = tree(&bench.path("out"));
    let names: Vec<String> = files
        .keys()
        .map(|name| name.display().to_string())
        .collect();
    assert_eq!(names.len(), 3 * 3 + 1, "{names:?}");
    for start in [
        "samples/robot=spot/foot=fl/day=unknown/logs-spot-monday-fl.csv-",
        "events/robot=spot/foot=fr/day=unknown/logs-spot-fr.csv-",
        "recordings/robot=go2/foot=broken/day=unknown/logs-go2-broken.csv-",
    ] {
        assert!(
            names.iter().any(|name| name.starts_with(start)),
            "{start} {names:?}"
        );
    }
}

/// Writes other bytes of the same length into a file, and restores its time of modification.
fn change_behind_the_listing(path: &Path) {
    let modified = fs::metadata(path).and_then(|about| about.modified());
    let mut bytes = fs::read(path).expect("a file");
    *bytes.last_mut().expect("a byte") ^= 1;
    fs::write(path, bytes).expect("a file");
    let file = fs::File::options().write(true).open(path);
    let set = file
        .expect("a file")
        .set_modified(modified.expect("a time"));
    set.expect("its time");
}

#[test]
fn unchanged_recording_is_known_by_its_listing() {
    let bench = lab();
    let recording = bench.path("logs/spot/fr.csv");
    let first = report(&bench, "logs --out out");
    assert_eq!(counts(&first), [3, 0, 1]);
    // The rows of the notes are those of the tables.
    let listed = report(&bench, "logs --out out");
    assert_eq!(counts(&listed), [0, 3, 1]);
    assert_eq!(listed, report(&bench, "logs --out out --verify contents"));
    change_behind_the_listing(&recording);
    assert_eq!(counts(&report(&bench, "logs --out out")), [0, 3, 1]);
    assert_eq!(
        counts(&report(&bench, "logs --out out --dry-run")),
        [0, 3, 1]
    );
    let planned = report(&bench, "logs --out out --dry-run --verify contents");
    let changed = "logs/spot/fr.csv to_do input_changed".to_owned();
    assert!(actions(&planned).contains(&changed), "{planned}");
    let contents = report(&bench, "logs --out out --verify contents");
    assert_eq!(counts(&contents), [1, 2, 1]);
    // Another time makes its bytes count, which are noted again.
    let noted = fs::read(bench.path("out").join(NOTES)).expect("notes");
    let file = fs::File::options().write(true).open(&recording);
    let set = file.expect("a file").set_modified(std::time::UNIX_EPOCH);
    set.expect("its time");
    assert_eq!(counts(&report(&bench, "logs --out out")), [0, 3, 1]);
    assert_ne!(
        fs::read(bench.path("out").join(NOTES)).expect("notes"),
        noted
    );
    // Without notes the bytes count, too.
    for damaged in [true, false] {
        change_behind_the_listing(&recording);
        match damaged {
            true => fs::write(bench.path("out").join(NOTES), "{"),
            false => fs::remove_file(bench.path("out").join(NOTES)),
        }
        .expect("notes");
        assert_eq!(counts(&report(&bench, "logs --out out")), [1, 2, 1]);
    }
    // Notes on recordings of other runs are kept, those on recordings without results are not.
    let notes = || crate::common::read(&bench.path("out").join(NOTES));
    bench.run("batch logs/go2 --out out");
    let noted = || notes().matches("{\"blake3\":").count();
    assert_eq!(noted(), 4);
    fs::remove_file(&recording).expect("it is there");
    bench.run("batch logs --out out --prune --yes");
    bench.run("batch logs --out out");
    assert_eq!(noted(), 3);
    // A file of a row that has changed is read.
    let table = bench.path("out/recordings/robot=spot");
    let name = tree(&table).into_keys().next().expect("a row");
    fs::write(table.join(name), "PAR1").expect("a file");
    let again = report(&bench, "logs --out out");
    assert_eq!(counts(&again), [1, 1, 1], "{again}");
}

#[test]
fn second_run_processes_only_missing_or_changed() {
    let bench = lab();
    fs::remove_file(bench.path("logs/go2/broken.csv")).expect("it is there");
    assert_eq!(counts(&report(&bench, "logs --out out")), [3, 0, 0]);
    let first = tree(&bench.path("out"));
    assert_eq!(counts(&report(&bench, "logs --out out")), [0, 3, 0]);
    assert!(tree(&bench.path("out")) == first);
    // A new recording, a changed input and a lost output file.
    fs::write(bench.path("logs/go2/new.csv"), standing()).expect("a file");
    fs::write(
        bench.path("logs/spot/fr.csv"),
        standing() + "1,0,0,9.81,0,0,0,50,1\n",
    )
    .expect("a file");
    let lost = first
        .keys()
        .find(|name| name.starts_with("samples/robot=spot/foot=fl"));
    fs::remove_file(bench.path("out").join(lost.expect("it is there"))).expect("it is there");
    let planned = report(&bench, "logs --out out --dry-run");
    let expected = |action: &str| {
        [
            format!("logs/go2/new.csv {action} missing"),
            "logs/go2/walk.csv up_to_date -".to_owned(),
            format!("logs/spot/fr.csv {action} input_changed"),
            format!("logs/spot/monday/fl.csv {action} incomplete"),
        ]
    };
    assert_eq!(actions(&planned), expected("to_do"));
    assert_eq!(
        actions(&report(&bench, "logs --out out")),
        expected("estimated")
    );
    assert_eq!(counts(&report(&bench, "logs --out out")), [0, 4, 0]);
    // Other settings, then another robot: no old output remains.
    let again = report(&bench, "logs --out out --preset paper --gravity included");
    let reasons = actions(&again);
    assert!(
        reasons
            .iter()
            .all(|one| one.ends_with("estimated other_settings")),
        "{reasons:?}"
    );
    let moved = report(
        &bench,
        "logs --out out --preset paper --gravity included --robot x",
    );
    let reasons = actions(&moved);
    assert!(
        reasons
            .iter()
            .all(|one| one.ends_with("estimated other_place")),
        "{reasons:?}"
    );
    let names = tree(&bench.path("out"));
    assert!(
        names
            .keys()
            .all(|name| name.display().to_string().contains("robot=x"))
    );
    assert_eq!(
        fs::read_dir(bench.path("out/samples"))
            .expect("a folder")
            .count(),
        1
    );
}

#[test]
fn unchanged_failure_is_reported_without_retry() {
    let bench = lab();
    report(&bench, "logs --out out");
    let again = report(&bench, "logs --out out");
    assert_eq!(counts(&again), [0, 3, 1]);
    assert_eq!(actions(&again)[0], "logs/go2/broken.csv up_to_date -");
}

#[test]
fn removed_sources_are_reported_and_pruned_on_request() {
    let bench = lab();
    report(&bench, "logs --out out");
    fs::remove_dir_all(bench.path("logs/go2")).expect("it is there");
    let kept = report(&bench, "logs --out out");
    let names: Vec<_> = kept["stale"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|s| &s["recording"])
        .collect();
    assert_eq!(names, ["logs/go2/broken.csv", "logs/go2/walk.csv"]);
    assert_eq!(tree(&bench.path("out")).len(), 10);
    // Without a terminal there is no confirmation.
    let output = bench.run("batch logs --out out --prune");
    let said = crate::common::text(&output.stderr);
    assert!(
        said.contains("there is no terminal") && !output.status.success(),
        "{said}"
    );
    assert_eq!(tree(&bench.path("out")).len(), 10);
    assert_eq!(
        report(&bench, "logs --out out --prune --yes")["pruned"],
        true
    );
    assert_eq!(tree(&bench.path("out")).len(), 6);
    assert!(!bench.path("out/recordings/robot=go2").exists());
}

#[test]
fn pruning_keeps_results_outside_of_the_sources() {
    let bench = lab();
    report(&bench, "logs --out out");
    let of_go2 = || tree(&bench.path("out/recordings/robot=go2"));
    let before = of_go2();
    assert!(!before.is_empty());
    fs::remove_dir_all(bench.path("logs/go2")).expect("it is there");
    for sources in ["logs/spot", "logs/spot/monday/fl.csv", "./logs/spot/"] {
        let pruned = report(&bench, &format!("{sources} --out out --prune --yes"));
        assert_eq!(
            pruned["stale"].as_array().map(Vec::len),
            Some(0),
            "{sources}"
        );
        assert!(of_go2() == before, "{sources}");
    }
}

#[test]
fn results_are_independent_of_jobs_and_output_location() {
    let bench = lab();
    report(&bench, "logs --out one --jobs 1");
    report(&bench, "logs --out logs/results --jobs 7");
    let again = report(&bench, "logs --out logs/results");
    assert_eq!(counts(&again), [0, 3, 1]);
    assert!(tree(&bench.path("one")) == tree(&bench.path("logs/results")));
}

#[test]
fn samples_match_a_replay() {
    let bench = lab();
    report(&bench, "logs/spot/monday/fl.csv --out out");
    bench.stdout("replay logs/spot/monday/fl.csv --output replayed.csv --events events.csv");
    let replayed = crate::common::read(&bench.path("replayed.csv"));
    let rows = report(&bench, "logs/spot/monday/fl.csv --out out");
    let row = &rows["recordings"][0]["rows"][0];
    assert_eq!(row["robot"], "unknown");
    assert_eq!(
        row["samples"].as_u64(),
        Some(replayed.lines().count() as u64 - 1)
    );
    let events = crate::common::read(&bench.path("events.csv"));
    let touch_downs = events
        .lines()
        .filter(|line| line.contains("touch_down"))
        .count();
    assert_eq!(row["steps"].as_u64(), Some(touch_downs as u64));
}

#[test]
fn paths_give_robot_foot_and_day() {
    let bench = Bench::new();
    fs::create_dir_all(bench.path("data/20240501/spot-3")).expect("a folder");
    fs::write(bench.path("data/20240501/spot-3/run1_fl.csv"), standing()).expect("a file");
    fs::write(bench.path("data/other.csv"), standing()).expect("a file");
    let output = bench.run("batch data --out out --path-pattern {day}/{robot}/*_{foot}.csv");
    assert_eq!(
        crate::common::text(&output.stderr),
        "footfall: 1 of 2 recordings are not as --path-pattern has it, such as data/other.csv\n"
    );
    assert!(
        bench
            .path("out/samples/robot=spot-3/foot=fl/day=2024-05-01")
            .is_dir()
    );
    assert!(
        bench
            .path("out/samples/robot=data/foot=other/day=unknown")
            .is_dir()
    );
}

#[test]
fn settings_apply_to_the_foot_in_the_path() {
    let bench = Bench::new();
    fs::create_dir_all(bench.path("data")).expect("a folder");
    for foot in ["fl", "fr"] {
        fs::write(bench.path(&format!("data/run1_{foot}.csv")), standing()).expect("a file");
    }
    let pattern = "data --out out --path-pattern *_{foot}.csv";
    let axes = |arguments: &str| {
        let report = report(&bench, &format!("{pattern} {arguments}"));
        let recordings = report["recordings"].as_array().expect("a list").clone();
        let axes = recordings.iter().map(|recording| {
            let correction = recording["rows"][0]["correction"].as_str().expect("a text");
            let correction: Value = serde_json::from_str(correction).expect("JSON");
            correction["axes"].as_str().expect("a text").to_owned()
        });
        axes.collect::<Vec<_>>()
    };
    assert_eq!(axes("--axes FR=-x,-y,z"), ["x,y,z", "-x,-y,z"]);
    fs::write(bench.path("robot.toml"), "[feet.fl]\naxes = 'y,-x,z'\n").expect("a file");
    assert_eq!(axes("--config robot.toml"), ["y,-x,z", "x,y,z"]);
}

#[test]
fn settings_of_a_foot_without_recording_are_a_warning() {
    let bench = lab();
    let said = |arguments: &str| {
        let output = bench.run(&format!("batch logs/spot --out out {arguments}"));
        crate::common::text(&output.stderr).to_owned()
    };
    assert_eq!(said("--axes fr=-x,-y,z"), "");
    let warning =
        "footfall: there are settings of f, but no recording of it; the feet are fl, fr\n";
    assert_eq!(said("--axes f=-x,-y,z"), warning);
    assert_eq!(said("--axes f=-x,-y,z"), warning);
    fs::write(bench.path("robot.toml"), "[feet.f]\naxes = 'y,-x,z'\n").expect("a file");
    assert_eq!(said("--config robot.toml"), warning);
}

#[cfg(unix)]
#[test]
fn links_are_followed_once_and_loops_are_skipped() {
    use std::os::unix::fs::symlink;
    let bench = lab();
    fs::remove_file(bench.path("logs/go2/broken.csv")).expect("it is there");
    symlink("../../logs", bench.path("logs/spot/loop")).expect("a link");
    symlink("spot", bench.path("logs/latest")).expect("a link");
    symlink("nowhere", bench.path("logs/dangling.csv")).expect("a link");
    let report = report(&bench, "logs --out out");
    assert_eq!(counts(&report), [3, 0, 0]);
    let names = actions(&report);
    assert!(
        !names.iter().any(|name| name.contains("latest")),
        "{names:?}"
    );
    let reasons = report["passed_over"].to_string();
    assert!(
        reasons.contains("it is a link to a folder above"),
        "{reasons}"
    );
    assert!(reasons.contains("dangling.csv"), "{reasons}");
}

#[test]
fn missing_source_and_invalid_settings_fail_early() {
    let bench = lab();
    let error = bench.error("batch absent --out out");
    assert!(
        error.starts_with("footfall: absent cannot be read: "),
        "{error}"
    );
    let error = bench.error("batch logs --out out --window 50ms");
    assert!(
        error.starts_with("footfall: --window has an effect"),
        "{error}"
    );
    let error = bench.error("batch logs --out logs/README.md");
    assert!(error.contains("results go into a directory"), "{error}");
    assert!(!bench.path("out").exists());
}

#[test]
fn finding_is_a_warning_and_with_strict_an_error() {
    let row = |k: u32| format!("{:.3},0,0,1,0,0,0\n", f64::from(k) * 0.002);
    let in_g: String = (0..2000).map(row).collect();
    let bench = Bench::with("g.csv", format!("t,{AXES}\n{in_g}"));
    let output = bench.run("batch g.csv --out out");
    assert!(output.status.success(), "{output:?}");
    assert!(
        crate::common::text(&output.stderr)
            .starts_with("footfall: g.csv: the acceleration is 1.00")
    );
    let output = bench.run("batch g.csv --out out");
    assert!(output.stderr.is_empty(), "{output:?}");
    let output = bench.run("batch g.csv --out out --strict");
    assert_eq!(output.status.code(), Some(1));
    assert!(crate::common::text(&output.stderr).contains("--strict does not let"));
}

/// Kills the command after this time; returns whether it was still running.
fn killed_after(bench: &Bench, out: &str, time: Duration) -> bool {
    let mut child = Command::new(env!("CARGO_BIN_EXE_footfall"))
        .args(["batch", "logs", "--quiet", "--jobs", "3", "--out", out])
        .current_dir(&bench.directory)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the command that was just built");
    thread::sleep(time);
    let was_running = child.try_wait().expect("a child").is_none();
    child.kill().expect("SIGKILL");
    child.wait().expect("it ends");
    was_running
}

/// Maximum number of runs, each killed twice.
const MOST_KILLS: u32 = 160;

#[test]
fn rerun_after_kill_gives_identical_output() {
    let bench = lab();
    for k in 0..6 {
        let path = bench.path(&format!("logs/spot/more{k}.csv"));
        fs::write(path, csv(GaitName::Walk, 5.0)).expect("a file");
    }
    let begun = Instant::now();
    report(&bench, "logs --out whole");
    let whole = begun.elapsed();
    let expected = tree(&bench.path("whole"));
    let is_unfinished = |name: &PathBuf| name.display().to_string().ends_with(".part");
    let (mut killed, mut halfway) = (0, 0);
    // On a busy machine few kills hit a run, and fewer a file being written, so the test repeats until enough do.
    for k in 0..MOST_KILLS {
        let out = format!("killed{k}");
        // The second kill hits the restart after the first.
        for part in [k % 16, 16 - k % 16] {
            killed += u32::from(killed_after(&bench, &out, whole * part / 18));
        }
        let left = tree(&bench.path(&out));
        halfway += u32::from(left.keys().any(is_unfinished));
        for (name, bytes) in &left {
            // Files with final names are complete.
            assert!(
                is_unfinished(name) || expected.get(name) == Some(bytes),
                "{name:?}"
            );
        }
        report(&bench, &format!("logs --out {out}"));
        let rerun = tree(&bench.path(&out));
        let names = [&rerun, &expected].map(|tree| tree.keys().collect::<Vec<_>>());
        assert!(rerun == expected, "{k}: {names:#?}");
        if k >= 15 && killed >= 8 && halfway >= 2 {
            return;
        }
    }
    panic!("{killed} were running, {halfway} left an unfinished file");
}

#[test]
fn unfinished_notes_of_a_killed_run_are_removed() {
    let bench = lab();
    let unfinished = bench.path(&format!("out/.{NOTES}.1.part"));
    fs::create_dir(bench.path("out")).expect("a folder");
    fs::write(&unfinished, "{").expect("a file");
    report(&bench, "logs --out out");
    assert!(!unfinished.exists());
}

#[cfg(unix)]
#[test]
fn concurrent_runs_into_one_folder_are_rejected() {
    let bench = lab();
    fs::create_dir(bench.path("out")).expect("a folder");
    let folder = fs::File::open(bench.path("out")).expect("a folder");
    folder.lock().expect("a lock");
    let error = bench.error("batch logs --out out");
    assert!(error.contains("another process writes there"), "{error}");
    drop(folder);
    assert_eq!(counts(&report(&bench, "logs --out out")), [3, 0, 1]);
}
