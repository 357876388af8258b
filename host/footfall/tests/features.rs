//! Tests of optional features: without a feature, the error names it and the build command, and nothing is written.

use crate::common::Bench;
use footfall::feature::Feature;

/// Commands by the feature they need.
const NEEDS: [(Feature, &str); 12] = [
    (Feature::Bags, "replay walk.mcap"),
    (Feature::Bags, "replay walk.db3"),
    (Feature::Bags, "replay walk.bag"),
    (Feature::Bags, "convert walk.csv new.mcap"),
    (Feature::Bags, "record demo:feet=1 --output new.mcap"),
    (Feature::Foxglove, "view demo:feet=1"),
    (Feature::Parquet, "replay walk.parquet"),
    (Feature::Parquet, "replay walk.csv --output new.parquet"),
    (Feature::Parquet, "convert walk.csv new.parquet"),
    (Feature::Ros2, "ros2 demo:feet=1 --compat champ"),
    (Feature::Ros2, "monitor ros2:FL=/lf_foot/imu"),
    (Feature::Ros2, "calibrate ros2:/*/imu"),
];

#[test]
fn missing_feature_error_names_the_build_command() {
    let bench = Bench::new();
    let table = b"t,ax,ay,az,wx,wy,wz\n0,0,0,9.8,0,0,0\n0.001,0,0,9.8,0,0,0\n";
    let files: [(_, &[u8]); 5] = [
        ("walk.csv", table),
        ("walk.mcap", b"\x89MCAP0\r\n"),
        ("walk.db3", b"SQLite format 3\0"),
        ("walk.bag", b"#ROSBAG V2.0\n"),
        ("walk.parquet", b"PAR1"),
    ];
    for (name, content) in files {
        std::fs::write(bench.path(name), content).expect("a file");
    }
    let before = bench.files();
    for (feature, arguments) in NEEDS {
        if feature.is_built() {
            continue;
        }
        let error = bench.error(arguments);
        let named = format!("needs the feature {feature}, ");
        assert!(error.contains(&named), "{arguments}: {error}");
        // The command must name the built features, too, because an installation without them would remove them.
        let features =
            Feature::ALL.into_iter().filter(|other| *other == feature || other.is_built());
        let features = features.map(|feature| feature.to_string()).collect::<Vec<_>>().join(",");
        let command =
            format!("cargo install --locked --path host/footfall --features {features}\n");
        assert!(error.ends_with(&command), "{arguments}: {error}");
        assert_eq!(bench.files(), before, "{arguments}");
    }
}

#[test]
fn version_lists_the_built_features() {
    let version = Bench::new().stdout("--version");
    let (number, features) = version.split_once(" (features: ").expect("features");
    assert_eq!(number, concat!("footfall ", env!("CARGO_PKG_VERSION")));
    let listed: Vec<_> = features.trim_end().trim_end_matches(')').split(", ").collect();
    for feature in Feature::ALL {
        assert_eq!(listed.contains(&feature.name()), feature.is_built(), "{feature}");
    }
}
