//! Bags of many topics: the time of a reading is proportional to their number.

use std::fs;

use super::*;

/// Numbers of topics that are compared.
const FEW: u32 = 2_000;
const MANY: u32 = 16_000;

/// Largest number of topics of a file in MCAP.
const MOST: u32 = 65_534;

/// Name of a topic.
pub(super) fn topic(place: u32) -> String {
    format!("/robot_{place}/imu")
}

/// Samples of a topic: 20 of the first, and one of each other.
pub(super) fn payloads(place: u32) -> impl Iterator<Item = (i64, Vec<u8>)> {
    let count = if place == 0 { 20 } else { 1 };
    (0..count).map(move |k| {
        let stamp = 1_700_000_000_000_000_000 + 1_000_000 * k;
        (stamp, imu(Order::Little, stamp, k as u64))
    })
}

fn mcap_of(count: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = WriteOptions::new().compression(None).create(Cursor::new(&mut bytes)).unwrap();
    let schema = writer.add_schema(IMU, "ros2msg", b"fields").unwrap();
    for place in 0..count {
        let name = topic(place);
        let channel_id = writer.add_channel(schema, &name, "cdr", &BTreeMap::new()).unwrap();
        for (log, payload) in payloads(place) {
            let log_time = log as u64;
            let header = MessageHeader { channel_id, sequence: 0, log_time, publish_time: 0 };
            writer.write_to_known_channel(&header, &payload).unwrap();
        }
    }
    writer.finish().unwrap();
    drop(writer);
    bytes
}

fn database_of(count: u32) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("walk.db3");
    fs::write(&path, database(&[], &[])).unwrap();
    let mut database = rusqlite::Connection::open(&path).unwrap();
    let all = database.transaction().unwrap();
    {
        let mut add_topic = all.prepare("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')").unwrap();
        let insert = "INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)";
        let mut add_message = all.prepare(insert).unwrap();
        for place in 0..count {
            add_topic.execute((place + 1, topic(place), IMU)).unwrap();
            for (log, payload) in payloads(place) {
                add_message.execute((place + 1, log, payload)).unwrap();
            }
        }
    }
    all.commit().unwrap();
    drop(database);
    fs::read(path).unwrap()
}

/// Processor time of this thread, ns; 0 on systems that do not report it.
fn processor_ns() -> u64 {
    let text = fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split(' ').next().unwrap_or_default().parse().unwrap_or_default()
}

/// Processor time, ns, of reading one topic of a bag, and of the error that lists several topics.
fn reading_ns(bytes: &[u8]) -> u64 {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(bytes).unwrap();
    let before = processor_ns();
    let one = read(file.path(), &topics(&["/robot_0/imu"])).unwrap();
    let error = read(file.path(), &InputOptions::default()).err().unwrap().to_string();
    let taken = processor_ns() - before;
    assert_eq!(one[0].about.samples, 20);
    assert!(error.contains(" has several IMUs") && error.contains("/robot_1/imu"), "{error}");
    taken
}

#[test]
fn mcap_with_the_most_topics_is_read() {
    reading_ns(&mcap_of(MOST));
}

#[test]
fn time_is_proportional_to_the_number_of_topics() {
    type Bag = fn(u32) -> Vec<u8>;
    let bags: [(&str, Bag); 3] =
        [("mcap", mcap_of), ("db3", database_of), ("bag", ros1::with_topics)];
    for (kind, bag) in bags {
        let [few, many] = [FEW, MANY].map(|count| {
            let bytes = bag(count);
            (0..2).map(|_| reading_ns(&bytes)).min().unwrap()
        });
        // Eight times as many topics: about 8, and 64 if the time grew with the square.
        let ratio = many as f64 / few.max(1) as f64;
        assert!(ratio < 24.0, "{kind}: {ratio}, {few} ns, {many} ns");
    }
}
