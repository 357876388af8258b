//! Contacts of four feet in one message, for programs that do not accept footfall's messages.
//!
//! | program | topic | message | content |
//! |---|---|---|---|
//! | [champ](https://github.com/chvmp/champ) | `/foot_contacts`, read by its state estimation | `champ_msgs/msg/ContactsStamped` | the decisions |
//! | [pronto](https://github.com/ori-drs/pronto) | `/footfall/stance` | `pronto_msgs/msg/QuadrupedStance` | the decisions, as 0 or 1: its `legodo_handler_ros.cpp` treats any number above 0.01 as stance |
//!
//! Both use the order left front, right front, left hind, right hind. A message is created as soon as each of
//! the four feet has a new contact; after 20 ms it is created without the silent feet, even if all are silent.
//! Invalid and silent feet are reported in swing: false, 0.

use std::sync::Arc;

use estimator_core::Timestamp;
use live::silence::COMPLETION_WAIT_US;

use crate::bridge::Published;
use crate::message::{Contact, ContactsStamped, Header, Message, QuadrupedStance, Time};

/// Names of the feet, in the order of the messages.
const FEET: [[&str; 2]; 4] = [["FL", "LF"], ["FR", "RF"], ["RL", "LH"], ["RR", "RH"]];

/// Program whose messages are created.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compat {
    /// Decisions as 0 or 1, for pronto.
    Pronto,
    /// Decisions, for champ.
    Champ,
}

/// Newest contacts of four feet.
#[derive(Debug)]
pub struct AllFeet {
    compat: Compat,
    topic: Arc<str>,
    feet: [Option<Stance>; 4],
    /// Listening time of the newest message, or of the first contact, µs.
    made_us: Option<u64>,
}

/// Decision of a foot since the newest message.
#[derive(Clone, Copy, Debug)]
struct Stance {
    stands: bool,
    stamp: Time,
}

impl AllFeet {
    /// Creates an empty state.
    #[must_use]
    pub fn new(compat: Compat) -> Self {
        let topic = match compat {
            Compat::Pronto => "/footfall/stance",
            Compat::Champ => "/foot_contacts",
        };
        Self {
            compat,
            topic: topic.into(),
            feet: [None; 4],
            made_us: None,
        }
    }

    /// Processes a contact received at `at` and `listened_us` of the listening time; returns the message that it completes, if any.
    pub fn take(
        &mut self,
        contact: &Contact,
        at: Timestamp,
        listened_us: u64,
    ) -> Option<Published> {
        let place = FEET
            .iter()
            .position(|names| names.contains(&contact.foot.as_str()))?;
        self.feet[place] = Some(Stance {
            stands: contact.valid && contact.decision,
            stamp: contact.header.stamp,
        });
        self.made_us.get_or_insert(listened_us);
        if self.feet.iter().all(Option::is_some) {
            return Some(self.make(at, listened_us));
        }
        self.advance(at, listened_us)
    }

    /// Advances the time to `at`; returns the message due, if there were contacts before.
    pub fn advance(&mut self, at: Timestamp, listened_us: u64) -> Option<Published> {
        let is_due = listened_us - self.made_us? >= COMPLETION_WAIT_US;
        is_due.then(|| self.make(at, listened_us))
    }

    /// Ends reception; returns a message with all feet in swing, if there were contacts before.
    pub fn end(&mut self, now: Timestamp) -> Option<Published> {
        let made_us = self.made_us?;
        self.feet = [None; 4];
        Some(self.make(now, made_us))
    }

    /// Creates a message of the known contacts at `at`.
    fn make(&mut self, at: Timestamp, listened_us: u64) -> Published {
        self.made_us = Some(listened_us);
        let feet = std::mem::take(&mut self.feet);
        let newest = feet.iter().flatten().map(|foot| foot.stamp).max();
        let header = Header {
            // If all feet are silent, the state applies now.
            stamp: newest.unwrap_or_else(|| at.into()),
            // The feet have no common frame.
            frame_id: String::new(),
        };
        let stands = |foot: Option<Stance>| foot.is_some_and(|foot| foot.stands);
        let message = match self.compat {
            Compat::Champ => Message::Champ(ContactsStamped {
                header,
                contacts: feet.map(stands).to_vec(),
            }),
            Compat::Pronto => {
                let [lf, rf, lh, rh] = feet.map(|foot| f32::from(u8::from(stands(foot))));
                Message::Pronto(QuadrupedStance {
                    header,
                    lf,
                    rf,
                    lh,
                    rh,
                })
            }
        };
        Published {
            topic: Arc::clone(&self.topic),
            at,
            message,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use live::silence::Listening;

    fn contact(foot: &str, p_stable: f32, us: u64) -> (Contact, Timestamp) {
        let at = Timestamp::from_micros(us);
        let header = Header {
            stamp: at.into(),
            frame_id: "ignored".to_owned(),
        };
        let contact = Contact {
            header,
            foot: foot.to_owned(),
            p_stable,
            decision: p_stable > 0.5,
            valid: p_stable < 0.95,
            ..Contact::default()
        };
        (contact, at)
    }

    /// All feet with the listening time that a session keeps.
    struct Listened {
        all: AllFeet,
        listening: Listening,
    }

    impl Listened {
        fn new(compat: Compat) -> Self {
            let (all, listening) = (AllFeet::new(compat), Listening::default());
            Self { all, listening }
        }

        fn take(&mut self, contact: &Contact, at: Timestamp) -> Option<Published> {
            self.listening.arrive(at);
            self.all.take(contact, at, self.listening.us())
        }

        fn hear(&mut self, at: Timestamp) -> Option<Published> {
            self.listening.arrive(at);
            self.all.advance(at, self.listening.us())
        }

        fn idle(&mut self, now: Timestamp) -> Option<Published> {
            self.listening.idle(now);
            self.all.advance(now, self.listening.us())
        }

        fn end(&mut self) -> Option<Published> {
            self.all.end(self.listening.now())
        }
    }

    /// Messages created from `contacts`: times in µs and the four numbers.
    fn made(compat: Compat, contacts: &[(&str, f32, u64)]) -> Vec<(u32, [f32; 4])> {
        let mut all = Listened::new(compat);
        let contacts = contacts.iter();
        let messages = contacts.filter_map(|(foot, p, us)| {
            let (contact, at) = contact(foot, *p, *us);
            all.take(&contact, at)
        });
        let micros = |header: Header| header.stamp.nanosec / 1000;
        messages
            .map(|published| match published.message {
                Message::Pronto(m) => (micros(m.header), [m.lf, m.rf, m.lh, m.rh]),
                Message::Champ(m) => {
                    let numbers = m.contacts.iter().map(|stands| f32::from(u8::from(*stands)));
                    let numbers: Vec<_> = numbers.collect();
                    (micros(m.header), numbers.try_into().expect("four feet"))
                }
                other => panic!("{other:?}"),
            })
            .collect()
    }

    #[test]
    fn newest_contact_of_each_foot_is_used_in_its_place() {
        let contacts = [
            ("RR", 0.1, 400),
            ("FL", 0.9, 100),
            ("FL", 0.6, 1100),
            ("tail", 0.8, 1200),
            ("RF", 0.2, 200),
            ("LH", 0.99, 300),
            ("FL", 0.7, 2100),
        ];
        // Pronto would treat a probability of 0.2 as stance.
        let pronto = [(1100, [1.0, 0.0, 0.0, 0.0])];
        assert_eq!(made(Compat::Pronto, &contacts), pronto);
        let champ = [(1100, [1.0, 0.0, 0.0, 0.0])];
        assert_eq!(made(Compat::Champ, &contacts), champ);
    }

    #[test]
    fn silent_foot_is_skipped_and_reported_in_swing() {
        let contacts: Vec<_> = (0..60)
            .flat_map(|ms| ["FL", "FR", "RL"].map(|foot| (foot, 0.9, ms * 1000)))
            .collect();
        let times = [20_000, 40_000].map(|us| (us, [1.0, 1.0, 1.0, 0.0]));
        assert_eq!(made(Compat::Pronto, &contacts), times);
    }

    #[test]
    fn silent_feet_are_reported_in_swing() {
        let mut all = Listened::new(Compat::Champ);
        let micros = Timestamp::from_micros;
        assert_eq!((all.idle(micros(5)), all.end()), (None, None));
        let of = |published: Option<Published>| match published?.message {
            Message::Champ(message) => Some((message.header.stamp, message.contacts)),
            other => panic!("{other:?}"),
        };
        for foot in ["FL", "FR", "RL", "RR"] {
            let (contact, at) = contact(foot, 0.9, 10_000);
            let stands = of(all.take(&contact, at)).map(|(_, contacts)| contacts);
            assert_eq!(stands, (foot == "RR").then(|| vec![true; 4]));
        }
        assert_eq!(all.idle(micros(29_000)), None);
        let none = |us| Some((micros(us).into(), vec![false; 4]));
        assert_eq!(of(all.idle(micros(30_000))), none(30_000));
        assert_eq!(all.idle(micros(49_000)), None);
        assert_eq!(of(all.idle(micros(51_000))), none(51_000));
        all.take(&contact("FL", 0.9, 60_000).0, micros(60_000));
        // Loads and heartbeats continue.
        let mut others = (0..20).filter_map(|ms| of(all.hear(micros(61_000 + 1000 * ms))));
        let (_, contacts) = others.next().expect("one is due");
        assert_eq!(
            (contacts, others.next()),
            (vec![true, false, false, false], None)
        );
        assert_eq!(of(all.end()), none(80_000));
    }

    #[test]
    fn host_stall_does_not_make_feet_silent() {
        let contacts: Vec<_> = [0, 1000, 901_000, 902_000]
            .into_iter()
            .flat_map(|us| ["FL", "FR", "RL", "RR"].map(|foot| (foot, 0.9, us)))
            .collect();
        let messages = made(Compat::Pronto, &contacts);
        assert_eq!(messages.len(), 4);
        assert!(messages.iter().all(|(_, stands)| *stands == [1.0; 4]));
    }
}
