//! Conversion of a foot's data to messages on topics.
//!
//! | topic | message | from |
//! |---|---|---|
//! | `/footfall/FL/contact` | `footfall_msgs/msg/Contact` | each contact |
//! | `/footfall/FL/contact/probability` | `std_msgs/msg/Float64`: P alone | each contact; 0 if invalid, because a number cannot express validity |
//! | `/footfall/FL/velocity` | `geometry_msgs/msg/TwistWithCovarianceStamped` | each contact: zero, with the default variance of the [zero-velocity measurement](estimator_core::velocity); 10⁴ (m/s)² if there is no information |
//! | `/footfall/FL/load` | `std_msgs/msg/Float64`, N | each load that the robot sends to the foot over CAN |
//! | `/footfall/FL/imu` | `sensor_msgs/msg/Imu` | each raw sample of a serial line, and each sample of a recording with gravity as it was recorded; on CAN each acceleration, with the newest orientation and rate, which are up to 20 ms older: for display, not for integration |
//! | `/diagnostics` | `diagnostic_msgs/msg/DiagnosticArray` | health and faults, at once on a change, otherwise once a second |
//!
//! Stamps are the times of the samples on the receiver's clock: by numbered SYNCs if the foot has reported
//! one, otherwise by the least delay of the last seconds ([`FootClock`](live::clock::FootClock)).
//!
//! A foot without a contact for half a second is silent: its probability is 0, and diagnostics report it.
//! Contacts of several boards with the same id ([`NewestSecond`](live::NewestSecond)) carry no information:
//! they are invalid, their probability is 0, no IMU is published, and diagnostics report the cause.

use std::collections::BTreeMap;
use std::sync::Arc;

use decode::live::{FootKey, Heard, Said};
use estimator_core::Timestamp;
use live::newest_second::SILENT_US;
use wire::{Counter, Emergency};

use crate::compat::{AllFeet, Compat};
use crate::foot::Foot;
use crate::listening::Listening;
use crate::message::{Float64, KeyValue, Message};
use crate::topics::DIAGNOSTICS;

pub use crate::foot::SEVERAL_BOARDS;

/// A message with its topic and time of reception.
#[derive(Clone, Debug, PartialEq)]
pub struct Published {
    /// The topic.
    pub topic: Arc<str>,
    /// Time of reception of its data.
    pub at: Timestamp,
    /// The message.
    pub message: Message,
}

/// State of all feet.
#[derive(Debug)]
pub struct Bridge {
    frame: String,
    feet: BTreeMap<FootKey, Foot>,
    /// Names of feet on serial lines, by line, from their first health message on.
    lines: BTreeMap<Arc<str>, FootKey>,
    listening: Listening,
    /// Combined messages of all feet for other programs.
    all_feet: Option<AllFeet>,
}

impl Default for Bridge {
    fn default() -> Self {
        Self::new(crate::topics::FRAME)
    }
}

impl Bridge {
    /// Creates a bridge. `frame` is the pattern of frame names; `{foot}` is replaced by the foot's name.
    #[must_use]
    pub fn new(frame: &str) -> Self {
        Self {
            frame: frame.to_owned(),
            feet: BTreeMap::new(),
            lines: BTreeMap::new(),
            listening: Listening::default(),
            all_feet: None,
        }
    }

    /// Enables combined messages of all feet for other programs.
    #[must_use]
    pub fn with_compat(mut self, compat: Compat) -> Self {
        self.all_feet = Some(AllFeet::new(compat));
        self
    }

    /// Returns the messages for received data; `name` is the name of the foot, if any.
    pub fn messages(&mut self, heard: &Heard, name: Option<&str>) -> Vec<Published> {
        let at = heard.at;
        let listened_us = self.listening.arrive(at);
        let foot = self.foot(heard, name);
        let mut of_all = None;
        let publish = |topic: &Arc<str>, message| Published {
            topic: Arc::clone(topic),
            at,
            message,
        };
        let mut published = Vec::new();
        let before = (foot.condition(), foot.diagnosed_us.is_some());
        match &heard.said {
            Said::Contact(row) => {
                let (contact, imu) = foot.contact(row, at);
                (foot.contact_us, foot.is_silent) = (Some(listened_us), false);
                of_all = Some(contact.clone());
                let data = if contact.valid {
                    f64::from(contact.p_stable)
                } else {
                    0.0
                };
                let velocity = Message::Velocity(Box::new(foot.velocity(&contact, row.timestamp)));
                published.push(publish(&foot.topics.contact, Message::Contact(contact)));
                published.push(publish(&foot.topics.velocity, velocity));
                let probability = Message::Number(Float64 { data });
                published.push(publish(&foot.topics.probability, probability));
                published
                    .extend(imu.map(|imu| publish(&foot.topics.imu, Message::Imu(Box::new(imu)))));
            }
            Said::Raw(raw) => {
                let imu = foot.raw(raw, at);
                published
                    .extend(imu.map(|imu| publish(&foot.topics.imu, Message::Imu(Box::new(imu)))));
            }
            Said::Board(board) => {
                foot.faults = board.faults;
                let count = |counter: Counter| KeyValue {
                    key: counter.name().to_owned(),
                    value: board.counters.get(counter).to_string(),
                };
                foot.counts = Counter::ALL.into_iter().map(count).collect();
            }
            Said::Health(health) => {
                foot.flags = health.flags;
                foot.counts = vec![KeyValue {
                    key: "dropped, modulo 256".to_owned(),
                    value: health.dropped.to_string(),
                }];
            }
            Said::Emergency(Emergency {
                code,
                fault: Some(fault),
                ..
            }) => {
                foot.faults = if *code == 0 {
                    foot.faults.without(*fault)
                } else {
                    foot.faults.with(*fault)
                };
            }
            Said::Load(newtons) => {
                let data = f64::from(*newtons);
                published.push(publish(
                    &foot.topics.load,
                    Message::Number(Float64 { data }),
                ));
            }
            Said::BootUp(faults) => {
                foot.faults = *faults;
                foot.second.start_again();
            }
            _ => {}
        }
        if foot.is_due(at) || before != (foot.condition(), true) {
            let diagnostics = Message::Diagnostics(foot.diagnostics(at));
            published.push(publish(&DIAGNOSTICS.into(), diagnostics));
        }
        if let Some(all_feet) = &mut self.all_feet {
            published.extend(match of_all {
                Some(contact) => all_feet.take(&contact, at),
                None => all_feet.hear(at),
            });
        }
        self.fall_silent(listened_us, at, &mut published);
        published
    }

    /// Returns the messages due if nothing was received until `now`, such as those of silent feet.
    pub fn idle(&mut self, now: Timestamp) -> Vec<Published> {
        let listened_us = self.listening.idle(now);
        let all_feet = self.all_feet.as_mut();
        let mut published: Vec<_> = all_feet
            .and_then(|feet| feet.idle(now))
            .into_iter()
            .collect();
        self.fall_silent(listened_us, now, &mut published);
        published
    }

    /// Returns the messages due at the end of reception: all feet are silent.
    pub fn end(&mut self) -> Vec<Published> {
        let all_feet = self.all_feet.as_mut();
        let mut published: Vec<_> = all_feet.and_then(AllFeet::end).into_iter().collect();
        self.fall_silent(u64::MAX, self.listening.now(), &mut published);
        published
    }

    /// Adds the messages of feet silent at `listened_us`, at once and then once a second.
    fn fall_silent(&mut self, listened_us: u64, at: Timestamp, published: &mut Vec<Published>) {
        let publish = |topic: &Arc<str>, message| Published {
            topic: Arc::clone(topic),
            at,
            message,
        };
        for foot in self.feet.values_mut() {
            if foot
                .contact_us
                .is_none_or(|us| listened_us - us < SILENT_US)
            {
                continue;
            }
            if !foot.is_silent {
                foot.is_silent = true;
                foot.diagnosed_us = None;
                let nothing = Message::Number(Float64 { data: 0.0 });
                published.push(publish(&foot.topics.probability, nothing));
            }
            if foot.is_due(at) {
                let diagnostics = Message::Diagnostics(foot.diagnostics(at));
                published.push(publish(&DIAGNOSTICS.into(), diagnostics));
            }
        }
    }

    /// Names of feet whose newest contacts come from several boards with the same id.
    pub fn shared_ids(&self) -> impl Iterator<Item = &str> {
        let shared = self.feet.values().filter(|foot| foot.is_shared);
        shared.map(|foot| foot.name.as_str())
    }

    /// Returns the foot that sent the data. On a serial line the foot is unknown before its first health
    /// message; until then it has the name of the line.
    fn foot(&mut self, heard: &Heard, name: Option<&str>) -> &mut Foot {
        let key = &heard.foot;
        let own = match &heard.said {
            Said::Contact(row) => row.foot.as_deref(),
            _ => None,
        };
        let name = own.or(name);
        if key.node.is_some()
            && let Some(before) = self.lines.remove(&key.line)
        {
            // Keeps its state under the name of the line, except for the topics.
            if let Some(known) = self.feet.remove(&before) {
                let foot = Foot::new(name.unwrap_or(&key.line), &self.frame);
                let foot = Foot {
                    clock: known.clock,
                    faults: known.faults,
                    ..foot
                };
                self.feet.insert(key.clone(), foot);
            }
        }
        if key.node.is_none() && own.is_none() {
            self.lines.insert(Arc::clone(&key.line), key.clone());
        }
        // Feet of one recording share a line and have no id.
        let key = FootKey {
            line: match (key.node, own) {
                (None, Some(own)) => format!("{} {own}", key.line).into(),
                _ => Arc::clone(&key.line),
            },
            node: key.node,
        };
        let fallback = || match key.node {
            Some(node) => format!("node_{node}"),
            None => key.line.to_string(),
        };
        let frame = &self.frame;
        let made = || Foot::new(&name.map_or_else(fallback, str::to_owned), frame);
        self.feet.entry(key.clone()).or_insert_with(made)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use decode::Row;
    use decode::live::Listener;
    use live::feed::Fed;
    use live::{Arrival, Feed};
    use wire::{CanFrame, NodeId};

    use super::*;
    use crate::foot::SILENT;
    use crate::message::{Contact, Level, Twist};

    /// Messages of a robot with two feet, of which the right one has the id `right`.
    fn messages(right: NodeId) -> Vec<Published> {
        let source = "demo:feet=2,speed=max,seconds=3".parse();
        let feed = Feed::open(source.expect("a source"));
        let (mut listener, mut bridge) = (Listener::default(), Bridge::default());
        let mut published = Vec::new();
        loop {
            match feed.next(Duration::from_secs(60)).expect("it ends") {
                Fed::Arrived((at, Arrival::Frame { interface, frame })) => {
                    let own = u16::from(wire::Foot::Right.default_node_id().get());
                    let (id, data) = (frame.id(), frame.data());
                    let is_right = id & 0x7F == own;
                    let id = if is_right {
                        id - own + u16::from(right.get())
                    } else {
                        id
                    };
                    let frame = CanFrame::new(id, data).expect("a frame");
                    listener.frame(&interface, &frame, at);
                }
                Fed::Ended(_) => return published,
                _ => {}
            }
            while let Some(heard) = listener.next_heard() {
                let name = listener.name(&heard.foot);
                published.extend(bridge.messages(&heard, name.as_deref()));
            }
        }
    }

    fn contacts(published: &[Published]) -> impl Iterator<Item = &Contact> {
        published
            .iter()
            .filter_map(|published| match &published.message {
                Message::Contact(contact) => Some(contact),
                _ => None,
            })
    }

    /// Returns for each diagnostic message whether it reports several boards.
    fn diagnoses(published: &[Published]) -> Vec<bool> {
        let of = |published: &Published| match &published.message {
            Message::Diagnostics(array) => {
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
        assert!(
            diagnoses[1..].iter().all(|several| *several),
            "{diagnoses:?}"
        );
    }

    #[test]
    fn probability_is_0_for_invalid_contacts() {
        let published = messages(wire::Foot::Right.default_node_id());
        let numbers = published
            .iter()
            .filter_map(|published| match published.message {
                Message::Number(Float64 { data }) if published.topic.ends_with("probability") => {
                    Some(data)
                }
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
        let velocities = published
            .iter()
            .filter_map(|published| match &published.message {
                Message::Velocity(velocity) => Some(&velocity.twist),
                _ => None,
            });
        let mut precise = 0;
        for (contact, velocity) in contacts(&published).zip(velocities) {
            let variance = velocity.covariance[0][0];
            assert_eq!(velocity.twist, Twist::default());
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
            Message::Number(number) => format!("{} {}", published.topic, number.data),
            Message::Diagnostics(array) => array.status[0].message.clone(),
            Message::Champ(champ) => format!("{:?}", champ.contacts),
            other => panic!("{other:?}"),
        });
        words.collect()
    }

    #[test]
    fn silent_foot_is_reported_once_a_second_with_probability_0() {
        let mut bridge = Bridge::default().with_compat(Compat::Champ);
        let contact = |bridge: &mut Bridge, ms: u64| {
            let at = Timestamp::from_micros(1000 * ms);
            let row = Row {
                timestamp: at,
                foot: Some("FL".into()),
                ..Row::default()
            };
            let said = Said::Contact(Box::new(row));
            let foot = FootKey::default();
            bridge.messages(&Heard { at, foot, said }, None)
        };
        (0..100).for_each(|ms| drop(contact(&mut bridge, ms)));
        let mut idle = |from_ms: u64, to_ms: u64| -> Vec<(u64, String)> {
            let times = (from_ms..to_ms).step_by(20);
            let words = times.flat_map(|ms| {
                let published = bridge.idle(Timestamp::from_micros(1000 * ms));
                last_words(&published)
                    .into_iter()
                    .map(move |words| (ms, words))
            });
            words.collect()
        };
        let none_stands = "[false, false, false, false]";
        let all = idle(110, 2000);
        let of_all = all.iter().filter(|(_, words)| words == none_stands);
        assert_eq!(of_all.count(), 95);
        let rest: Vec<_> = all
            .iter()
            .filter(|(_, words)| words != none_stands)
            .collect();
        let number = "/footfall/FL/contact/probability 0".to_owned();
        let expected = [
            (610, number),
            (610, SILENT.to_owned()),
            (1610, SILENT.to_owned()),
        ];
        assert!(rest.iter().copied().eq(&expected), "{rest:?}");
        let back = contact(&mut bridge, 2000);
        let said = back
            .iter()
            .filter_map(|published| match &published.message {
                Message::Diagnostics(array) => Some(array.status[0].message.as_str()),
                _ => None,
            });
        assert!(said.eq(["no fault"]));
        let last = last_words(&bridge.end());
        assert_eq!(last.len(), 3, "{last:?}");
        assert_eq!((last[0].as_str(), last[2].as_str()), (none_stands, SILENT));
    }
}
