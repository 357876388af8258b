//! Third-party programs with the ELF: python-can, python-canopen, cantools.

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;

use host_tests::committed::workspace;
use host_tests::requirements::unmet;

use super::server::{Server, footfall};
use crate::environment;

/// Runs a script on the bus of the server.
pub fn script(python: &Path, name: &str, server: &Server, arguments: &[&Path]) {
    let output = Command::new(python)
        .arg(workspace().join("laboratory/virtual-board/tests/python").join(name))
        .arg(server.path("bus.slcan"))
        .args(arguments)
        .output()
        .expect("the interpreter starts");
    let [printed, words] =
        [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    assert!(output.status.success(), "{printed}{words}{}", server.error_output());
}

#[test]
fn python_canopen_is_master_of_a_foot() {
    let python = match environment::make() {
        Ok(python) => python,
        Err(missing) => return unmet(&missing),
    };
    let server = Server::start(&["--gait", "stand", "--no-control"]);
    server.run(3000);
    let eds = workspace().join("wire/footfall.eds");
    script(&python, "master.py", &server, &[&eds]);
}

#[test]
fn python_can_and_cantools_work_with_a_foot() {
    let python = match environment::make() {
        Ok(python) => python,
        Err(missing) => return unmet(&missing),
    };
    let server = Server::start(&[]);
    // The foot stands for two seconds, and then takes some steps.
    server.run(1000);
    let dbc = workspace().join("wire/footfall.dbc");
    script(&python, "board.py", &server, &[&dbc, &server.path("can.log")]);

    // cantools and `footfall` decode the log of python-can.
    let log = fs::read(server.path("can.log")).expect("a log");
    let mut cantools = Command::new(&python)
        .args(["-m", "cantools", "decode", "--single-line"])
        .arg(&dbc)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the interpreter starts");
    let mut to = cantools.stdin.take().expect("piped");
    let head: Vec<u8> =
        log.split_inclusive(|byte| *byte == b'\n').take(500).flatten().copied().collect();
    let writer = thread::spawn(move || to.write_all(&head));
    let output = cantools.wait_with_output().expect("it ends");
    let decoded = String::from_utf8_lossy(&output.stdout);
    writer.join().expect("no panic").expect("written");
    assert!(decoded.matches("FL_Contact(").count() > 300, "{decoded}");
    assert!(decoded.contains("StableContactProbability: "), "{decoded}");
    let arguments = ["decode", "can.log", "--output", "rows.csv"];
    let (report, _) = footfall(server.folder(), &arguments);
    assert!(report.contains("missing  0 in 0 gaps"), "{report}");
    server.end();
}
