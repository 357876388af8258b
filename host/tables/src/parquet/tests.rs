use std::io::Write;
use std::sync::Arc;

use ::parquet::arrow::ArrowWriter;
use ::parquet::basic::{Compression, ZstdLevel};
use ::parquet::file::properties::WriterProperties;
use arrow_array::types::Int8Type;
use arrow_array::{
    ArrayRef, BooleanArray, DictionaryArray, DurationMillisecondArray, Float32Array, Float64Array,
    Int16Array, Int32Array, Int64Array, LargeStringArray, ListArray, NullArray, RecordBatch,
    StringArray, StringViewArray, StructArray, TimestampMicrosecondArray, TimestampSecondArray,
    UInt8Array, UInt64Array,
};
use arrow_schema::Field;
use estimator_core::{Load, Saturation, Validity};
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};
use samples::{Label, RecordedSample};

use options::InputOptions;
use stored::Stored;
use stored::container::Readable;
use stored::error::InputError;

const ROWS: usize = 20;

/// Six axes whose values are all different, without a time.
fn axes() -> Columns {
    axes_named(["ax", "ay", "az", "wx", "wy", "wz"])
}

fn axes_named(names: [&'static str; 6]) -> Columns {
    let axes = names.into_iter().enumerate();
    axes.map(|(axis, name)| (name, numbers(|k| k / 3.0 + axis as f64))).collect()
}

type Columns = Vec<(&'static str, ArrayRef)>;

fn numbers(of: impl Fn(f64) -> f64) -> ArrayRef {
    Arc::new(Float64Array::from_iter_values((0..ROWS).map(|k| of(k as f64))))
}

fn wholes(step: i64) -> impl Iterator<Item = i64> {
    (0..ROWS as i64).map(move |k| k * step)
}

fn seconds() -> ArrayRef {
    numbers(|k| k / 100.0)
}

fn written(columns: Vec<(&str, ArrayRef)>) -> Vec<u8> {
    let properties = WriterProperties::builder()
        .set_max_row_group_row_count(Some(7))
        .set_compression(Compression::ZSTD(ZstdLevel::default()));
    let batch = RecordBatch::try_from_iter_with_nullable(
        columns.into_iter().map(|(name, array)| (name, array, true)),
    )
    .unwrap();
    let mut bytes = Vec::new();
    let mut writer =
        ArrowWriter::try_new(&mut bytes, batch.schema(), Some(properties.build())).unwrap();
    writer.write(&batch).unwrap();
    writer.close().unwrap();
    bytes
}

fn open(bytes: &[u8], input_options: &InputOptions) -> Result<Stored, InputError> {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(bytes).unwrap();
    match Readable::open(file.path(), None, |file, _| Box::new(file), |_| None)? {
        Readable::Container(container) => {
            super::read(&container, input_options).map(|mut feet| feet.remove(0))
        }
        Readable::Text(_) => panic!("a container"),
    }
}

fn samples(columns: Vec<(&str, ArrayRef)>) -> Vec<RecordedSample> {
    let mut stored = open(&written(columns), &InputOptions::default()).unwrap();
    stored.samples().unwrap().map(Result::unwrap).collect()
}

/// The part of an error after the name of the file.
fn why(columns: Vec<(&str, ArrayRef)>) -> String {
    let result = open(&written(columns), &InputOptions::default());
    let said = result.err().expect("an error").to_string();
    let name = said.find(".tmp").expect("the name of a file");
    let rest = &said[name..];
    rest[rest.find([' ', ':', ',']).unwrap()..].to_owned()
}

fn with(more: Columns, mut columns: Columns) -> Columns {
    columns.extend(more);
    columns
}

fn times(samples: &[RecordedSample]) -> Vec<u64> {
    samples.iter().map(|sample| sample.imu.timestamp.as_micros()).collect()
}

#[test]
fn columns_of_ours_are_read_over_all_row_groups() {
    let samples = samples(with(vec![("t", seconds())], axes()));
    assert_eq!(samples.len(), ROWS);
    for (k, sample) in samples.iter().enumerate() {
        assert_eq!(sample.imu.timestamp.as_micros(), 10_000 * k as u64);
        assert_eq!(sample.imu.specific_force.0.y, (k as f64 / 3.0 + 1.0) as f32);
        assert_eq!(sample.imu.angular_rate.0.z, (k as f64 / 3.0 + 5.0) as f32);
    }
}

#[test]
fn time_is_the_same_in_every_type() {
    let expected: Vec<u64> = (0..ROWS as u64).map(|k| 1_000_000 * k).collect();
    let start = 1_700_000_000;
    let since_1970 = |per_second: i64| wholes(per_second).map(move |t| t + start * per_second);
    let floats = Float32Array::from_iter_values((0..ROWS).map(|k| k as f32));
    let shorts = Int16Array::from_iter_values((0..ROWS as i16).map(|k| k + 7));
    let nanos = Int64Array::from_iter_values(since_1970(1_000_000_000));
    let stamps = TimestampSecondArray::from_iter_values(since_1970(1));
    let utc = TimestampMicrosecondArray::from_iter_values(since_1970(1_000_000));
    let elapsed = DurationMillisecondArray::from_iter_values(wholes(1000));
    let text = |k| format!("2024-05-01T12:00:{k:02}.000000+02:00");
    let texts = StringArray::from_iter_values((0..ROWS).map(text));
    let columns: [(&str, ArrayRef); 8] = [
        ("t", Arc::new(floats)),
        ("t", Arc::new(shorts)),
        ("time_ms", Arc::new(Int64Array::from_iter_values(wholes(1000)))),
        ("t_ns", Arc::new(nanos)),
        ("t", Arc::new(stamps)),
        ("__index_level_0__", Arc::new(utc.with_timezone("+02:00"))),
        ("elapsed", Arc::new(elapsed)),
        ("t", Arc::new(texts)),
    ];
    for (name, column) in columns {
        let named = format!("{name}: {}", column.data_type());
        // Other names of times are recognised only in tables of other origin.
        let axes = match name {
            "time_ms" | "t_ns" => {
                axes_named(["acc_x", "acc_y", "acc_z", "gyro_x", "gyro_y", "gyro_z"])
            }
            _ => axes(),
        };
        let read = samples(with(vec![(name, column)], axes));
        assert_eq!(times(&read), expected, "{named}");
    }
}

#[test]
fn numbers_of_every_type_are_read_and_null_is_blank() {
    let some = |k: usize| (k != 3).then_some(k);
    let numbers = || (0..ROWS).map(some);
    let texts = || numbers().map(|k| k.map(|k| k.to_string()));
    let columns: [ArrayRef; 4] = [
        Arc::new(UInt8Array::from_iter(numbers().map(|k| k.map(|k| k as u8)))),
        Arc::new(UInt64Array::from_iter(numbers().map(|k| k.map(|k| k as u64)))),
        Arc::new(LargeStringArray::from_iter(texts())),
        Arc::new(StringViewArray::from_iter(texts())),
    ];
    for column in columns {
        let named = column.data_type().to_string();
        let read = samples(with(vec![("t", seconds()), ("force", column)], axes()));
        assert_eq!((read[2].load, read[3].load), (Some(Load(2.0)), None), "{named}");
    }
    let labels = BooleanArray::from_iter((0..ROWS).map(|k| some(k).map(|k| k > 5)));
    let empty = NullArray::new(ROWS);
    let more: Vec<(&str, ArrayRef)> =
        vec![("t", seconds()), ("label", Arc::new(labels)), ("force", Arc::new(empty))];
    let read = samples(with(more, axes()));
    let labels = [2, 3, 6].map(|k: usize| read[k].label);
    assert_eq!(labels, [Some(Label::NotStable), None, Some(Label::Stable)]);
    assert_eq!(read[0].load, None);
}

#[test]
fn validity_is_a_name_also_in_a_dictionary() {
    let name = |k: usize| ["valid", "stale", "gyroscope_saturated", ""][k % 4];
    let columns: [ArrayRef; 2] = [
        Arc::new(StringArray::from_iter_values((0..ROWS).map(name))),
        Arc::new(DictionaryArray::<Int8Type>::from_iter((0..ROWS).map(name))),
    ];
    for column in columns {
        let read = samples(with(vec![("t", seconds()), ("validity", column)], axes()));
        assert_eq!(read[1].imu.validity, Validity::Stale);
        assert_eq!(read[2].imu.validity, Validity::Saturated(Saturation::Gyroscope));
        assert_eq!(read[3].imu.validity, Validity::Valid);
    }
}

#[test]
fn columns_in_structs_have_the_names_of_both() {
    let of = |name: &'static str, parts: Vec<(&str, ArrayRef)>| {
        let fields = parts.into_iter().map(|(part, array)| {
            (Arc::new(Field::new(part, array.data_type().clone(), true)), array)
        });
        let array: ArrayRef = Arc::new(StructArray::from(fields.collect::<Vec<_>>()));
        (name, array)
    };
    let triple = |offset: f64| {
        ["x", "y", "z"]
            .into_iter()
            .enumerate()
            .map(|(axis, name)| (name, numbers(|k| k / 3.0 + axis as f64 + offset)))
            .collect()
    };
    let whole = Int32Array::from_iter_values((0..ROWS as i32).map(|k| 1_700_000_000 + k / 10));
    let nanosec =
        Int32Array::from_iter_values((0..ROWS as i32).map(|k| k % 10 * 100_000_000 + 499));
    let stamp =
        of("stamp", vec![("sec", Arc::new(whole) as ArrayRef), ("nanosec", Arc::new(nanosec))]);
    let read = samples(vec![
        of("header", vec![stamp]),
        of("angular_velocity", triple(3.0)),
        of("linear_acceleration", triple(0.0)),
    ]);
    let mut plain = samples(with(vec![("t", seconds())], axes()));
    for (k, sample) in plain.iter_mut().enumerate() {
        sample.imu.timestamp = estimator_core::Timestamp::from_micros(100_000 * k as u64);
    }
    assert_eq!(read, plain);
}

#[test]
fn errors_name_the_row_and_the_column() {
    let blank = Float64Array::from_iter((0..ROWS).map(|k| (k != 12).then_some(0.0)));
    let mut columns = axes();
    columns[1].1 = Arc::new(blank);
    assert_eq!(
        why(with(vec![("t", seconds())], columns)),
        ", row 13, column 2 (ay): blank where a number is needed; nan marks a missing reading"
    );
    let late = numbers(|k| if k == 5.0 { 0.0 } else { k });
    assert!(
        why(with(vec![("t", late)], axes())).starts_with(
            ", row 6, column 7 (t): time 0 s does not come after 4 s in the row before"
        )
    );
    let list =
        ListArray::from_iter_primitive::<Int8Type, _, _>((0..ROWS).map(|_| Some(vec![Some(0_i8)])));
    let mut columns = axes();
    columns[0].1 = Arc::new(list);
    assert!(
        why(with(vec![("t", seconds())], columns)).contains(": column ax has values of type List(")
    );
    let mut columns = axes();
    columns[0].1 = Arc::new(TimestampSecondArray::from_iter_values(wholes(1)));
    assert_eq!(
        why(with(vec![("t", seconds())], columns)),
        ", row 1, column 1 (ax): \"a time\" is not a number"
    );
    let odd = axes_named(["a", "b", "c", "d", "e", "f"]);
    assert_eq!(
        why(odd),
        ": missing in the header: ax, ay, az, wx, wy, wz; map gives the columns for them, \
         such as map ax=a,ay=b,az=c,wx=d,wy=e,wz=f"
    );
    let far = TimestampSecondArray::from_iter_values(wholes(i64::MAX / 100));
    assert!(
        why(with(vec![("t", Arc::new(far) as ArrayRef)], axes())).contains("is not a time in us")
    );
}

#[test]
fn mapping_and_units_are_applied() {
    let columns = axes_named(["u", "v", "w", "p", "q", "r"]);
    let bytes = written(with(vec![("clock", seconds())], columns));
    let mut input_options = InputOptions::default();
    input_options.table.mapping = "t=clock,ax=u,ay=v,az=w,wx=p,wy=q,wz=r".parse().unwrap();
    input_options.table.units = "dps".parse().unwrap();
    let mut stored = open(&bytes, &input_options).unwrap();
    let second = stored.samples().unwrap().nth(1).unwrap().unwrap();
    assert_eq!(second.imu.angular_rate.0.x, (1.0_f64 / 3.0 + 3.0).to_radians() as f32);
}

#[test]
fn file_without_rows_is_empty() {
    let mut columns = axes();
    for (_, column) in &mut columns {
        *column = column.slice(0, 0);
    }
    assert_eq!(why(columns), " is empty: it holds no sample");
}

#[test]
fn damage_is_an_error_without_panic() {
    let whole = written(with(vec![("t", seconds())], axes()));
    for length in 4..whole.len() {
        assert!(open(&whole[..length], &InputOptions::default()).is_err(), "{length}");
    }
    let mut random = SmallRng::seed_from_u64(0x5EED);
    for _ in 0..6_000 {
        let mut bytes = whole.clone();
        for _ in 0..=random.random_range(0..3) {
            let at = 4 + random.random_range(0..bytes.len() - 4);
            bytes[at] = match random.random_range(0..3) {
                0 => 0xFF,
                1 => bytes[at] ^ 1 << random.random_range(0..8),
                _ => random.random(),
            };
        }
        if let Err(error) = open(&bytes, &InputOptions::default()) {
            assert!(!error.to_string().contains('\n'), "{error}");
        }
    }
}

/// Written by pyarrow 26 with `write_page_checksum`.
const WITH_CHECKSUMS: &[u8] = include_bytes!("page_checksums.parquet");

#[test]
fn page_with_a_wrong_checksum_is_an_error() {
    let mut stored = open(WITH_CHECKSUMS, &InputOptions::default()).unwrap();
    let samples: Vec<_> = stored.samples().unwrap().map(Result::unwrap).collect();
    assert_eq!(times(&samples)[1], 10_000);
    let mut damaged = WITH_CHECKSUMS.to_vec();
    let second_time = 0.01_f64.to_le_bytes();
    let at = damaged.windows(8).position(|bytes| bytes == second_time).unwrap();
    damaged[at] ^= 1;
    let error = open(&damaged, &InputOptions::default()).err().expect("an error").to_string();
    assert!(error.contains("CRC"), "{error}");
}
