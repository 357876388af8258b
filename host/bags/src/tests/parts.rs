//! Bags whose IMUs and loads are fields of messages of any type.

use super::*;

const FEET: &str = "my_msgs/msg/Feet";

/// Two frames in one header, with our names of the axes beside others.
const NAMED: &str =
    "std_msgs/Header header\nfloat64[3] acc\nfloat64 ax\nfloat64 ay\nfloat64 az\nfloat64[3] gyro";

/// An IMU as a part.
const PART: &str = "uint8 id
sensor_msgs/Imu imu
===
MSG: sensor_msgs/Imu
std_msgs/Header header
float64[4] orientation
float64[9] orientation_covariance
float64[3] angular_velocity
float64[9] angular_velocity_covariance
float64[3] linear_acceleration
float64[9] linear_acceleration_covariance
";

/// Messages on `/feet` of a type with this definition, and loads on other topics.
fn bag(encoding: &str, definition: &str, messages: &[(i64, Vec<u8>)], loads: &[&str]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = WriteOptions::new().create(Cursor::new(&mut bytes)).unwrap();
    let schema = writer.add_schema(FEET, encoding, definition.as_bytes());
    let none = BTreeMap::new();
    let feet = writer.add_channel(schema.unwrap(), "/feet", "cdr", &none);
    let float = writer.add_schema(FLOAT, "ros2msg", b"float64 data").unwrap();
    let loads: Vec<_> =
        loads.iter().map(|topic| writer.add_channel(float, topic, "cdr", &none).unwrap()).collect();
    let mut put = |channel_id, log_time, payload: &[u8]| {
        let header = MessageHeader { channel_id, sequence: 0, log_time, publish_time: 0 };
        writer.write_to_known_channel(&header, payload).unwrap();
    };
    for (load, channel) in (1..).zip(&loads) {
        put(*channel, START as u64, &super::float(f64::from(load)));
    }
    let feet = feet.unwrap();
    for (log_ns, payload) in messages {
        put(feet, *log_ns as u64, payload);
    }
    writer.finish().unwrap();
    drop(writer);
    bytes
}

const START: i64 = 1_700_000_000_000_000_000;

/// Messages of [`NAMED`] in turn from two frames, 1 ms apart.
fn alternating_messages() -> Vec<(i64, Vec<u8>)> {
    let message = |k: i64| {
        let foot = if k % 2 == 0 { 1.0 } else { 2.0 };
        let frame: &[u8] = if k % 2 == 0 { b"fl" } else { b"fr" };
        let stamp = START + 1_000_000 * k;
        let cdr = Cdr::new(Order::Little).header(stamp, frame);
        let cdr = cdr.numbers(&[7.0; 3]).numbers(&[foot, 0.0, 9.75]);
        (stamp, cdr.numbers(&[0.0; 3]).bytes)
    };
    (0..100).map(message).collect()
}

#[test]
fn frames_of_other_messages_are_separate_feet() {
    let bytes = bag("ros2msg", NAMED, &alternating_messages(), &["/load/fl", "/load/fr"]);
    let input_options = with_loads(topics(&["/feet"]), &["/load/fl", "/load/fr"]);
    let mut feet = open(&bytes, &input_options).unwrap();
    for ((foot, name), stored) in (1_u8..).zip(["fl", "fr"]).zip(&mut feet) {
        assert_eq!(stored.about.foot.as_deref(), Some(name));
        let said: String = stored.about.notices.iter().map(ToString::to_string).collect();
        assert!(
            said.ends_with(
                ": ax is ax, ay is ay, az is az, wx is gyro[0], wy is gyro[1], wz is gyro[2]"
            ),
            "{said}"
        );
        let samples = samples(stored);
        assert_eq!(samples.len(), 50);
        let is_own = |sample: &RecordedSample| {
            sample.imu.specific_force.0.x == f32::from(foot)
                && sample.load == Some(Load(f32::from(foot)))
        };
        assert!(samples.iter().all(is_own), "{foot}");
    }
}

#[test]
fn sensor_declared_missing_in_a_part_is_missing() {
    let message = |k: i64| {
        let stamp = START + 1_000_000 * k;
        let missing = if k == 7 { -1.0 } else { 0.0 };
        let cdr = Cdr::new(Order::Little).put([3]).header(stamp, b"fl");
        let cdr = cdr.numbers(&[0.0; 13]).numbers(&[0.0; 3]);
        let cdr = cdr.numbers(&[0.0; 9]).numbers(&[0.0, 0.0, 9.75]);
        (stamp, cdr.number(missing).numbers(&[0.0; 8]).bytes)
    };
    let messages: Vec<_> = (0..100).map(message).collect();
    let bytes = bag("ros2msg", PART, &messages, &[]);
    let mut feet = open(&bytes, &topics(&["/feet.imu"])).unwrap();
    let samples = samples(&mut feet[0]);
    let is_invalid = |k: &usize| samples[*k].imu.checked_validity() == Validity::Invalid;
    assert_eq!((0..100).filter(is_invalid).collect::<Vec<_>>(), [7]);
}

#[test]
fn definition_in_another_language_is_named() {
    let idl = "module my_msgs { struct Feet { double y; }; };";
    let bytes = bag("ros2idl", idl, &alternating_messages(), &[]);
    let said = why(open(&bytes, &topics(&["/feet"])));
    assert!(said.ends_with("its definition is in ros2idl, and only ros2msg is read"), "{said}");
}
