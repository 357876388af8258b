mod contacts;
mod many_topics;
mod parts;
mod ros1;

use std::collections::BTreeMap;
use std::io::{Cursor, Write};
use std::path::Path;

use ::mcap::records::MessageHeader;
use ::mcap::{Compression, WriteOptions};
use estimator_core::{Load, Validity, Vec3};
use files::compressed::ZSTD;
use samples::RecordedSample;

use options::{BagOptions, Format, InputOptions, LoadTopic, TimeUnit, Times, Topics};
use recordings::Opened;
use stored::Stored;
use stored::error::InputError;

const IMU: &str = "sensor_msgs/msg/Imu";
const FLOAT: &str = "std_msgs/msg/Float64";
const WRENCH: &str = "geometry_msgs/msg/WrenchStamped";

#[derive(Clone, Copy, Debug, PartialEq)]
enum Order {
    Little,
    Big,
}

/// A message in CDR, built field by field.
struct Cdr {
    order: Order,
    bytes: Vec<u8>,
}

impl Cdr {
    fn new(order: Order) -> Self {
        let encoding = if order == Order::Little { 1 } else { 0 };
        Self { order, bytes: vec![0, encoding, 0, 0] }
    }

    fn put<const N: usize>(mut self, little: [u8; N]) -> Self {
        while !(self.bytes.len() - 4).is_multiple_of(N) {
            self.bytes.push(0xAA);
        }
        let mut value = little;
        if self.order == Order::Big {
            value.reverse();
        }
        self.bytes.extend_from_slice(&value);
        self
    }

    fn number(self, value: f64) -> Self {
        self.put(value.to_le_bytes())
    }

    fn numbers(self, values: &[f64]) -> Self {
        values.iter().fold(self, |cdr, value| cdr.number(*value))
    }

    /// Appends a header with this frame.
    fn header(self, stamp_ns: i64, frame: &[u8]) -> Self {
        let sec = (stamp_ns / 1_000_000_000) as i32;
        let nanosec = (stamp_ns % 1_000_000_000) as u32;
        let mut cdr = self
            .put(sec.to_le_bytes())
            .put(nanosec.to_le_bytes())
            .put((frame.len() as u32 + 1).to_le_bytes());
        cdr.bytes.extend_from_slice(frame);
        cdr.bytes.push(0);
        cdr
    }
}

/// An Imu message whose readings are all different.
fn imu(order: Order, stamp_ns: i64, k: u64) -> Vec<u8> {
    imu_with(order, stamp_ns, k, [0.0, 0.0])
}

/// An Imu message with these first covariances of rate and acceleration.
fn imu_with(order: Order, stamp_ns: i64, k: u64, covariance: [f64; 2]) -> Vec<u8> {
    // No text of UTF-8 has these bytes.
    let frame: &[u8] = if order == Order::Little { b"foot" } else { &[0xFF; 2] };
    imu_of(frame, order, stamp_ns, k, covariance)
}

/// An Imu message of this frame.
fn imu_of(frame: &[u8], order: Order, stamp_ns: i64, k: u64, covariance: [f64; 2]) -> Vec<u8> {
    let value = k as f64 / 3.0;
    let of = |first: f64| [first, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    Cdr::new(order)
        .header(stamp_ns, frame)
        .numbers(&[0.5; 4])
        .numbers(&of(-1.0))
        .numbers(&[value, -value, 0.25])
        .numbers(&of(covariance[0]))
        .numbers(&[value + 1.0, 2.0, 9.75])
        .numbers(&of(covariance[1]))
        .bytes
}

fn float(value: f64) -> Vec<u8> {
    Cdr::new(Order::Little).number(value).bytes
}

fn wrench(stamp_ns: i64, force: [f64; 3]) -> Vec<u8> {
    Cdr::new(Order::Little).header(stamp_ns, b"foot").numbers(&force).numbers(&[7.0; 3]).bytes
}

/// A message with its topic, type and log time.
#[derive(Clone)]
struct Message(&'static str, &'static str, i64, Vec<u8>);

/// Storage of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Chunks,
    Zstd,
    Lz4,
    Records,
    Database,
}

const KINDS: [Kind; 5] = [Kind::Chunks, Kind::Zstd, Kind::Lz4, Kind::Records, Kind::Database];

/// Returns a file with these messages, and topics without messages.
fn written(kind: Kind, messages: &[Message], declared: &[(&str, &str)]) -> Vec<u8> {
    let mut topics: Vec<(&str, &str)> = Vec::new();
    let of_messages = messages.iter().map(|message| (message.0, message.1));
    for topic in declared.iter().copied().chain(of_messages) {
        if !topics.contains(&topic) {
            topics.push(topic);
        }
    }
    match kind {
        Kind::Database => database(messages, &topics),
        Kind::Records => mcap(None, false, messages, &topics),
        Kind::Chunks => mcap(None, true, messages, &topics),
        Kind::Zstd => mcap(Some(Compression::Zstd), true, messages, &topics),
        Kind::Lz4 => mcap(Some(Compression::Lz4), true, messages, &topics),
    }
}

fn mcap(
    compression: Option<Compression>,
    chunks: bool,
    messages: &[Message],
    topics: &[(&str, &str)],
) -> Vec<u8> {
    let options = WriteOptions::new()
        .profile("ros2")
        .compression(compression)
        .chunk_size(Some(4096))
        .use_chunks(chunks);
    let mut bytes = Vec::new();
    let mut writer = options.create(Cursor::new(&mut bytes)).unwrap();
    let mut ids = Vec::new();
    for (topic, message) in topics {
        let schema = writer.add_schema(message, "ros2msg", b"fields").unwrap();
        let channel = writer.add_channel(schema, topic, "cdr", &BTreeMap::new());
        ids.push(channel.unwrap());
    }
    for Message(topic, _, log_ns, payload) in messages {
        let at = topics.iter().position(|(name, _)| name == topic).unwrap();
        let header = MessageHeader {
            channel_id: ids[at],
            sequence: 0,
            log_time: *log_ns as u64,
            publish_time: 0,
        };
        writer.write_to_known_channel(&header, payload).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    bytes
}

fn database(messages: &[Message], topics: &[(&str, &str)]) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("walk.db3");
    let mut database = rusqlite::Connection::open(&path).unwrap();
    database
        .execute_batch(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, \
             serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL); \
             CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, \
             timestamp INTEGER NOT NULL, data BLOB NOT NULL); \
             CREATE INDEX timestamp_idx ON messages (timestamp ASC);",
        )
        .unwrap();
    let all = database.transaction().unwrap();
    for (id, (topic, message)) in topics.iter().enumerate() {
        let row = (id as i64 + 1, topic, message);
        all.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')", row).unwrap();
    }
    for Message(topic, _, log_ns, payload) in messages {
        let at = topics.iter().position(|(name, _)| name == topic).unwrap() as i64 + 1;
        let insert = "INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)";
        all.execute(insert, (at, log_ns, payload)).unwrap();
    }
    all.commit().unwrap();
    drop(database);
    std::fs::read(path).unwrap()
}

fn open(bytes: &[u8], input_options: &InputOptions) -> Result<Vec<Stored>, InputError> {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(bytes).unwrap();
    read(file.path(), input_options)
}

fn read(path: &Path, input_options: &InputOptions) -> Result<Vec<Stored>, InputError> {
    Opened::new(path, None)?.store_all(input_options)
}

fn samples(stored: &mut Stored) -> Vec<RecordedSample> {
    stored.samples().unwrap().map(Result::unwrap).collect()
}

/// The part of an error after the name of the file.
fn why<T>(result: Result<T, InputError>) -> String {
    let said = result.err().expect("an error").to_string();
    let name = said.find(".tmp").expect("the name of a file");
    let rest = &said[name..];
    rest[rest.find([' ', ':', ',']).unwrap()..].to_owned()
}

fn topics(names: &[&str]) -> InputOptions {
    let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
    InputOptions {
        bag: BagOptions { topics: Topics::from_names(&names), ..BagOptions::default() },
        ..InputOptions::default()
    }
}

fn with_loads(mut input_options: InputOptions, loads: &[&str]) -> InputOptions {
    input_options.bag.loads = loads.iter().map(|load| load.parse::<LoadTopic>().unwrap()).collect();
    input_options
}

/// Messages at 1 kHz from 1700000000.1 s, alternating between two topics; logged 3 ms later, and every second
/// message before its predecessor.
fn two_feet(order: Order) -> Vec<Message> {
    let mut messages = Vec::new();
    for k in 0..200_u64 {
        let stamp = 1_700_000_000_100_000_000 + 1_000_000 * k as i64;
        let log = stamp + 3_000_000 - 1_500_000 * (k as i64 % 2);
        let [left, right] = ["/imu/fl", "/imu/fr"];
        messages.push(Message(left, IMU, log, imu(order, stamp, k)));
        messages.push(Message(right, IMU, log, imu(order, stamp, 1000 + k)));
    }
    messages
}

fn one_foot(order: Order) -> Vec<Message> {
    let mut messages = two_feet(order);
    messages.retain(|message| message.0 == "/imu/fl");
    messages
}

#[test]
fn foot_is_the_same_in_every_storage_and_byte_order() {
    for order in [Order::Little, Order::Big] {
        for kind in KINDS {
            let bytes = written(kind, &one_foot(order), &[("/chatter", "std_msgs/msg/String")]);
            let mut feet = open(&bytes, &InputOptions::default()).unwrap();
            let [foot] = &mut feet[..] else {
                panic!("one foot");
            };
            assert_eq!(foot.about.foot, None);
            assert_eq!(foot.about.notices, [], "{kind:?}");
            assert_eq!(foot.about.sample_rate, 1000.0);
            assert_eq!(foot.about.start_us, 1_700_000_000_100_000);
            let samples = samples(foot);
            assert_eq!(samples.len(), 200);
            for (k, sample) in samples.iter().enumerate() {
                let value = k as f64 / 3.0;
                let [up, down, more] = [value, -value, value + 1.0].map(|value| value as f32);
                assert_eq!(sample.imu.timestamp.as_micros(), 1000 * k as u64);
                assert_eq!(sample.imu.angular_rate.0, Vec3::new(up, down, 0.25));
                assert_eq!(sample.imu.specific_force.0, Vec3::new(more, 2.0, 9.75));
                assert_eq!((sample.load, sample.label), (None, None));
            }
        }
    }
}

#[test]
fn several_feet_are_listed_selected_or_all_read() {
    for kind in KINDS {
        let bytes = written(kind, &two_feet(Order::Little), &[("/imu/rear", IMU)]);
        assert_eq!(
            why(open(&bytes, &InputOptions::default())),
            " has several IMUs, choose with topic, or topic all: \
             /imu/rear (0 messages), /imu/fl (200 messages, 1003 Hz), \
             /imu/fr (200 messages, 1003 Hz)"
        );
        let mut right = open(&bytes, &topics(&["/imu/fr"])).unwrap();
        assert_eq!(right.len(), 1);
        assert_eq!(right[0].about.foot.as_deref(), Some("fr"));
        let rate = samples(&mut right[0])[0].imu.angular_rate.0.x;
        assert_eq!(rate, (1000.0_f64 / 3.0) as f32);
        for (chosen, feet) in
            [(topics(&["all"]), ["fl", "fr"]), (topics(&["imu/fr", "imu/fl"]), ["fr", "fl"])]
        {
            for (foot, name) in open(&bytes, &chosen).unwrap().iter().zip(feet) {
                assert_eq!(foot.about.foot.as_deref(), Some(name));
                assert_eq!(foot.about.samples, 200);
            }
        }
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(&bytes).unwrap();
        let opened = Opened::new(file.path(), None).unwrap();
        assert_eq!(
            why(opened.store(&topics(&["all"]))),
            " has several feet, and one is wanted here: fl, fr"
        );
    }
}

/// Four feet on one topic by their frames, with the load of each.
fn feet_on_one_topic() -> Vec<Message> {
    let mut messages = Vec::new();
    for k in 0..100_u64 {
        let stamp = 1_700_000_000_000_000_000 + 2_000_000 * k as i64;
        for (foot, frame) in (0..).zip(["fl_foot", "fr_foot", "rl_foot", "rr_foot"]) {
            let stamp = stamp + 1000 * foot;
            let k = 1000 * foot as u64 + k;
            let message = imu_of(frame.as_bytes(), Order::Little, stamp, k, [0.0; 2]);
            messages.push(Message("/foot_imus", IMU, stamp, message));
        }
    }
    for (k, topic) in ["/load/fl", "/load/fr", "/load/rl", "/load/rr"].into_iter().enumerate() {
        let stamp = 1_700_000_000_000_000_000;
        messages.push(Message(topic, FLOAT, stamp, float(k as f64)));
    }
    messages
}

#[test]
fn frames_of_one_topic_are_separate_feet() {
    const FRAMES: [&str; 4] = ["fl_foot", "fr_foot", "rl_foot", "rr_foot"];
    let bytes = written(Kind::Chunks, &feet_on_one_topic(), &[]);
    let found = FRAMES.map(|frame| format!("/foot_imus frame \"{frame}\" (100 messages, 500 Hz)"));
    assert_eq!(
        why(open(&bytes, &InputOptions::default())),
        format!(" has several IMUs, choose with frame, or topic all: {}", found.join(", "))
    );
    let of_frames = |feet: &[usize]| {
        let mut input_options = InputOptions::default();
        input_options.bag.frames = feet.iter().map(|foot| FRAMES[*foot].to_owned()).collect();
        input_options
    };
    for (chosen, expected) in [
        (topics(&["all"]), &[0, 1, 2, 3][..]),
        (topics(&["/foot_imus"]), &[0, 1, 2, 3]),
        (of_frames(&[2]), &[2]),
        (of_frames(&[3, 0]), &[3, 0]),
    ] {
        let loads = ["/load/fl", "/load/fr", "/load/rl", "/load/rr"];
        let loads: Vec<&str> = expected.iter().map(|foot| loads[*foot]).collect();
        let mut feet = open(&bytes, &with_loads(chosen, &loads)).unwrap();
        assert_eq!(feet.len(), expected.len());
        for (stored, foot) in feet.iter_mut().zip(expected) {
            assert_eq!(stored.about.foot.as_deref(), Some(FRAMES[*foot]));
            assert_eq!(stored.about.sample_rate, 500.0);
            let samples = samples(stored);
            assert_eq!(samples.len(), 100);
            let rate = samples[0].imu.angular_rate.0.x;
            assert_eq!(rate, (1000.0 * *foot as f64 / 3.0) as f32);
            assert_eq!(samples[0].load, Some(Load(*foot as f32)));
        }
    }
    let mut input_options = InputOptions::default();
    input_options.bag.frames = vec!["trunk".to_owned()];
    assert!(why(open(&bytes, &input_options)).starts_with(
        " has no IMU with the frame \"trunk\"; it has /foot_imus frame \"fl_foot\" (100"
    ));
}

#[test]
fn messages_are_counted_by_frame_beside_another_topic() {
    let mut messages = Vec::new();
    for message in feet_on_one_topic() {
        if message.0 == "/foot_imus" && message.2 % 2_000_000 == 0 {
            messages.push(Message("/trunk/imu", IMU, message.2, message.3.clone()));
        }
        messages.push(message);
    }
    // Either the topic of the feet or the topic of the trunk is the first of the bag.
    for first in [0, 1] {
        let said =
            why(open(&written(Kind::Chunks, &messages[first..], &[]), &InputOptions::default()));
        let found = ["fl_foot", "fr_foot", "rl_foot", "rr_foot"]
            .map(|frame| format!("/foot_imus frame \"{frame}\" (100 messages, 500 Hz)"));
        assert!(said.starts_with(" has several IMUs, choose with topic and frame"), "{said}");
        for imu in found {
            assert!(said.contains(&imu), "{said}");
        }
        let of_trunk = format!("/trunk/imu ({} messages, 500 Hz)", 100 - first);
        assert!(said.contains(&of_trunk), "{said}");
    }
}

#[test]
fn frames_of_a_topic_are_limited() {
    let messages: Vec<_> = (0..100_u64)
        .map(|k| {
            let stamp = 1_700_000_000_000_000_000 + 2_000_000 * k as i64;
            let frame = format!("frame {k}");
            let message = imu_of(frame.as_bytes(), Order::Little, stamp, k, [0.0, 0.0]);
            Message("/imu", IMU, stamp, message)
        })
        .collect();
    let bytes = written(Kind::Records, &messages, &[]);
    assert_eq!(
        why(open(&bytes, &topics(&["all"]))),
        ", topic /imu, message 65: its frame \"frame 64\" is beyond the 64 that a topic may have"
    );
}

#[test]
fn missing_topic_error_lists_the_topics() {
    let chatter = Message("/chatter", "std_msgs/msg/String", 1, vec![0, 1, 0, 0]);
    let other = std::slice::from_ref(&chatter);
    let ros_1 = [("/imu", "sensor_msgs/Imu")];
    let empty = [("/imu", IMU)];
    let no_message = ": no topic of sensor_msgs/msg/Imu has a message; there is /imu (0 messages)";
    for (messages, declared, chosen, expected) in [
        (
            other,
            &ros_1[..],
            &[][..],
            " has no topic of sensor_msgs/msg/Imu in CDR; there is /imu (sensor_msgs/Imu), \
             /chatter (std_msgs/msg/String)",
        ),
        (&[], &[], &[], " has no topic of sensor_msgs/msg/Imu in CDR; there is nothing"),
        (other, &empty, &[], no_message),
        (other, &empty, &["all"], no_message),
        (other, &empty, &["/imu"], ": topic /imu has no message; there is /imu (0 messages)"),
        (
            other,
            &empty,
            &["/foot"],
            " has no topic /foot of sensor_msgs/msg/Imu; there is /imu (0 messages), \
             /chatter (std_msgs/msg/String)",
        ),
    ] {
        for kind in KINDS {
            let bytes = written(kind, messages, declared);
            assert_eq!(why(open(&bytes, &topics(chosen))), expected);
        }
    }
}

#[test]
fn log_times_are_used_without_any_stamp() {
    let mut messages = one_foot(Order::Little);
    for (k, message) in messages.iter_mut().enumerate() {
        message.2 = 5_000_000_000 + 2_000_000 * k as i64;
        message.3 = imu(Order::Little, 0, k as u64);
    }
    for kind in KINDS {
        let mut feet = open(&written(kind, &messages, &[]), &InputOptions::default()).unwrap();
        let about = &feet[0].about;
        assert_eq!((about.start_us, about.sample_rate), (5_000_000, 500.0));
        assert_eq!(about.notices.len(), 1);
        assert!(
            about.notices[0].text.ends_with(
                "topic /imu/fl: no message has a stamp, so times are those when messages were written"
            ),
            "{:?}",
            about.notices
        );
        assert_eq!(samples(&mut feet[0]).len(), 200);
    }
}

#[test]
fn messages_without_a_stamp_among_others_are_left_out() {
    let mut messages = one_foot(Order::Little);
    for k in [0, 1, 2, 70] {
        messages[k].3 = imu(Order::Little, 0, 0);
    }
    let bytes = written(Kind::Records, &messages, &[]);
    let mut feet = open(&bytes, &InputOptions::default()).unwrap();
    assert_eq!(feet[0].about.samples, 196);
    assert!(feet[0].about.notices[0].text.ends_with("4 messages left out, without a stamp"));
    assert_eq!(feet[0].about.start_us, 1_700_000_000_103_000);
    assert_eq!(samples(&mut feet[0])[0].imu.timestamp.as_micros(), 0);
}

#[test]
fn sensor_declared_missing_is_missing() {
    let mut messages = one_foot(Order::Little);
    let without = |k: u64, covariance| {
        let stamp = 1_700_000_000_100_000_000 + 1_000_000 * k as i64;
        imu_with(Order::Little, stamp, k, covariance)
    };
    messages[3].3 = without(3, [-1.0, 0.0]);
    messages[4].3 = without(4, [0.0, -1.0]);
    let mut feet = open(&written(Kind::Records, &messages, &[]), &InputOptions::default()).unwrap();
    let read = samples(&mut feet[0]);
    let invalid: Vec<usize> =
        (0..200).filter(|k| read[*k].imu.checked_validity() == Validity::Invalid).collect();
    assert_eq!(invalid, [3, 4]);
    assert_eq!(feet[0].about.notices.len(), 2);
    for (k, message) in messages.iter_mut().enumerate() {
        message.3 = without(k as u64, [0.0, -1.0]);
    }
    assert_eq!(
        why(open(&written(Kind::Records, &messages, &[]), &InputOptions::default())),
        ", topic /imu/fl: its messages have no linear_acceleration, as \
         linear_acceleration_covariance[0] = -1 says"
    );
}

#[test]
fn times_that_go_back_are_an_error_or_left_out() {
    let mut messages = one_foot(Order::Little);
    messages[9].3 = messages[8].3.clone();
    let bytes = written(Kind::Database, &messages, &[]);
    let said = why(open(&bytes, &InputOptions::default()));
    assert!(
        said.starts_with(
            ", topic /imu/fl: the time of a message does not come after 1700000000.108 s"
        ),
        "{said}"
    );
    let mut input_options = InputOptions::default();
    input_options.table.times = Times::DropBad;
    let feet = open(&bytes, &input_options).unwrap();
    assert_eq!(feet[0].about.samples, 199);
}

#[test]
fn given_units_are_applied() {
    let mut input_options = InputOptions::default();
    input_options.table.units = "g,dps".parse().unwrap();
    let bytes = written(Kind::Records, &one_foot(Order::Big), &[]);
    let mut feet = open(&bytes, &input_options).unwrap();
    let imu = samples(&mut feet[0])[0].imu;
    assert_eq!(imu.specific_force.0.z, (9.75 * f64::from(9.806_65_f32)) as f32);
    assert_eq!(imu.angular_rate.0.z, 0.25_f64.to_radians() as f32);
}

#[test]
fn load_is_the_last_before_the_sample_unless_old() {
    // Every 20 ms by its own stamps, stored after all samples.
    let mut messages = one_foot(Order::Little);
    let start = 1_700_000_000_100_000_000;
    for k in 0..3 {
        let stamp = start + 10_500_000 + 20_000_000 * k;
        let force = [3.0, 4.0, 100.0 + k as f64];
        messages.push(Message("/ft", WRENCH, stamp + 9_000_000_000, wrench(stamp, force)));
    }
    for kind in KINDS {
        let input_options = with_loads(InputOptions::default(), &["/ft"]);
        let mut feet = open(&written(kind, &messages, &[]), &input_options).unwrap();
        let loads: Vec<_> = samples(&mut feet[0]).iter().map(|sample| sample.load).collect();
        assert_eq!(loads[10], None);
        assert_eq!(loads[11], Some(Load(100.0)));
        assert_eq!(loads[30], Some(Load(100.0)));
        assert_eq!(loads[31], Some(Load(101.0)));
        assert_eq!(loads[150], Some(Load(102.0)));
        assert_eq!(loads[151], None);
        assert_eq!(feet[0].about.load_title, "/ft (N)");
        assert!(feet[0].about.notices[0].text.contains("60 messages without a load"));
    }
    let input_options = with_loads(InputOptions::default(), &["/ft:force"]);
    let mut feet = open(&written(Kind::Records, &messages, &[]), &input_options).unwrap();
    let load = samples(&mut feet[0])[20].load;
    assert_eq!(load, Some(Load((25.0_f64 + 10_000.0).sqrt() as f32)));
    for (field, title) in [("force", "/ft:force (N)"), ("torque.z", "/ft:torque.z")] {
        let input_options = with_loads(InputOptions::default(), &[&format!("/ft:{field}")]);
        let feet = open(&written(Kind::Records, &messages, &[]), &input_options).unwrap();
        assert_eq!(feet[0].about.load_title, title);
    }
    let mut downward = with_loads(InputOptions::default(), &["/ft"]);
    downward.table.scale = "1,1,-1".parse().unwrap();
    let mut feet = open(&written(Kind::Records, &messages, &[]), &downward).unwrap();
    assert_eq!(samples(&mut feet[0])[11].load, Some(Load(-100.0)));
}

#[test]
fn joined_files_are_read_to_the_end() {
    let (right, left): (Vec<_>, Vec<_>) =
        two_feet(Order::Little).into_iter().partition(|message| message.0 == "/imu/fr");
    for kind in [Kind::Chunks, Kind::Zstd, Kind::Records] {
        let mut joined = [written(kind, &right, &[]), written(kind, &left, &[])].concat();
        let mut feet = open(&joined, &topics(&["all"])).unwrap();
        let counts: Vec<_> = feet.iter_mut().map(|foot| samples(foot).len()).collect();
        assert_eq!(counts, [200, 200]);
        joined.extend_from_slice(b"and so on");
        let feet = open(&joined, &topics(&["all"])).unwrap();
        let notices = feet.iter().flat_map(|foot| &foot.about.notices);
        let said: String = notices.map(ToString::to_string).collect();
        assert!(said.contains("other data follow its end"), "{said}");
    }
}

#[test]
fn imu_of_the_trunk_and_empty_topic_are_named() {
    let mut messages = two_feet(Order::Little);
    for k in 0..40 {
        let stamp = 1_700_000_000_100_000_000 + 5_000_000 * k as i64;
        messages.push(Message("/trunk/imu", IMU, stamp, imu(Order::Little, stamp, k)));
    }
    for kind in KINDS {
        let bytes = written(kind, &messages, &[("/imu/rl", IMU)]);
        let feet = open(&bytes, &topics(&["all"])).unwrap();
        let notices = feet.iter().flat_map(|foot| &foot.about.notices);
        let said: String = notices.map(ToString::to_string).collect();
        let asked = "is read with /trunk/imu as a foot; if it is the robot's trunk: not topic /trunk/imu leaves it out";
        assert!(said.contains(asked), "{said}");
        assert!(said.contains("topic /imu/rl is empty"), "{said}");
    }
}

#[test]
fn samples_without_a_load_say_which_kind_is_missing() {
    let mut messages = one_foot(Order::Little);
    let start = messages[0].2;
    for (at, force) in [(10, 50.0), (20, f64::NAN), (21, 60.0), (22, f64::NAN), (24, 70.0)] {
        let log = start - 1 + at * 1_000_000;
        messages.push(Message("/load", FLOAT, log, float(force)));
    }
    let input_options = with_loads(InputOptions::default(), &["/load"]);
    let feet = open(&written(Kind::Records, &messages, &[]), &input_options).unwrap();
    let notices = &feet[0].about.notices;
    let said = |text: &str| notices.iter().any(|notice| notice.text.ends_with(text));
    assert!(
        said(": 3 messages without a load: the last value on /load is not a number"),
        "{notices:?}"
    );
    messages.retain(|message| message.0 != "/load");
    for at in [0, 90, 180] {
        let log = start - 1 + at * 1_000_000;
        messages.push(Message("/load", FLOAT, log, float(50.0)));
    }
    let feet = open(&written(Kind::Records, &messages, &[]), &input_options).unwrap();
    let notice = feet[0].about.notices.last().unwrap();
    assert!(
        notice.text.ends_with(": 1 message without a load: nothing on /load in the 100 ms before"),
        "{notice}"
    );
}

#[test]
fn loads_without_stamps_use_log_times_in_order_of_feet() {
    let mut messages = two_feet(Order::Little);
    let log = messages[0].2;
    for k in 0..10 {
        let log = log - 1 + 20_000_000 * k;
        messages.push(Message("/load/a", FLOAT, log, float(10.0 + k as f64)));
        messages.push(Message("/load/b", FLOAT, log, float(20.0 + k as f64)));
    }
    let bytes = written(Kind::Chunks, &messages, &[]);
    for (feet, loads, first) in [
        (["/imu/fr", "/imu/fl"], ["/load/a", "/load/b"], [10.0, 20.0]),
        (["/imu/fl", "/imu/fr"], ["/load/b", "/load/a"], [20.0, 10.0]),
    ] {
        let mut read = open(&bytes, &with_loads(topics(&feet), &loads)).unwrap();
        for (foot, load) in read.iter_mut().zip(first) {
            assert_eq!(samples(foot)[0].load, Some(Load(load)));
        }
    }
    assert_eq!(
        why(open(&bytes, &with_loads(topics(&["all"]), &["/load/a"]))),
        ": there are loads for 1 of 2 feet: give load topic once for each of /imu/fl, /imu/fr"
    );
    let one = |load| open(&bytes, &with_loads(topics(&["/imu/fl"]), &[load]));
    assert_eq!(
        why(one("/load/a:force.z")),
        ": /load/a:force.z is not a load: std_msgs/msg/Float64 has data"
    );
    assert!(why(one("/imu/fr")).ends_with(
        ": /imu/fr is not a load: sensor_msgs/msg/Imu cannot be read: its definition has a line \
         that is not a field: \"fields\""
    ));
    assert!(why(one("/load/c")).starts_with(" has no topic /load/c of numbers; there is /imu/fl"));
}

#[test]
fn loads_of_all_feet_are_paired_by_name_or_refused() {
    let mut messages = two_feet(Order::Little);
    let log = messages[0].2;
    for k in 0..10 {
        let log = log - 1 + 20_000_000 * k;
        messages.push(Message("/force/fl", FLOAT, log, float(10.0)));
        messages.push(Message("/force/fr", FLOAT, log, float(20.0)));
        messages.push(Message("/force/other", FLOAT, log, float(30.0)));
    }
    let bytes = written(Kind::Chunks, &messages, &[]);
    for feet in [&["all"][..], &["/imu/fr", "/imu/fl"], &["/imu/fl", "/imu/fr"]] {
        let options = with_loads(topics(feet), &["/force/fr", "/force/fl"]);
        let mut read = open(&bytes, &options).unwrap();
        let notices: Vec<_> = read[0].about.notices.iter().map(ToString::to_string).collect();
        assert!(notices.iter().any(|text| text.contains("/force/fl of /imu/fl")), "{notices:?}");
        for foot in &mut read {
            let load = if foot.about.foot.as_deref() == Some("fl") { 10.0 } else { 20.0 };
            assert_eq!(samples(foot)[0].load, Some(Load(load)), "{feet:?}");
        }
    }
    let options = with_loads(topics(&["all"]), &["/force/fr", "/force/other"]);
    assert!(why(open(&bytes, &options)).starts_with(
        ": the loads /force/fr, /force/other cannot be paired by name with the feet fl, fr: name the feet with topic"
    ));
}

/// Forms of the names of four legs. Topics of IMUs and of loads may have any of these forms.
const LEGS: [[&str; 4]; 5] = [
    ["fl", "fr", "rl", "rr"],
    ["LF", "RF", "LH", "RH"],
    ["FL_foot", "FR_foot", "HL_foot", "HR_foot"],
    ["front_left", "front_right", "rear_left", "rear_right"],
    ["left/front", "right/front", "left/hind", "right/hind"],
];

#[test]
fn loads_of_feet_in_random_order_are_those_of_their_legs() {
    let mut random = Random(0x5eed_0000_0000_0087);
    let mut shuffled = |names: [usize; 4]| {
        let mut names = names;
        for last in (1..4).rev() {
            names.swap(last, random.next(last + 1));
        }
        names
    };
    for turn in 0..60 {
        let (of_feet, of_loads) = (LEGS[turn % LEGS.len()], LEGS[turn / LEGS.len() % LEGS.len()]);
        let leak = |text: String| -> &'static str { text.leak() };
        let feet = of_feet.map(|leg| leak(format!("/robot/{leg}/imu")));
        let loads = of_loads.map(|leg| leak(format!("/ft/{leg}/wrench")));
        let mut messages = Vec::new();
        for k in 0..20_i64 {
            let stamp = 1_700_000_000_000_000_000 + 2_000_000 * k;
            for leg in shuffled([0, 1, 2, 3]) {
                let force = [0.0, 0.0, 10.0 + leg as f64];
                messages.push(Message(loads[leg], WRENCH, stamp, wrench(stamp, force)));
            }
            for leg in shuffled([0, 1, 2, 3]) {
                let readings = 1000 * leg as u64 + k as u64;
                messages.push(Message(feet[leg], IMU, stamp, imu(Order::Little, stamp, readings)));
            }
        }
        let typed = shuffled([0, 1, 2, 3]).map(|leg| loads[leg]);
        let named = shuffled([0, 1, 2, 3]).map(|leg| feet[leg]);
        for selected in [&["all"][..], &named] {
            let kind = KINDS[turn % KINDS.len()];
            let options = with_loads(topics(selected), &typed);
            let mut read = open(&written(kind, &messages, &[]), &options).unwrap();
            let notices: Vec<_> = read[0].about.notices.iter().map(ToString::to_string).collect();
            assert_eq!(read.len(), 4);
            for foot in &mut read {
                let address = foot.about.address.clone().unwrap();
                let leg = feet.iter().position(|foot| *foot == address).unwrap();
                let said = format!("{} of {address}", loads[leg]);
                assert!(notices.iter().any(|text| text.contains(&said)), "{said}: {notices:?}");
                let of_foot = samples(foot);
                assert!(of_foot.iter().all(|sample| sample.load == Some(Load(10.0 + leg as f32))));
            }
        }
    }
}

#[test]
fn load_of_another_leg_is_said_even_of_one_foot() {
    let mut messages = two_feet(Order::Little);
    let log = messages[0].2;
    messages.push(Message("/force/fr", FLOAT, log, float(20.0)));
    let options = with_loads(topics(&["/imu/fl"]), &["/force/fr"]);
    let read = open(&written(Kind::Chunks, &messages, &[]), &options).unwrap();
    let said = "loads are /force/fr of /imu/fl, which has the name of another leg";
    assert!(read[0].about.notices.iter().any(|notice| notice.text.contains(said)));
}

#[test]
fn message_of_wrong_length_is_named() {
    for kind in KINDS {
        let mut messages = one_foot(Order::Little);
        let whole = messages[20].3.clone();
        for (length, what) in [
            (whole.len() - 1, "bytes are fewer than its type has"),
            (whole.len() + 4, "bytes are more than its type has"),
            (3, "3 bytes are too short for a message"),
            (0, "0 bytes are too short for a message"),
        ] {
            messages[20].3 = whole.clone();
            messages[20].3.resize(length, 0);
            let said = why(open(&written(kind, &messages, &[]), &InputOptions::default()));
            assert!(said.starts_with(", topic /imu/fl, message 21: "), "{said}");
            assert!(said.contains(what), "{said}");
        }
        // A writer may pad to a multiple of four.
        messages[20].3 = whole.clone();
        messages[20].3.resize(whole.len() + 3, 0);
        assert!(open(&written(kind, &messages, &[]), &InputOptions::default()).is_ok());
        // XCDR2 has another alignment.
        messages[20].3[1] = 7;
        let said = why(open(&written(kind, &messages, &[]), &InputOptions::default()));
        assert!(said.contains("it is encoded as 0x0007, not in plain CDR"), "{said}");
    }
}

#[test]
fn invalid_compressed_message_is_named() {
    // A frame of zstd: blocks of 128 KiB, each of which repeats a zero.
    let zeros = |blocks: usize| {
        let block = |k| {
            let header = u32::from(k + 1 == blocks) | 1 << 1 | (128 << 10) << 3;
            [&header.to_le_bytes()[..3], &[0]].concat()
        };
        let window_of_1_mib = [0, 0x50];
        [&ZSTD[..], &window_of_1_mib, &(0..blocks).flat_map(block).collect::<Vec<_>>()].concat()
    };
    for (message, what) in [
        (ZSTD.to_vec(), "it cannot be decompressed: "),
        (zeros(9), "it is longer than 1048576 bytes when it is decompressed"),
        (zeros(8), "1048576 bytes are more than its type has"),
    ] {
        let mut messages = one_foot(Order::Little);
        messages[20].3 = message;
        let said = why(open(&written(KINDS[0], &messages, &[]), &InputOptions::default()));
        let expected = format!(", topic /imu/fl, message 21: {what}");
        assert!(said.starts_with(&expected), "{said}");
    }
}

#[test]
fn compressed_chunk_of_mcap_ends_at_the_size_that_it_states() {
    for kind in [Kind::Zstd, Kind::Lz4] {
        let mut bytes = written(kind, &one_foot(Order::Little), &[]);
        // The frame of the first chunk after the magic and the header.
        let header = u64::from_le_bytes(bytes[9..17].try_into().unwrap()) as usize;
        let chunk = 8 + 9 + header;
        assert_eq!(bytes[chunk], ::mcap::records::op::CHUNK, "{kind:?}");
        let size = chunk + 9 + 16;
        bytes[size..size + 8].copy_from_slice(&1_000_u64.to_le_bytes());
        let said = why(open(&bytes, &InputOptions::default()));
        // For zstd the library reports the excess, for lz4 this crate.
        let is_ended = said.contains("uncompressed bytes remaining")
            || said.contains("a chunk has more than 1000 bytes when it is decompressed");
        assert!(said.starts_with(" is damaged: ") && is_ended, "{kind:?}: {said}");
    }
}

#[test]
fn truncated_file_yields_its_messages() {
    for kind in KINDS {
        let bytes = written(kind, &one_foot(Order::Little), &[]);
        let whole = samples(&mut open(&bytes, &InputOptions::default()).unwrap()[0]);
        let mut longest = 0;
        let step = if kind == Kind::Database { 509 } else { 97 };
        for length in (0..bytes.len()).step_by(step) {
            if let Ok(mut feet) = open(&bytes[..length], &InputOptions::default()) {
                let read = samples(&mut feet[0]);
                assert_eq!(read, whole[..read.len()], "{kind:?}, {length}");
                assert!(read.len() >= longest || kind == Kind::Database);
                longest = read.len();
                let notices = &feet[0].about.notices;
                assert!(read.len() == 200 || notices[0].text.contains("ends early"), "{notices:?}");
            }
        }
        assert!(longest > 100, "{kind:?}: {longest}");
    }
}

#[test]
fn damaged_page_of_a_database_is_no_early_end() {
    let mut bytes = written(Kind::Database, &one_foot(Order::Little), &[]);
    let middle = bytes.len() / 4096 / 2 * 4096;
    bytes[middle..middle + 64].fill(0xFF);
    let said = why(open(&bytes, &InputOptions::default()));
    assert!(said.starts_with(" is damaged"), "{said}");
}

/// Pseudo-random numbers: xorshift.
struct Random(u64);

impl Random {
    fn next(&mut self, below: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % below
    }
}

#[test]
fn damage_is_a_one_line_error_or_changes_the_data() {
    let mut random = Random(0x5eed_1234_5678_9abc);
    let loads = with_loads(topics(&["all"]), &["/ft"]);
    let mut messages = one_foot(Order::Little);
    messages.push(Message("/ft", WRENCH, 0, wrench(0, [0.0; 3])));
    for kind in KINDS {
        let whole = written(kind, &messages, &[]);
        for _ in 0..400 {
            let mut bytes = whole.clone();
            for _ in 0..=random.next(4) {
                // Most of a file's structure is at its start and at its end.
                let at = match random.next(3) {
                    0 => 16 + random.next(400),
                    1 => bytes.len() - 1 - random.next(400),
                    _ => 16 + random.next(bytes.len() - 16),
                };
                bytes[at] = match random.next(3) {
                    0 => 0xFF,
                    1 => bytes[at] ^ 1 << random.next(8),
                    _ => random.next(256) as u8,
                };
            }
            if let Err(error) = open(&bytes, &loads) {
                assert!(!error.to_string().contains('\n'), "{error}");
            }
        }
    }
}

#[test]
fn excessive_lengths_are_rejected() {
    let magic = b"\x89MCAP0\r\n";
    for opcode in 1..=0x0F_u8 {
        for length in [u64::MAX, u64::MAX / 2, 1 << 40, 1 << 32, 300 << 20] {
            let mut bytes = magic.to_vec();
            bytes.push(opcode);
            bytes.extend_from_slice(&length.to_le_bytes());
            bytes.extend_from_slice(&[0xFF; 64]);
            let said = why(open(&bytes, &InputOptions::default()));
            // The others are skipped up to the end of the file.
            let expected =
                if (3..=6).contains(&opcode) { " is damaged" } else { " has no topic of" };
            assert!(said.starts_with(expected), "{opcode}, {length}: {said}");
        }
    }
}

#[test]
fn database_of_another_program_is_named_as_such() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("other.tmp");
    let database = rusqlite::Connection::open(&path).unwrap();
    database
        .execute_batch(
            "CREATE TABLE messages (text); \
             CREATE VIEW topics AS WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL SELECT id FROM n) \
             SELECT id, id AS name, id AS type, id AS serialization_format FROM n",
        )
        .unwrap();
    drop(database);
    let said = read(&path, &InputOptions::default()).err().unwrap().to_string();
    assert!(said.contains("is an SQLite database without the tables of a rosbag2"), "{said}");
}

#[test]
fn database_that_another_program_writes_is_not_damaged() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("walk.tmp");
    std::fs::write(&path, written(Kind::Database, &one_foot(Order::Little), &[])).unwrap();
    let writer = rusqlite::Connection::open(&path).unwrap();
    writer.execute_batch("BEGIN EXCLUSIVE").unwrap();
    let said = read(&path, &InputOptions::default()).err().unwrap().to_string();
    assert!(said.ends_with("cannot be read: database is locked"), "{said}");
    writer.execute_batch("ROLLBACK").unwrap();
    assert!(read(&path, &InputOptions::default()).is_ok());
}

#[test]
fn folder_is_read_in_order_of_its_numbers() {
    let messages = one_foot(Order::Little);
    let folder = tempfile::tempdir().unwrap();
    for (part, messages) in messages.chunks(18).enumerate() {
        let kind = if part % 2 == 0 { Kind::Records } else { Kind::Database };
        let ending = if part % 2 == 0 { "mcap" } else { "db3" };
        let path = folder.path().join(format!("walk_{part}.{ending}"));
        std::fs::write(path, written(kind, messages, &[])).unwrap();
    }
    std::fs::write(folder.path().join("metadata.yaml"), "rosbag2_bagfile_information:").unwrap();
    let mut feet = read(folder.path(), &InputOptions::default()).unwrap();
    let whole = written(Kind::Records, &messages, &[]);
    let mut expected = open(&whole, &InputOptions::default()).unwrap();
    assert_eq!(samples(&mut feet[0]), samples(&mut expected[0]));
    assert_eq!(feet[0].about.notices, []);
    let empty = tempfile::tempdir().unwrap();
    let said = read(empty.path(), &InputOptions::default()).err().unwrap().to_string();
    assert!(said.ends_with("is a folder without files of a rosbag2: .mcap or .db3"), "{said}");
}

#[cfg(target_os = "linux")]
#[test]
fn bag_from_a_pipe_is_read() {
    use std::os::fd::AsRawFd;
    for kind in KINDS {
        let bytes = written(kind, &one_foot(Order::Little), &[]);
        let (from, mut to) = std::io::pipe().unwrap();
        let writer = std::thread::spawn(move || to.write_all(&bytes));
        let path = format!("/proc/self/fd/{}", from.as_raw_fd());
        let opened = Opened::new(Path::new(&path), None).unwrap();
        writer.join().unwrap().unwrap();
        let feet = opened.store_all(&InputOptions::default()).unwrap();
        assert_eq!(feet[0].about.samples, 200, "{kind:?}");
    }
}

#[test]
fn options_for_other_formats_are_rejected() {
    let bytes = written(Kind::Records, &one_foot(Order::Little), &[]);
    let mut input_options = InputOptions::default();
    input_options.table.time_unit = Some(TimeUnit::Seconds);
    assert!(why(open(&bytes, &input_options)).ends_with("time unit is for csv and parquet"));
    let mut input_options = InputOptions::default();
    input_options.table.mapping = "ax=x".parse().unwrap();
    assert!(
        why(open(&bytes, &input_options))
            .ends_with("map is for messages of other types than sensor_msgs/msg/Imu")
    );
    let table = b"t,ax,ay,az,wx,wy,wz\n0,0,0,0,0,0,0\n";
    assert_eq!(
        why(open(table, &topics(&["/imu"]))),
        " is read as csv: topic, not topic, frame and load topic are for mcap, rosbag2 and rosbag1"
    );
    let given = |bytes: &[u8], format| {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(bytes).unwrap();
        Opened::new(file.path(), Some(format)).map(|opened| opened.format())
    };
    assert_eq!(given(&bytes, Format::Mcap).unwrap(), Format::Mcap);
    for (bytes, format, is) in [
        (&bytes[..], Format::Csv, "mcap"),
        (&bytes, Format::Rosbag2, "mcap"),
        (table, Format::Mcap, "a table or of no kind that is known"),
    ] {
        let expected = format!(" is {is}, but was given as format {format}");
        assert_eq!(why(given(bytes, format)), expected);
    }
}
