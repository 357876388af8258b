use super::*;

const NESTED: &str = "# A comment
uint8 KIND = 3
string<=10 label \"a=b\"   # default
Inner[2] inner
int16[<=3] few
other/Empty empty
float64 last
================================================================================
MSG: test_msgs/msg/Inner
bool on
float32[] many
uint64 big 7
================================================================================
MSG: other/Empty
int32 ONLY=1
";

/// A message of [`NESTED`], little endian.
fn message() -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    let mut put = |size: usize, value: &[u8]| {
        while !(bytes.len() - 4).is_multiple_of(size) {
            bytes.push(0xAA);
        }
        bytes.extend_from_slice(value);
    };
    put(4, &3_u32.to_le_bytes());
    put(1, b"ab\0");
    for inner in 0..2_u8 {
        put(1, &[inner]);
        put(4, &2_u32.to_le_bytes());
        for k in 0..2_u8 {
            put(4, &(f32::from(10 * inner + k) + 0.5).to_le_bytes());
        }
        put(8, &(1000 + u64::from(inner)).to_le_bytes());
    }
    put(4, &2_u32.to_le_bytes());
    put(2, &(-7_i16).to_le_bytes());
    put(2, &8_i16.to_le_bytes());
    // The one byte of an empty type.
    put(1, &[0]);
    put(8, &(-2.25_f64).to_le_bytes());
    bytes
}

fn nested() -> Definition {
    Definition::parse("test_msgs/msg/Outer", NESTED).unwrap()
}

fn values(names: &[&str], payload: &[u8]) -> Result<Vec<f64>, MessageProblem> {
    let definition = nested();
    let paths: Vec<FieldPath> =
        (names.iter()).map(|name| definition.number(name).unwrap()).collect();
    definition.values(payload, &paths.iter().collect::<Vec<_>>())
}

#[test]
fn numbers_are_found_behind_every_kind_of_field() {
    let names = ["last", "inner[1].many[0]", "inner[0].on", "inner[1].big", "few[0]", "few[1]"];
    assert_eq!(values(&names, &message()).unwrap(), [-2.25, 10.5, 0.0, 1001.0, -7.0, 8.0]);
    // In big endian each value is reversed; the first one is enough here.
    let swapped = [&[0, 0, 0, 0][..], &[0, 0, 0, 7]].concat();
    let single = Definition::parse("a/msg/B", "int32 x").unwrap();
    let path = single.number("x").unwrap();
    assert_eq!(single.values(&swapped, &[&path]).unwrap(), [7.0]);
}

#[test]
fn cut_and_overlong_messages_are_refused() {
    let whole = message();
    for length in 0..whole.len() {
        assert!(values(&["last"], &whole[..length]).is_err(), "{length}");
    }
    let longer = [&whole[..], &[0; 4]].concat();
    let said = values(&["last"], &longer).unwrap_err().to_string();
    let (bytes, expected) = (longer.len(), whole.len());
    assert_eq!(said, format!("{bytes} bytes are more than its type has, {expected}"));
    let said = values(&["few[2]"], &whole).unwrap_err().to_string();
    assert!(said.contains("fewer elements"), "{said}");
}

#[test]
fn paths_to_no_number_are_named() {
    let definition = nested();
    for (name, why) in [
        ("first", "there is no first, but label, inner, few, empty, last"),
        ("inner[2].big", "inner has the elements [0] to [1]"),
        ("inner[0]", "inner[0] has the numbers on, big"),
        ("inner", "inner is not one number"),
        ("few", "few is not one number"),
        ("label", "label is not one number"),
        ("last[0]", "last is not an array"),
        ("last.x", "what is before .x has no fields"),
        ("few[x]", "\"few[x]\" is not of the form field[INDEX]"),
    ] {
        let said = definition.number(name).unwrap_err().to_string();
        assert!(said.contains(why), "{name}: {said}");
    }
    let numbers = ["inner[0].on", "inner[0].big", "inner[1].on", "inner[1].big", "last"];
    assert_eq!(definition.names(""), numbers);
}

#[test]
fn hostile_definitions_are_refused() {
    for (text, why) in [
        ("a/B b\n===\nMSG: a/B\na/B b", "has a/B within itself"),
        ("c/D d", "lacks c/D"),
        ("int32[x] y", "a line that is not a field"),
        ("int32[3 y", "a line that is not a field"),
    ] {
        let said = Definition::parse("a/msg/A", text).unwrap_err().to_string();
        assert!(said.contains(why), "{text}: {said}");
    }
    // Each of 30 types contains the next one twice, and a chain of types is 1000 deep.
    let nested_types = |levels: usize, fields: &dyn Fn(usize) -> String| -> String {
        let sections = (1..levels).map(|k| format!("===\nMSG: a/T{k}\n{}\n", fields(k + 1)));
        fields(1)
            + "\n"
            + &sections.collect::<String>()
            + &format!("===\nMSG: a/T{levels}\nint32[0] x")
    };
    let twice = nested_types(30, &|k| format!("T{k} a\nT{k} b"));
    let twice = Definition::parse("a/msg/A", &twice).unwrap();
    assert!(twice.names("").is_empty());
    let path = FieldPath::default();
    let said = twice.values(&[0, 1, 0, 0], &[&path]).unwrap_err().to_string();
    assert!(said.contains("more than 4000000 fields"), "{said}");
    let deep = Definition::parse("a/msg/A", &nested_types(1000, &|k| format!("T{k} a")));
    let said = deep.unwrap_err().to_string();
    assert!(said.contains("more than 32 types within each other"), "{said}");
    // Arrays of four billion elements take neither time nor memory.
    let huge = "Z[4000000000] z\nint32[4000000000] x\n===\nMSG: a/Z\nint32[0] none";
    let huge = Definition::parse("a/msg/A", huge).unwrap();
    let path = huge.number("x[3]").unwrap();
    assert!(huge.values(&[0, 1, 0, 0, 1, 2, 3, 4], &[&path]).is_err());
    assert_eq!(huge.names("").len(), MOST_NAMES);
}

#[test]
fn numbers_beside_wide_text_are_found_in_each_encoding() {
    let text = "uint8 first\nwstring title\nwstring[2] names\nfloat64 force";
    let definition = Definition::parse("a/msg/A", text).unwrap();
    let paths = ["first", "force"].map(|name| definition.number(name).unwrap());
    for unit in [1, 2, 4] {
        let mut message = vec![0, 1, 0, 0, 7];
        for characters in [3_u32, 0, 5] {
            message.resize(message.len().next_multiple_of(4), 0);
            message.extend(characters.to_le_bytes());
            message.resize(message.len() + unit * characters as usize, 1);
        }
        // Alignment counts from the fifth byte.
        message.resize((message.len() - 4).next_multiple_of(8) + 4, 0);
        message.extend(12.5_f64.to_le_bytes());
        let paths: Vec<&FieldPath> = paths.iter().collect();
        assert_eq!(definition.values(&message, &paths).unwrap(), [7.0, 12.5]);
        message.extend([0; 32]);
        let said = definition.values(&message, &paths).unwrap_err().to_string();
        assert!(said.starts_with("its wstrings have neither"), "{said}");
    }
    let said = definition.number("title").unwrap_err().to_string();
    assert!(said.contains("title is not one number"), "{said}");
}

#[test]
fn known_definitions_are_complete() {
    for (message, _) in KNOWN {
        let definition = Definition::of(message, None).map_err(|problem| problem.to_string());
        let numbers = definition
            .and_then(|definition| definition.numbers("").map_err(|problem| problem.to_string()));
        assert!(numbers.is_ok(), "{message}: {numbers:?}");
    }
    let state = Definition::of("unitree_go/msg/LowState", None).unwrap();
    assert!(state.number("foot_force[3]").is_ok());
    assert!(state.number("imu_state.accelerometer[2]").is_ok());
    let joints = Definition::of("sensor_msgs/msg/JointState", None).unwrap();
    assert!(joints.number("effort[3]").is_ok());
    assert!(joints.number("header.stamp.nanosec").is_ok());
    assert!(Definition::of("a/msg/Unknown", None).is_err());
}

#[test]
fn element_of_a_known_array_is_found() {
    let array = Definition::of("std_msgs/msg/Float32MultiArray", None).unwrap();
    let path = |name| array.number(name).unwrap();
    // One dimension: its label, size and stride; then the offset and three numbers.
    let layout = [1, 2, 0x0000_0078, 3, 3, 0];
    let mut message = vec![0, 1, 0, 0];
    message.extend(layout.into_iter().flat_map(u32::to_le_bytes));
    message.extend(3_u32.to_le_bytes());
    message.extend([0.5_f32, -2.0, 7.0].into_iter().flat_map(f32::to_le_bytes));
    let found = array.values(&message, &[&path("data[1]")]);
    assert_eq!(found.unwrap(), [-2.0]);
    assert!(array.values(&message, &[&path("data[3]")]).is_err());
    let stamped = Definition::of("geometry_msgs/msg/WrenchStamped", None).unwrap();
    assert!(stamped.number("wrench.force.z").is_ok() && stamped.stamp("").is_some());
}

#[test]
fn times_are_known_without_their_definitions() {
    let text = "builtin_interfaces/Duration life\nbuiltin_interfaces/Time at\nuint8 last";
    let marker = Definition::parse("my_msgs/msg/Marker", text).unwrap();
    for name in ["life.nanosec", "at.sec", "last"] {
        assert!(marker.number(name).is_ok(), "{name}");
    }
}
