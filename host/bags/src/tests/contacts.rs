//! Bags with contacts that feet have sent.

use super::*;
use options::ContactUse;
use samples::ros::{Header, RosContact, Time};

const CONTACT: &str = "footfall_msgs/msg/Contact";

/// Contacts at 1 kHz on these topics, as many as each number says.
fn contacts(topics: &[(&'static str, i64)]) -> Vec<Message> {
    let contact = |topic: &'static str, k: i64| {
        let (sec, nanosec) = (1_700_000_000, 1_000_000 * k as u32);
        let header = Header { stamp: Time { sec, nanosec }, frame_id: "foot".to_owned() };
        let contact = RosContact { header, ..RosContact::default() };
        let fields = cdr_encoding::to_vec::<_, byteorder::LittleEndian>(&contact).unwrap();
        let payload = [&[0, 1, 0, 0][..], &fields].concat();
        Message(topic, CONTACT, 1_700_000_000_000_000_000 + 1_000_000 * k, payload)
    };
    let of_topic = |(topic, count): &(&'static str, i64)| {
        let topic = *topic;
        (0..*count).map(move |k| contact(topic, k))
    };
    topics.iter().flat_map(of_topic).collect()
}

fn recorded(mut input_options: InputOptions, excluded: &[&str]) -> InputOptions {
    input_options.contacts = ContactUse::Recorded;
    input_options.bag.excluded = excluded.iter().map(|pattern| (*pattern).to_owned()).collect();
    input_options
}

#[test]
fn contacts_without_samples_are_read() {
    let two = [("/footfall/FL/contact", 20), ("/footfall/FR/contact", 10)];
    let bytes = written(Kind::Records, &contacts(&two), &[]);
    for (chosen, excluded, expected) in [
        (&["all"][..], &[][..], &[("FL", 20), ("FR", 10)][..]),
        (&["/footfall/FR/contact"], &[], &[("FR", 10)]),
        (&[], &["*FL*"], &[("FR", 10)]),
    ] {
        let feet = open(&bytes, &recorded(topics(chosen), excluded)).unwrap();
        let about = feet.iter().map(|foot| &foot.about);
        let read: Vec<_> =
            about.map(|foot| (foot.foot.as_deref().unwrap(), foot.samples)).collect();
        assert_eq!(read, expected);
    }
}

#[test]
fn several_feet_without_samples_are_listed() {
    let two = [("/footfall/FL/contact", 20), ("/footfall/FR/contact", 10)];
    let bytes = written(Kind::Records, &contacts(&two), &[]);
    assert_eq!(
        why(open(&bytes, &recorded(topics(&[]), &[]))),
        " has several IMUs, choose with topic, or topic all: /footfall/FL/contact (20 messages), \
         /footfall/FR/contact (10 messages)"
    );
}

#[test]
fn bag_without_a_selected_contact_is_an_error() {
    let bytes = written(Kind::Records, &contacts(&[("/footfall/FL/contact", 20)]), &[]);
    for chosen in [&[][..], &["all"]] {
        let said = why(open(&bytes, &recorded(topics(chosen), &["/footfall/*"])));
        assert!(said.starts_with(" has no topic of sensor_msgs/msg/Imu in CDR; "), "{said}");
    }
    let named = topics(&["/footfall/FL/contact"]);
    let said = why(open(&bytes, &recorded(named, &["/footfall/*"])));
    assert!(said.starts_with(" has no topic /footfall/FL/contact of sensor_msgs/"), "{said}");
    // Two contacts are the fewest of a recording.
    let bytes = written(Kind::Records, &contacts(&[("/footfall/FL/contact", 1)]), &[]);
    let said = why(open(&bytes, &recorded(topics(&["all"]), &[])));
    assert!(said.starts_with(" has no topic of sensor_msgs/msg/Imu in CDR; "), "{said}");
}

#[test]
fn contacts_left_out_are_reported_even_if_none_is_used() {
    let mut messages = one_foot(Order::Little);
    messages.iter_mut().for_each(|message| message.0 = "/footfall/FL/imu");
    let mut sent = contacts(&[("/footfall/FL/contact", 3)]);
    for (cut, said) in [
        (1, "1 contact left out, which is no message of this type"),
        (2, "2 contacts left out, which are no message of this type"),
    ] {
        sent[cut].3.truncate(8);
        let bytes = written(Kind::Records, &[&messages[..], &sent].concat(), &[]);
        let feet = open(&bytes, &recorded(topics(&[]), &[])).unwrap();
        let notices = &feet[0].about.notices;
        let expected = format!("topic /footfall/FL/contact: {said}");
        assert!(notices.iter().any(|notice| notice.text.ends_with(&expected)), "{notices:?}");
    }
}
