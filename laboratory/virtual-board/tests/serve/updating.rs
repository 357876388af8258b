//! Other masters replace the program of a foot.

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::process::{Command, Stdio};

use host_tests::committed::workspace;
use host_tests::requirements::unmet;
use serde_json::Value as Json;
use virtual_board::emulator::wiring::Wiring;

use super::python::script;
use super::server::{Server, footfall, program};
use crate::common::image::{changed_image, identification, new_image};
use crate::common::{build_bootloader, product};
use crate::environment;

/// Image of the program of the server's boards, with another hash than theirs, which a probe has written.
fn same_program(elf: &[u8]) -> Vec<u8> {
    changed_image(elf, |_| ())
}

/// Starts feet with a bootloader.
fn with_bootloader(options: [&str; 2]) -> Server {
    let bootloader = build_bootloader(Wiring::reference());
    let bootloader = bootloader.to_str().expect("a path of text");
    let [option, value] = options;
    Server::start(&[option, value, "--bootloader", bootloader])
}

/// Begins an update, and kills the program while it sends.
fn vanish_while_sending(server: &Server, arguments: &[&str]) {
    let mut sender = Command::new(program())
        .args(arguments)
        .current_dir(server.folder())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs");
    let mut lines = BufReader::new(sender.stderr.take().expect("piped")).lines();
    assert!(lines.any(|line| line.expect("text").ends_with("sending")));
    sender.kill().expect("it runs");
    sender.wait().expect("it ends");
}

#[test]
#[ignore = "full: two updates by another master"]
fn python_canopen_updates_a_foot() {
    let python = match environment::make() {
        Ok(python) => python,
        Err(missing) => return unmet(&missing),
    };
    let elf = product();
    let server = with_bootloader(["--gait", "stand"]);
    fs::write(server.path("foot.img"), same_program(&elf)).expect("written");
    fs::write(server.path("second.img"), new_image(&elf)).expect("written");
    let [serial, eds, first, second] = [
        server.path("FL.uart"),
        workspace().join("wire/footfall.eds"),
        server.path("foot.img"),
        server.path("second.img"),
    ];
    script(&python, "update.py", &server, &[&serial, &eds, &first, &second]);
    server.end();
}

#[test]
fn footfall_updates_a_foot_over_its_serial_line() {
    let elf = product();
    let server = with_bootloader(["--gait", "stand"]);
    let image = same_program(&elf);
    let number = identification(&image);
    fs::write(server.path("foot.img"), &image).expect("written");
    let serial = server.serial("FL");
    // A master that vanishes while it sends.
    vanish_while_sending(&server, &["foot", &serial, "update", "foot.img"]);
    let refused =
        Command::new(program()).args(["foot", &serial, "info"]).output().expect("the program runs");
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(said.contains("runs its bootloader"), "{said}");
    let updated = server.foot(&serial, &["update", "foot.img"]);
    let expected = format!("no program → 0.1.0 ({number:08X}), confirmed\n");
    assert!(updated.ends_with(&expected), "{updated}");
    let again = server.foot(&serial, &["update", "foot.img", "--all"]);
    assert!(again.starts_with("the foot: 0.1.0 (") && again.contains("runs already"));
    // From program to program, and back to streaming.
    fs::write(server.path("second.img"), new_image(&elf)).expect("written");
    let updated = server.foot(&serial, &["update", "second.img"]);
    assert!(updated.starts_with(&format!("the foot: 0.1.0 ({number:08X}) → 0.1.9 (")), "{updated}");
    let info = server.foot(&serial, &["info"]);
    let programs = format!("\nprevious program {number:08X}, kept\n");
    assert!(info.contains("version  0.1.9") && info.contains(&programs), "{info}");
    // The state is printed only if a foot does not stream.
    assert!(!info.contains("state "), "{info}");
    server.end();
}

#[test]
#[ignore = "full: two feet, updated twice"]
fn footfall_updates_all_feet_of_a_bus() {
    let elf = product();
    let server = with_bootloader(["--feet", "2"]);
    let good = same_program(&elf);
    let number = identification(&good);
    let mut damaged = good.clone();
    damaged[1000] ^= 1;
    fs::write(server.path("foot.img"), &good).expect("written");
    fs::write(server.path("damaged.img"), &damaged).expect("written");
    fs::write(server.path("short.img"), &good[..5000]).expect("written");
    let bus = server.bus();
    let refused = |arguments: &[&str]| {
        let output = Command::new(program())
            .args([&["foot", &bus, "--node", "22"], arguments].concat())
            .current_dir(server.folder())
            .output()
            .expect("the program runs");
        assert_eq!(output.status.code(), Some(1));
        String::from_utf8(output.stderr).expect("text")
    };
    let said = refused(&["update", "short.img"]);
    assert!(said.contains("short.img: the image is shorter"), "{said}");
    let said = refused(&["update", "damaged.img"]);
    assert!(said.contains("node 22 has refused the image: the image is damaged"), "{said}");
    assert!(said.contains("continues with its program"), "{said}");
    // A master that vanishes while it sends.
    vanish_while_sending(&server, &["foot", &bus, "--node", "22", "update", "foot.img"]);
    let (updated, _) = footfall(server.folder(), &["foot", &bus, "update", "foot.img", "--all"]);
    let after = format!(" → 0.1.0 ({number:08X}), confirmed");
    let lines: Vec<&str> = updated.lines().collect();
    let [first, second] = lines[..] else {
        panic!("{updated}");
    };
    // A program written by a probe has the number of its commit, if no source was changed.
    assert!(first.starts_with("node 21: 0.1.0"), "{updated}");
    assert!(first.ends_with(&after), "{updated}");
    assert_eq!(second, format!("node 22: no program{after}"));
    let again = server.foot(&bus, &["--node", "21", "update", "foot.img", "--json"]);
    let again: Json = serde_json::from_str(&again).expect("JSON");
    let number = format!("{number:08X}");
    assert_eq!(again[0]["from_program"], number.as_str());
    assert!(again[0]["to_program"].is_null());
    let info = server.foot(&bus, &["--node", "21", "info"]);
    assert!(info.contains(&format!("0.1.0, program {number}")), "{info}");
    server.end();
}

#[test]
#[ignore = "full: two feet, of which one is updated"]
fn footfall_updates_a_foot_by_its_serial_number() {
    let elf = product();
    let server = with_bootloader(["--feet", "2"]);
    let image = new_image(&elf);
    fs::write(server.path("foot.img"), &image).expect("written");
    let bus = server.bus();
    let info = |node: &str| -> Json {
        let info = server.foot(&bus, &["--node", node, "info", "--json"]);
        serde_json::from_str(&info).expect("JSON")
    };
    let before = ["21", "22"].map(info);
    let [first, second] = before.each_ref().map(|info| &info["serial"]);
    assert_ne!(first, second);
    let number = format!("0x{:08X}", second.as_u64().expect("a number"));
    let updated = server.foot(&bus, &["update", "foot.img", "--serial", &number]);
    let expected = format!(" → 0.1.9 ({:08X}), confirmed\n", identification(&image));
    assert!(updated.starts_with("node 22: 0.1.0"), "{updated}");
    assert!(updated.ends_with(&expected), "{updated}");
    let after = ["21", "22"].map(info);
    assert_eq!(after[0]["program"], before[0]["program"]);
    assert_eq!(after[1]["previous"], before[1]["program"]);
    assert_eq!(after[1]["version"], "0.1.9");
    server.end();
}

/// The two minutes of `docs/guide/update.md`, of the boards' time.
#[test]
#[ignore = "full: four boards, two minutes of virtual time"]
fn footfall_updates_four_feet_within_two_minutes() {
    let elf = product();
    let server = with_bootloader(["--feet", "4"]);
    fs::write(server.path("foot.img"), new_image(&elf)).expect("written");
    let begin_ms = server.now_ms();
    let bus = server.bus();
    let arguments = ["foot", &bus, "update", "foot.img", "--all"];
    let (updated, _) = footfall(server.folder(), &arguments);
    let took_ms = server.now_ms() - begin_ms;
    assert_eq!(updated.matches(", confirmed\n").count(), 4, "{updated}");
    assert!(took_ms < 120_000, "{took_ms} ms");
    server.end();
}
