//! Conversion of a foot's data to messages on topics.
//!
//! | topic | message | from |
//! |---|---|---|
//! | `/footfall/FL/contact` | `footfall_msgs/msg/Contact` | each contact |
//! | `/footfall/FL/contact/probability` | `std_msgs/msg/Float64`: P alone | each contact; 0 if invalid, because a number cannot express validity |
//! | `/footfall/FL/velocity` | `geometry_msgs/msg/TwistWithCovarianceStamped` | each contact: zero, with the default variance of the [zero-velocity measurement](estimator_core::velocity); 10⁴ (m/s)² if there is no information |
//! | `/footfall/FL/load` | `std_msgs/msg/Float64`, N | each load that the robot sends to the foot over CAN, and each that a recording has with a sample; NaN where it is no longer known |
//! | `/footfall/FL/imu` | `sensor_msgs/msg/Imu` | each raw sample of a serial line, and each sample of a recording with gravity as it was recorded; on CAN each acceleration, with the newest orientation and rate, which are up to 20 ms older: for display, not for integration |
//! | `/diagnostics` | `diagnostic_msgs/msg/DiagnosticArray` | health and faults, at once on a change, otherwise once a second |
//!
//! Stamps are the times of the samples on the receiver's clock: by numbered SYNCs if the foot has reported
//! one, otherwise by the least delay of the last seconds ([`FootClock`](feet::clock::FootClock)).
//!
//! A foot without a contact for half a second is silent: its probability is 0, and diagnostics report it.
//! Contacts of several boards with the same id ([`NewestSecond`](feet::NewestSecond)) carry no information:
//! they are invalid, their probability is 0, no IMU is published, and diagnostics report the cause.

use std::collections::BTreeMap;

use estimator_core::Timestamp;
use feet::decode::live::{Heard, Said};
use feet::{LiveFoot, Session, Update};

use crate::ros::compat::{AllFeet, Compat};
use crate::ros::foot::Foot;
use crate::ros::message::{RosContact, RosMessage};
use crate::ros::published::Published;

/// Messages from the updates of a session.
#[derive(Debug)]
pub struct Bridge {
    frame: String,
    /// Feet, by their index in the session.
    feet: BTreeMap<usize, Foot>,
    /// Combined messages of all feet for other programs.
    all_feet: Option<AllFeet>,
}

impl Bridge {
    /// Creates a bridge. `frame` is the pattern of frame names, in which `{foot}` is replaced by the foot's name;
    /// `compats` are other programs for which there are combined messages of all feet.
    #[must_use]
    pub fn new(frame: &str, compats: &[Compat]) -> Self {
        Self {
            frame: frame.to_owned(),
            feet: BTreeMap::new(),
            all_feet: (!compats.is_empty()).then(|| AllFeet::new(compats)),
        }
    }

    /// Names of feet that combined messages have no place for.
    pub fn without_place(&self) -> impl Iterator<Item = &str> {
        let all_feet = self.all_feet.iter();
        all_feet.flat_map(|feet| feet.others.iter().map(String::as_str))
    }

    /// Names of feet that combined messages report in swing, as they have sent no contact.
    #[must_use]
    pub fn absent(&self, session: &Session) -> Vec<&'static str> {
        let all_feet = self.all_feet.as_ref();
        all_feet.map_or_else(Vec::new, |feet| feet.absent(session.listening().us()))
    }

    /// Returns the messages for the newest update of a session.
    pub fn messages(&mut self, session: &Session, update: &Update) -> Vec<Published> {
        let listening = session.listening();
        let mut published = Vec::new();
        let (at, contact) = match update {
            Update::Message(foot, heard) => {
                let contact = self.of_foot(*foot, &session.feet()[*foot], heard, &mut published);
                (heard.at, contact)
            }
            Update::Quiet(now) => (*now, None),
            Update::Line(_) => return published,
        };
        if let Some(all_feet) = &mut self.all_feet {
            published.extend(match contact {
                Some(contact) => all_feet.take(&contact, at, listening.us()),
                None => all_feet.advance(at, listening.us()),
            });
        }
        published.extend(self.silent(session, listening.us(), at));
        published
    }

    /// Adds the messages of a foot; returns its contact, if it has sent one.
    fn of_foot(
        &mut self,
        index: usize,
        state: &LiveFoot,
        Heard { at, said, .. }: &Heard,
        published: &mut Vec<Published>,
    ) -> Option<RosContact> {
        let made = || Foot::new(state, &self.frame);
        let foot = self.feet.entry(index).or_insert_with(made);
        if foot.node != state.key.node {
            // A foot on a serial line has the name of the line until its id is known.
            *foot = made();
        }
        let mut publish = |topic, message| published.push(Published::new(topic, *at, message));
        let (mut sent, mut imu) = (None, None);
        match said {
            Said::Contact(row) => {
                let contact;
                (contact, imu) = foot.contact(row, state);
                sent = Some(contact.clone());
                let probability = RosMessage::probability(&contact);
                let velocity = RosMessage::Velocity(Box::new(foot.velocity(&contact, row)));
                publish(&foot.topics.contact, RosMessage::Contact(contact));
                publish(&foot.topics.velocity, velocity);
                publish(&foot.topics.probability, probability);
                if let Some(load) = row.load {
                    publish(&foot.topics.load, RosMessage::number(load));
                }
            }
            Said::Raw(raw) => imu = foot.raw(raw, state.stamp),
            Said::Load(newtons) => publish(&foot.topics.load, RosMessage::number(*newtons)),
            _ => {}
        }
        if let Some(imu) = imu {
            publish(&foot.topics.imu, RosMessage::Imu(Box::new(imu)));
        }
        published.extend(foot.diagnostics(state, *at));
        sent
    }

    /// Returns the messages due at the end of reception: all feet are silent.
    pub fn end(&mut self, session: &Session) -> Vec<Published> {
        let listening = session.listening();
        let all_feet = self.all_feet.as_mut();
        let due = all_feet.map(|feet| feet.end(listening.now()));
        let mut published = due.unwrap_or_default();
        published.extend(self.silent(session, u64::MAX, listening.now()));
        published
    }

    /// Returns the messages of feet silent at `listened_us`, which are due at once and then once a second.
    fn silent(&mut self, session: &Session, listened_us: u64, at: Timestamp) -> Vec<Published> {
        let mut published = Vec::new();
        let feet = self.feet.iter_mut();
        let feet = feet.map(|(index, foot)| (&session.feet()[*index], foot));
        let silent = feet.filter(|(state, _)| state.has_fallen_silent(listened_us));
        let mut silent: Vec<_> = silent.collect();
        silent.sort_by_key(|(state, _)| (&state.key, &state.name));
        for (state, foot) in silent {
            if !foot.is_silent {
                foot.is_silent = true;
                let nothing = RosMessage::number(0.0);
                published.push(Published::new(&foot.topics.probability, at, nothing));
            }
            published.extend(foot.diagnostics(state, at));
        }
        published
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use feet::decode::{ContactRow, Feet};
    use feet::feed::Fed;
    use feet::session::SEVERAL_BOARDS;
    use feet::{Arrival, Feed};
    use wire::{CanFrame, NodeId};

    use super::*;
    use crate::ros::foot::SILENT;
    use crate::ros::message::Level;
    use crate::ros::topics::FRAME;

    /// Messages of a robot with two feet, of which the right one has the id `right`.
    fn messages(right: NodeId) -> Vec<Published> {
        let source = "demo:feet=2,speed=max,seconds=3".parse();
        let feed = Feed::open(source.expect("a source"));
        let (mut session, mut bridge) = (Session::new(Feet::default()), Bridge::new(FRAME, &[]));
        let mut published = Vec::new();
        loop {
            let mut fed = feed.next(Duration::from_secs(600)).expect("it ends");
            if let Fed::Arrived((_, Arrival::Frame { frame, .. })) = &mut fed {
                let own = u16::from(wire::Foot::Right.default_node_id().get());
                if frame.id() & 0x7F == own {
                    let id = frame.id() - own + u16::from(right.get());
                    *frame = CanFrame::new(id, frame.data()).expect("a frame");
                }
            }
            session.take(fed);
            while let Some(update) = session.next_update() {
                if let Update::Line(Fed::Ended(_)) = update {
                    return published;
                }
                published.extend(bridge.messages(&session, &update));
            }
        }
    }

    fn contacts(published: &[Published]) -> impl Iterator<Item = &RosContact> {
        published.iter().filter_map(|published| match &published.message {
            RosMessage::Contact(contact) => Some(contact),
            _ => None,
        })
    }

    /// Returns for each diagnostic message whether it reports several boards.
    fn diagnoses(published: &[Published]) -> Vec<bool> {
        let of = |published: &Published| match &published.message {
            RosMessage::Diagnostics(array) => {
                let status = array.status.first()?;
                let says = status.message.contains(SEVERAL_BOARDS);
                assert_eq!(says, matches!(status.level, Level::Error));
                Some(says)
            }
            _ => None,
        };
        published.iter().filter_map(of).collect()
    }

    #[test]
    fn boards_sharing_an_id_become_invalid_within_100_ms() {
        let published = messages(wire::Foot::Left.default_node_id());
        let all: Vec<_> = contacts(&published).collect();
        assert!(all.len() > 5000, "{}", all.len());
        for contact in &all[200..] {
            assert!(!contact.valid && !contact.decision, "{contact:?}");
            assert_eq!((contact.p_stable, contact.state), (0.0, 0));
        }
        let diagnoses = diagnoses(&published);
        assert_eq!(diagnoses.first(), Some(&false));
        assert!(diagnoses[1..].iter().all(|several| *several), "{diagnoses:?}");
    }

    #[test]
    fn probability_is_0_for_invalid_contacts() {
        let published = messages(wire::Foot::Right.default_node_id());
        let numbers = published.iter().filter_map(|published| match published.message {
            RosMessage::Number(number) if published.topic.ends_with("probability") => Some(number),
            _ => None,
        });
        let mut doubtful = 0;
        for (contact, number) in contacts(&published).zip(numbers) {
            if contact.valid {
                assert_eq!(number, f64::from(contact.p_stable));
            } else {
                doubtful += usize::from(contact.p_stable > 0.0);
                assert_eq!(number, 0.0, "{contact:?}");
            }
        }
        assert!(doubtful > 100, "{doubtful}");
    }

    #[test]
    fn velocity_is_uninformative_for_invalid_contacts() {
        let published = messages(wire::Foot::Right.default_node_id());
        let velocities = published.iter().filter_map(|published| match &published.message {
            RosMessage::Velocity(velocity) => Some(velocity),
            _ => None,
        });
        let mut precise = 0;
        for (contact, velocity) in contacts(&published).zip(velocities) {
            let variance = velocity.covariance[0][0];
            assert_eq!(velocity.twist, [0.0; 6]);
            assert!(variance > 0.0 && variance <= 1.0e4, "{variance}");
            if contact.valid {
                precise += usize::from(variance < 0.1 * 0.1);
            } else {
                assert_eq!(variance, 1.0e4, "{contact:?}");
            }
        }
        assert!(precise > 1000, "{precise}");
    }

    #[test]
    fn boards_with_different_ids_stay_valid() {
        let published = messages(wire::Foot::Right.default_node_id());
        assert!(contacts(&published).any(|contact| contact.valid && contact.p_stable > 0.5));
        assert!(!diagnoses(&published).contains(&true));
    }

    /// Formats the messages published after the last contact of a foot.
    fn last_words(published: &[Published]) -> Vec<String> {
        let words = published.iter().map(|published| match &published.message {
            RosMessage::Number(number) => format!("{} {number}", published.topic),
            RosMessage::Diagnostics(array) => array.status[0].message.clone(),
            RosMessage::Champ(champ) => format!("{:?}", champ.stances),
            other => panic!("{other:?}"),
        });
        words.collect()
    }

    #[test]
    fn silent_foot_is_reported_once_a_second_with_probability_0() {
        let mut session = Session::new(Feet::default());
        let mut bridge = Bridge::new(FRAME, &[Compat::Champ]);
        let mut next = |session: &mut Session| -> Vec<Published> {
            let updates = std::iter::from_fn(|| {
                let update = session.next_update()?;
                Some(bridge.messages(session, &update))
            });
            updates.flatten().collect()
        };
        let contact = |session: &mut Session, ms: u64| {
            let at = Timestamp::from_micros(1000 * ms);
            let row =
                ContactRow { timestamp: at, foot: Some("FL".into()), ..ContactRow::default() };
            session.take(Fed::Arrived((at, Arrival::Estimate(Box::new(row)))));
        };
        for ms in 0..100 {
            contact(&mut session, ms);
            next(&mut session);
        }
        let mut idle = |from_ms: u64, to_ms: u64| -> Vec<(u64, String)> {
            let times = (from_ms..to_ms).step_by(20);
            let words = times.flat_map(|ms| {
                session.idle(Duration::from_millis(ms - 99));
                last_words(&next(&mut session)).into_iter().map(move |words| (ms, words))
            });
            words.collect()
        };
        let none_stands = "[false, false, false, false]";
        let all = idle(110, 2000);
        let of_all = all.iter().filter(|(_, words)| words == none_stands);
        assert_eq!(of_all.count(), 95);
        let rest: Vec<_> = all.iter().filter(|(_, words)| words != none_stands).collect();
        let number = "/footfall/FL/contact/probability 0".to_owned();
        let expected = [(610, number), (610, SILENT.to_owned()), (1610, SILENT.to_owned())];
        assert!(rest.iter().copied().eq(&expected), "{rest:?}");
        contact(&mut session, 2000);
        let back = next(&mut session);
        let said = back.iter().filter_map(|published| match &published.message {
            RosMessage::Diagnostics(array) => Some(array.status[0].message.as_str()),
            _ => None,
        });
        assert!(said.eq(["no fault"]));
        let last = last_words(&bridge.end(&session));
        assert_eq!(last.len(), 3, "{last:?}");
        assert_eq!((last[0].as_str(), last[2].as_str()), (none_stands, SILENT));
    }
}
