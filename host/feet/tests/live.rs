//! Feeds and sessions of simulated feet.

use std::time::Duration;

use feet::decode::Feet;
use feet::decode::live::MessageBody;
use feet::feed::Fed;
use feet::{Arrival, Feed, Session, Update};
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
            Fed::Arrived((_, Arrival::Frame { frame, .. })) => {
                contacts += usize::from(frame.id() & 0x780 == 0x180);
            }
            Fed::Ended(error) => {
                assert_eq!(error.to_string(), "the demo has ended");
                break;
            }
            _ => {}
        }
    }
    assert_eq!((contacts, feed.lost()), (4000, 0));
}

#[test]
fn serial_foot_keeps_its_state_when_its_id_becomes_known() {
    let feed = demo("line=uart,seconds=2,speed=max");
    let mut session = Session::new(Feet::default());
    let mut contacts = 0;
    'listen: loop {
        session.listen(&feed, LONGEST);
        while let Some(update) = session.next_update() {
            match update {
                Update::Line(Fed::Ended(_)) => break 'listen,
                Update::Message(0, message) if message.foot.node.is_none() => {
                    contacts += u64::from(matches!(message.body, MessageBody::Contact(_)));
                    assert_eq!(session.feet()[0].name, None);
                }
                _ => {}
            }
        }
    }
    let [foot] = session.feet() else {
        panic!("{} feet", session.feet().len());
    };
    assert!(contacts > 0 && foot.key.node.is_some());
    assert_eq!((foot.name.as_deref(), foot.missing), (Some("FL"), 0));
    // The second begins before the id is known, and the demo lasts two.
    assert!(foot.second.rate_hz().is_some_and(|rate| rate > 990.0));
}
