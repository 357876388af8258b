//! `footfall foot`, as a whole program, on a simulated foot that runs the board's program.

mod common;

use common::{Bench, read, text};

/// What a command prints, and its errors.
fn foot(bench: &Bench, arguments: &str) -> (String, String) {
    let output = bench.run(&format!("foot {arguments}"));
    (text(&output.stdout), text(&output.stderr))
}

#[test]
fn a_foot_is_found_described_and_asked() {
    let bench = Bench::new();
    let (scan, _) = foot(&bench, "demo:feet=4,speed=10 scan");
    assert_eq!(
        scan,
        "can0  node 17  FL\ncan0  node 18  FR\ncan0  node 19  RL\ncan0  node 20  RR\n"
    );
    let (info, error) = foot(&bench, "demo:speed=10 info");
    assert!(info.starts_with("foot     FL, node 17\n"), "{info}{error}");
    assert!(info.contains("faults   none\n"), "{info}");
    let (info, _) = foot(&bench, "demo:feet=4,speed=10 --node 0x13 info --json");
    let json: serde_json::Value = serde_json::from_str(&info).expect("JSON");
    assert_eq!((&json["foot"], &json["node"]), (&"RL".into(), &19.into()));
    let (one, _) = foot(&bench, "demo:speed=10,line=uart get decision.threshold");
    assert!(one.starts_with("decision.threshold = 0.5   # "), "{one}");
    let (all, _) = foot(&bench, "demo:speed=10 get --json");
    let all: serde_json::Value = serde_json::from_str(&all).expect("JSON");
    assert!(all.as_object().expect("an object").len() > 60);
}

#[test]
fn settings_go_to_a_file_and_back() {
    let bench = Bench::new();
    let (_, error) = foot(&bench, "demo:speed=10 export foot.txt");
    assert_eq!(error, "");
    let exported = read(&bench.path("foot.txt"));
    assert!(
        exported.contains("\ndecision.threshold = 0.5 # "),
        "{exported}"
    );
    let changed = exported.replace("decision.threshold = 0.5 ", "decision.threshold = 0.625 ");
    std::fs::write(bench.path("foot.txt"), changed).expect("a file");
    for line in ["can", "uart"] {
        let (diff, _) = foot(&bench, &format!("demo:speed=10,line={line} diff foot.txt"));
        assert!(
            diff.contains("decision.threshold: 0.625 → 0.5\n"),
            "{line}: {diff}"
        );
        let (imported, error) = foot(
            &bench,
            &format!("demo:speed=10,line={line} import foot.txt"),
        );
        assert!(
            imported.contains("decision.threshold: 0.5 → 0.625\n"),
            "{imported}{error}"
        );
        assert!(imported.ends_with("stored\n"), "{imported}");
    }
    let (diff, _) = foot(&bench, "demo:speed=10 diff");
    assert_eq!(diff, "load_input.source: 0 → 2\n");
}

#[test]
fn a_setting_that_is_wrong_is_refused_with_its_name_and_range() {
    let bench = Bench::new();
    for (arguments, expected) in [
        (
            "set decision.threshold=2",
            "decision.threshold is \"2\", but 0",
        ),
        ("set threshold=0.5", "did you mean decision.threshold or "),
        ("set decision.threshold", "write NAME=VALUE"),
        ("set stage=1", "stage is no setting"),
        ("get nothing", "no object is called \"nothing\""),
        ("import none.txt", "none.txt: "),
        ("export settings.csv", ".txt"),
    ] {
        let (_, error) = foot(&bench, &format!("demo:speed=10 {arguments}"));
        assert!(error.contains(expected), "{arguments}: {error}");
    }
    let (set, _) = foot(&bench, "demo:speed=10 set decision.threshold=0.75 --save");
    assert_eq!(set, "decision.threshold: 0.5 → 0.75\nstored\n");
}
