//! Contacts sent by feet, on topics next to the topics of their samples, as `footfall record` writes them.
//!
//! | topic | message | content |
//! |---|---|---|
//! | `/footfall/FL/contact` | `footfall_msgs/msg/Contact` | probabilities, decision, state, flags |
//! | `/footfall/FL/velocity` | `geometry_msgs/msg/TwistWithCovarianceStamped` | variance of the velocity, for the contact of the same stamp |
//! | `/footfall/FL/imu` | `sensor_msgs/msg/Imu` | samples; their orientation belongs to the contacts up to 25 ms later |

use std::collections::BTreeMap;
use std::io;

use estimator_core::{Decision, Flags, PerAxis, Probabilities, Quaternion};

use crate::messages::{Channel, decode, micros};
use options::hint::Notice;
use samples::phase_of_code;
use samples::ros::{Imu, RosContact, TwistWithCovarianceStamped};
use stored::contacts::{
    Contacts, NO_ORIENTATION, NO_VECTOR, NewestOrientation, SentContact, flags_of_contact,
};

/// Largest deviation of the square of a unit quaternion's length from 1.
const UNIT: f64 = 1.0e-3;

/// Fewest contacts of a recording, because one contact has no rate.
const FEWEST: usize = 2;

/// End of the topic of contacts.
const CONTACT: &str = "/contact";

/// Contacts of all feet of a bag, by the start of their topics, such as `/footfall/FL`.
#[derive(Default)]
pub(super) struct ContactFeeds(BTreeMap<String, ContactFeed>);

/// Contacts of a foot while they are read.
#[derive(Default)]
struct ContactFeed {
    contacts: Contacts,
    /// Newest contact, whose velocity and orientation may follow it.
    pending: Option<SentContact>,
    /// Newest standard deviation of the velocity, with its time, µs.
    sigma: Option<(i64, f32)>,
    orientation: NewestOrientation,
    /// Number of contacts left out because they could not be decoded.
    not_decoded: u64,
    /// Number of contacts left out because their time was not after the previous contact's.
    not_after: u64,
}

/// Contacts of a foot, as read from a bag.
pub(super) struct FootContacts {
    /// Topic of the contacts.
    pub(super) topic: String,
    pub(super) contacts: Contacts,
    /// Number of contacts left out because they could not be decoded.
    not_decoded: u64,
    /// Number of contacts left out because their time was not after the previous contact's.
    not_after: u64,
}

impl FootContacts {
    /// Returns sentences on the contacts of `file` that were left out.
    pub(super) fn notices(&self, file: &str) -> Vec<Notice> {
        let counted = [
            (self.not_decoded, "no message of this type"),
            (self.not_after, "not after the one before"),
        ];
        let notice = |(count, what)| {
            let (noun, verb) = if count == 1 { ("contact", "is") } else { ("contacts", "are") };
            let topic = &self.topic;
            format!("{file}, topic {topic}: {count} {noun} left out, which {verb} {what}").into()
        };
        counted.into_iter().filter(|(count, _)| *count > 0).map(notice).collect()
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Contact,
    Velocity,
}

/// Returns whether a channel has contacts of a foot, on any topic.
pub(super) fn is_contact(channel: &Channel) -> bool {
    channel.message == RosContact::TYPE
}

/// Foot that a channel describes, and its kind of data.
fn about(channel: &Channel) -> Option<(&str, Kind)> {
    let (suffix, kind) = match channel.message.as_str() {
        RosContact::TYPE => (CONTACT, Kind::Contact),
        TwistWithCovarianceStamped::TYPE => ("/velocity", Kind::Velocity),
        _ => return None,
    };
    let foot = channel.topic.strip_suffix(suffix)?;
    (channel.encoding == "cdr").then_some((foot, kind))
}

/// Foot whose samples are on a topic.
fn foot_of_imu(topic: &str) -> Option<&str> {
    topic.strip_suffix("/imu")
}

impl ContactFeeds {
    /// Returns whether the messages of a channel are read.
    pub(super) fn is_part(channel: &Channel) -> bool {
        about(channel).is_some()
    }

    /// Processes a message of a channel.
    ///
    /// # Errors
    /// The temporary file cannot be written.
    pub(super) fn process(
        &mut self,
        channel: &Channel,
        log_ns: i64,
        payload: &[u8],
    ) -> io::Result<()> {
        let Some((foot, kind)) = about(channel) else {
            return Ok(());
        };
        let feed = self.0.entry(foot.to_owned()).or_default();
        match kind {
            Kind::Contact => match decode(payload) {
                Ok(contact) => return feed.contact(&contact, log_ns),
                Err(_) => feed.not_decoded += 1,
            },
            Kind::Velocity => {
                if let Ok(velocity) = decode::<TwistWithCovarianceStamped>(payload) {
                    let time_us = velocity.header.stamp.micros();
                    feed.velocity(time_us.unwrap_or(micros(log_ns)), velocity.covariance[0][0]);
                }
            }
        }
        Ok(())
    }

    /// Processes the orientation of a sample of an IMU.
    pub(super) fn process_imu(&mut self, topic: &str, log_ns: i64, imu: &Imu) {
        let foot = foot_of_imu(topic).map(str::to_owned);
        if let (Some(foot), Some([x, y, z, w])) = (foot, imu.orientation()) {
            let is_unit = ((x * x + y * y + z * z + w * w) - 1.0).abs() <= UNIT;
            let time_us = imu.header.stamp.micros().unwrap_or(micros(log_ns));
            let [x, y, z, w] = [x, y, z, w].map(|part| part as f32);
            let feed = self.0.entry(foot).or_default();
            if is_unit {
                feed.orientation.set(time_us, Quaternion { w, x, y, z });
            }
        }
    }

    /// Stores the last contact of each foot after all messages have been processed.
    ///
    /// # Errors
    /// The temporary file cannot be written.
    pub(super) fn finish(&mut self) -> io::Result<()> {
        self.0.values_mut().try_for_each(ContactFeed::flush)
    }

    /// Topics with enough contacts for a recording, and their numbers.
    pub(super) fn topics(&self) -> impl Iterator<Item = (String, usize)> {
        let counted = self.0.iter();
        counted
            .map(|(foot, feed)| (format!("{foot}{CONTACT}"), feed.contacts.count()))
            .filter(|(_, contacts)| *contacts >= FEWEST)
    }

    /// Removes and returns the contacts on a topic. All of them may have been left out. `None` if the foot of the
    /// topic has sent nothing.
    pub(super) fn of_topic(&mut self, topic: &str) -> Option<FootContacts> {
        self.of_foot(topic.strip_suffix(CONTACT)?)
    }

    /// Removes and returns the contacts of the foot whose samples are on a topic. There may be none; `None` if the bag
    /// has nothing of the foot but samples without orientation.
    pub(super) fn of_imu(&mut self, topic: &str) -> Option<FootContacts> {
        self.of_foot(foot_of_imu(topic)?)
    }

    fn of_foot(&mut self, foot: &str) -> Option<FootContacts> {
        let (foot, feed) = self.0.remove_entry(foot)?;
        let ContactFeed { contacts, not_decoded, not_after, .. } = feed;
        Some(FootContacts { topic: foot + CONTACT, contacts, not_decoded, not_after })
    }
}

impl ContactFeed {
    /// Takes a contact, and stores the previous one.
    fn contact(&mut self, contact: &RosContact, log_ns: i64) -> io::Result<()> {
        self.flush()?;
        let stamp_us = contact.header.stamp.micros();
        let mut taken = converted(contact, stamp_us.unwrap_or(micros(log_ns)));
        if let Some((time_us, sigma)) = self.sigma
            && time_us == taken.time_us
        {
            taken.velocity_sigma = sigma;
        }
        self.pending = Some(taken);
        Ok(())
    }

    fn velocity(&mut self, time_us: i64, variance: f64) {
        let sigma = variance.sqrt() as f32;
        match &mut self.pending {
            Some(contact) if contact.time_us == time_us => contact.velocity_sigma = sigma,
            _ => self.sigma = Some((time_us, sigma)),
        }
    }

    /// Stores the pending contact.
    fn flush(&mut self) -> io::Result<()> {
        let Some(mut contact) = self.pending.take() else {
            return Ok(());
        };
        contact.orientation = self.orientation.at(contact.time_us);
        if !self.contacts.push(&contact)? {
            self.not_after += 1;
        }
        Ok(())
    }
}

/// The contact of a message.
fn converted(contact: &RosContact, time_us: i64) -> SentContact {
    SentContact {
        time_us,
        probabilities: Probabilities {
            axes: PerAxis::from_array(contact.p_axes),
            tangential: contact.p_tangential,
            vertical: contact.p_vertical,
            stable: contact.p_stable,
        },
        velocity_sigma: f32::NAN,
        decision: if contact.decision { Decision::Stable } else { Decision::NotStable },
        phase: phase_of_code(contact.state),
        flags: flags_of_contact(Flags::from_bits(contact.flags), contact.valid),
        is_valid: contact.valid,
        orientation: NO_ORIENTATION,
        acceleration: NO_VECTOR,
    }
}
