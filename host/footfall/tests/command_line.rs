//! Tests of the command line: messages, pipes, interruption, configuration, help and completions.

use std::fs;
use std::thread::sleep;
use std::time::Duration;

use crate::common::{
    AXES, Bench, assert_has, cases, kill, read, standing, text, unmet, wait_until,
};

const SHELLS: [&str; 5] = ["bash", "zsh", "fish", "powershell", "elvish"];

fn with_another_column() -> Bench {
    Bench::with("x.csv", format!("t,{AXES},mood\n0,0,0,9,0,0,0,1\n0.01,0,0,9,0,0,0,1\n"))
}

#[test]
fn quiet_keeps_errors_and_verbose_adds_details() {
    let bench = with_another_column();
    let said = |arguments: &str| text(&bench.run(arguments).stderr);
    assert_eq!(said("replay x.csv"), "footfall: x.csv: ignored columns: mood\n");
    assert_eq!(said("replay x.csv --quiet"), "");
    assert_eq!(said("-q replay x.csv"), "");
    assert!(said("-q replay absent.csv").starts_with("footfall: absent.csv"));
    fs::write(bench.path("c.toml"), "decision.threshold = 0.6\n").expect("a file");
    let verbose = said("replay x.csv -v --config c.toml");
    let lines: Vec<&str> = verbose.lines().collect();
    assert_eq!(
        lines[..3],
        [
            "footfall: x: 2 samples, 0.010 s at 100 Hz, gravity included, 0 with a label",
            "footfall: x.csv: format csv; preset default, but decision.threshold = 0.6 (0.5)",
            lines[2],
        ]
    );
    let times = lines[2].strip_prefix("footfall: x.csv: ").expect(lines[2]);
    let times = times.strip_suffix(" s to estimate").expect(lines[2]);
    let [read, estimate] = times
        .split_once(" s to read, ")
        .map_or([""; 2], |(read, estimate)| [read, estimate])
        .map(str::parse::<f64>);
    assert!(read.is_ok() && estimate.is_ok(), "{}", lines[2]);
    assert_eq!(lines[3..], ["footfall: x.csv: ignored columns: mood"]);
    assert_eq!(bench.run("replay x.csv -q -v").status.code(), Some(2));
}

#[test]
fn strict_findings_are_printed_with_quiet() {
    let rows: String =
        (0..2000).map(|k| format!("{},0,0,1,0,0,0\n", f64::from(k) * 0.01)).collect();
    let bench = Bench::with("g.csv", format!("t,{AXES}\n{rows}"));
    let said = bench.error("replay g.csv --strict -q");
    assert!(said.lines().count() > 1, "{said}");
}

#[test]
fn colour_is_used_on_terminals_or_when_forced() {
    let bench = Bench::new();
    let said = |variables: &[(&str, &str)]| {
        let mut command = bench.command("replay absent.csv");
        let output = command.env_remove("NO_COLOR").envs(variables.iter().copied()).output();
        text(&output.expect("the command that was just built").stderr)
    };
    assert!(said(&[]).starts_with("footfall: absent.csv "));
    assert!(said(&[("CLICOLOR_FORCE", "1")]).contains("error:\u{1b}[0m absent.csv "));
    let neither = said(&[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")]);
    assert!(!neither.contains('\u{1b}'), "{neither:?}");
}

#[test]
fn closed_stdout_is_not_an_error() {
    let rows: String =
        (0..30_000).map(|k| format!("{},0,0,9.81,0,0,0\n", f64::from(k) * 0.01)).collect();
    let bench = Bench::with("long.csv", format!("t,{AXES}\n{rows}"));
    // More than the capacity of a pipe.
    let frame = |k: u32| {
        format!("({}.{:03}000) can0 191#FFFF80800000{:02X}1A\n", k / 1000, k % 1000, k % 256)
    };
    fs::write(bench.path("x.log"), (0..10_000).map(frame).collect::<String>()).expect("a file");
    for command in [
        "replay long.csv --output - --plot out.svg",
        "replay long.csv --json",
        "decode x.log --output -",
        "config",
        "completions bash",
        "--help",
    ] {
        // The reader closes the pipe before anything is written.
        let pipe = format!("{{ \"$0\" {command}; echo $? >&2; }} | true");
        let output = bench.shell("bash", &pipe).expect("bash");
        let said = text(&output.stderr);
        assert!(said.ends_with("0\n") && !said.contains("cannot be written"), "{command}: {said}");
    }
    assert!(read(&bench.path("out.svg")).starts_with("<svg"));
}

#[cfg(target_os = "linux")]
#[test]
fn interrupted_command_leaves_no_unfinished_file() {
    let rows: String =
        (0..100_000).map(|k| format!("{},0,0,9.81,0,0,0\n", f64::from(k) * 0.01)).collect();
    let bench = Bench::with("long.csv", format!("t,{AXES}\n{rows}"));
    let is_unfinished = || bench.files().iter().any(|name| name.ends_with(".part"));
    // The command may finish before it is interrupted.
    wait_until("an interruption before the end", || {
        let mut child = bench.start("replay long.csv --output out.csv --overwrite", None);
        while !is_unfinished() && child.try_wait().expect("a child").is_none() {
            sleep(Duration::from_micros(500));
        }
        kill("INT", &child);
        let status = child.wait().expect("a child");
        assert!(!is_unfinished(), "{:?}", bench.files());
        status.code() == Some(130)
    });
}

/// Returns whether a process ignores a signal, so that the system discards it.
#[cfg(all(target_os = "linux", feature = "bags"))]
fn is_ignored(process: u32, signal: u32) -> bool {
    let status = fs::read_to_string(format!("/proc/{process}/status")).expect("a process");
    let mask = status
        .lines()
        .find_map(|line| line.strip_prefix("SigIgn:"))
        .and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.expect("a mask") >> (signal - 1) & 1 == 1
}

#[cfg(all(target_os = "linux", feature = "bags"))]
#[test]
fn signals_ignored_at_start_stay_ignored() {
    for (ignored, number, sent) in [("INT", 2, "TERM"), ("HUP", 1, "INT"), ("HUP", 1, "TERM")] {
        let bench = Bench::new();
        let mut child = bench.start("record demo:feet=1,speed=1 --output walk.mcap", Some(ignored));
        // The handlers are installed before the file is created.
        bench.wait_for("walk.mcap");
        assert!(is_ignored(child.id(), number), "{ignored}");
        assert!(kill(ignored, &child));
        bench.wait_for_samples("walk.mcap", "/footfall/FL/imu", 0);
        assert!(child.try_wait().expect("a child").is_none(), "{ignored}");
        assert!(kill(sent, &child));
        let status = child.wait().expect("a child");
        assert_eq!(status.code(), Some(0), "{sent} with {ignored} ignored");
    }
}

#[test]
fn manual_has_a_page_for_each_command() {
    let bench = Bench::new();
    let page = bench.stdout("man");
    assert!(page.contains(".TH footfall 1"), "{page}");
    bench.stdout("man man1");
    for command in ["", "-replay", "-foot-set", "-ros2"] {
        let page = read(&bench.path(&format!("man1/footfall{command}.1")));
        assert!(page.contains(".SH NAME"), "{command}");
    }
}

#[test]
fn configuration_errors_give_the_place_of_each() {
    let bench = Bench::new();
    let check = |content: &str| {
        fs::write(bench.path("c.toml"), content).expect("a file");
        let output = bench.run("config --check c.toml");
        (output.status.code(), text(&output.stdout) + &text(&output.stderr))
    };
    assert_eq!(check("decision.threshold = 0.6\n"), (Some(0), "c.toml: ok\n".to_owned()));
    for (content, expected) in cases(
        r#"
        [decision]\non_delay = 1\n => line 2, column 1, key decision.on_delay: unknown field
        [decison]\nthreshold = 1\n => line 1, column 2
        [decision]\non_delay = 1\nthreshold = 'high'\n[load]\noff = 1\n => expected one of `threshold`, `on_delay_s`, `off_delay_s`\nc.toml, line 3, column 13, key decision.threshold:
        [decision]\non_delay_s = -1\nthreshold = 2\n => key decision.threshold is 2, allowed is 0.01 to 0.99\nc.toml, line 2, column 1, key decision.on_delay_s is -1
        \n[decision]\n threshold = 2\n => line 3, column 2, key decision.threshold is 2, allowed
        a = [\n => c.toml, line
        window = '20ms'\n => line 1, column 1, key window has an effect
        window = '50'\n => line 1, column 10, key window: "50" is not a window: write a duration such as 50ms
        [learnt]\nstill = -1\nmoving = -2\nspeed = -5\nstill_seconds = 2\nmoving_seconds = 3\nversion = 1\n => line 3, column 1, key learnt.moving is -2, allowed is -1 to 6
        [accelerometer]\nscale = { az = 9 }\n => line 2, column 16, key accelerometer.scale: az is 9
        "#,
    ) {
        let [content, expected] = [content, expected].map(|text| text.replace("\\n", "\n"));
        let (code, said) = check(&content);
        assert_eq!(code, Some(1));
        assert!(said.starts_with("footfall: c.toml, ") && said.contains(&expected), "{said}");
    }
    fs::write(bench.path("c.toml"), "window = '20ms'\n").expect("a file");
    bench.stdout("config --check c.toml --preset paper");
    bench.refuses("config --check absent.toml", "absent.toml cannot be read");
}

#[test]
fn printed_example_is_a_valid_configuration() {
    let bench = Bench::with("x.csv", standing());
    for preset in ["default", "paper"] {
        let example = bench.stdout(&format!("config --preset {preset}"));
        fs::write(bench.path("c.toml"), &example).expect("a file");
        bench.stdout(&format!("config --check c.toml --preset {preset}"));
        let replay = |config: &str| {
            bench.stdout(&format!("replay x.csv --output - --preset {preset} {config}"))
        };
        assert!(replay("") == replay("--config c.toml"));
        // Activating a key of the example takes effect.
        let set = example.replace("#decision.on_delay_s = 0.02", "decision.on_delay_s = 0.5");
        assert_ne!(set, example);
        fs::write(bench.path("c.toml"), set).expect("a file");
        assert!(replay("") != replay("--config c.toml"));
    }
}

#[test]
fn wrong_option_error_suggests_what_to_write() {
    let bench = Bench::with("x.csv", standing());
    for (arguments, expected) in cases(
        "
        replay x.csv --gravity inclded => 'included'
        replay x.csv --times dropbad => 'drop-bad'
        replay x.csv --time-unit mss => 'ms'
        replay x.csv --format pce-altas => 'pce-atlas'
        replay x.csv --preset papr => 'paper'
        replay x.csv --ouput y.csv => '--output'
        repaly x.csv => 'replay'
        ",
    ) {
        let output = bench.run(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments}");
        let said = text(&output.stderr);
        assert_has(&said, "similar");
        assert_has(&said, expected);
    }
    for (option, hint) in cases(
        r#"
        --window=50 => write a duration such as 50ms or a count such as 50samples
        --sample-rate=-5 => write a number of Hz above 0
        --units=mph => "mph" is not a unit: write m/s2 or g, and rad/s or dps
        --time-unit=min => possible values: s, ms, 100us, us, ns
        --map=ax => write OURS=THEIRS
        "#,
    ) {
        bench.refuses(&format!("replay x.csv {option}"), hint);
    }
}

#[test]
fn help_fits_80_columns_and_groups_options() {
    let bench = Bench::new();
    let help = |command: &str| {
        let output = bench.command(command).env("COLUMNS", "80").output();
        text(&output.expect("the command that was just built").stdout)
    };
    for command in ["", "replay", "calibrate", "config", "completions"] {
        for line in help(&format!("{command} --help")).lines() {
            assert!(line.chars().count() <= 80, "{command}: {line}");
        }
    }
    let replay = help("replay --help");
    for heading in ["Input", "Estimator", "Output", "Examples"] {
        let heading = format!("\n{heading}:\n");
        assert!(replay.contains(&heading), "{replay}");
    }
    assert!(help("--help").contains("\nExit codes:\n"));
}

#[test]
fn bash_accepts_the_completions() {
    let bench = Bench::new();
    for name in SHELLS {
        let script = bench.stdout(&format!("completions {name}"));
        fs::write(bench.path(name), script).expect("a file");
    }
    let commands = "set -e; bash -n bash; source ./bash; complete -p footfall; \
        COMP_WORDS=(footfall replay --pre); COMP_CWORD=2; _footfall footfall --pre replay; \
        echo \"${COMPREPLY[@]}\"";
    let Ok(output) = bench.shell("bash", commands) else {
        return unmet("bash is not installed");
    };
    assert!(output.status.success(), "{output:?}");
    let said = text(&output.stdout);
    assert!(said.contains("-F _footfall"), "{said}");
    assert!(said.ends_with("\n--preset\n"), "{said}");
}
