//! Tests of the `evaluate` command on synthetic recordings.

mod bench;

use std::fs;

use bench::Bench;
use evaluate::method::ComparedMethod;
use evaluate::sets::{Set, files};
use serde_json::Value;

fn array<'a>(value: &'a Value, name: &str) -> &'a Vec<Value> {
    value[name].as_array().expect(name)
}

#[test]
fn methods_are_scored_on_all_sets_with_their_inputs() {
    let json = Bench::with_recordings().stdout("--datasets data --json");
    let evaluation: Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(array(&evaluation, "sets").len(), Set::ALL.len());
    let methods = array(&evaluation, "methods");
    assert_eq!(methods.len(), ComparedMethod::ALL.len());
    for method in methods {
        let sets = array(method, "sets");
        let count = match method["method"].as_str() {
            // The five sets with a wrench and ATLAS at 500 Hz are without gravity.
            Some("authors") => 6,
            _ if method["mean"].is_null() => 5,
            _ => Set::ALL.len(),
        };
        assert_eq!(sets.len(), count, "{}", method["name"]);
        for on in sets {
            assert!(on["figures"]["rmse"].is_number(), "{on}");
            assert!(on["learnt"].is_string(), "{on}");
        }
        // Stance and swing are easy to distinguish here.
        let auc = method["pools"][0]["figures"]["roc_auc"].as_f64();
        assert!(auc.expect("both labels") > 0.9, "{method}");
    }
    let robots = methods.iter().filter(|method| method["mean"].is_null());
    let robots: Vec<_> = robots
        .filter_map(|method| method["name"].as_str())
        .collect();
    assert_eq!(
        robots,
        [
            "authors' script (looks ahead)",
            "force threshold, tuned on other families",
            "force threshold, tuned on its family",
            "force Schmitt trigger 10/5 %",
            "fuzzy c-means, force and IMU"
        ]
    );
}

#[test]
fn tables_are_written_as_text_or_markdown() {
    let bench = Bench::with_recordings();
    let text = bench.stdout("--datasets data");
    assert!(
        text.starts_with("== Means over seven sets\nmethod "),
        "{text}"
    );
    assert!(
        text.contains("\n== NAO: NAO_05ground\n600 samples at 100 Hz, 50.0 % of them stable.\n")
    );
    assert!(text.contains("\n== shoe: 12 recordings\n14400 samples at 200 Hz, "));
    let markdown = bench.stdout("--datasets data --markdown");
    assert!(
        markdown.contains("\n| SHOE / GLRT, as published | "),
        "{markdown}"
    );
    assert!(markdown.contains("| threshold from ATLAS_01ground_3steps |\n"));
    assert!(markdown.contains("| threshold from ATLAS, LCD, simulated |\n"));
    // A missing figure is not shown as zero.
    assert!(markdown.contains("\n| force Schmitt trigger 10/5 % | – | "));
}

#[test]
fn both_pictures_are_drawn() {
    let bench = Bench::with_recordings();
    bench.stdout("--datasets data --histogram errors.svg --reliability means.svg");
    assert!(bench.read("errors.svg").contains("|P − label|"));
    assert!(bench.read("means.svg").contains("share that is stable"));
}

#[test]
fn unwritable_picture_fails_before_the_evaluation() {
    let bench = Bench::new();
    for (arguments, why) in [
        (
            "--histogram a.png",
            "a.png cannot be written: pictures are SVG, so the name must end in .svg",
        ),
        (
            "--reliability no/a.svg",
            "no/a.svg cannot be written: there is no directory no",
        ),
        (
            "--histogram a.svg --reliability ./a.svg",
            "./a.svg cannot be written: it is named for two results",
        ),
    ] {
        let error = bench.error(arguments);
        assert_eq!(error, format!("footfall: {why}\n"));
    }
}

#[test]
fn help_lists_every_recording_and_its_origin() {
    let help = Bench::new().stdout("--help");
    for file in files() {
        let (before, _) = help.split_once(file.path).expect(file.path);
        let origin = before.lines().rfind(|line| line.starts_with("  from "));
        assert_eq!(
            origin,
            Some(format!("  from {}", file.layout.origin()).as_str())
        );
    }
}

#[test]
fn missing_recording_error_names_its_origin() {
    let bench = Bench::with_recordings();
    for (file, origin) in [
        (
            "robots/nao_gem/2_r.csv",
            "the history of github.com/mrsp/gem, converted to CSV",
        ),
        (
            "pyshoe/2017-11-22-11-36-45.csv",
            "github.com/mtahakoroglu/OpenShoe-PyShoe-DeepShoe-FuseShoe",
        ),
        ("lcd/NAO_05ground.csv", "github.com/mrsp/lcd"),
    ] {
        fs::remove_file(bench.path("data").join(file)).expect("it is there");
        assert_eq!(
            bench.error("--datasets data"),
            format!(
                "footfall: data/{file} is not there; --datasets names the folder above it, the \
                 file is from {origin}\n"
            )
        );
    }
}
