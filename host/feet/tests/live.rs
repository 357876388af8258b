//! Feeds and sessions of simulated feet.

use std::time::Duration;

use estimator_core::Timestamp;
use feet::decode::KnownFeet;
use feet::decode::live::MessageBody;
use feet::feed::FeedEvent;
use feet::{Arrival, Feed, LineSource, Session, Update};
use simulated_robot::Demo;

/// Timeout that ends a hang.
const LONGEST: Duration = Duration::from_secs(120);

fn demo(keys: &str) -> Feed {
    Feed::open(keys.parse::<Demo>().expect("keys"))
}

#[test]
fn demo_at_max_speed_yields_every_frame_and_its_end() {
    let feed = demo("feet=2,speed=max,seconds=2");
    let mut contacts = 0;
    loop {
        match feed.next(LONGEST).expect("it ends") {
            FeedEvent::Arrived((_, Arrival::Frame { frame, .. })) => {
                contacts += usize::from(frame.id() & 0x780 == 0x180);
            }
            FeedEvent::Ended(error) => {
                assert_eq!(error.to_string(), "the demo has ended");
                break;
            }
            _ => {}
        }
    }
    assert_eq!((contacts, feed.lost()), (4000, 0));
}

#[test]
fn contacts_of_a_serial_foot_have_its_name_from_the_first() {
    let feed = demo("line=uart,seconds=2,speed=max");
    let mut session = Session::new(KnownFeet::default());
    let mut contacts = 0;
    'listen: loop {
        session.listen(&feed, LONGEST);
        while let Some(update) = session.next_update() {
            match update {
                Update::Line(FeedEvent::Ended(_)) => break 'listen,
                Update::Message(0, message) => {
                    contacts += u64::from(matches!(message.body, MessageBody::Contact(_)));
                    assert_eq!(message.foot.node, Some(0x11));
                    assert_eq!(session.feet()[0].name.as_deref(), Some("FL"));
                }
                _ => {}
            }
        }
    }
    let [foot] = session.feet() else {
        panic!("{} feet", session.feet().len());
    };
    assert_eq!((contacts, foot.missing), (2000, 0));
    assert!(foot.second.rate_hz().is_some_and(|rate| rate > 990.0));
}

#[test]
fn feet_of_two_sources_are_one_feed_in_order_of_time() {
    let sources = ["feet=1,line=uart,seconds=2,speed=max", "feet=2,seconds=1,speed=max"];
    let sources =
        sources.map(|keys| Box::new(keys.parse::<Demo>().expect("keys")) as Box<dyn LineSource>);
    let feed = Feed::open_all(sources.into());
    let mut session = Session::new(KnownFeet::default());
    let mut newest = Timestamp::default();
    'listen: loop {
        session.listen(&feed, LONGEST);
        assert!(session.now() >= newest);
        newest = session.now();
        while let Some(update) = session.next_update() {
            if let Update::Line(FeedEvent::Ended(_)) = update {
                break 'listen;
            }
        }
    }
    let mut names: Vec<_> =
        session.feet().iter().map(|foot| foot.name_or("").into_owned()).collect();
    names.sort();
    assert_eq!(names, ["FL", "L", "R"]);
    assert!(session.same_name().is_none());
    assert!(session.elapsed_s() > 1.9, "the end of the first source does not end the other");
}
