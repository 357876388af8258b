//! Tests of `footfall foot` and `footfall accept` as a program, on a simulated foot that runs the board's firmware.

use gait::GaitName;

use crate::common::feet::{csv, image};
use crate::common::{Bench, assert_has, cases, kill, text, wait_until};

/// Returns stdout and stderr of a command.
fn foot(bench: &Bench, arguments: &str) -> (String, String) {
    let output = bench.run(&format!("foot {arguments}"));
    (text(&output.stdout), text(&output.stderr))
}

#[test]
fn foot_is_scanned_described_and_read() {
    let bench = Bench::new();
    let (scan, _) = foot(&bench, "demo:feet=4,speed=max scan");
    assert_eq!(
        scan,
        "can0  node 17  FL\ncan0  node 18  FR\ncan0  node 19  RL\ncan0  node 20  RR\n"
    );
    let (info, error) = foot(&bench, "demo:speed=max info");
    assert!(info.starts_with("foot     FL, node 17\n"), "{info}{error}");
    assert!(info.contains("faults   none\n"), "{info}");
    let (info, _) = foot(&bench, "demo:feet=4,speed=max --node 0x13 info --json");
    let json: serde_json::Value = serde_json::from_str(&info).expect("JSON");
    assert_eq!((&json["foot"], &json["node"]), (&"RL".into(), &19.into()));
    let (one, _) = foot(&bench, "demo:speed=max,line=uart get decision.threshold");
    // As in the table of docs/reference/settings.md.
    assert_eq!(
        one,
        "decision.threshold = 0.5   # 0.01 to 0.99; probability above which contact counts as stable\n"
    );
    let (all, _) = foot(&bench, "demo:speed=max get --json");
    let all: serde_json::Value = serde_json::from_str(&all).expect("JSON");
    assert!(all.as_object().expect("an object").len() > 60);
}

#[test]
fn report_has_a_line_for_all_that_a_foot_knows_of_its_board() {
    let bench = Bench::new();
    let (report, error) = foot(&bench, "demo:speed=max report");
    for line in [
        "foot     FL, node 17",
        "faults   none",
        "crash    none",
        "history  none",
        "reset    power-up, or a dip of the supply",
        "sensor   WHO_AM_I 0x6C, ",
        "supply   brown-out level 3",
        "costs    edge to mailbox ",
        "counters can_bus_off 0, ",
        "settings load_input.source = ",
    ] {
        let has = report.lines().any(|other| other.starts_with(line));
        assert!(has, "no line {line:?} in\n{report}{error}");
    }
    let (json, _) = foot(&bench, "demo:speed=max report --json");
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(json["diagnosis"]["diagnosis.sensor_identity"], 0x6C, "{json:#}");
    assert_eq!(json["counters"]["late_ticks"], 0, "{json:#}");
}

#[test]
fn action_without_results_prints_an_object_as_json() {
    let bench = Bench::new();
    for action in ["save", "restore", "reset", "selftest", "calibrate --forget"] {
        let (sentence, error) = foot(&bench, &format!("demo:speed=max {action}"));
        let (json, _) = foot(&bench, &format!("demo:speed=max --json {action}"));
        let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        assert_eq!(json, serde_json::json!({ "done": sentence.trim_end() }), "{action}: {error}");
    }
}

#[test]
fn scan_and_acceptance_take_the_feet_of_several_lines() {
    let bench = Bench::new();
    let (scan, error) = foot(&bench, "demo:feet=2,speed=max demo:line=uart,speed=max scan");
    assert_eq!(scan, "can0  node 21  L\ncan0  node 22  R\nFL  FL\n", "{error}");
    let (scan, error) = foot(&bench, "demo:feet=2,line=uart,speed=max scan");
    assert_eq!(scan, "L  L\nR  R\n", "{error}");
    let (_, error) = foot(&bench, "demo:speed=max demo:line=uart info");
    assert_eq!(error, "footfall: demo:feet=1 demo:feet=1 are several sources: name one\n");
    let both = bench.run("accept demo:speed=max demo:line=uart,speed=max --only board --json");
    let said = text(&both.stderr);
    assert!(both.status.success(), "{said}");
    let reports = text(&both.stdout);
    let reports = serde_json::Deserializer::from_str(&reports).into_iter::<serde_json::Value>();
    let nodes: Vec<_> = reports.map(|report| report.expect("JSON")["node"].clone()).collect();
    assert_eq!(nodes, [17.into(), serde_json::Value::Null]);
}

#[test]
fn invalid_setting_error_gives_name_and_range() {
    let bench = Bench::new();
    for (arguments, expected) in cases(
        r#"
        set decision.threshold=2 => decision.threshold is "2", but 0
        set threshold=0.5 => no object has the name "threshold"
        set decision.threshold => write NAME=VALUE
        set stage=1 => stage is not a setting
        get nothing => no object has the name "nothing"
        import none.txt => none.txt:
        export settings.csv => .txt
        "#,
    ) {
        let (_, error) = foot(&bench, &format!("demo:speed=max {arguments}"));
        assert!(error.contains(expected), "{arguments}: {error}");
    }
    // As an export has it.
    let set = bench.command("foot demo:speed=max set").arg("decision.threshold = 0.6").output();
    let output = text(&set.expect("it runs").stdout);
    assert!(output.starts_with("decision.threshold: 0.5 → 0.6\n"), "{output}");
    let (set, _) = foot(&bench, "demo:speed=max set decision.threshold=0.75 --save");
    assert_eq!(set, "decision.threshold: 0.5 → 0.75\nstored\n");
}

#[test]
fn id_command_refuses_an_id_in_use_and_an_unknown_foot() {
    let bench = Bench::new();
    for (arguments, expected) in cases(
        "
        demo:feet=4,speed=max --node 17 id FR => would become node 18, which is already on the bus
        demo:speed=max id XY => write one of FL, FR, RL, RR, L, R
        ",
    ) {
        let (_, error) = foot(&bench, arguments);
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn calibration_needs_a_walking_and_learning_foot() {
    let bench = Bench::new();
    let (text, error) = foot(&bench, "demo:speed=max --node 17 calibrate");
    for expected in
        ["kept and stored\n", "still ", "speed ", "gyroscope_bias_z ", "accelerometer.scale.ax "]
    {
        assert!(text.contains(expected), "{expected}: {text}{error}");
    }
    assert!(error.contains("let the foot walk: "), "{error}");
    let (_, error) = foot(&bench, "demo:speed=max calibrate --seconds 0.001");
    assert_has(&error, "has not learnt enough in 0.001 s (");
    let (forgotten, _) = foot(&bench, "demo:speed=max calibrate --forget");
    assert_eq!(forgotten, "the learnt values are erased\n");
}

/// Returns whether a process has ended, and the processor time that it has used, clock ticks (`man proc_pid_stat`).
#[cfg(target_os = "linux")]
fn ended_and_ticks(child: &std::process::Child) -> (bool, u32) {
    let path = format!("/proc/{}/stat", child.id());
    let stat = std::fs::read_to_string(path).expect("a process");
    let (_, fields) = stat.rsplit_once(") ").expect("a name in parentheses");
    let fields: Vec<&str> = fields.split(' ').collect();
    let ticks = |at: usize| fields[at].parse::<u32>().expect("ticks");
    (fields[0] == "Z", ticks(11) + ticks(12))
}

#[cfg(target_os = "linux")]
#[test]
fn interrupted_id_change_is_completed() {
    // The node is given so that the command does not search for the foot, because an interruption during the search
    // would end the command before the change.
    let bench = Bench::new();
    let start = || bench.start("foot demo:speed=max --node 17 id FR", None);
    let mut whole = start();
    wait_until("an end without interruption", || ended_and_ticks(&whole).0);
    let (_, ticks) = ended_and_ticks(&whole);
    whole.wait().expect("it has ended");
    // The command may end before it is interrupted.
    wait_until("an interruption before the end", || {
        let child = start();
        // After half of the processor time of a whole run, the program has started its request and has not ended.
        let is_over = || {
            let (has_ended, used) = ended_and_ticks(&child);
            has_ended || used > ticks / 2
        };
        while !is_over() {
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        assert!(kill("INT", &child));
        let is_interrupted = !ended_and_ticks(&child).0;
        let output = child.wait_with_output().expect("it ends");
        assert_eq!(output.status.code(), Some(0));
        let info = text(&output.stdout);
        assert!(info.starts_with("foot     FR, node 18\n"), "{info}");
        is_interrupted
    });
}

/// A simulated foot stands for the board on USB.
#[test]
fn each_command_of_the_first_page_can_be_typed() {
    let page = include_str!("../../../docs/start/ten-minutes.md");
    let four = include_str!("../../../docs/start/four-feet.md");
    // One board after the other gets its name; all four at once are tested elsewhere.
    let names = four.lines().filter(|line| line.starts_with("footfall foot usb id "));
    let commands = page.lines().chain(names).filter_map(|line| line.strip_prefix("footfall "));
    let mut typed = Vec::new();
    let bench = Bench::new();
    for line in commands {
        let command = line.split('#').next().unwrap_or(line).trim();
        let source = match command.split(' ').next() {
            Some("monitor" | "record") => "demo:seconds=2,speed=max,line=uart",
            _ => "demo:speed=max,line=uart",
        };
        let arguments = if command == "monitor" {
            format!("monitor {source}")
        } else {
            command.replacen("usb", source, 1)
        };
        let output = bench.run(&arguments);
        let said = text(&output.stderr);
        let is_not_built = command.contains(".mcap") && !cfg!(feature = "bags");
        assert_eq!(output.status.success(), !is_not_built, "{arguments}: {said}");
        typed.push(command);
    }
    for expected in ["monitor", "calibrate usb --write", "foot usb id FR"] {
        assert!(typed.contains(&expected), "{typed:?}");
    }
}

#[test]
fn calibrated_file_is_imported_with_axes_and_learnt_values() {
    let bench = Bench::with("walk.csv", csv(GaitName::Walk, 12.0));
    // Turns the walk, as if y of the sensor were up.
    let walk = std::fs::read_to_string(bench.path("walk.csv")).expect("a table");
    let turned = walk.lines().enumerate().map(|(k, line)| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if k > 0 {
            for at in [1, 4] {
                let (y, z) = (cells[at + 1].clone(), cells[at + 2].clone());
                cells[at + 1] = z;
                let negated = -y.parse::<f64>().expect("a number");
                cells[at + 2] = negated.to_string();
            }
        }
        cells.join(",") + "\n"
    });
    let turned: String = turned.collect();
    std::fs::write(bench.path("turned.csv"), turned).expect("a file");
    bench.stdout("calibrate turned.csv --output robot.toml");
    let (said, error) = foot(&bench, "demo:speed=max import robot.toml");
    for expected in ["axes: x,y,z → x,-z,y\n", "learnt.crc: 0 → ", "stored\n"] {
        assert_has(&said, expected);
    }
    assert_eq!(error, "");
    // The commands in the report can be typed.
    let report = bench.stdout("calibrate turned.csv");
    let mut typed = Vec::new();
    for line in
        report.lines().filter_map(|line| line.strip_prefix("if the foot has a footfall board: "))
    {
        typed.push(foot(&bench, &format!("demo:speed=max {line}")).0);
    }
    assert_has(&typed[0], "learnt.crc: 0 → ");
    assert_has(&typed[1], "axes: x,y,z → x,-z,y\n");
    // A setting for the gyroscope's bias is left out, because a foot finds its bias itself. A foot gets its own table.
    let text = "[gyroscope.bias_rad_s]\nwx = 0.01\n[feet.fl]\naxes = '0.8,0.6,0,0'\n[feet.fr]\naxes = '-x,-y,z'\n";
    std::fs::write(bench.path("feet.toml"), text).expect("a file");
    let (said, error) = foot(&bench, "demo:speed=max import feet.toml");
    for expected in ["axes: x,y,z → quaternion\n", "mounting.rotation_w: 1 → 0.8\n"] {
        assert_has(&said, expected);
    }
    assert_has(&error, "feet.toml: a foot has no setting gyroscope.bias_rad_s.wx; left out");
    std::fs::write(bench.path("feet.toml"), "axes = 'x,z,y'\n").expect("a file");
    let (_, error) = foot(&bench, "demo:speed=max import feet.toml");
    assert_has(&error, "feet.toml, line 1");
}

#[test]
fn empty_file_and_duplicate_setting_are_rejected() {
    let bench = Bench::with("foot.txt", "# settings of a foot\n");
    for action in ["import", "diff"] {
        let (output, error) = foot(&bench, &format!("demo:speed=max {action} foot.txt"));
        assert_eq!(output, "");
        assert!(error.contains("foot.txt: it holds no setting"), "{error}");
    }
    std::fs::write(bench.path("locked.txt"), "configuration_lock = 1\ndecision.threshold = 0.6\n")
        .expect("a file");
    let (output, error) = foot(&bench, "demo:speed=max import locked.txt");
    assert_has(&output, "decision.threshold: 0.5 → 0.6");
    assert_eq!(error, "");
    let (output, error) = foot(&bench, "demo:speed=max set window=40ms window=50ms");
    assert_eq!(output, "");
    assert!(error.contains("is named twice"), "{error}");
}

#[test]
fn settings_are_read_from_stdin_with_a_size_limit() {
    let bench = Bench::with("zeros.txt", vec![0; 2 << 20]);
    let output = bench.piped("foot demo:speed=max import -", "decision.threshold = 0.625\n");
    assert_eq!(text(&output.stdout), "decision.threshold: 0.5 → 0.625\nstored\n");
    let (output, error) = foot(&bench, "demo:speed=max import zeros.txt");
    assert_eq!(output, "");
    assert_eq!(error, "footfall: zeros.txt: settings are 1048576 bytes at most\n");
}

#[test]
fn images_are_checked_before_anything_is_sent() {
    let bench = Bench::new();
    let image = image();
    let mut unsigned = image.clone();
    unsigned[9] = 0;
    for (name, bytes, expected) in [
        ("empty.img", &image[..0], "the file is not an image"),
        ("elf.img", &[0x7F; 2000], "the file is not an image"),
        ("unsigned.img", &unsigned, "the image is not signed"),
        ("short.img", &image[..600], "the image is shorter"),
    ] {
        std::fs::write(bench.path(name), bytes).expect("a file");
        let (_, error) = foot(&bench, &format!("demo:speed=max update {name}"));
        assert_has(&error, &format!("{name}: {expected}"));
    }
    // The beginning of a UF2 file for an RP2040.
    let mut copied = [0; 32];
    copied[..8].copy_from_slice(b"UF2\nWQ]\x9E");
    copied[28..].copy_from_slice(&0xE48B_FF56_u32.to_le_bytes());
    std::fs::write(bench.path("foot.uf2"), copied).expect("a file");
    let name_usb = "a program for a foot on USB: name it as usb or uart:PORT";
    let one = "a program for the one foot on a USB port: no --all, --node, --serial or --json";
    for (options, expected) in
        [("", name_usb), ("--all", one), ("--serial 4", one), ("--json", one)]
    {
        let (_, error) = foot(&bench, &format!("demo:speed=max update foot.uf2 {options}"));
        assert_has(&error, &format!("foot.uf2: {expected}"));
    }
    std::fs::write(bench.path("foot.img"), &image).expect("a file");
    let (same, error) = foot(&bench, "demo:speed=max,line=uart update foot.img");
    assert_eq!(same, "the foot: 0.1.0 runs already, confirmed\n", "{error}");
    let mut other = image.clone();
    // The first byte of the hash.
    other[44] = 1;
    std::fs::write(bench.path("other.img"), &other).expect("a file");
    let (_, error) = foot(&bench, "demo:speed=max update other.img");
    assert!(error.contains("demo feet have no bootloader"), "{error}");
    let (same, error) = foot(&bench, "demo:speed=max,feet=2 update foot.img --all");
    let line = |node| format!("node {node}: 0.1.0 runs already, confirmed\n");
    assert_eq!(same, line(21) + &line(22), "{error}");
    let (same, error) =
        foot(&bench, "demo:speed=max,feet=2 update foot.img --serial 0xF0070006,0xF0070006");
    assert_eq!(same, line(22), "{error}");
    for (line, number, heard) in [
        ("feet=2", "0x00000004", "0xF0070005 (node 21), 0xF0070006 (node 22)"),
        ("line=uart", "0xF0070006", "0xF0070001"),
    ] {
        let arguments = format!("demo:speed=max,{line} update foot.img --serial 0xF0070006,4");
        let (_, error) = foot(&bench, &arguments);
        let expected = format!(
            "no foot with the serial number {number} was found on this line; found: {heard}."
        );
        assert_has(&error, &expected);
    }
}

#[test]
fn acceptance_ends_with_what_was_not_seen_or_is_out() {
    let bench = Bench::new();
    let accept = |options: &str| {
        let output = bench.run(&format!("accept demo:speed=max --seconds 1 --json {options}"));
        let report: serde_json::Value = serde_json::from_str(&text(&output.stdout)).expect("JSON");
        (report, text(&output.stderr), output.status.code())
    };
    let (report, said, code) = accept("--only board,unplug");
    assert_eq!((code, &report["foot"]), (Some(0), &"FL".into()), "{said}");
    assert_eq!(report["schema"], "urn:footfall:accept:1");
    assert_eq!((&report["passed"], &report["not_tested"]), (&3.into(), &7.into()), "{said}");
    assert!(said.contains("not tested: it cannot be unplugged"), "{said}");
    assert_eq!(report["steps"], serde_json::json!(["board", "unplug"]));
    // Ten steps take longer than a second.
    let (report, said, code) = accept("--only steps");
    assert_eq!((code, &report["accepted"]), (Some(1), &false.into()), "{said}");
    assert!(said.contains("not accepted: steps seen"), "{said}");
    assert_has(
        &text(&bench.run("accept demo:speed=max --only board").stdout),
        "accepted in board: 3 passed",
    );
    let said = text(&bench.run("accept demo --only steps,hop").stderr);
    assert_has(&said, "write some of board, self-test, still");
}
