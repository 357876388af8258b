//! Third-party programs with the ELF: python-can, python-canopen, cantools.

use std::fs;
use std::io::Write as _;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use host_tests::committed::workspace;
use host_tests::requirements::unmet;

use crate::environment;
use crate::server::{LONGEST, Server, footfall};

#[test]
fn python_can_canopen_and_cantools_work_with_a_foot() {
    let python = match environment::make() {
        Ok(python) => python,
        Err(missing) => return unmet(&missing),
    };
    let Some(server) = Server::start("python", &[]) else {
        return;
    };
    // The foot stands for two seconds, and then takes some steps.
    server.run(1000);
    let wire = workspace().join("wire");
    let dbc = wire.join("footfall.dbc");
    let output = Command::new(&python)
        .arg(workspace().join("host/virtual-board/tests/python/board.py"))
        .arg(server.path("bus.slcan"))
        .args([&wire.join("footfall.eds"), &dbc])
        .arg(server.path("can.log"))
        .output()
        .expect("the interpreter starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (printed, words) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{printed}{words}{}", server.said());

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
    let head: Vec<u8> = log
        .split_inclusive(|byte| *byte == b'\n')
        .take(500)
        .flatten()
        .copied()
        .collect();
    let writer = thread::spawn(move || to.write_all(&head));
    let decoded = text(&cantools.wait_with_output().expect("it ends").stdout);
    writer.join().expect("no panic").expect("written");
    assert!(decoded.matches("FL_Contact(").count() > 300, "{decoded}");
    assert!(decoded.contains("StableContactProbability: "), "{decoded}");
    let arguments = ["decode", "can.log", "--output", "rows.csv"];
    let (report, _) = footfall(&server.folder, &arguments);
    assert!(report.contains("missing  0 in 0 gaps"), "{report}");
    let (said, status) = server.end();
    assert!(status.success(), "{said}");
}

#[test]
#[ignore = "real time"]
fn cantools_monitor_shows_a_foot_on_a_terminal() {
    let python = match environment::make() {
        Ok(python) => python,
        Err(missing) => return unmet(&missing),
    };
    if Command::new("tmux").arg("-V").output().is_err() {
        return unmet("tmux is not installed");
    }
    let Some(server) = Server::start_in_real_time("cantools", &[]) else {
        return;
    };
    let screen = monitored_by_cantools(&python, &server);
    assert!(screen.contains("FL_Contact("), "{screen}");
    let (said, status) = server.end();
    assert!(status.success(), "{said}");
}

/// Output of `cantools monitor` on a terminal, once it shows a contact.
fn monitored_by_cantools(python: &std::path::Path, server: &Server) -> String {
    let socket = server.path("tmux");
    let tmux = |arguments: &[&str]| {
        let run = Command::new("tmux")
            .arg("-S")
            .arg(&socket)
            .args(arguments)
            .output();
        String::from_utf8_lossy(&run.expect("tmux runs").stdout).into_owned()
    };
    let command = format!(
        "{} -m cantools monitor --single-line --interface slcan --channel {} --bitrate 1000000 {}",
        python.display(),
        server.path("bus.slcan").display(),
        workspace().join("wire/footfall.dbc").display()
    );
    tmux(&[
        "-f",
        "/dev/null",
        "new-session",
        "-d",
        "-x",
        "200",
        "-y",
        "60",
        &command,
    ]);
    let end = Instant::now() + LONGEST;
    let mut screen = String::new();
    while !screen.contains("FL_Contact(") && Instant::now() < end {
        thread::sleep(Duration::from_millis(500));
        screen = tmux(&["capture-pane", "-p"]);
    }
    tmux(&["kill-server"]);
    screen
}
