//! Routes to subscribers on this machine, found again where `rustdds` missed them.
//!
//! `rustdds` sends to a loopback address only after it has received a datagram of the same participant from that address,
//! and it takes the participant from the header of the datagram. `CycloneDDS` uses one socket for all participants of a
//! process, and puts messages of several participants into one datagram, whose header names only one of them. So
//! `rustdds` may match a subscriber before it has seen a datagram of the subscriber's participant, and then it never sends
//! to the subscriber. A new writer of the topic makes `rustdds` choose the routes to all subscribers of the topic again,
//! so a second writer is created for a second.

use std::collections::{BTreeMap, BTreeSet};
use std::net::SocketAddr;

use rustdds::no_key::DataWriter;
use rustdds::{DomainParticipant, GUID, QosPolicies, TopicKind};

use crate::ros::subscriber::{AnyMessage, Message};

/// Number of times that the route to a subscriber is chosen again, once a second. A reliable subscriber of
/// `CycloneDDS` sends a datagram of its own within the first second.
const TIMES: u8 = 5;

/// Subscribers that share a socket of this machine with other participants.
#[derive(Default)]
pub(super) struct Routes {
    /// How often the route of each was chosen again.
    chosen: BTreeMap<GUID, u8>,
    /// Writers that exist until the next look.
    writers: Vec<DataWriter<Message, AnyMessage>>,
}

impl Routes {
    /// Chooses the routes of subscribers that share a socket again if `qos_of` knows the topic, by its name in ROS.
    /// Call it once a second.
    pub(super) fn renew(
        &mut self,
        participant: &DomainParticipant,
        qos_of: impl Fn(&str) -> Option<QosPolicies>,
    ) {
        self.writers.clear();
        let readers = participant.discovered_readers();
        let writers = participant.discovered_writers();
        let of_readers = readers.iter().map(|reader| {
            let proxy = &reader.reader_proxy;
            (proxy.remote_reader_guid, &proxy.unicast_locator_list)
        });
        let of_writers = writers.iter().map(|writer| {
            let proxy = &writer.writer_proxy;
            (proxy.remote_writer_guid, &proxy.unicast_locator_list)
        });
        let endpoints = of_readers.chain(of_writers).flat_map(|(guid, locators)| {
            locators.iter().map(move |locator| (SocketAddr::from(*locator), guid.prefix))
        });
        let shared = shared_local(endpoints);
        self.forget_all_but(readers.iter().map(|reader| reader.reader_proxy.remote_reader_guid));
        let mut renewed = BTreeSet::new();
        for reader in &readers {
            let locators = &reader.reader_proxy.unicast_locator_list;
            let mut addresses = locators.iter().map(|locator| SocketAddr::from(*locator));
            if !addresses.any(|address| shared.contains(&address)) {
                continue;
            }
            let topic = reader.subscription_topic_data.topic_name();
            let Some(qos) = topic.strip_prefix("rt").and_then(&qos_of) else { continue };
            if !self.choose(reader.reader_proxy.remote_reader_guid) {
                continue;
            }
            if renewed.insert(topic.clone()) {
                let dds_type = reader.subscription_topic_data.type_name();
                self.writers.extend(writer(participant, topic, dds_type, &qos));
            }
        }
    }

    /// Returns whether the route to a subscriber is to be chosen again, and counts it.
    fn choose(&mut self, reader: GUID) -> bool {
        let times = self.chosen.entry(reader).or_default();
        let is_due = *times < TIMES;
        *times += u8::from(is_due);
        is_due
    }

    /// Forgets the subscribers that have left, because a node may outlive thousands of them.
    fn forget_all_but(&mut self, present: impl Iterator<Item = GUID>) {
        let present: BTreeSet<GUID> = present.collect();
        self.chosen.retain(|reader, _| present.contains(reader));
    }
}

/// Returns the addresses of the loopback interface that several participants have.
fn shared_local<P: PartialEq>(
    endpoints: impl Iterator<Item = (SocketAddr, P)>,
) -> BTreeSet<SocketAddr> {
    let mut owners = BTreeMap::new();
    let mut shared = BTreeSet::new();
    for (address, participant) in endpoints.filter(|(address, _)| address.ip().is_loopback()) {
        let is_other = owners.get(&address).is_some_and(|owner| *owner != participant);
        if is_other {
            shared.insert(address);
        }
        owners.entry(address).or_insert(participant);
    }
    shared
}

/// Creates a writer. Without it, the routes stay as they are.
fn writer(
    participant: &DomainParticipant,
    topic: &str,
    dds_type: &str,
    qos: &QosPolicies,
) -> Option<DataWriter<Message, AnyMessage>> {
    let topic =
        participant.create_topic(topic.to_owned(), dds_type.to_owned(), qos, TopicKind::NoKey);
    let publisher = participant.create_publisher(qos).ok()?;
    publisher.create_datawriter_no_key(&topic.ok()?, Some(qos.clone())).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subscribers_that_have_left_are_forgotten() {
        let reader = |number: u8| GUID::from_bytes([number; 16]);
        let mut routes = Routes::default();
        for number in 0..100 {
            assert!(routes.choose(reader(number)));
            routes.forget_all_but([reader(0), reader(number)].into_iter());
        }
        assert!(routes.chosen.keys().copied().eq([reader(0), reader(99)]));
        let times = (0..10).filter(|_| routes.choose(reader(0))).count();
        assert_eq!(times, usize::from(TIMES) - 1);
    }

    #[test]
    fn only_sockets_of_several_participants_are_shared() {
        let address = |text: &str| -> SocketAddr { text.parse().expect("an address") };
        let endpoints = [
            ("127.0.0.1:7411", 1),
            ("127.0.0.1:7411", 1),
            ("127.0.0.1:7413", 2),
            ("127.0.0.1:7413", 3),
            ("192.0.2.1:7413", 4),
            ("192.0.2.1:7413", 5),
        ];
        let shared = shared_local(endpoints.map(|(text, id)| (address(text), id)).into_iter());
        assert_eq!(shared, BTreeSet::from([address("127.0.0.1:7413")]));
    }
}
