//! Existing files: no command replaces one without `--overwrite`.

use std::fs;

use clap::{Command, CommandFactory};
use footfall::commands::Arguments;

use crate::common::{Bench, cases, read, standing};

/// Content of a file that exists before.
const BEFORE: &str = "precious";

/// Commands that write a file, each up to the name of the file, and that name.
const WRITERS: &str = "
    replay walk.csv --output => there.csv
    replay walk.csv --events => there.csv
    replay walk.csv --plot => there.svg
    replay walk.csv --plot => there.html
    convert walk.csv --output => there.csv
    convert walk.csv => there.csv
    decode can.log --output => there.csv
    calibrate rests.csv --rests --output => there.toml
    calibrate demo: --output => there.toml
    demo --output . => samples.csv
    demo --output . => plot.svg
    demo --output . => can.log
    demo --output . => uart.bin
    record demo:seconds=1,speed=max -o => there.mcap
    foot uart:/dev/null export => there.txt
";

/// Returns a bench with inputs for each command.
fn bench() -> Bench {
    let bench = Bench::with("walk.csv", standing());
    let contact = "(1.000000) can0 191#0000000000000080\n";
    fs::write(bench.path("inputs.log"), contact).expect("a file");
    bench
}

/// Names of the commands with an option `--overwrite`, and of those that name an output.
fn commands(command: &Command, before: &str, found: &mut [Vec<String>; 2]) {
    for command in command.get_subcommands() {
        let name = format!("{before}{}", command.get_name());
        let arguments = || command.get_arguments();
        let is_output = |argument: &clap::Arg| {
            let long = argument.get_long().unwrap_or_default();
            let values = argument.get_value_names().unwrap_or_default();
            ["output", "plot", "events"].contains(&long)
                || values.iter().any(|value| value.starts_with("OUT"))
        };
        if arguments().any(|argument| argument.get_long() == Some("overwrite")) {
            found[0].push(name.clone());
        }
        if arguments().any(is_output) {
            found[1].push(name.clone());
        }
        commands(command, &format!("{name} "), found);
    }
}

#[test]
fn every_command_with_an_output_has_the_option() {
    let mut found = [Vec::new(), Vec::new()];
    commands(&Arguments::command(), "", &mut found);
    let [with_option, mut with_output] = found;
    // `foot export` names its output by an argument.
    with_output.push("foot export".to_owned());
    with_output.sort();
    let mut sorted = with_option.clone();
    sorted.sort();
    assert_eq!(sorted, with_output);
    for command in with_option {
        let first = command.split(' ').next().expect("a name");
        let is_tried = cases(WRITERS).any(|(arguments, _)| {
            arguments.starts_with(first) && command.split(' ').all(|word| arguments.contains(word))
        });
        assert!(is_tried, "{command} is in no case");
    }
}

#[test]
fn existing_file_is_kept_and_named() {
    for (arguments, file) in cases(WRITERS) {
        if arguments.starts_with("record") && cfg!(not(feature = "bags")) {
            continue;
        }
        let bench = bench();
        fs::write(bench.path(file), BEFORE).expect("a file");
        fs::write(bench.path("rests.csv"), standing()).expect("a file");
        let files = bench.files();
        // The demo names its files itself.
        let (command, name, advice) = if arguments.starts_with("demo") {
            let advice = "or replace it with `footfall demo --overwrite`";
            (arguments.to_owned(), format!("./{file}"), advice)
        } else {
            let advice = "name another file, or add --overwrite";
            (format!("{arguments} {file}"), file.to_owned(), advice)
        };
        bench.refuses(&command, &format!("footfall: {name} is there already: "));
        bench.refuses(&command, advice);
        assert_eq!(read(&bench.path(file)), BEFORE, "{command}");
        assert_eq!(bench.files(), files, "{command}");
    }
}

#[test]
fn standard_output_is_not_a_file_of_its_name() {
    let bench = bench();
    fs::write(bench.path("-"), BEFORE).expect("a file");
    for command in ["replay ./walk.csv --output -", "replay ./walk.csv --plot -"] {
        assert!(!bench.stdout(command).is_empty(), "{command}");
    }
    assert_eq!(read(&bench.path("-")), BEFORE);
}

#[test]
fn overwrite_replaces_the_existing_file() {
    let bench = bench();
    for command in [
        "replay walk.csv --output there.csv --plot there.svg --events events.csv",
        "convert walk.csv there.csv",
        "decode inputs.log --output there.csv",
        "demo -o .",
    ] {
        for file in ["there.csv", "there.svg", "events.csv", "samples.csv", "plot.svg"] {
            fs::write(bench.path(file), BEFORE).expect("a file");
        }
        bench.stdout(&format!("{command} --overwrite"));
        let words = command.split(' ');
        let written: Vec<&str> = words.filter(|word| bench.path(word).is_file()).collect();
        for file in written.into_iter().filter(|file| !["walk.csv", "inputs.log"].contains(file)) {
            assert_ne!(read(&bench.path(file)), BEFORE, "{command}: {file}");
        }
    }
    assert_ne!(read(&bench.path("plot.svg")), BEFORE);
}

#[test]
fn picture_of_a_foot_keeps_an_existing_file() {
    let bench = bench();
    fs::write(bench.path("other.csv"), standing()).expect("a file");
    // The names of these pictures contain the names of the feet.
    fs::write(bench.path("all-other.svg"), BEFORE).expect("a file");
    let command = "replay walk.csv other.csv --plot all.svg --output all.csv";
    let files = bench.files();
    bench.refuses(command, "footfall: all-other.svg is there already");
    assert_eq!(bench.files(), files);
    assert_eq!(read(&bench.path("all-other.svg")), BEFORE);
    bench.stdout(&format!("{command} --overwrite"));
    assert_ne!(read(&bench.path("all-other.svg")), BEFORE);
}

#[test]
fn pipe_and_device_are_no_existing_files() {
    let bench = bench();
    bench.stdout("replay walk.csv --output /dev/null");
    bench.stdout("replay walk.csv --output /dev/null");
    bench.stdout("convert walk.csv -");
}
