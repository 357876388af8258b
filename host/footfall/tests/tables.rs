//! Tests of table formats in use: the same walk gives the same P in each of them, and an unknown header is answered
//! with a working mapping.

use std::fs;
use std::path::Path;

use crate::common::{AXES, Bench, assert_has, read, text};

/// Number of rows of the committed walk in the files in this directory.
const ROWS: usize = 400;

/// A row of the walk as text.
struct Sample {
    micros: i64,
    axes: [String; 6],
    force: String,
}

fn walk() -> Vec<Sample> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../host-tests/recordings/walk.csv");
    let row = |line: &str| {
        let cells: Vec<_> = line.split(',').collect();
        let seconds: f64 = cells[0].parse().expect("a time");
        Sample {
            micros: (seconds * 1e6).round() as i64,
            axes: std::array::from_fn(|axis| cells[axis + 1].to_owned()),
            force: cells[7].to_owned(),
        }
    };
    read(&path).lines().skip(1).take(ROWS).map(row).collect()
}

/// Returns a table with this header, and the result of `row` for each sample.
fn table(header: &str, row: impl Fn(&Sample) -> String) -> String {
    let rows: String = walk().iter().map(|sample| row(sample) + "\n").collect();
    format!("{header}\n{rows}")
}

fn seconds(sample: &Sample) -> String {
    format!("{:.6}", sample.micros as f64 / 1e6)
}

/// Returns a table of times in s, axes and loads with this header.
fn named(header: &str) -> String {
    table(header, |sample| {
        let axes = sample.axes.join(",");
        format!("{},{axes},{}", seconds(sample), sample.force)
    })
}

fn plain() -> String {
    named(&format!("t,{AXES},force"))
}

/// Returns the summary of a replay, and its standard error.
fn summary(bench: &Bench, arguments: &str) -> (serde_json::Value, String) {
    let output = bench.run(&format!("replay {arguments} --json"));
    let summary: serde_json::Value =
        serde_json::from_slice(&output.stdout).expect("one JSON object");
    (summary["recordings"][0].clone(), text(&output.stderr))
}

/// Returns all estimates of a recording without their times.
fn estimates(bench: &Bench, arguments: &str) -> Vec<String> {
    bench.stdout(&format!("replay {arguments} --output out.csv --overwrite"));
    let row = |line: &str| line.split_once(',').map(|(_, rest)| rest.to_owned());
    let table = read(&bench.path("out.csv"));
    table.lines().filter_map(row).collect()
}

/// Returns a row of estimates without the state, which needs a load.
fn without_state(row: &str) -> String {
    let mut cells: Vec<_> = row.split(',').collect();
    cells.remove(cells.len() - 3);
    cells.join(",")
}

/// Checks that a file gives the estimates of the plain walk, to the last digit.
fn assert_same(name: &str, content: impl AsRef<[u8]>, options: &str) {
    let bench = Bench::with(name, content);
    fs::write(bench.path("plain.csv"), plain()).expect("a file");
    let expected = estimates(&bench, "plain.csv");
    let found = estimates(&bench, &format!("{name} {options}"));
    assert_eq!(expected.len(), ROWS + 1);
    assert_eq!(found.len(), ROWS + 1, "{name}");
    for (row, (expected, found)) in expected.iter().zip(&found).enumerate() {
        assert_eq!(without_state(found), without_state(expected), "{name}, row {row}");
    }
}

/// Returns the six axes in ROS order: rates first.
fn rates_first(axes: &[String; 6]) -> String {
    [&axes[3..], &axes[..3]].concat().join(",")
}

#[test]
fn ros2_topic_echo_is_read_without_header() {
    let zeros = ["0.0"; 9].join(",");
    let text: String = walk()
        .iter()
        .map(|sample| {
            let [ax, ay, az, wx, wy, wz] = &sample.axes;
            let seconds = 1_714_564_800 + sample.micros / 1_000_000;
            let nanoseconds = sample.micros % 1_000_000 * 1000;
            format!(
                "{seconds},{nanoseconds},imu_link,0.0,0.0,0.0,1.0,{zeros},{wx},{wy},{wz},{zeros},{ax},{ay},{az},{zeros}\n"
            )
        })
        .collect();
    assert_same("echo.csv", &text, "");
    // Unknown orientation: -1 in its covariance.
    let unknown = text.replace("0.0,0.0,0.0,1.0,0.0,0.0", "0.0,0.0,0.0,0.0,-1.0,0.0");
    assert_same("unknown.csv", unknown, "");
    // Forty arbitrary numbers are not accepted as a message.
    let numbers = text.replace("0.0,0.0,0.0,1.0", "0.0,0.0,0.0,2.0");
    assert!(Bench::with("x.csv", numbers).error("replay x.csv").contains("no header"));
}

#[test]
fn plotjuggler_rows_of_other_topics_are_skipped() {
    let header = "__time,/cmd/x,/imu/angular_velocity/x,/imu/angular_velocity/y,\
                  /imu/angular_velocity/z,/imu/linear_acceleration/x,\
                  /imu/linear_acceleration/y,/imu/linear_acceleration/z";
    let content = table(header, |sample| {
        let time = 1_714_564_800 + sample.micros / 1_000_000;
        let micros = sample.micros % 1_000_000;
        format!(
            "{time}.{micros:06},,{}\n{time}.{:06},0.5,,,,,,",
            rates_first(&sample.axes),
            micros + 1
        )
    });
    assert_same("plot.csv", &content, "");
    let bench = Bench::with("plot.csv", content);
    let (summary, stderr) = summary(&bench, "plot.csv");
    assert_eq!(summary["input"]["blank_rows"], 400);
    assert_has(&stderr, "plot.csv: ax is /imu/linear_acceleration/x, ay is ");
    assert_has(&stderr, "plot.csv: 400 rows left out, in which all six axes are blank\n");
}

#[test]
fn ros_1_rostopic_echo_times_are_nanoseconds() {
    let header = "%time,field.header.seq,field.header.stamp,field.angular_velocity.x,\
                  field.angular_velocity.y,field.angular_velocity.z,field.linear_acceleration.x,\
                  field.linear_acceleration.y,field.linear_acceleration.z";
    // The second start is that of a simulation clock, which begins at 0.
    for start in [1_714_564_800_000_000, 0] {
        let content = table(header, |sample| {
            let nanoseconds = (start + sample.micros) * 1000;
            format!("{nanoseconds},1,{nanoseconds},{}", rates_first(&sample.axes))
        });
        assert_same("echo.csv", content, "");
    }
}

#[test]
fn pandas_datetime_index_without_name_is_read() {
    // Written by pandas 3.1.1, `to_csv` of a table with a `DatetimeIndex`.
    assert_same("pandas.csv", include_bytes!("tables/pandas.csv"), "");
}

#[test]
fn blank_pandas_cell_is_an_invalid_sample() {
    let table = read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tables/pandas.csv"));
    let mut rows: Vec<String> = table.lines().map(str::to_owned).collect();
    let cells: Vec<_> = rows[99].split(',').collect();
    rows[99] = format!("{},,{}", cells[0], cells[2..].join(","));
    let (summary, _) = summary(&Bench::with("pandas.csv", rows.join("\n")), "pandas.csv");
    assert_eq!(summary["flag_counts"]["invalid_sample"], 1, "{summary}");
    assert_eq!(summary["samples"], 400);
}

#[test]
fn unitree_logs_are_recognised_by_their_fields() {
    for (time, imu) in [("timestamp", "imu"), ("time", "imu_state")] {
        let names =
            |sensor: &str| [0, 1, 2].map(|axis| format!("{imu}.{sensor}[{axis}]")).join(",");
        let header = format!("{time},{},{},motor[0].q", names("accelerometer"), names("gyroscope"));
        assert_same("log.csv", named(&header), "");
    }
    let header = "timestamp,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z";
    let content =
        table(header, |sample| format!("{},{}", seconds(sample), rates_first(&sample.axes)));
    assert_same("log.csv", content, "");
}

#[test]
fn px4_log_converted_by_ulog2csv_is_read() {
    let axes = |field: &str| [0, 1, 2].map(|axis| format!("{field}[{axis}]")).join(",");
    let header = format!(
        "timestamp,{},gyro_integral_dt,accelerometer_timestamp_relative,{},accelerometer_integral_dt",
        axes("gyro_rad"),
        axes("accelerometer_m_s2")
    );
    let content = table(&header, |sample| {
        let [ax, ay, az, wx, wy, wz] = &sample.axes;
        format!("{},{wx},{wy},{wz},4000,0,{ax},{ay},{az},4000", 68_000_000 + sample.micros)
    });
    assert_same("log.csv", content, "--time-unit us");
}

#[test]
fn gzip_and_zstd_are_recognised_by_content() {
    // Written by gzip 1.12 and zstd 1.5.
    let gzip = include_bytes!("tables/walk.csv.gz");
    assert_same("walk.csv.gz", gzip, "");
    assert_same("walk.csv", gzip, "");
    assert_same("walk.csv.zst", include_bytes!("tables/walk.csv.zst"), "");
    let summary = Bench::with("walk.csv.gz", gzip).stdout("replay walk.csv.gz");
    assert!(summary.starts_with("walk: 400 samples"), "{summary}");
    let cut = Bench::with("walk.csv.gz", &gzip[..2000]).run("replay walk.csv.gz");
    let summary = text(&cut.stdout);
    assert!(summary.starts_with("walk: 138 samples"), "{summary}");
    assert_eq!(
        text(&cut.stderr),
        "footfall: walk.csv.gz: the compressed data ends early; what comes before is read\n"
    );
}

#[test]
fn any_column_can_be_mapped() {
    let header = "clock,u,v,w,p,q,r,/foot/load";
    let content = named(header);
    let map = "--map t=clock,ax=u,ay=v,az=w,wx=p,wy=q,wz=r,force=load";
    assert_same("walk.csv", &content, map);
    let bench = Bench::with("walk.csv", content);
    assert_eq!(
        bench.error("replay walk.csv --map ax=acc"),
        "footfall: walk.csv, line 1: there is no column \"acc\" to map; there are clock, u, v, w, \
         p, q, r, /foot/load\n"
    );
}

#[test]
fn unknown_header_error_suggests_a_working_mapping() {
    let header = "Time [s],BodyAccX (m/s^2),BodyAccY (m/s^2),BodyAccZ (m/s^2),RotX,RotY,RotZ";
    let content = table(header, |sample| format!("{},{}", seconds(sample), sample.axes.join(",")));
    let bench = Bench::with("x.csv", &content);
    let mapping = "t=Time [s],ax=BodyAccX (m/s^2),ay=BodyAccY (m/s^2),az=BodyAccZ (m/s^2),\
                   wx=RotX,wy=RotY,wz=RotZ";
    assert_eq!(
        bench.error("replay x.csv"),
        format!(
            "footfall: x.csv, line 1: missing in the header: ax, ay, az, wx, wy, wz; did you mean \
             --map {mapping}?\n"
        )
    );
    // The suggestion works; a shell would quote it, but this bench splits at spaces.
    let renamed = content.replace(" [s]", "").replace(" (m/s^2)", "");
    let mapping = mapping.replace(" [s]", "").replace(" (m/s^2)", "");
    assert_same("x.csv", renamed, &format!("--map {mapping}"));
}

#[test]
fn two_sensors_error_gives_a_mapping_of_each() {
    let names = |foot: &str| {
        let axis = |field: &str| ["x", "y", "z"].map(|axis| format!("/{foot}/{field}/{axis}"));
        [axis("linear_acceleration"), axis("angular_velocity")].concat().join(",")
    };
    let header = format!("__time,{},{}", names("fl"), names("fr"));
    let content = table(&header, |sample| {
        let axes = sample.axes.join(",");
        format!("{},0,0,0,0,0,0,{axes}", seconds(sample))
    });
    let map = |foot: &str| {
        let theirs = names(foot);
        let pairs = AXES.split(',').zip(theirs.split(','));
        let pairs: Vec<_> = pairs.map(|(ours, theirs)| format!("{ours}={theirs}")).collect();
        format!("--map {}", pairs.join(","))
    };
    assert_eq!(
        Bench::with("x.csv", &content).error("replay x.csv"),
        format!(
            "footfall: x.csv, line 1: /fl/linear_acceleration/x, /fr/linear_acceleration/x are of \
             different sensors: choose one, {} or {}\n",
            map("fl"),
            map("fr")
        )
    );
    assert_same("x.csv", content, &map("fr"));
}

#[test]
fn units_and_units_of_time_are_converted() {
    let content = table(&format!("t,{AXES}"), |sample| {
        let value = |axis: usize| sample.axes[axis].parse::<f64>().expect("a number");
        let g = [0, 1, 2].map(|axis| (value(axis) / 9.80665).to_string());
        let dps = [3, 4, 5].map(|axis| value(axis).to_degrees().to_string());
        format!("{},{},{}", sample.micros, g.join(","), dps.join(","))
    });
    let bench = Bench::with("x.csv", content);
    fs::write(bench.path("plain.csv"), plain()).expect("a file");
    let p = |arguments: &str| -> Vec<f64> {
        let first = |row: &String| row.split(',').next()?.parse().ok();
        estimates(&bench, arguments).iter().filter_map(first).collect()
    };
    let expected = p("plain.csv");
    assert_eq!(expected.len(), ROWS);
    for (expected, found) in expected.iter().zip(p("x.csv --units g,dps --time-unit us")) {
        assert!((expected - found).abs() < 1e-3, "{expected} {found}");
    }
}

#[test]
fn unit_of_times_since_1970_is_detected() {
    for (unit, factor) in [("ms", 1_000), ("us", 1), ("ns", 0)] {
        let content = table(&format!("t,{AXES}"), |sample| {
            let micros = 1_714_564_800_000_000 + sample.micros;
            let axes = sample.axes.join(",");
            match factor {
                0 => format!("{micros}000,{axes}"),
                1 => format!("{micros},{axes}"),
                _ => format!("{}.{:03},{axes}", micros / 1000, micros % 1000),
            }
        });
        assert_same("x.csv", &content, "");
        assert_same("x.csv", &content, &format!("--time-unit {unit}"));
    }
}

/// Returns a foot that stands for one second at 1 kHz, with these times in ms.
fn standing_at(times: impl Fn(i64) -> i64) -> String {
    let rows: String = (0..1000).map(|k| format!("{},0,0,9.81,0,0,0\n", times(k))).collect();
    format!("t,{AXES}\n{rows}")
}

#[test]
fn non_increasing_times_are_dropped_on_request() {
    let content = standing_at(|k| match k {
        100 => 99,
        500 => 900_000,
        700 => 3,
        _ => k,
    });
    let bench = Bench::with("x.csv", content);
    assert_eq!(
        bench.error("replay x.csv --time-unit ms"),
        "footfall: x.csv, line 102, column 1 (t): time 99 ms does not come after 99 ms in the row \
         before: sort the rows, leave such rows out with --times drop-bad, or smooth times that jitter with --times smooth; \
         if rows of several feet have the same times, name the column of the foot: --map foot=COLUMN\n"
    );
    let (summary, stderr) = summary(&bench, "x.csv --time-unit ms --times drop-bad");
    assert_eq!(summary["samples"], 997);
    assert_eq!(summary["input"]["dropped_rows"], 3);
    assert_eq!(summary["sample_rate_hz"], 1000.0);
    assert_eq!(stderr, "footfall: x.csv: 3 rows left out, whose times do not advance\n");
}

#[test]
fn batches_are_spaced_by_the_rate_on_request() {
    let content = standing_at(|k| k / 10 * 10);
    let bench = Bench::with("x.csv", content);
    for rate in ["", "--sample-rate 1000"] {
        let (summary, _) = summary(&bench, &format!("x.csv --time-unit ms --times rate {rate}"));
        assert_eq!(summary["samples"], 1000);
        assert_eq!(summary["sample_rate_hz"], 1000.0);
        assert_eq!(summary["duration_s"], 0.999);
        assert_eq!(summary["input"]["retimed_rows"], 900);
    }
}

#[test]
fn jittered_times_with_a_gap_are_smoothed_on_request() {
    // 500 Hz, stamps late or early by up to 3 ms, and a gap of 0.5 s.
    let time = |k: i64| 2_000 * k + if k < 600 { 0 } else { 500_000 };
    let stamp = |k: i64| time(k) + (k * 7_919 % 601) * 10 - 3_000;
    let rows: String = (0..1000).map(|k| format!("{},0,0,9.81,0,0,0\n", stamp(k))).collect();
    let bench = Bench::with("x.csv", format!("t_us,{AXES}\n{rows}"));
    bench.refuses("replay x.csv", "or smooth times that jitter with --times smooth");
    bench.refuses(
        "replay x.csv --times drop-bad",
        "of 1000 rows would be left out though only their times jitter: --times smooth keeps all rows",
    );
    let (summary, stderr) = summary(&bench, "x.csv --times smooth");
    assert_eq!(summary["samples"], 1000);
    assert_eq!(summary["sample_rate_hz"], 500.0);
    assert_has(&stderr, "x.csv: times are smooth up to a gap and after it\n");
    bench.stdout("replay x.csv --times smooth --output out.csv");
    let time = |row: &str| row.split(',').next().and_then(|cell| cell.parse().ok());
    let times: Vec<f64> = read(&bench.path("out.csv")).lines().skip(1).filter_map(time).collect();
    assert_eq!(times.len(), 1000);
    assert!(times.windows(2).all(|two| two[0] < two[1]));
    let gap = times[600] - times[599];
    assert!((gap - 0.502).abs() < 0.003, "{gap}");
}

#[test]
fn tables_in_utf16_are_read() {
    let little = |text: &str| text.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<_>>();
    let big = |text: &str| text.encode_utf16().flat_map(u16::to_be_bytes).collect::<Vec<_>>();
    let marked = format!("\u{feff}{}", plain().replace('\n', "\r\n"));
    for content in [little(&plain()), big(&plain()), little(&marked), big(&marked)] {
        assert_same("walk.csv", content, "");
    }
}

#[test]
fn fixed_unit_formats_reject_table_options() {
    let row = "0,0,0,0,0,0,0,0,0,0,0,0,1\n".repeat(100);
    assert_eq!(
        Bench::with("x.csv", row).error("replay x.csv --format pce-atlas --units g"),
        "footfall: x.csv is read as pce-atlas, which has columns, units and times of its own: \
         --time-unit is for csv and parquet, --map, --units and --times for mcap, rosbag2 and rosbag1, too\n"
    );
}

#[test]
fn table_of_two_feet_is_read_as_two_feet() {
    let rows = table(&format!("t,{AXES},foot"), |sample| {
        let row = |foot| format!("{},{},{foot}", seconds(sample), sample.axes.join(","));
        format!("{}\n{}", row("FL"), row("FR"))
    });
    let bench = Bench::with("two.csv", rows);
    let output = bench.run("replay two.csv --json");
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one object");
    let feet = summary["recordings"].as_array().expect("feet");
    let of = |foot: &serde_json::Value| (foot["foot"].clone(), foot["samples"].clone());
    assert_eq!(
        feet.iter().map(of).collect::<Vec<_>>(),
        [("FL".into(), ROWS.into()), ("FR".into(), ROWS.into())]
    );
    let stderr = text(&output.stderr);
    assert_has(&stderr, "two.csv: split into feet by column foot: FL, FR");
}

#[test]
fn stream_of_two_feet_is_refused() {
    let rows = table(&format!("t,{AXES},side"), |sample| {
        let row = |foot, us| format!("{us}e-6,{},{foot}", sample.axes.join(","));
        format!("{}\n{}", row("left", sample.micros), row("right", sample.micros + 400))
    });
    // So few that they are read at once.
    let rows: Vec<&str> = rows.lines().take(100).collect();
    let output = Bench::new().piped("replay - --output -", &(rows.join("\n") + "\n"));
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert_has(&said, "several feet, and one is wanted here: left, right");
}

#[test]
fn stamps_of_a_computer_are_smoothed_by_themselves() {
    // Stamps that a computer rounds down to multiples of 3 ms, of samples at 200 Hz.
    let content = table(&format!("t,{AXES}"), |sample| {
        let stamp = sample.micros / 1000 * 5 / 3 * 3;
        format!("{}e-3,{}", stamp, sample.axes.join(","))
    });
    let bench = Bench::with("x.csv", content);
    let (smooth, stderr) = summary(&bench, "x.csv");
    assert_has(
        &stderr,
        "around a steady 200.0 Hz, and are smoothed: --times keep reads them as they are",
    );
    let (kept, stderr) = summary(&bench, "x.csv --times keep");
    assert!(!stderr.contains("smoothed"), "{stderr}");
    assert_eq!(smooth["samples"], kept["samples"]);
}
