//! Bags of ROS 1, and messages of ROS 1 in MCAP.

use std::io::Read;

use super::*;
use options::hint::Hint;

const COMPRESSIONS: [&str; 3] = ["none", "bz2", "lz4"];

const HEADER: &str = "uint32 seq\ntime stamp\nstring frame_id\n";

/// Definition of a type as a bag of ROS 1 has it.
fn definition(message: &str) -> String {
    let rule = "=".repeat(80);
    let fields = match message {
        IMU => {
            "Header header\n\nfloat64[4] orientation\nfloat64[9] orientation_covariance\n\
             float64[3] angular_velocity\nfloat64[9] angular_velocity_covariance\n\
             float64[3] linear_acceleration\nfloat64[9] linear_acceleration_covariance\n"
        }
        WRENCH => "Header header\nWrench wrench\n",
        "sensor_msgs/msg/JointState" => {
            "Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"
        }
        FLOAT => return "float64 data\n".to_owned(),
        NUMBERS => {
            return format!(
                "MultiArrayLayout layout\nfloat64[] data\n{rule}\nMSG: std_msgs/MultiArrayLayout\n\
                 MultiArrayDimension[] dim\nuint32 data_offset\n{rule}\nMSG: std_msgs/MultiArrayDimension\n\
                 string label\nuint32 size\nuint32 stride\n"
            );
        }
        LOW_STATE => return LOW_STATE_FIELDS.to_owned(),
        other => panic!("{other}"),
    };
    format!("{fields}{rule}\nMSG: std_msgs/Header\n# The number of the message.\n{HEADER}")
}

/// Name of a type in ROS 1.
fn in_ros1(message: &str) -> String {
    message.replace("/msg/", "/")
}

/// A message in the serialisation of ROS 1, built field by field.
#[derive(Default)]
struct Serialised(Vec<u8>);

impl Serialised {
    fn put<const N: usize>(mut self, value: [u8; N]) -> Self {
        self.0.extend_from_slice(&value);
        self
    }

    fn text(self, text: &[u8]) -> Self {
        let mut long = self.put((text.len() as u32).to_le_bytes());
        long.0.extend_from_slice(text);
        long
    }

    fn numbers(self, values: &[f64]) -> Self {
        values.iter().fold(self, |to, value| to.put(value.to_le_bytes()))
    }

    fn header(self, sequence: u32, stamp_ns: i64, frame: &[u8]) -> Self {
        self.put(sequence.to_le_bytes())
            .put(((stamp_ns / 1_000_000_000) as u32).to_le_bytes())
            .put(((stamp_ns % 1_000_000_000) as u32).to_le_bytes())
            .text(frame)
    }
}

/// The same message in the serialisation of ROS 1: from little-endian CDR of one of the three types above.
fn serialised(Message(_, message, _, cdr): &Message) -> Vec<u8> {
    let mut rest = &cdr[4..];
    let mut bytes = Serialised::default();
    if *message != FLOAT {
        let stamp_ns = 1_000_000_000 * i64::from(u32::from_le_bytes(rest[..4].try_into().unwrap()))
            + i64::from(u32::from_le_bytes(rest[4..8].try_into().unwrap()));
        let length = u32::from_le_bytes(rest[8..12].try_into().unwrap()) as usize;
        bytes = bytes.header(7, stamp_ns, &rest[12..11 + length]);
        rest = &rest[(12 + length).next_multiple_of(8)..];
    }
    bytes.0.extend_from_slice(rest);
    bytes.0
}

fn fields(fields: &[(&str, &[u8])]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (name, value) in fields {
        bytes.extend(((name.len() + 1 + value.len()) as u32).to_le_bytes());
        bytes.extend_from_slice(name.as_bytes());
        bytes.push(b'=');
        bytes.extend_from_slice(value);
    }
    bytes
}

fn record(header: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let header = fields(header);
    let mut bytes = (header.len() as u32).to_le_bytes().to_vec();
    bytes.extend_from_slice(&header);
    bytes.extend((data.len() as u32).to_le_bytes());
    bytes.extend_from_slice(data);
    bytes
}

fn connection(id: u32, topic: &str, message: &str, definition: &str) -> Vec<u8> {
    let about = fields(&[
        ("topic", topic.as_bytes()),
        ("type", in_ros1(message).as_bytes()),
        ("md5sum", b"*"),
        ("message_definition", definition.as_bytes()),
    ]);
    let (op, id) = ([7], id.to_le_bytes());
    record(&[("op", &op), ("conn", &id), ("topic", topic.as_bytes())], &about)
}

fn message_record(id: u32, log_ns: i64, payload: &[u8]) -> Vec<u8> {
    let time = [log_ns / 1_000_000_000, log_ns % 1_000_000_000].map(|part| part as u32);
    let time: Vec<u8> = time.into_iter().flat_map(u32::to_le_bytes).collect();
    record(&[("op", &[2]), ("conn", &id.to_le_bytes()), ("time", &time)], payload)
}

fn compressed(compression: &str, records: &[u8]) -> Vec<u8> {
    match compression {
        "bz2" => {
            let mut bytes = Vec::new();
            let mut encoder = bzip2::read::BzEncoder::new(records, bzip2::Compression::fast());
            encoder.read_to_end(&mut bytes).unwrap();
            bytes
        }
        "lz4" => {
            let mut encoder = lz4::EncoderBuilder::new().build(Vec::new()).unwrap();
            encoder.write_all(records).unwrap();
            let (bytes, finished) = encoder.finish();
            finished.unwrap();
            bytes
        }
        _ => records.to_vec(),
    }
}

fn chunk(compression: &str, records: &[u8]) -> Vec<u8> {
    let size = (records.len() as u32).to_le_bytes();
    let header: [(&str, &[u8]); 3] =
        [("op", &[5]), ("compression", compression.as_bytes()), ("size", &size)];
    record(&header, &compressed(compression, records))
}

/// Header of a bag whose index is at a position, 4096 bytes long.
fn bag_header(index: u64, encryptor: &str) -> Vec<u8> {
    let (index, none) = (index.to_le_bytes(), [0; 4]);
    let header: [(&str, &[u8]); 5] = [
        ("op", &[3]),
        ("index_pos", &index),
        ("conn_count", &none),
        ("chunk_count", &none),
        ("encryptor", encryptor.as_bytes()),
    ];
    let padding = vec![b' '; 4096 - fields(&header).len() - 8];
    record(&header, &padding)
}

const FIRST_LINE: &[u8] = b"#ROSBAG V2.0\n";

/// Messages with their topic, type, log time and content, all in ROS 1.
type Serials<'a> = &'a [(&'a str, &'a str, i64, Vec<u8>)];

/// Returns a bag with a chunk for each 50 messages, and an index.
fn bag(compression: &str, messages: Serials<'_>) -> Vec<u8> {
    let mut connections: Vec<(&str, Vec<u8>)> = Vec::new();
    let mut chunks = Vec::new();
    for messages in messages.chunks(50) {
        let mut records = Vec::new();
        for (topic, message, log_ns, payload) in messages {
            let known = connections.iter().position(|(known, _)| known == topic);
            let id = known.unwrap_or_else(|| {
                let id = connections.len();
                let declared = connection(id as u32, topic, message, &definition(message));
                records.extend_from_slice(&declared);
                connections.push((topic, declared));
                id
            });
            records.extend(message_record(id as u32, *log_ns, payload));
        }
        chunks.extend(chunk(compression, &records));
        // The index of the chunk, which is not used.
        chunks.extend(record(&[("op", &[4]), ("ver", &[1, 0, 0, 0])], &[0; 12]));
    }
    let header = bag_header((FIRST_LINE.len() + 4096 + chunks.len()) as u64, "");
    let connections = connections.into_iter().map(|(_, declared)| declared).collect::<Vec<_>>();
    let info = record(&[("op", &[6]), ("ver", &[1, 0, 0, 0])], &[0; 8]);
    [FIRST_LINE, &header, &chunks, &connections.concat(), &info].concat()
}

/// Returns a bag with a connection for each of these topics.
pub(super) fn with_topics(count: u32) -> Vec<u8> {
    let mut records = Vec::new();
    for place in 0..count {
        records.extend(connection(place, &many_topics::topic(place), IMU, &definition(IMU)));
        for (log, payload) in many_topics::payloads(place) {
            let payload = serialised(&Message("", IMU, log, payload));
            records.extend(message_record(place, log, &payload));
        }
    }
    let chunk = chunk("none", &records);
    let header = bag_header((FIRST_LINE.len() + 4096 + chunk.len()) as u64, "");
    let info = record(&[("op", &[6]), ("ver", &[1, 0, 0, 0])], &[0; 8]);
    [FIRST_LINE, &header, &chunk, &info].concat()
}

fn in_serials(messages: &[Message]) -> Vec<(&'static str, &'static str, i64, Vec<u8>)> {
    let messages = messages.iter();
    messages.map(|message| (message.0, message.1, message.2, serialised(message))).collect()
}

/// Two feet with the load of one.
fn loaded_feet() -> Vec<Message> {
    let mut messages = two_feet(Order::Little);
    for k in 0..40_i64 {
        let log = 1_700_000_000_100_000_000 + 5_000_000 * k;
        messages.push(Message("/load", WRENCH, log, wrench(log, [0.0, 0.0, k as f64])));
        messages.push(Message("/other", FLOAT, log, float(1.0)));
    }
    messages
}

#[test]
fn bag_of_ros_1_gives_the_samples_of_one_of_ros_2() {
    let messages = loaded_feet();
    let options = with_loads(topics(&["/imu/fr", "/imu/fl"]), &["/load", "/other"]);
    let mut expected = open(&written(Kind::Chunks, &messages, &[]), &options).unwrap();
    let expected: Vec<_> = expected.iter_mut().map(samples).collect();
    assert!(expected[0].iter().any(|sample| sample.load.is_some()));
    for compression in COMPRESSIONS {
        let bytes = bag(compression, &in_serials(&messages));
        let mut feet = open(&bytes, &options).unwrap();
        let names: Vec<_> = feet.iter().filter_map(|foot| foot.about.foot.clone()).collect();
        assert_eq!(names, ["fr", "fl"]);
        for (foot, expected) in feet.iter_mut().zip(&expected) {
            let is_of_loads =
                |text: &str| text.contains("loads are /load of /imu/fr, /other of /imu/fl");
            let notices = foot.about.notices.iter().filter(|notice| !is_of_loads(&notice.text));
            assert_eq!(notices.count(), 0, "{compression}");
            assert_eq!(foot.about.start_us, 1_700_000_000_100_000);
            assert_eq!(samples(foot), *expected, "{compression}");
        }
        let said = why(open(&bytes, &InputOptions::default()));
        assert!(said.starts_with(" has several IMUs, choose with topic, or topic all"), "{said}");
        let said = why(open(&bytes, &topics(&["/imu"])));
        assert!(said.contains("there is /imu/fl"), "{said}");
    }
}

#[test]
fn copy_of_a_bag_of_ros_1_has_messages_of_ros_2() {
    let messages = loaded_feet();
    let mut file = tempfile::NamedTempFile::new().unwrap();
    let bytes = bag("lz4", &in_serials(&messages));
    file.write_all(&bytes).unwrap();
    for foot in open(&bytes, &topics(&["/imu/fr", "/imu/fl"])).unwrap() {
        assert_eq!(foot.about.notices, [], "no part ends early");
    }
    let mut copied = Vec::new();
    let whole = crate::copy::copy(file.path(), &mut |channel, times, payload| {
        assert_eq!(channel.encoding, "cdr");
        assert_eq!(channel.schema.as_ref().unwrap().encoding, "ros2msg");
        copied.push((channel.message.clone(), times.log_ns, payload.to_vec()));
        Ok(())
    });
    whole.unwrap();
    assert_eq!(copied.len(), messages.len());
    for ((message, log_ns, payload), Message(_, expected, log, cdr)) in copied.iter().zip(&messages)
    {
        assert_eq!((message.as_str(), log_ns), (*expected, log));
        // The padding may have any content.
        assert_eq!(payload.len(), cdr.len());
        assert_eq!(payload[..12], cdr[..12]);
        assert_eq!(payload[payload.len() - 8..], cdr[cdr.len() - 8..]);
    }
}

#[test]
fn truncated_bag_of_ros_1_yields_its_messages() {
    for compression in COMPRESSIONS {
        let bytes = bag(compression, &in_serials(&one_foot(Order::Little)));
        let whole = samples(&mut open(&bytes, &InputOptions::default()).unwrap()[0]);
        assert_eq!(whole.len(), 200);
        let mut longest = 0;
        for length in (0..bytes.len()).step_by(31) {
            let read = open(&bytes[..length], &InputOptions::default());
            let mut feet = match read {
                Ok(feet) => feet,
                Err(error) => {
                    assert_eq!(longest, 0, "{compression}, {length}: {error}");
                    continue;
                }
            };
            let read = samples(&mut feet[0]);
            assert_eq!(read, whole[..read.len()], "{compression}, {length}");
            assert!(read.len() >= longest, "{compression}, {length}");
            longest = read.len();
            let notices = &feet[0].about.notices;
            let is_early = notices.iter().any(|notice| notice.text.contains("ends early"));
            assert!(is_early || read.len() == 200, "{compression}, {length}");
        }
        assert_eq!(longest, 200, "{compression}");
        // If only a part of the index is missing, no message is missing.
        let feet = open(&bytes[..bytes.len() - 5], &InputOptions::default()).unwrap();
        assert_eq!(feet[0].about.notices, []);
    }
}

#[test]
fn recording_that_was_not_closed_yields_its_messages() {
    let messages = in_serials(&one_foot(Order::Little));
    for compression in COMPRESSIONS {
        let mut bytes = [FIRST_LINE, &bag_header(0, "")].concat();
        let declared = connection(0, "/imu/fl", IMU, &definition(IMU));
        let records = |messages: Serials<'_>| {
            let records =
                messages.iter().map(|(_, _, log_ns, payload)| message_record(0, *log_ns, payload));
            records.collect::<Vec<_>>().concat()
        };
        bytes.extend(chunk(compression, &[declared, records(&messages[..100])].concat()));
        // The header of the last chunk is written again when the chunk is finished.
        let header: [(&str, &[u8]); 3] =
            [("op", &[5]), ("compression", compression.as_bytes()), ("size", &[0; 4])];
        bytes.extend(record(&header, &[]));
        let open_chunk = compressed(compression, &records(&messages[100..]));
        bytes.extend_from_slice(&open_chunk[..open_chunk.len() - 7]);
        let feet = open(&bytes, &InputOptions::default()).unwrap();
        let notice = &feet[0].about.notices[0];
        assert!(notice.text.contains("ends early"), "{notice}");
        assert_eq!(notice.hint, Some(Hint::WholeCopy));
        assert!(feet[0].about.samples >= 100, "{compression}: {}", feet[0].about.samples);
        if compression == "none" {
            assert_eq!(feet[0].about.samples, 199);
        }
    }
}

#[test]
fn damage_in_a_bag_of_ros_1_is_a_one_line_error() {
    let mut random = Random(0x5eed_1234_5678_9abc);
    let messages = in_serials(&loaded_feet());
    let loads = with_loads(topics(&["all"]), &["/load", "/other"]);
    let mut errors = 0;
    for compression in COMPRESSIONS {
        let whole = bag(compression, &messages);
        for _ in 0..200 {
            let mut bytes = whole.clone();
            for _ in 0..=random.next(3) {
                let at = match random.next(3) {
                    0 => 16 + random.next(100),
                    1 => bytes.len() - 1 - random.next(400),
                    _ => 4109 + random.next(bytes.len() - 4109),
                };
                bytes[at] = match random.next(3) {
                    0 => 0xFF,
                    1 => bytes[at] ^ 1 << random.next(8),
                    _ => random.next(256) as u8,
                };
            }
            if let Err(error) = open(&bytes, &loads) {
                errors += 1;
                assert!(!error.to_string().contains('\n'), "{error}");
            }
        }
    }
    assert!(errors > 100, "{errors}");
}

#[test]
fn compressed_chunk_of_another_length_is_damaged() {
    let messages = in_serials(&one_foot(Order::Little));
    for compression in ["bz2", "lz4"] {
        let mut bytes = bag(compression, &messages);
        let size = bytes.windows(5).position(|part| part == b"size=").unwrap() + 5;
        bytes[size] ^= 1;
        let said = why(open(&bytes, &InputOptions::default()));
        assert!(said.starts_with(" is damaged: a chunk has "), "{said}");
        assert!(said.ends_with("; rosbag reindex, of ROS 1, saves what can be"), "{said}");
    }
}

#[test]
fn compressed_chunk_of_ros_1_ends_at_the_size_that_it_states() {
    let declared = connection(0, "/imu/fl", IMU, &definition(IMU));
    // Records of an index, which are skipped.
    let long = record(&[("op", &[4])], &vec![0; 64 << 20]);
    for compression in ["bz2", "lz4"] {
        let mut grows = chunk(compression, &[&declared[..], &long].concat());
        let size = grows.windows(5).position(|part| part == b"size=").unwrap() + 5;
        grows[size..size + 4].copy_from_slice(&5_000_u32.to_le_bytes());
        let bytes = [FIRST_LINE, &bag_header(0, ""), &grows].concat();
        let said = why(open(&bytes, &InputOptions::default()));
        let expected = " is damaged: a chunk has more than 5000 bytes when it is decompressed";
        assert!(said.starts_with(expected), "{said}");
    }
}

const NUMBERS: &str = "std_msgs/msg/Float64MultiArray";

/// A bag as the README of `DogLegs` describes it: five IMUs with the times of writing, and 29 numbers of the robot.
fn doglegs() -> Vec<u8> {
    let mut messages = Vec::new();
    for k in 0..200_u64 {
        let log = 250_046_000_000_000 + 5_000_000 * k as i64;
        for (place, part) in (0..).zip(["body", "fl", "fr", "rl", "rr"]) {
            let topic: &str = format!("/doglegs/imu/{part}").leak();
            let topic: &'static str = topic;
            let cdr = imu(Order::Little, log, 1000 * place + k);
            messages.push((topic, IMU, log, serialised(&Message(topic, IMU, log, cdr))));
        }
        let mut robot = vec![log as f64 / 1.0e9];
        robot.extend((1..25).map(f64::from));
        robot.extend((0..4).map(|foot| 100.0 * f64::from(foot) + k as f64));
        let numbers = Serialised::default().put(1_u32.to_le_bytes()).text(b"values");
        let numbers = numbers.put(29_u32.to_le_bytes()).put(29_u32.to_le_bytes()).put([0; 4]);
        let numbers = numbers.put(29_u32.to_le_bytes()).numbers(&robot);
        messages.push(("/doglegs/robot_sensor", NUMBERS, log, numbers.0));
    }
    bag("none", &messages)
}

#[test]
fn bag_of_doglegs_is_read_with_its_loads() {
    let bytes = doglegs();
    let feet = ["fl", "fr", "rl", "rr"];
    let imus = feet.map(|foot| format!("/doglegs/imu/{foot}"));
    let loads = [25, 26, 27, 28].map(|at| format!("/doglegs/robot_sensor:data[{at}]"));
    let expect = |stored: &mut Stored, foot: usize| {
        assert_eq!(stored.about.foot.as_deref(), Some(feet[foot]));
        assert_eq!((stored.about.samples, stored.about.sample_rate), (200, 200.0));
        for (k, sample) in samples(stored).iter().enumerate() {
            let readings = 1000 * (foot + 1) + k;
            assert_eq!(sample.imu.angular_rate.0.x, (readings as f64 / 3.0) as f32);
            assert_eq!(sample.load, Some(Load(100.0 * foot as f32 + k as f32)));
        }
    };
    for foot in 0..4 {
        let options = with_loads(topics(&[&imus[foot]]), &[&loads[foot]]);
        expect(&mut open(&bytes, &options).unwrap()[0], foot);
    }
    let mut four = open(
        &bytes,
        &with_loads(
            topics(&imus.each_ref().map(String::as_str)),
            &loads.each_ref().map(String::as_str),
        ),
    )
    .unwrap();
    for (foot, stored) in four.iter_mut().enumerate() {
        expect(stored, foot);
    }
    // Numbers have no names of feet.
    let mut options = with_loads(topics(&["all"]), &loads.each_ref().map(String::as_str));
    options.bag.excluded = vec!["/doglegs/imu/body".to_owned()];
    let said = why(open(&bytes, &options));
    assert!(said.contains("cannot be paired by name with the feet fl, fr, rl, rr"), "{said}");
}

#[test]
fn excessive_lengths_in_a_bag_of_ros_1_are_rejected() {
    for length in [u32::MAX, u32::MAX / 2, 300 << 20] {
        let mut bytes = [FIRST_LINE, &bag_header(0, "")].concat();
        bytes.extend(length.to_le_bytes());
        bytes.extend_from_slice(&[0xFF; 64]);
        let said = why(open(&bytes, &InputOptions::default()));
        assert!(said.contains("a record has a header of"), "{said}");
        let mut bytes = [FIRST_LINE, &bag_header(0, "")].concat();
        let declared = connection(0, "/imu", IMU, &definition(IMU));
        let end = declared.len() - definition(IMU).len();
        bytes.extend_from_slice(&declared[..end]);
        let at = bytes.windows(5).position(|part| part == b"topic").unwrap() + 10;
        bytes[at..at + 4].copy_from_slice(&length.to_le_bytes());
        let said = why(open(&bytes, &InputOptions::default()));
        assert!(said.contains(&format!("a record has {length} bytes")), "{said}");
    }
}

#[test]
fn unsupported_bag_of_ros_1_is_named() {
    let messages = in_serials(&one_foot(Order::Little));
    let said = why(open(&bag("zstd", &messages), &InputOptions::default()));
    assert_eq!(
        said,
        " has chunks with the compression \"zstd\", and bz2, lz4 and none are read; write it again: \
         rosbag decompress walk.bag"
    );
    let encrypted = [FIRST_LINE, &bag_header(0, "rosbag/AesCbcEncryptor")].concat();
    let said = why(open(&encrypted, &InputOptions::default()));
    assert!(said.starts_with(" is encrypted (rosbag/AesCbcEncryptor)"), "{said}");
    let old = why(open(b"#ROSRECORD V1.2\n", &InputOptions::default()));
    assert!(old.starts_with(" is a ROS 1 bag of a version before 2.0; "), "{old}");
    let records = [connection(0, "/imu", IMU, "legs/Missing part"), message_record(0, 1, &[0; 8])];
    let unknown = [FIRST_LINE, &bag_header(0, ""), &chunk("none", &records.concat())].concat();
    let said = why(open(&unknown, &InputOptions::default()));
    assert!(
        said.contains("there is /imu (sensor_msgs/Imu in ros1); messages of ROS 1 are read by"),
        "{said}"
    );
}

const LOW_STATE: &str = "unitree_legged_msgs/msg/LowState";

/// The beginning and the forces of the state of a GO1.
const LOW_STATE_FIELDS: &str = "uint8[2] head
IMU imu
int16[4] footForce
================================================================================
MSG: unitree_legged_msgs/IMU
float32[4] quaternion
float32[3] gyroscope
float32[3] accelerometer
float32[3] rpy
int8 temperature
";

#[test]
fn loads_of_other_messages_of_ros_1_are_read_by_name() {
    const JOINTS: &str = "sensor_msgs/msg/JointState";
    let mut messages = in_serials(&one_foot(Order::Little));
    for k in 0..40_i64 {
        let log = 1_700_000_000_100_000_000 + 5_000_000 * k;
        let mut state = Serialised::default().put([1, 2]);
        for part in 0..13_u8 {
            state = state.put(f32::from(part).to_le_bytes());
        }
        let state = state.put([20]);
        let state =
            (0..4).fold(state, |state, foot| state.put((100 * foot + k as i16).to_le_bytes()));
        messages.push(("/low_state", LOW_STATE, log, state.0));
        let joints = Serialised::default().header(1, log, b"").put(2_u32.to_le_bytes());
        let joints = joints.text(b"hip").text(b"knee").put([0; 8]).put(2_u32.to_le_bytes());
        messages.push(("/joints", JOINTS, log, joints.numbers(&[-1.0, k as f64]).0));
    }
    let bytes = bag("bz2", &messages);
    for (load, expected) in [("/low_state.footForce[1]", 139.0), ("/joints.effort[1]", 39.0)] {
        let load = load.replacen('.', ":", 1);
        let options = with_loads(topics(&["/imu/fl"]), &[&load]);
        let last = samples(&mut open(&bytes, &options).unwrap()[0]).pop().unwrap();
        assert_eq!(last.load, Some(Load(expected)), "{load}");
    }
    // The trunk's IMU is found, and taken only if it is named.
    let said = why(open(&bytes, &topics(&["/low_state"])));
    assert!(said.contains("imu is the IMU of the robot's trunk, not of a foot"), "{said}");
    let mut trunk = open(&bytes, &topics(&["/low_state.imu"])).unwrap();
    let sample = samples(&mut trunk[0])[0];
    assert_eq!(sample.imu.angular_rate.0, Vec3::new(4.0, 5.0, 6.0));
    assert_eq!(sample.imu.specific_force.0, Vec3::new(7.0, 8.0, 9.0));
}

#[test]
fn messages_of_ros_1_in_mcap_are_read() {
    let messages = one_foot(Order::Little);
    let mut expected =
        open(&written(Kind::Chunks, &messages, &[]), &InputOptions::default()).unwrap();
    let mut bytes = Vec::new();
    let mut writer = WriteOptions::new().profile("ros1").create(Cursor::new(&mut bytes)).unwrap();
    let schema = writer.add_schema("sensor_msgs/Imu", "ros1msg", definition(IMU).as_bytes());
    let channel_id =
        writer.add_channel(schema.unwrap(), "/imu/fl", "ros1", &BTreeMap::new()).unwrap();
    for (_, _, log_ns, payload) in in_serials(&messages) {
        let header =
            MessageHeader { channel_id, sequence: 0, log_time: log_ns as u64, publish_time: 0 };
        writer.write_to_known_channel(&header, &payload).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    let mut feet = open(&bytes, &InputOptions::default()).unwrap();
    assert_eq!(samples(&mut feet[0]), samples(&mut expected[0]));
}
