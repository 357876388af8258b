//! A foot that is asked and set, over CAN and over its serial line: the board's own program answers.

use std::time::Duration;

use live::foot::Named;
use live::foot::client::{Client, RequestError};
use live::foot::settings::{self, SettingsError, Values};
use live::link::{self, Arrived};
use live::{Link, LinkError, Sending};
use wire::dictionary::index;
use wire::node::{Command, State};
use wire::{AbortCode, Address, DataType, NodeId, Value};

const LINES: [&str; 2] = ["can", "uart"];

fn client(line: &str) -> Client {
    let source = format!("demo:feet=1,line={line},speed=20");
    let link = link::open(&source.parse().expect("a source")).expect("a demo");
    Client::new(link, None).expect("one foot")
}

fn values(client: &Client, texts: &[(&str, &str)]) -> Values {
    let value = |(name, text): &(&str, &str)| {
        let named = Named::find(name).expect("a name");
        (
            named.address,
            named.parse(text, client.node()).expect("a value"),
        )
    };
    texts.iter().map(value).collect()
}

fn get(client: &mut Client, name: &str) -> String {
    let named = Named::find(name).expect("a name");
    let value = client.read(named.address, named.entry.data_type());
    named.text(value.unwrap_or_else(|error| panic!("{error}")))
}

#[test]
fn every_setting_of_a_new_foot_is_its_default() {
    for line in LINES {
        let mut client = client(line);
        let own = settings::read(&mut client).expect("answers");
        assert_eq!(own.len(), Named::settings().count());
        let defaults = settings::defaults(client.node());
        let differ = settings::differences(&defaults, &own);
        let names: Vec<_> = differ.iter().map(|(named, ..)| named.name()).collect();
        // What the demo sets: the load comes over CAN, and samples over the serial line.
        let expected = ["uart_streams.raw_sample", "load_input.source"];
        let expected = &expected[usize::from(line == "can")..];
        assert_eq!(names, expected, "{line}");
    }
}

#[test]
fn texts_come_in_segments_and_whole() {
    for line in LINES {
        let mut client = client(line);
        let name = client
            .read_text(Address::new(index::DEVICE_NAME, 0))
            .expect("a name");
        assert!(name.contains("footfall"), "{line}: {name}");
    }
}

#[test]
fn settings_are_written_read_back_stored_and_there_after_a_reset() {
    for line in LINES {
        let mut client = client(line);
        let wanted = values(
            &client,
            &[("decision.threshold", "0.625"), ("half_width.ax", "0.5")],
        );
        let changes = settings::write(&mut client, &wanted).expect("taken");
        assert_eq!(changes.len(), 2, "{line}");
        assert_eq!(
            client.state().expect("a state"),
            State::Operational,
            "{line}"
        );
        assert!(
            settings::write(&mut client, &wanted)
                .expect("taken")
                .is_empty()
        );
        // Without a store a reset forgets them; with one it does not.
        for (stored, threshold) in [(false, "0.5"), (true, "0.625")] {
            if stored {
                settings::write(&mut client, &wanted).expect("taken");
                let after = settings::paused(&mut client).expect("a state");
                client.store().expect("stored");
                client.command(after).expect("sent");
            }
            client.command(Command::ResetNode).expect("sent");
            client.state().expect("it is back");
            assert_eq!(get(&mut client, "decision.threshold"), threshold, "{line}");
        }
        let after = settings::paused(&mut client).expect("a state");
        client.restore().expect("forgotten");
        client.command(after).expect("sent");
        client.command(Command::ResetNode).expect("sent");
        client.state().expect("it is back");
        assert_eq!(get(&mut client, "decision.threshold"), "0.5", "{line}");
    }
}

#[test]
fn settings_that_fit_only_in_some_order_are_taken_in_any() {
    let mut client = client("can");
    // Both above the upper threshold that the foot has: the lower one fits only after the upper one.
    let upper = Named::find("load_input.on_threshold").expect("a name");
    let wanted = values(
        &client,
        &[
            ("load_input.on_threshold", "90"),
            ("load_input.off_threshold", "80"),
        ],
    );
    settings::write(&mut client, &wanted).expect("taken");
    assert_eq!(get(&mut client, &upper.name()), "90");
    let wanted = values(
        &client,
        &[
            ("load_input.on_threshold", "12"),
            ("load_input.off_threshold", "6"),
        ],
    );
    settings::write(&mut client, &wanted).expect("taken");
    assert_eq!(get(&mut client, "load_input.off_threshold"), "6");
}

#[test]
fn settings_that_do_not_go_together_change_nothing() {
    for line in LINES {
        let mut client = client(line);
        let before = settings::read(&mut client).expect("answers");
        let wanted = values(
            &client,
            &[
                ("decision.threshold", "0.75"),
                ("load_input.on_threshold", "5"),
                ("load_input.off_threshold", "50"),
            ],
        );
        match settings::write(&mut client, &wanted) {
            Err(SettingsError::Incompatible(_)) => {}
            other => panic!("{line}: {other:?}"),
        }
        let after = settings::read(&mut client).expect("answers");
        assert!(settings::differences(&before, &after).is_empty(), "{line}");
        assert_eq!(
            client.state().expect("a state"),
            State::Operational,
            "{line}"
        );
    }
}

#[test]
fn a_value_that_is_refused_says_why_in_words() {
    for line in LINES {
        let mut client = client(line);
        let window = Named::find("window").expect("a name");
        // Without a pause the foot is operational, and refuses settings.
        let error = client
            .write(window.address, window.entry.default)
            .expect_err("refused");
        let RequestError::Refused { reason, .. } = &error else {
            panic!("{line}: {error}");
        };
        assert_eq!(*reason, AbortCode::DeviceState);
        let text = error.to_string();
        assert!(
            text.starts_with("writing window (0x2010:0) was refused: "),
            "{text}"
        );
        assert!(text.contains("pre-operational state first"), "{text}");
        let unknown = client.read(Address::new(0x2FFF, 0), DataType::Unsigned8);
        assert!(
            unknown
                .expect_err("there is none")
                .to_string()
                .contains("no such object")
        );
    }
}

#[test]
fn four_feet_want_to_be_told_apart() {
    let open = || link::open(&"demo:feet=4,speed=20".parse().expect("a source")).expect("a demo");
    match Client::new(open(), None) {
        Err(error) => assert_eq!(
            error.to_string(),
            "there are several feet, 17, 18, 19, 20: name one with --node"
        ),
        Ok(_) => panic!("which one?"),
    }
    let mut second = Client::new(open(), NodeId::new(18)).expect("a foot");
    assert_eq!(get(&mut second, "foot"), "2");
    let mut nobody = Client::new(open(), NodeId::new(99)).expect("a line");
    let error = nobody.read(Address::new(index::FOOT, 0), DataType::Unsigned8);
    assert!(
        error
            .expect_err("nobody")
            .to_string()
            .starts_with("node 99 does not answer: reading foot")
    );
}

/// A line that breaks after some frames were sent.
struct Breaking {
    link: Box<dyn Link>,
    left: u32,
}

impl Link for Breaking {
    fn receive(&mut self, longest: Duration) -> Result<Option<Arrived>, LinkError> {
        let arrived = self.link.receive(longest)?;
        // What the foot says is lost, too.
        Ok(arrived.filter(|_| self.left > 0))
    }

    fn send(&mut self, sending: &Sending) -> Result<(), LinkError> {
        if self.left == 0 {
            return Ok(());
        }
        self.left -= 1;
        self.link.send(sending)
    }
}

#[test]
fn a_foot_that_vanishes_in_between_is_said_to_have_some_of_both() {
    let settings_read = Named::settings().count() as u32;
    for more in [2, 3] {
        let source = "demo:feet=1,speed=20".parse().expect("a source");
        let link = Breaking {
            link: link::open(&source).expect("a demo"),
            // All settings are read, the foot is paused, and some are written.
            left: settings_read + more,
        };
        let mut client = Client::new(Box::new(link), NodeId::new(17)).expect("a foot");
        let wanted = values(
            &client,
            &[
                ("half_width.ax", "0.5"),
                ("half_width.ay", "0.5"),
                ("half_width.az", "0.5"),
            ],
        );
        let error = settings::write(&mut client, &wanted)
            .expect_err("it vanished")
            .to_string();
        assert!(error.contains("node 17 does not answer"), "{error}");
        assert!(error.contains("none of the new are stored"), "{error}");
    }
}

#[test]
fn a_text_reads_back_as_the_settings_it_was_made_of() {
    let mut client = client("can");
    let own = settings::read(&mut client).expect("answers");
    let text = settings::to_text(&own, "settings");
    let back = settings::from_text(&text, client.node()).expect("settings");
    assert_eq!(back, own);
    // On another foot, identifiers of PDOs are its own.
    let other = settings::from_text(&text, NodeId::new(0x14)).expect("settings");
    assert!(settings::differences(&own, &other).is_empty());
    for (wrong, message) in [
        ("windw = 5", "line 1: no object is called \"windw\""),
        ("\nwindow = 0", "line 2: window is \"0\", but "),
        (
            "window",
            "line 1: \"window\" is no setting, such as window = 50000",
        ),
        (
            "window = 50000\nwindow = 50000",
            "line 2: window stands twice",
        ),
        (
            "stage = 1",
            "line 1: stage is no setting: it cannot be written",
        ),
    ] {
        let error = settings::from_text(wrong, None)
            .expect_err(wrong)
            .to_string();
        assert!(error.starts_with(message), "{error}");
    }
    assert!(matches!(
        own.get(&Address::new(index::FOOT, 0)),
        Some(Value::U8(1))
    ));
}
