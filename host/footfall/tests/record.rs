//! Tests of `footfall record` as a program.

use std::fs;
use std::io::Write;
use std::time::Duration;

use crate::common::{AXES, Bench, assert_has, cases, kill, read, samples, text};
use feet::feed::FeedEvent;
use feet::{Arrival, Feed};
use wire::Foot as Position;

/// Returns the reported message count of a topic.
pub fn count(report: &str, topic: &str) -> u64 {
    let line = report.lines().find(|line| line.ends_with(&format!(" {topic}")));
    let count = line.and_then(|line| line.split_whitespace().next());
    count.and_then(|count| count.parse().ok()).unwrap_or(0)
}

#[test]
fn recording_of_four_feet_is_complete_and_replayable() {
    let bench = Bench::new();
    let output = bench.run("record demo:feet=4,line=uart,seconds=10,speed=max -o walk.mcap");
    let report = text(&output.stdout);
    assert_eq!((text(&output.stderr).as_str(), output.status.code()), ("", Some(0)));
    for foot in ["FL", "FR", "RL", "RR"] {
        for topic in ["contact", "contact/probability", "velocity", "imu"] {
            let topic = format!("/footfall/{foot}/{topic}");
            assert_eq!(count(&report, &topic), 10_000, "{topic}\n{report}");
        }
    }
    assert!(count(&report, "/diagnostics") >= 40, "{report}");
    let output = bench.run("replay walk.mcap --topic all --json --estimate-again");
    let said = text(&output.stderr);
    assert_has(&said, "walk.mcap has contacts on /footfall/FL/contact, /footfall/FR/contact,");
    assert_has(&said, "which are not read: the estimate is computed again from the samples");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let recordings = json["recordings"].as_array().expect("recordings");
    assert_eq!(recordings.len(), 4);
    assert!(recordings.iter().all(|recording| recording["samples"] == 10_000));
}

#[test]
fn recording_without_a_message_keeps_the_file_it_would_replace() {
    let bench = Bench::with("walk.mcap", "precious");
    let command = "record uart:/dev/there-is-none --seconds 0.1 --overwrite -o";
    bench.refuses(&format!("{command} walk.mcap"), "nothing was recorded");
    assert_eq!(read(&bench.path("walk.mcap")), "precious");
    bench.refuses(&format!("{command} new.mcap"), "nothing was recorded");
    bench.stdout("record demo:seconds=1,speed=max --overwrite -o walk.mcap");
    assert!(fs::read(bench.path("walk.mcap")).expect("a file").starts_with(b"\x89MCAP"));
    assert_eq!(bench.files(), ["walk.mcap"]);
}

#[test]
fn line_that_is_absent_is_waited_for() {
    let bench = Bench::new();
    let said = bench.error("record uart:/dev/there-is-none --seconds 0.1 -o new.mcap");
    assert_has(&said, "/dev/there-is-none: ");
    assert_has(&said, "; waiting for it\n");
}

#[test]
fn recording_of_a_damaged_log_counts_its_lines_and_absent_samples() {
    let bench = Bench::new();
    bench.stdout("demo --output demo");
    let log = read(&bench.path("demo/can.log"));
    // Contacts of node 0x11, without the frames of its samples.
    let is_contact = |line: &&str| line.contains(" 191#");
    let contacts: Vec<&str> = log.lines().filter(is_contact).collect();
    let damaged = format!("{}\nnothing of a log\n{}\n", contacts[0], contacts[1..].join("\n"));
    fs::write(bench.path("damaged.log"), damaged).expect("a file");
    let output = bench.run("record file:damaged.log@max -o contacts.mcap");
    let said = text(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert_has(&said, "1 lines unreadable");
    assert_has(&said, "/imu is not in the recording: the foot sent no samples.");
}

#[test]
fn seconds_of_a_recording_are_those_of_its_data() {
    let bench = Bench::new();
    let report = bench.stdout("record demo: --seconds 1 -o walk.mcap");
    let contacts = count(&report, "/footfall/FL/contact");
    assert!((1..=1200).contains(&contacts), "{report}");
}

#[test]
fn forces_and_stances_of_all_feet_are_recorded() {
    let bench = Bench::new();
    let four = "record demo:feet=4,seconds=3,speed=max --compat wrench --wrench-force 40";
    let report = bench.stdout(&format!("{four} -o four.mcap"));
    for foot in ["FL", "FR", "RL", "RR"] {
        let wrenches = count(&report, &format!("/footfall/{foot}/wrench"));
        assert!(wrenches > 2800, "{foot}: {wrenches}");
    }
    let report =
        bench.stdout("record demo:feet=2,seconds=3,speed=max --compat biped,wrench -o two.mcap");
    assert!(count(&report, "/footfall/phase") > 2000, "{report}");
    assert!(count(&report, "/footfall/L/wrench") > 2800, "{report}");
    bench.refuses(
        "record demo:feet=2,seconds=3,speed=max --compat biped,champ -o mixed.mcap",
        "--compat biped is of two feet, and champ of four: give one of them",
    );
    bench.refuses(
        "record demo:feet=4 --compat wrench --wrench-force 0 -o none.mcap",
        "write a force in N, more than 0",
    );
}

/// Four feet on two lines: two of a bus, two on serial lines that are named by their ports.
const TWO_LINES: &str =
    "demo:feet=2,seconds=3 demo:feet=2,line=uart,seconds=3 --names 0x15=FL,0x16=FR,L=RL,R=RR";

#[test]
fn feet_of_several_sources_are_one_robot() {
    let bench = Bench::new();
    let output = bench.run(&format!("record {TWO_LINES} --compat pronto -o robot.mcap"));
    let (report, said) = (text(&output.stdout), text(&output.stderr));
    assert_eq!((said.as_str(), output.status.code()), ("", Some(0)));
    for foot in ["FL", "FR", "RL", "RR"] {
        let topic = format!("/footfall/{foot}/contact");
        assert_eq!(count(&report, &topic), 3000, "{topic}\n{report}");
    }
    // One message for each millisecond in which all four have a contact.
    assert!(count(&report, "/footfall/stance") > 2800, "{report}");
    // No contact was recorded under a foot without a name, although its name comes only with a health message.
    assert_eq!(report.lines().filter(|line| line.ends_with("/contact")).count(), 4, "{report}");
}

#[test]
fn two_boards_of_one_name_are_an_error_that_names_both() {
    let bench = Bench::new();
    let both = "demo:line=uart,seconds=3 demo:seconds=3";
    let expected = "footfall: two boards are FL, node 17 on can0 and uart:FL; play them one at a time; for this command alone: --names FL=FR\n";
    let output = bench.run(&format!("record {both} -o robot.mcap"));
    assert_has(&text(&output.stderr), expected);
    assert!(!output.status.success());
    assert!(bench.path("robot.mcap").exists(), "what came before is kept");
    assert_has(&text(&bench.run(&format!("monitor {both}")).stderr), expected);
    let report = bench.stdout(&format!("record {both} --names FL=FR -o named.mcap"));
    for foot in ["FL", "FR"] {
        assert_eq!(count(&report, &format!("/footfall/{foot}/contact")), 3000, "{report}");
    }
}

#[test]
fn recordings_made_apart_merge_into_one_robot() {
    let bench = Bench::new();
    for (file, names) in [("front", "L=FL,R=FR"), ("rear", "L=RL,R=RR")] {
        bench.stdout(&format!(
            "record demo:feet=2,line=uart,seconds=2,speed=max --names {names} -o {file}.mcap"
        ));
    }
    let report = bench.stdout("convert front.mcap rear.mcap -o robot.mcap --topic all");
    for foot in ["FL", "FR", "RL", "RR"] {
        assert_has(&report, &format!("2000 samples of {foot}"));
    }
    // The last name is the output, as with a single recording.
    bench.stdout("convert front.mcap rear.mcap last.mcap --topic all");
    let bytes = |name: &str| fs::read(bench.path(name)).expect("a file");
    assert!(bytes("last.mcap") == bytes("robot.mcap"));
    bench.stdout("replay robot.mcap --topic all --output walked.mcap --compat pronto");
    let replay = "replay front.mcap rear.mcap --topic all --estimate-again --output both.mcap";
    bench.stdout(&format!("{replay} --compat pronto"));
    for name in ["walked.mcap", "both.mcap"] {
        let of_all = b"/footfall/stance";
        assert!(bytes(name).windows(of_all.len()).any(|window| window == of_all), "{name}");
        let json = bench.stdout(&format!("replay {name} --topic all --json"));
        let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        let recordings = json["recordings"].as_array().expect("recordings");
        assert!(recordings.len() == 4 && recordings.iter().all(|foot| foot["samples"] == 2000));
    }
    // The messages are in order of their times, whichever recording is named first.
    let turned = "replay rear.mcap front.mcap --topic all --estimate-again --output turned.mcap";
    bench.stdout(turned);
    let steps_back = |name: &str| {
        let bag = bytes(name);
        let times: Vec<u64> = mcap::MessageStream::new(&bag)
            .expect("a bag")
            .map(|message| message.expect("a message").log_time)
            .collect();
        assert!(times.len() > 16_000, "{}", times.len());
        // A contact is written with its sample, whose time is rounded to µs.
        let is_back = |two: &&[u64]| two[1] + 1_000 < two[0];
        times.windows(2).filter(is_back).count()
    };
    // A recording may step back in time, because the first contacts of a foot waited for the foot's name.
    let in_recordings = steps_back("front.mcap") + steps_back("rear.mcap");
    assert!(in_recordings <= 2, "{in_recordings}");
    for name in ["both.mcap", "turned.mcap"] {
        assert_eq!(steps_back(name), in_recordings, "{name}");
    }
    for command in [
        "convert front.mcap robot.mcap -o twice.mcap",
        "replay front.mcap robot.mcap --output twice.mcap --estimate-again",
    ] {
        let said = bench.error(&format!("{command} --topic all"));
        assert_has(
            &said,
            "FL is in both front.mcap and robot.mcap, but a robot has each foot once; convert one of them with --rename FL=OTHER first",
        );
    }
    assert_has(
        &bench.error("convert front.mcap"),
        "no output is given: name it after the recordings, or with --output",
    );
}

#[test]
fn absent_feet_are_in_no_message_of_all_feet() {
    let absent = "footfall: no contact of RL, RR: --compat sends messages of all feet once each has sent a contact; bool and wrench send those of the others\n";
    for (compat, topic) in [("pronto", "/footfall/stance"), ("champ", "/foot_contacts")] {
        let bench = Bench::new();
        let record = |options: &str| {
            let output =
                bench.run(&format!("record {options} --compat {compat} -o walk.mcap --overwrite"));
            let report = text(&output.stdout);
            (text(&output.stderr), count(&report, topic))
        };
        let (said, messages) = record("demo:feet=2,seconds=3 --names 0x15=FL,0x16=FR");
        assert_eq!((said.as_str(), messages), (absent, 0), "{compat}");
        // Feet of a biped have other names than the four.
        let (said, messages) = record("demo:feet=2,seconds=3");
        let lines: Vec<&str> = said.lines().collect();
        assert_eq!(lines.len(), 2, "{compat}: {said}");
        for (line, foot) in lines.into_iter().zip(["L", "R"]) {
            let no_place = format!(
                "footfall: no message of --compat includes {foot}, only the feet FL, FR, RL, RR: rename it with --names"
            );
            assert_eq!(line, no_place, "{compat}");
        }
        assert_eq!(messages, 0, "{compat}");
        let (said, messages) = record("demo:feet=4,seconds=3");
        assert_eq!(said, "", "{compat}");
        assert!(messages > 1000, "{compat}: {messages}");
    }
}

#[cfg(unix)]
#[test]
fn interrupted_and_killed_recordings_are_readable() {
    for signal in ["INT", "KILL"] {
        let bench = Bench::new();
        let mut child = bench.start("record demo:feet=2,speed=1 -o walk.mcap", None);
        // On CAN, each motion message carries an IMU sample, 50 times a second.
        let topic = "/footfall/L/imu";
        bench.wait_for_samples("walk.mcap", topic, 75);
        assert!(kill(signal, &child));
        let code = child.wait().expect("it ends").code();
        assert_eq!(code, (signal == "INT").then_some(0), "{signal}");
        let report = bench.stdout(&format!("replay walk.mcap --topic {topic} --json"));
        let samples = samples(report.as_bytes());
        assert!(samples > 75, "{signal}: {samples}");
    }
}

#[cfg(unix)]
#[test]
fn interruption_ends_a_command_whose_device_never_responds() {
    let bench = Bench::new();
    let path = bench.path("board.sock");
    let device = std::os::unix::net::UnixListener::bind(&path).expect("a socket");
    let source = format!("uart:{}", path.display());
    for command in ["record SOURCE -o walk.mcap", "calibrate SOURCE", "monitor SOURCE"] {
        let mut child = bench.start(&command.replace("SOURCE", &source), None);
        // The device takes the connection, and says nothing.
        let _line = device.accept().expect("the program connects");
        assert!(kill("TERM", &child));
        let code = child.wait().expect("it ends").code();
        assert_eq!(code, Some(130), "{command}");
    }
}

#[cfg(unix)]
#[test]
fn reader_that_has_stopped_does_not_prevent_the_end() {
    let bench = Bench::new();
    let (reader, writer) = std::io::pipe().expect("a pipe");
    let mut other = writer.try_clone().expect("a pipe");
    // Fills the pipe of the report, and then waits until it is closed.
    let filler = std::thread::spawn(move || other.write_all(&[b'\n'; 1 << 20]));
    let said = fs::File::create(bench.path("said.txt")).expect("a file");
    let mut command = bench.command_with_signals("record demo -o walk.mcap", None);
    let mut child = command.stdout(writer).stderr(said).spawn().expect("it starts");
    drop(command);
    bench.wait_for_samples("walk.mcap", "/footfall/FL/imu", 25);
    assert!(kill("TERM", &child));
    let code = child.wait().expect("it ends").code();
    drop(reader);
    assert!(filler.join().expect("a thread").is_err(), "nothing has read the pipe");
    let said = read(&bench.path("said.txt"));
    assert_eq!(code, Some(130), "{said}");
    assert_has(&said, "the reader of the output has blocked the end for 5 s");
    let report = bench.stdout("replay walk.mcap --topic /footfall/FL/imu --json");
    assert!(samples(report.as_bytes()) >= 25);
}

#[test]
fn simulated_feet_are_recorded_in_real_time() {
    let bench = Bench::new();
    let began = std::time::Instant::now();
    bench.stdout("record demo:feet=1,seconds=2 -o walk.mcap");
    assert!(began.elapsed() >= Duration::from_secs(2), "{:?}", began.elapsed());
}

/// Returns three seconds of output of two boards with the id of FL, in the format of `candump -L`.
fn log_of_two_boards_with_one_id() -> String {
    let source = "feet=2,speed=max,seconds=3".parse::<simulated_robot::Demo>();
    let feed = Feed::open(source.expect("a source"));
    let [own, left] = [Position::Right, Position::Left].map(|foot| foot.default_node_id().get());
    let mut log = String::new();
    loop {
        match feed.next(Duration::from_secs(600)).expect("it ends") {
            FeedEvent::Arrived((at, Arrival::Frame { frame, .. })) => {
                let is_right = frame.id() & 0x7F == u16::from(own);
                let id = frame.id() - if is_right { u16::from(own - left) } else { 0 };
                let (s, us) = (at.as_micros() / 1_000_000, at.as_micros() % 1_000_000);
                let data: String = frame.data().iter().map(|byte| format!("{byte:02X}")).collect();
                log.push_str(&format!("({s}.{us:06}) can0 {id:03X}#{data}\n"));
            }
            FeedEvent::Ended(_) => return log,
            _ => {}
        }
    }
}

#[test]
fn contacts_of_boards_sharing_an_id_are_invalid() {
    let bench = Bench::with("two.log", log_of_two_boards_with_one_id());
    let output = bench.run("record file:two.log@max -o two.mcap");
    assert!(output.status.success());
    let said = text(&output.stderr);
    assert!(
        said.starts_with("footfall: L: several boards with this id, no contact of it is valid; "),
        "{said}"
    );
    assert_eq!(said.matches("several boards").count(), 1, "{said}");
    assert!(!said.contains("missing"), "{said}");
    assert!(count(&text(&output.stdout), "/footfall/L/contact") > 5000);
}

#[test]
fn foot_with_custom_id_is_recorded_when_named() {
    // One contact of node 34 per millisecond: probabilities, time in steps of 10 µs, sequence number, status.
    let contact = |ms: u16| {
        let [low, high] = (100 * ms).to_le_bytes();
        format!("(1.{ms:03}000) can0 1A2#00000000{low:02X}{high:02X}{ms:02X}80\n")
    };
    let bench = Bench::with("own.log", (0..100).map(contact).collect::<String>());
    let output = bench.run("record file:own.log@max -o none.mcap");
    let said = text(&output.stderr);
    assert_has(&said, "no foot was heard, but node 34 may be one: --node 34");
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(bench.files(), ["own.log"], "no file is left");
    for (option, name) in [("--node 34", "node_34"), ("--names 34=FL", "FL")] {
        let report = bench.stdout(&format!("record file:own.log@max {option} -o {name}.mcap"));
        assert_eq!(count(&report, &format!("/footfall/{name}/contact")), 100, "{report}");
    }
}

#[test]
fn recorded_log_has_the_events_of_its_walk() {
    let bench = Bench::new();
    bench.stdout("demo --output walk");
    let events = |recording: &str| -> Vec<String> {
        let table = bench.stdout(&format!("replay {recording} --events -"));
        let name = |row: &str| row.split(',').nth(1).expect("an event").to_owned();
        table.lines().skip(1).map(name).collect()
    };
    let expected = events("walk/samples.csv");
    assert_eq!(expected.len(), 32);
    bench.stdout("record file:walk/can.log -o walk.mcap");
    assert_eq!(events("walk.mcap"), expected);
}

#[test]
fn existing_file_is_replaced_on_request_by_a_valid_source_alone() {
    let bench = Bench::with("walk.mcap", "precious");
    for (arguments, expected) in cases(
        "
        demo:seconds=1 -o walk.mcap => walk.mcap is there already
        demo:seconds=1 -o - => cannot be written
        demo:seconds=1 -o walk.bag => .mcap
        file:none.log -o other.mcap => footfall: none.log
        file:none.log -o walk.mcap --overwrite => none.log cannot be read
        file:walk.mcap -o walk.mcap --overwrite => it is the recording itself
        ",
    ) {
        bench.refuses(&format!("record {arguments}"), expected);
        assert_eq!(bench.files(), ["walk.mcap"]);
        assert_eq!(read(&bench.path("walk.mcap")), "precious");
    }
    bench.stdout("record demo:seconds=1,speed=max -o walk.mcap --overwrite");
    let bytes = fs::read(bench.path("walk.mcap")).expect("a file");
    assert!(bytes.starts_with(b"\x89MCAP0"));
}

#[cfg(target_os = "linux")]
#[test]
fn pipe_and_device_are_written_in_place_and_a_terminal_is_not() {
    let bench = Bench::new();
    for line in [
        "mkfifo pipe && { timeout 60 cat pipe > walk.mcap & } && \"$0\" record demo:seconds=2,speed=max -o pipe; wait",
        "\"$0\" record demo:seconds=2,speed=max -o /dev/stdout | cat > walk.mcap",
    ] {
        let output = bench.shell("sh", line).expect("a shell");
        let (said, error) = (text(&output.stdout), text(&output.stderr));
        assert_eq!(said, "", "{line}: {error}");
        assert_has(&error, "wrote ");
        assert_has(&bench.stdout("replay walk.mcap"), "walk: 2000 samples");
    }
    let output = bench.run("record demo:seconds=1,speed=max -o /dev/null");
    assert!(output.status.success(), "{output:?}");
    // A new pseudo-terminal.
    bench.refuses(
        "record demo:seconds=1,speed=max -o /dev/ptmx",
        "footfall: /dev/ptmx is a terminal or a serial port, and a recording is binary: name a file, or a pipe",
    );
}

/// Cells of the six axes in each row of a table of ours with times, without trailing columns.
fn axes(table: &str) -> Vec<String> {
    let cells = |line: &str| line.split(',').skip(1).take(6).collect::<Vec<_>>().join(",");
    table.lines().skip(1).map(cells).collect()
}

#[test]
fn recorded_samples_are_recorded_as_they_were() {
    let row = |k: u32| {
        let t = f64::from(k) * 0.005;
        let [part, other] = [(k % 32) as f32 / 16.0, (k % 7) as f32 / 32.0];
        format!("{t:.3},{part},{other},9.75,{other},{part},-{other}\n")
    };
    let rows: String = (0..600).map(row).collect();
    let original = format!("t,{AXES}\n{rows}");
    let bench = Bench::with("walk.csv", &original);
    let output = bench.run("record file:walk.csv -o walk.mcap");
    assert_eq!((text(&output.stderr).as_str(), output.status.success()), ("", true));
    bench.stdout("convert walk.mcap back.csv --topic /footfall/walk/imu");
    assert_eq!(axes(&read(&bench.path("back.csv"))), axes(&original));
}

/// Cells of a column in each row of a table.
pub fn column(table: &str, name: &str) -> Vec<String> {
    let mut rows = table.lines().map(|line| line.split(','));
    let mut header = rows.next().expect("a header");
    let place = header.position(|column| column == name).expect(name);
    let cell = |mut row: std::str::Split<'_, char>| row.nth(place).unwrap_or_default().to_owned();
    rows.map(cell).collect()
}

#[test]
fn recorded_loads_are_recorded_with_their_samples() {
    // The load is not known for half a second.
    let row = |k: u32| {
        let t = f64::from(k) * 0.005;
        let load = if (200..300).contains(&k) { String::new() } else { format!("{}", k % 64) };
        format!("{t:.3},0,0,9.75,0,0,0,{load}\n")
    };
    let rows: String = (0..600).map(row).collect();
    let original = format!("t,{AXES},force\n{rows}");
    let bench = Bench::with("walk.csv", &original);
    let report = bench.stdout("record file:walk.csv -o walk.mcap");
    // One message more where the load ends.
    assert_eq!(count(&report, "/footfall/walk/load"), 501, "{report}");
    let back = |options: &str| {
        bench.stdout(&format!("convert {options} back.csv --overwrite"));
        column(&read(&bench.path("back.csv")), "force")
    };
    let loads = "--load-topic /footfall/walk/load";
    assert_eq!(back(&format!("walk.mcap {loads}")), column(&original, "force"));
    // The loads are kept whether the contacts are copied as recorded or estimated again.
    for options in ["", " --estimate-again"] {
        bench.stdout(&format!("record file:walk.mcap {loads}{options} -o again.mcap --overwrite"));
        let again = back(&format!("again.mcap {loads}"));
        assert_eq!(again, column(&original, "force"), "{options}");
    }
    let shown = bench.stdout("monitor --json file:walk.csv@max");
    assert!(shown.contains("\"load_n\":23"), "{shown}");
}

#[test]
fn implausible_unit_is_remarked_in_live_sources() {
    let row = |k: u32| format!("{:.3},0,0,1.0,0,0,0\n", f64::from(k) * 0.005);
    let rows: String = (0..600).map(row).collect();
    let bench = Bench::with("g.csv", format!("t,{AXES}\n{rows}"));
    let remark = "g: the acceleration is 1.00 m/s² at rest, which looks like g: --units g\n";
    let output = bench.run("record file:g.csv -o g.mcap");
    assert!(text(&output.stderr).contains(remark), "{output:?}");
    let shown = bench.stdout("monitor file:g.csv@max");
    assert!(shown.contains(remark), "{shown}");
    let shown = bench.stdout("monitor file:g.csv@max --units g");
    assert!(!shown.contains("looks like g"), "{shown}");
    let rows = rows.replace(",1.0,", ",0.0,");
    fs::write(bench.path("rest.csv"), format!("t,{AXES}\n{rows}")).expect("a file");
    fs::write(bench.path("removed.toml"), "gravity = 'removed'\n").expect("a file");
    let output = bench.run("record file:rest.csv --config removed.toml -o rest.mcap");
    let said = text(&output.stderr);
    let computed = "rest: gravity was removed from its accelerations, so that messages of an IMU are computed, with \
                    gravity by the estimated orientation\n";
    assert!(said.contains(computed), "{said}");
}

#[test]
fn feet_of_a_bag_are_calibrated_each_by_itself() {
    let bench = Bench::new();
    bench.stdout("record demo:feet=2,line=uart,seconds=20,speed=max -o feet.mcap");
    let said = bench.stdout("calibrate feet.mcap --topic all --output robot.toml");
    assert!(said.contains("foot L\nlearnt from"), "{said}");
    assert!(said.ends_with("written  robot.toml\n"), "{said}");
    let file = read(&bench.path("robot.toml"));
    for foot in ["L", "R"] {
        let alone = format!("--topic /footfall/{foot}/imu --foot {foot}");
        let alone = format!("calibrate feet.mcap {alone} --output {foot}.toml");
        bench.stdout(&alone);
        let table = read(&bench.path(&format!("{foot}.toml")));
        let table = table.split_once("[feet").expect("a table").1;
        assert!(file.contains(&format!("[feet{table}")), "{file}{table}");
    }
    let json = bench.json("calibrate feet.mcap --topic all --config robot.toml");
    let feet = json["feet"].as_object().expect("feet");
    assert_eq!(feet.keys().collect::<Vec<_>>(), ["L", "R"]);
    bench.stdout("replay feet.mcap --topic all --config robot.toml");
    fs::write(bench.path("paper.toml"), "method = 'half_widths'\n").expect("a file");
    bench.refuses(
        "calibrate feet.mcap --topic all --config paper.toml",
        "foot L: method = \"half_widths\" learns nothing",
    );
}

#[test]
fn copy_of_a_bag_wants_a_place_for_each_foot() {
    let bench = Bench::new();
    let names = "--names 0x15=FL,0x16=R";
    bench.stdout(&format!("record demo:feet=2,line=uart,seconds=3,speed=max {names} -o walk.mcap"));
    // Copy without the contacts of the recording.
    bench.stdout("convert walk.mcap imu.mcap --topic all");
    let copy = "replay imu.mcap --topic all --output copy.mcap";
    let said = bench.error(&format!("{copy} --compat champ"));
    assert!(
        said.contains("the foot R has no place of its own in the messages of all feet"),
        "{said}"
    );
    let right = "--rename R=FR";
    let said = bench.error(&format!("{copy} --compat champ {right}"));
    assert_has(&said, "missing feet: RL, RR; --compat writes messages of FL, FR, RL, RR,");
    let output = bench.run(&format!("{copy} --compat bool {right}"));
    let said = text(&output.stderr);
    assert!(output.status.success(), "{said}");
    bench.stdout("replay copy.mcap --topic all");
    fs::remove_file(bench.path("copy.mcap")).expect("the copy");
    let said = text(&bench.run(copy).stderr);
    assert!(!said.contains("of all feet"), "{said}");
    let replay = "replay imu.mcap --topic all --rename R=fl";
    assert_has(&bench.error(replay), "two feet would be fl: --rename");
    bench.stdout(&format!("{replay} --rename FL=R"));
    for options in ["--compat champ", "--lowstate /lowstate"] {
        let said = bench.error(&format!("replay imu.mcap --topic all {options}"));
        let option = options.split(' ').next().expect("an option");
        let expected =
            format!("footfall: {option} applies only to a copy of a bag: add --output copy.mcap\n");
        assert_eq!(said, expected);
    }
}
