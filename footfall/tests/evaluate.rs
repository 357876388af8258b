//! `footfall evaluate` from outside, on recordings made up for it.

mod common;

use std::fs;

use common::{Bench, read};
use footfall::evaluate::labelled::SOURCES;
use footfall::input::pce::LabelScheme;

/// A bench with recordings in a folder `data`: standing and swinging by turns.
fn bench() -> Bench {
    let bench = Bench::new();
    for source in SOURCES {
        let (labels, per_turn) = match source.labels {
            LabelScheme::StableOrNot => (["1", "0"], 300),
            LabelScheme::ContactClass => (["0", "1"], 30),
        };
        let row = |k: u32| {
            let noise = 0.02 * (f64::from(k * 7919 % 1000) / 1000.0 - 0.5);
            match k / per_turn % 2 {
                0 => format!("1,2,800,3,4,5,{noise},{noise},0,0,0,0,{}\n", labels[0]),
                _ => {
                    let a = if k.is_multiple_of(2) { 8 } else { -8 };
                    format!("0,0,0,0,0,0,{a},7,6,3,2,{noise},{}\n", labels[1])
                }
            }
        };
        let path = bench.path("data").join(source.path);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, (0..per_turn * 20).map(row).collect::<String>()).expect("a recording");
    }
    bench
}

#[test]
fn every_method_is_scored_on_every_recording() {
    let json = bench().stdout("evaluate --datasets data --json");
    let evaluation: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    let methods = evaluation["methods"].as_array().expect("methods");
    assert_eq!(methods.len(), 13);
    for method in methods {
        let recordings = method["recordings"].as_array().expect("recordings");
        assert_eq!(recordings.len(), SOURCES.len(), "{}", method["name"]);
        for on in recordings {
            assert!(on["figures"]["rmse"].is_number(), "{on}");
            assert!(on["learnt"].is_string(), "{on}");
        }
        // Standing and swinging are that plain here.
        let auc = method["groups"][0]["figures"]["roc_auc"].as_f64();
        assert!(auc.expect("both labels") > 0.9, "{method}");
    }
}

#[test]
fn tables_are_for_a_terminal_or_in_markdown() {
    let bench = bench();
    let text = bench.stdout("evaluate --datasets data");
    assert!(text.starts_with("== All recordings\nmethod "), "{text}");
    assert!(text.contains("\n== NAO_05ground\n600 samples at 100 Hz, 50.0 % of them stable.\n"));
    let markdown = bench.stdout("evaluate --datasets data --markdown");
    assert!(markdown.contains("\n| SHOE / GLRT | "), "{markdown}");
    assert!(markdown.contains("| threshold from ATLAS_01ground_3steps |\n"));
}

#[test]
fn both_pictures_are_drawn() {
    let bench = bench();
    bench.stdout("evaluate --datasets data --histogram errors.svg --reliability means.svg");
    assert!(read(&bench.path("errors.svg")).contains("|P − label|"));
    assert!(read(&bench.path("means.svg")).contains("share that is stable"));
}

#[test]
fn a_picture_that_cannot_be_written_is_found_before_anything_is_computed() {
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
            "./a.svg cannot be written: it is named for both pictures",
        ),
    ] {
        let error = bench.error(&format!("evaluate {arguments}"));
        assert_eq!(error, format!("footfall: {why}\n"));
    }
}

#[test]
fn the_help_names_every_recording_that_is_wanted_and_where_it_is_from() {
    let help = Bench::new().stdout("evaluate --help");
    for source in SOURCES {
        let (before, _) = help.split_once(source.path).expect(source.path);
        let origin = before.lines().rfind(|line| line.starts_with("  from "));
        assert_eq!(origin, Some(format!("  from {}", source.origin()).as_str()));
    }
}

#[test]
fn a_recording_that_is_absent_is_named_with_where_to_get_it() {
    let bench = bench();
    fs::remove_file(bench.path("data/lcd/NAO_05ground.csv")).expect("it is there");
    assert_eq!(
        bench.error("evaluate --datasets data"),
        "footfall: data/lcd/NAO_05ground.csv is not there; --datasets names the folder above it, \
         the file is from github.com/mrsp/lcd\n"
    );
}
