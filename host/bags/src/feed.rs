//! Converts the messages of one IMU into the rows of a recording.
//!
//! `sensor_msgs/msg/Imu` has no field for validity and label. These are on their own topics. Their messages precede
//! their sample and have its time.
//!
//! | topic | message | topic of the samples |
//! |---|---|---|
//! | `/imu/fl/validity` | `std_msgs/msg/String`, a name of a validity | `/imu/fl` |
//! | `/imu/fl/label` | `std_msgs/msg/Bool`, true for stable | `/imu/fl` |
//!
//! `footfall convert` writes them. Topics of these names with other content are ignored.

use std::collections::HashMap;

use estimator_core::{Axis, Gravity, Load, Timestamp, Validity};

use crate::loads::LoadSeries;
use crate::messages::{Channel, decode, micros};
use options::InputOptions;
use options::hint::Notice;
use samples::ros::Imu;
use samples::{Label, RecordedSample, imu_sample, validity_of_name};
use stored::error::{ImuTopic, InputError, Place, Problem};
use stored::{About, OLDEST_LOAD_US, Rows, Stored};

/// Deviation from a constant delay up to which the time of writing of a sample is not kept, µs.
const FOLLOWS_US: u64 = 1_000;

/// Samples of an IMU: all samples of a topic, or its samples with the same frame.
pub(super) struct Feed {
    pub(super) topic: String,
    /// `None` before the first message that is decoded.
    pub(super) frame: Option<String>,
    /// Whether its topic has messages of several frames.
    pub(super) is_shared: bool,
    /// Names of the axes in messages of another type, if they were found by their names.
    pub(super) found_axes: Option<[String; 6]>,
    pub(super) messages: u64,
    /// Log times of the first and the last message, µs.
    log_us: Option<(i64, i64)>,
    rows: Rows,
    /// Whether times are the stamps of messages. Otherwise they are the times at which messages were written.
    has_stamps: bool,
    /// Times of some samples, and the times at which they were written, µs.
    anchors_us: Vec<(i64, i64)>,
    /// Error in the log times, held back in case they are not needed.
    log_failed: Option<InputError>,
    without: Lacking,
}

/// Number of messages that lack a field.
#[derive(Clone, Copy, Debug, Default)]
struct Lacking {
    stamp: u64,
    accelerations: u64,
    rates: u64,
    /// No load is new enough.
    load: u64,
    /// The load is not a number.
    number: u64,
}

impl Feed {
    pub(super) fn new(topic: String, input_options: &InputOptions) -> Self {
        Self {
            topic,
            frame: None,
            is_shared: false,
            found_axes: None,
            messages: 0,
            log_us: None,
            rows: Rows::new(input_options.table.times),
            has_stamps: false,
            anchors_us: Vec::new(),
            log_failed: None,
            without: Lacking::default(),
        }
    }

    /// Counts a message without decoding it.
    pub(super) fn count(&mut self, log_ns: i64) {
        self.messages += 1;
        let now_us = micros(log_ns);
        let (first, last) = self.log_us.unwrap_or((now_us, now_us));
        self.log_us = Some((first.min(now_us), last.max(now_us)));
    }

    /// Processes a message that was counted, with the data about it on other topics.
    pub(super) fn process(
        &mut self,
        SidecarData { log_ns, known: sidecar }: SidecarData,
        imu: &Imu,
        load: Option<&LoadSeries>,
        input_options: &InputOptions,
        file: &str,
    ) -> Result<(), InputError> {
        let log_us = micros(log_ns);
        let stamp_us = imu.header.stamp.micros();
        if stamp_us.is_none() && self.has_stamps {
            self.without.stamp += 1;
            return Ok(());
        }
        if stamp_us.is_some() && !self.has_stamps {
            self.has_stamps = true;
            // Both clocks begin at 0 if a recording without a date was played, so the first stamp is a valid time.
            let began_at_0 = self.messages == 2 && self.log_us.is_some_and(|(first, _)| first == 0);
            if !began_at_0 {
                // Earlier messages had no stamps, so their times are on another clock.
                self.without = Lacking { stamp: self.messages - 1, ..Lacking::default() };
                self.rows = Rows::new(input_options.table.times);
                self.anchors_us.clear();
                self.log_failed = None;
            }
        }
        let time_us = stamp_us.unwrap_or(log_us);
        let load = match load.map(|series| series.at(stamp_us, log_us)) {
            Some(Some(load)) if load.is_finite() => Some(Load(load)),
            Some(Some(_)) => {
                self.without.number += 1;
                None
            }
            Some(None) => {
                self.without.load += 1;
                None
            }
            None => None,
        };
        self.without.accelerations += u64::from(!imu.has_accelerations());
        self.without.rates += u64::from(!imu.has_rates());
        let [ax, ay, az] = known(imu.linear_acceleration, imu.has_accelerations());
        let [wx, wy, wz] = known(imu.angular_velocity, imu.has_rates());
        let readings = input_options.table.to_si([ax, ay, az, wx, wy, wz]);
        let sample = RecordedSample {
            imu: imu_sample(
                Timestamp::default(),
                readings,
                sidecar.validity.unwrap_or(Validity::Valid),
            ),
            load,
            label: sidecar.label,
        };
        if self.log_failed.is_some() {
            return Ok(());
        }
        self.anchor(time_us, log_us);
        let pushed = self.rows.push(Some(time_us), sample);
        let pushed = pushed.map_err(|refused| refused.into_error(&self.place(file)));
        if self.has_stamps {
            return pushed;
        }
        self.log_failed = pushed.err();
        Ok(())
    }

    /// Keeps the time at which a sample was written, if it does not follow from the time of an earlier one.
    fn anchor(&mut self, time_us: i64, log_us: i64) {
        while self.anchors_us.last().is_some_and(|(before, _)| *before >= time_us) {
            self.anchors_us.pop();
        }
        let follows = self.anchors_us.last().is_some_and(|(before, written)| {
            time_us.saturating_sub(*before).abs_diff(log_us.saturating_sub(*written)) <= FOLLOWS_US
        });
        if !follows {
            self.anchors_us.push((time_us, log_us));
        }
    }

    /// Properties of the topic.
    pub(super) fn about(&self) -> ImuTopic {
        let rate = self.log_us.and_then(|(first, last)| {
            let span_us = last.abs_diff(first) as f64;
            let periods = self.messages.checked_sub(1).filter(|_| span_us > 0.0)?;
            Some(1.0e6 * periods as f64 / span_us)
        });
        ImuTopic {
            name: self.topic.clone(),
            frame: self.shown_frame().map(str::to_owned),
            messages: self.messages,
            rate,
        }
    }

    /// Returns the recording `name` of `foot`.
    pub(super) fn finish(
        self,
        name: String,
        foot: Option<String>,
        load: Option<&LoadSeries>,
        input_options: &InputOptions,
        file: &str,
    ) -> Result<Stored, InputError> {
        let place = self.place(file);
        if let Some(error) = self.log_failed {
            return Err(error);
        }
        let taken = self.messages - self.without.stamp;
        for (without, sensor) in [
            (self.without.accelerations, "linear_acceleration"),
            (self.without.rates, "angular_velocity"),
        ] {
            if without > 0 && without == taken {
                return Err(InputError {
                    file: file.to_owned(),
                    place: Place::Topic(self.topic),
                    problem: Problem::Absent(sensor),
                });
            }
        }
        let notices = self.notices(&place, load);
        let about = About {
            name,
            address: Some(self.address()),
            foot,
            gravity: Gravity::Included,
            load_title: load.map_or_else(|| "load".to_owned(), LoadSeries::title),
            notices: notices.into_iter().map(Notice::from).collect(),
            anchors_us: self.anchors_us,
            ..About::default()
        };
        self.rows.finish(&place, about, input_options)
    }

    fn notices(&self, place: &str, load: Option<&LoadSeries>) -> Vec<String> {
        let without = self.without;
        let mut notices = Vec::new();
        if let Some(names) = &self.found_axes {
            let axes = Axis::ALL.iter().zip(names);
            let found: Vec<_> =
                axes.map(|(axis, name)| format!("{} is {name}", axis.name())).collect();
            notices.push(format!("{place}: {}", found.join(", ")));
        }
        if !self.has_stamps {
            notices.push(format!(
                "{place}: no message has a stamp, so times are those when messages were written"
            ));
        }
        let load = load.map(|series| series.topic.to_string());
        let load = load.unwrap_or_default();
        let newest_ms = OLDEST_LOAD_US / 1000;
        let counted = [
            (without.stamp, "left out, without a stamp".to_owned()),
            (
                without.accelerations,
                "without accelerations, by their covariance: invalid samples".to_owned(),
            ),
            (
                without.rates,
                "without angular rates, by their covariance: invalid samples".to_owned(),
            ),
            (
                without.load,
                format!("without a load: nothing on {load} in the {newest_ms} ms before"),
            ),
            (without.number, format!("without a load: the last value on {load} is not a number")),
        ];
        let counted = counted.into_iter().filter(|(count, _)| *count > 0);
        notices.extend(counted.map(|(count, what)| {
            let noun = if count == 1 { "message" } else { "messages" };
            format!("{place}: {count} {noun} {what}")
        }));
        notices
    }

    fn place(&self, file: &str) -> String {
        let topic = &self.topic;
        match self.shown_frame() {
            Some(frame) => format!("{file}, topic {topic}, frame {frame}"),
            None => format!("{file}, topic {topic}"),
        }
    }

    /// Unique name of the foot: its topic, with the frame if the topic has several.
    pub(super) fn address(&self) -> String {
        match self.shown_frame() {
            Some(frame) => format!("{}/{}", self.topic, frame.trim_matches('/')),
            None => self.topic.clone(),
        }
    }

    /// The frame, if the topic has several.
    fn shown_frame(&self) -> Option<&str> {
        self.frame.as_deref().filter(|_| self.is_shared)
    }
}

/// Three readings, or NaN if they are missing.
fn known(readings: [f64; 3], are_there: bool) -> [f64; 3] {
    if are_there { readings } else { [f64::NAN; 3] }
}

/// Validity and label of a sample, if known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Known {
    pub(super) validity: Option<Validity>,
    pub(super) label: Option<Label>,
}

/// Data about a sample, from other topics.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SidecarData {
    /// Time at which they were written, ns.
    pub(super) log_ns: i64,
    pub(super) known: Known,
}

/// Data about the next sample of each topic.
#[derive(Debug, Default)]
pub(super) struct Sidecar(HashMap<String, SidecarData>);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Validity,
    Label,
}

/// The topic of the samples that a channel describes, and the kind of data in it.
fn about(channel: &Channel) -> Option<(&str, Kind)> {
    let (suffix, kind) = match channel.message.as_str() {
        "std_msgs/msg/String" => ("/validity", Kind::Validity),
        "std_msgs/msg/Bool" => ("/label", Kind::Label),
        _ => return None,
    };
    let topic = channel.topic.strip_suffix(suffix)?;
    (channel.encoding == "cdr").then_some((topic, kind))
}

/// Returns whether a channel describes samples.
pub(super) fn is_sidecar(channel: &Channel) -> bool {
    about(channel).is_some()
}

impl Sidecar {
    /// Processes a message.
    pub(super) fn process(&mut self, channel: &Channel, log_ns: i64, payload: &[u8]) {
        let Some((topic, kind)) = about(channel) else {
            return;
        };
        let data = self.0.entry(topic.to_owned()).or_default();
        if data.log_ns != log_ns {
            *data = SidecarData { log_ns, known: Known::default() };
        }
        match kind {
            Kind::Validity => {
                let text = decode::<String>(payload).ok();
                data.known.validity = text.and_then(|text| validity_of_name(&text));
            }
            Kind::Label => {
                let label = |is_stable| if is_stable { Label::Stable } else { Label::NotStable };
                data.known.label = decode(payload).ok().map(label);
            }
        }
    }

    /// Data about the sample of a topic that was written at this time.
    pub(super) fn of(&mut self, topic: &str, log_ns: i64) -> Known {
        match self.0.remove(topic) {
            Some(data) if data.log_ns == log_ns => data.known,
            _ => Known::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn channel(topic: &str, message: &str) -> Channel {
        Channel {
            topic: topic.to_owned(),
            message: message.to_owned(),
            encoding: "cdr".to_owned(),
            schema: None,
            metadata: BTreeMap::new(),
        }
    }

    #[test]
    fn data_apply_only_to_the_sample_of_their_topic_and_time() {
        let label = channel("/imu/fl/label", "std_msgs/msg/Bool");
        let validity = channel("/imu/fl/validity", "std_msgs/msg/String");
        let stale = [&[0, 1, 0, 0, 6, 0, 0, 0][..], b"stale\0"].concat();
        let mut beside = Sidecar::default();
        beside.process(&label, 5, &[0, 1, 0, 0, 1]);
        beside.process(&validity, 5, &stale);
        assert_eq!(beside.of("/imu/fr", 5), Known::default());
        let both = Known { validity: Some(Validity::Stale), label: Some(Label::Stable) };
        assert_eq!(beside.of("/imu/fl", 5), both);
        assert_eq!(beside.of("/imu/fl", 5), Known::default(), "once");
        beside.process(&label, 6, &[0, 1, 0, 0, 0]);
        assert_eq!(beside.of("/imu/fl", 7), Known::default(), "another time");
        beside.process(&label, 8, &[0, 1, 0, 0, 0]);
        beside.process(&validity, 9, &stale);
        assert_eq!(beside.of("/imu/fl", 9).label, None, "of the sample before");
    }

    #[test]
    fn other_content_under_the_same_name_is_ignored() {
        assert!(!is_sidecar(&channel("/imu/label", "std_msgs/msg/Float64")));
        assert!(!is_sidecar(&channel("/imu", "std_msgs/msg/Bool")));
        let validity = channel("/imu/validity", "std_msgs/msg/String");
        let mut beside = Sidecar::default();
        for payload in [&[0, 1, 0, 0, 3, 0, 0, 0, b'o', b'k', 0][..], &[0, 1], &[]] {
            beside.process(&validity, 1, payload);
            assert_eq!(beside.of("/imu", 1), Known::default());
        }
    }
}
