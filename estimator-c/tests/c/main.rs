//! Programs in C and C++ with the static library: the example gives the bits of the Rust estimator over recorded walks; the
//! header has the layout of the library.

mod boards;
mod packages;
mod support;

use std::env;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::mem::{offset_of, size_of};
use std::path::{Path, PathBuf};
use std::process::Command;

use estimator_c::error::Error;
use estimator_c::estimator::{MOST_SAMPLES, SIZE};
use estimator_c::types::{CEstimate, CLearnt, CParams, CSample};
use estimator_core::{
    ContactEstimate, Decision, Flag, Flags, Gravity, Learning, Phase, Saturation, Validity,
};
use host_tests::requirements::unmet;

use support::{WARNINGS, assert_same_bits, folder, run, walk};

const C: [&str; 2] = ["cc", "-std=c99"];
const CPP: [&str; 4] = ["c++", "-x", "c++", "-std=c++17"];
const SANITIZERS: [&str; 2] = ["-fsanitize=address,undefined", "-fno-sanitize-recover"];

/// Builds the static library for this machine as the archive has it.
fn library() -> PathBuf {
    let mut cargo = Command::new(env!("CARGO"));
    let arguments =
        "rustc --lib --profile firmware --crate-type staticlib --features alone --config";
    cargo.current_dir(folder()).args(arguments.split(' '));
    cargo.arg("profile.firmware.panic='abort'");
    let built = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("a target directory");
    run(cargo.env("CARGO_TARGET_DIR", built));
    built.join("firmware/libestimator_c.a")
}

/// Returns whether the compiler is installed.
fn installed(compiler: &str, package: &str) -> bool {
    let found = Command::new(compiler).arg("--version").output().is_ok();
    if !found {
        unmet(&format!("{compiler} is not installed (Debian: apt-get install {package})"));
    }
    found
}

/// Compiles a program for this machine with warnings as errors and sanitizers, and links it.
fn compile(compiler: &[&str], source: &Path, library: &Path, program: &Path) {
    let [name, options @ ..] = compiler else { unreachable!("a compiler") };
    let mut command = Command::new(name);
    command.args(options).args(WARNINGS).args(SANITIZERS);
    command.arg("-I").arg(folder().join("include")).arg(source);
    run(command.args(["-x", "none"]).arg(library).args(["-lm", "-o"]).arg(program));
}

#[test]
fn programs_in_c_and_cpp_have_the_bits_of_rust() {
    let library = library();
    let temporary = tempfile::tempdir().expect("a temporary directory");
    for (compiler, package) in [(&C[..], "gcc"), (&CPP[..], "g++")] {
        if installed(compiler[0], package) {
            let program = temporary.path().join(compiler[0]);
            let source = folder().join("examples/walk.c");
            compile(compiler, &source, &library, &program);
            let (lines, _) = walk("walk.csv");
            let input = temporary.path().join("input");
            fs::write(&input, &lines).expect("a file");
            let mut shown = Command::new(&program);
            let shown = run(shown.stdin(File::open(&input).expect("a file")));
            let shown = String::from_utf8(shown.stdout).expect("text");
            assert_eq!(shown.lines().count(), lines.lines().count() - 2);
            assert!(shown.lines().any(|line| line.ends_with("  stable")));
            let with_bits = [compiler, &["-DBITS"]].concat();
            compile(&with_bits, &source, &library, &program);
            assert_same_bits(temporary.path(), || Command::new(&program));
        }
    }
}

#[test]
fn programs_of_the_document_compile_as_c_and_cpp() {
    let document = folder().join("../docs/guide/your-own-board.md");
    let text = fs::read_to_string(document).expect("the document");
    let mut programs = text.split("```c\n").skip(1).map(|rest| rest.split("```").next());
    let mut program = || programs.next().flatten().expect("a program");
    let (source, batch) = (program(), program());
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let path = temporary.path().join("foot.c");
    let yours = "#include <string.h>\n\
                 static uint64_t now_us(void) { return 16000; }\n\
                 static size_t fifo_read(footfall_sample *samples, size_t most) {\n    \
                 memset(samples, 0, most * sizeof *samples);\n    return most;\n}\n";
    let read = format!(
        "static int foot_read(void) {{\n    footfall_estimate estimate;\n{batch}\n    \
         return samples[0].timestamp_us != 2000 || estimate.timestamp_us != 16000;\n}}\n"
    );
    let main = "int main(void) {\n    footfall_sample sample = {0, {0, 0, 0}, {0, 0, 0}, 0};\n    \
                return foot_start() + foot_may_be_leant_on(&sample) + foot_read();\n}\n";
    fs::write(&path, format!("{source}\n{yours}{read}{main}")).expect("a file");
    let library = library();
    for (compiler, package) in [(&C[..], "gcc"), (&CPP[..], "g++")] {
        if installed(compiler[0], package) {
            let program = temporary.path().join(compiler[0]);
            compile(compiler, &path, &library, &program);
            run(&mut Command::new(program));
        }
    }
}

/// Declarations of the parts of ROS 2 that the program of a document uses: a topic whose samples are given at once.
const ROS: [(&str, &str); 3] = [
    (
        "rclcpp/rclcpp.hpp",
        r#"
#pragma once
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
namespace builtin { struct Time { int32_t sec; uint32_t nanosec; }; }
namespace rclcpp {
struct SensorDataQoS {};
struct Time {
    builtin::Time time;
    explicit Time(const builtin::Time &of) : time(of) {}
    int64_t nanoseconds() const { return time.sec * 1000000000ll + time.nanosec; }
};
template <class M> struct Publisher {
    void publish(const M &message) { std::printf("%.9g\n", message.data); }
};
struct Node {
    std::function<void()> run;
    explicit Node(const char *) {}
    template <class M> std::shared_ptr<Publisher<M>> create_publisher(const char *, int) {
        return std::make_shared<Publisher<M>>();
    }
    template <class M, class F> int create_subscription(const char *, SensorDataQoS, F callback) {
        run = [callback] {
            for (uint32_t k = 0; k < 2000; ++k) {
                M imu{};
                imu.header.stamp = {static_cast<int32_t>(7 + k / 400), k % 400 * 2500000};
                imu.linear_acceleration.z = 9.81;
                callback(imu);
            }
        };
        return 0;
    }
};
inline void init(int, char **) {}
inline void spin(const std::shared_ptr<Node> &node) { node->run(); }
inline void shutdown() {}
}
"#,
    ),
    (
        "sensor_msgs/msg/imu.hpp",
        r#"
#pragma once
#include <rclcpp/rclcpp.hpp>
namespace sensor_msgs { namespace msg {
struct Vector3 { double x, y, z; };
struct Header { builtin::Time stamp; };
struct Imu { Header header; Vector3 angular_velocity, linear_acceleration; };
} }
"#,
    ),
    (
        "std_msgs/msg/float64.hpp",
        "#pragma once\nnamespace std_msgs { namespace msg { struct Float64 { double data; }; } }\n",
    ),
];

#[test]
fn node_of_the_document_publishes_p_of_each_sample() {
    let document = folder().join("../docs/guide/own-imus.md");
    let text = fs::read_to_string(document).expect("the document");
    let program = text.split("```cpp\n").nth(1).and_then(|rest| rest.split("```").next());
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let path = temporary.path().join("node.cpp");
    fs::write(&path, program.expect("a program")).expect("a file");
    for (name, content) in ROS {
        let header = temporary.path().join(name);
        fs::create_dir_all(header.parent().expect("a folder")).expect("a folder");
        fs::write(header, content).expect("a file");
    }
    if !installed(CPP[0], "g++") {
        return;
    }
    let program = temporary.path().join("node");
    let include = format!("-I{}", temporary.path().display());
    // The node keeps its subscription by a name that nothing else uses.
    let compiler = [&CPP[..], &[include.as_str(), "-Wno-unused-variable"]].concat();
    compile(&compiler, &path, &library(), &program);
    let shown = run(&mut Command::new(program));
    let shown = String::from_utf8(shown.stdout).expect("text");
    let probabilities: Vec<f64> = shown.lines().map(|line| line.parse().expect("P")).collect();
    assert_eq!(probabilities.len(), 2000);
    assert!(probabilities[1999] > 0.9, "{:?}", &probabilities[1990..]);
}

/// A C program's line for the size of a struct or the offset of a field, and the same in Rust.
macro_rules! layout {
    ($($name:literal = $type:ty { $($field:ident),* })*) => {
        [$((format!("sizeof({})", $name), size_of::<$type>()),
            $((format!("offsetof({}, {})", $name, stringify!($field)), offset_of!($type, $field)),)*)*]
    };
}

#[test]
fn header_has_the_layout_of_the_library() {
    if !installed(C[0], "gcc") {
        return;
    }
    let expected = layout! {
        "footfall_learnt" = CLearnt { bytes }
        "footfall_params" = CParams {
            sample_rate_hz, decision_threshold, decision_on_delay_s, decision_off_delay_s, load_on, load_off,
            velocity_speed_m_s, velocity_lever_m, velocity_floor_m_s, learnt, has_learnt, gravity, learning
        }
        "footfall_sample" = CSample { timestamp_us, specific_force_m_s2, angular_rate_rad_s, validity }
        "footfall_estimate" = CEstimate {
            timestamp_us, stable, tangential, vertical, axes, orientation, linear_acceleration_m_s2,
            angular_rate_rad_s, gyro_bias_rad_s, velocity_sigma_m_s, flags, decision, phase, reserved
        }
        "footfall_memory" = [u8; SIZE] {}
    };
    assert_same_in_c(&expected);
}

/// Constants of the header, and their values in the library.
fn constants() -> Vec<(String, usize)> {
    let mut constants = vec![
        ("FOOTFALL_OK".to_owned(), 0),
        ("FOOTFALL_MOST_SAMPLES".to_owned(), MOST_SAMPLES),
        ("FOOTFALL_ESTIMATOR_SIZE".to_owned(), SIZE),
    ];
    let mut add = |kind: &str, name: &str, value: usize| {
        constants.push((format!("FOOTFALL_{kind}{}", name.to_uppercase()), value));
    };
    for (name, error) in [
        ("null", Error::Null),
        ("misaligned", Error::Misaligned),
        ("too_small", Error::TooSmall),
        ("not_initialised", Error::NotInitialised),
        ("choice", Error::Choice),
        ("sample_rate", Error::SampleRate),
        ("decision", Error::Decision),
        ("load", Error::Load),
        ("velocity", Error::Velocity),
        ("learnt", Error::Learnt),
        ("count", Error::Count),
        ("unit", Error::Unit),
    ] {
        add("ERROR_", name, error as usize);
    }
    for (name, validity) in [
        ("valid", Validity::Valid),
        ("accelerometer_saturated", Validity::Saturated(Saturation::Accelerometer)),
        ("gyroscope_saturated", Validity::Saturated(Saturation::Gyroscope)),
        ("saturated", Validity::Saturated(Saturation::Both)),
        ("stale", Validity::Stale),
        ("invalid", Validity::Invalid),
    ] {
        let checked = |validity| CSample { validity, ..CSample::default() }.checked();
        add("SAMPLE_", name, number(|n| checked(n).is_ok_and(|read| read.validity == validity)));
    }
    let checked = |params: CParams| params.checked().expect("a constant");
    for (name, gravity) in [("included", Gravity::Included), ("removed", Gravity::Removed)] {
        let read = |gravity| checked(CParams { gravity, ..CParams::default() }).1.gravity();
        add("GRAVITY_", name, number(|n| read(n) == gravity));
    }
    for (name, learning) in [("on", Learning::On), ("frozen", Learning::Frozen)] {
        let read = |learning| checked(CParams { learning, ..CParams::default() }).0.learning;
        add("LEARNING_", name, number(|n| read(n) == learning));
    }
    let doubtful = ContactEstimate::DOUBTFUL;
    let converted = |estimate: ContactEstimate| CEstimate::from(&estimate);
    for flag in Flag::ALL {
        let flags = Flags::NONE.with(flag);
        let estimate = converted(ContactEstimate { flags, ..doubtful });
        add("FLAG_", flag.name(), estimate.flags as usize);
    }
    add("FLAG_", "unit", CEstimate::UNIT as usize);
    add("FLAG_", "gravity", CEstimate::GRAVITY as usize);
    for phase in Phase::ALL {
        let estimate = converted(ContactEstimate { phase, ..doubtful });
        add("PHASE_", phase.name(), estimate.phase.into());
    }
    for (name, decision) in [("not_stable", Decision::NotStable), ("stable", Decision::Stable)] {
        let estimate = converted(ContactEstimate { decision, ..doubtful });
        add("", name, estimate.decision.into());
    }
    constants
}

/// First number of C that the library takes for a value.
fn number(is_taken: impl Fn(u8) -> bool) -> usize {
    (0..=u8::MAX).position(is_taken).expect("a number of each value")
}

#[test]
fn header_has_the_constants_of_the_library() {
    if !installed(C[0], "gcc") {
        return;
    }
    let expected = constants();
    // The version has tests of its own.
    let header = include_str!("../../include/footfall_estimator.h");
    let parts = header.lines().flat_map(|line| line.split(['{', ',']));
    let enumerated = parts.filter_map(|part| Some(part.split_once(" = ")?.0.trim()));
    let enumerated: Vec<&str> = enumerated.filter(|name| name.starts_with("FOOTFALL_")).collect();
    assert!(enumerated.len() > 30, "{enumerated:?}");
    for name in enumerated {
        assert!(expected.iter().any(|(known, _)| known == name), "{name} is not compared");
    }
    assert_same_in_c(&expected);
}

/// Compares expressions of C with values of the library.
fn assert_same_in_c(expected: &[(String, usize)]) {
    let mut source = "#include <stddef.h>\n#include <stdio.h>\n#include \"footfall_estimator.h\"\nint main(void) {\n".to_owned();
    for (expression, _) in expected {
        writeln!(source, "    printf(\"%zu\\n\", (size_t)({expression}));").expect("memory");
    }
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let (path, program) = (temporary.path().join("layout.c"), temporary.path().join("layout"));
    fs::write(&path, source + "    return 0;\n}\n").expect("a file");
    compile(&C, &path, &library(), &program);
    let printed = String::from_utf8(run(&mut Command::new(program)).stdout).expect("text");
    for (value, (expression, expected)) in printed.lines().zip(expected) {
        assert_eq!(value.parse(), Ok(*expected), "{expression}");
    }
    assert_eq!(printed.lines().count(), expected.len());
}
