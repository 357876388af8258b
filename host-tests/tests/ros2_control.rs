//! The component of `ros2_control` in `ros2/footfall_hardware`, compiled against a stub of ROS 2's interfaces. It
//! receives the bytes of a foot's serial line and the frames of a bus, and exports their values.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use estimator_core::parameter::{Parameter, Row};
use estimator_core::velocity::{VelocityCoefficients, VelocityParams};
use estimator_core::{
    AngularRate, ContactEstimate, Decision, Flag, Flags, Phase, Timestamp, Validity, Vec3,
};
use host_tests::committed::assert_current;
use wire::node::NmtState;
use wire::pdo::{Contact, P16, Quantity, Rate};
use wire::uart::{ContactMessage, HealthMessage, Message, RawMessage, encode};
use wire::{Counters, Faults, Foot, Pdo, Stage};

const PACKAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../ros2/footfall_hardware");
/// The package's copy of the decoder, and its source.
const DECODER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../ros2/footfall_hardware/decoder");
const WIRE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../wire/c");

/// State interfaces of each foot, in the order in which they are printed.
const INTERFACES: usize = 4;

/// Compiles the component with the program that feeds it; each warning is an error.
fn compiled() -> PathBuf {
    let package = Path::new(PACKAGE);
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join("feed_footfall_sensor");
    let sources = ["foot", "lines", "footfall_sensor"].map(|name| format!("src/{name}.cpp"));
    let mut command = Command::new("c++");
    command
        .args(["-x", "c++", "-std=c++17", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow"])
        .args(["-Wconversion", "-Werror", "-I", "include", "-I", "test/stub", "-I", DECODER])
        .args(sources)
        .arg("test/feed_footfall_sensor.cpp")
        .arg(Path::new(DECODER).join("footfall.c"))
        .arg("-o")
        .arg(&program)
        .current_dir(package);
    let output = command.output().expect("a compiler of C++");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    program
}

/// Commands for the program.
#[derive(Default)]
struct Script(String);

impl Script {
    fn serial(&mut self, foot: &str, message: &Message) {
        let frame = encode(0, message);
        self.0 += &format!("serial {foot} {}\n", digits(frame.as_bytes()));
    }

    fn can(&mut self, pdo: Pdo, foot: Foot, data: &[u8]) {
        let id = pdo.cob_id(foot.default_node_id());
        self.0 += &format!("can {id:x} {}\n", digits(data));
    }

    fn line(&mut self, line: &str) {
        self.0 += line;
        self.0.push('\n');
    }

    /// Runs the program; returns the values of each read, by foot.
    fn run(&self, program: &Path) -> Vec<[[f64; INTERFACES]; 4]> {
        let mut child = Command::new(program)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program that was just built");
        let mut stdin = child.stdin.take().expect("piped");
        stdin.write_all(self.0.as_bytes()).expect("it reads");
        drop(stdin);
        let output = child.wait_with_output().expect("it ends");
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{errors}");
        let printed = String::from_utf8(output.stdout).expect("text");
        let of_read = |line: &str| {
            let numbers = line.split(' ').map(|number| number.parse().expect("a number"));
            let numbers: Vec<f64> = numbers.collect();
            let (feet, rest) = numbers.as_chunks();
            assert!(rest.is_empty(), "{line}");
            feet.try_into().expect("four feet")
        };
        printed.lines().map(of_read).collect()
    }
}

fn digits(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

fn estimate(p_stable: f32, decision: Decision, phase: Phase) -> ContactEstimate {
    let mut estimate = ContactEstimate {
        decision,
        phase,
        flags: Flags::NONE,
        angular_rate: AngularRate(Vec3::new(0.5, -0.25, 0.1)),
        ..ContactEstimate::DOUBTFUL
    };
    estimate.probabilities.stable = p_stable;
    estimate
}

/// Standard deviation that the estimator gives with its defaults.
fn sigma_v(probability: f32, rate: Vec3) -> f64 {
    let coefficients = VelocityCoefficients::new(&VelocityParams::DEFAULT);
    f64::from(coefficients.sigma(probability, rate, Flags::NONE).0)
}

fn assert_near(found: [f64; INTERFACES], expected: [f64; INTERFACES]) {
    for (found, expected) in found.into_iter().zip(expected) {
        let is_same = found.is_nan() && expected.is_nan();
        assert!(is_same || (found - expected).abs() < 1.0e-4, "{found} is not {expected}");
    }
}

const UNKNOWN: [f64; INTERFACES] = [f64::NAN; INTERFACES];

/// Values of a foot that is silent or not valid.
const DOUBTFUL: [f64; INTERFACES] = [0.0, 0.0, 100.0, f64::NAN];

#[test]
fn hardware_component_exports_the_feet_of_both_kinds_of_lines() {
    let stance = estimate(0.9, Decision::Stable, Phase::Stance);
    let slip = estimate(0.02, Decision::NotStable, Phase::Slip);
    let doubt = ContactEstimate { flags: Flags::NONE.with(Flag::Stale), ..stance };
    let contact =
        |estimate: &ContactEstimate| Message::Contact(ContactMessage::new(estimate, Faults::NONE));
    let raw = RawMessage {
        validity: Validity::Valid,
        rate: [300, -200, 100],
        rate_scale: 1.0e-3,
        ..RawMessage::default()
    };
    let health = Message::Health(HealthMessage {
        timestamp: Timestamp::from_micros(0),
        stage: Stage::Running,
        state: NmtState::Operational,
        id: Some(Foot::RearLeft.default_node_id()),
        faults: Faults::NONE,
        unknown_faults: 0,
        temperature: Quantity(0),
        counters: Counters::default(),
    });
    let on_bus = |estimate: &ContactEstimate| Contact::new(estimate, 0, Faults::NONE).encode();

    let mut script = Script::default();
    script.line("read 1.0");
    // The end of a frame whose start was not received.
    script.line("serial FL 123456");
    script.serial("FL", &contact(&stance));
    script.serial("FL", &Message::Raw(raw));
    script.serial("FR", &contact(&stance));
    script.can(Pdo::Contact, Foot::RearLeft, &on_bus(&stance));
    script.can(Pdo::Rate, Foot::RearLeft, &Rate::new(&stance, Faults::NONE).encode());
    script.can(Pdo::Contact, Foot::RearRight, &on_bus(&doubt));
    // Frames of a node on another line, and a frame that no foot sends.
    script.can(Pdo::Contact, Foot::FrontLeft, &on_bus(&slip));
    script.line("can 7ff 00");
    script.line("read 1.001");
    script.can(Pdo::Contact, Foot::RearLeft, &on_bus(&slip));
    script.line("read 1.04");
    // Silent from here.
    script.line("read 1.2");
    // A board that was plugged into another port.
    script.serial("FR", &contact(&stance));
    script.serial("FR", &health);
    script.line("read 1.21");
    script.line("unplug FL");
    script.line("read 1.22");
    script.can(Pdo::Contact, Foot::RearLeft, &on_bus(&stance));
    script.line("read 1.23");
    // After the clock is set back, the foot is valid again from its next contact on.
    script.line("read 0.2");
    script.can(Pdo::Contact, Foot::RearLeft, &on_bus(&stance));
    script.line("read 0.21");

    let [before, first, second, silent, swapped, unplugged, on_time, set_back, again] =
        script.run(&compiled())[..]
    else {
        panic!("a line for each read");
    };
    assert!(before.into_iter().flatten().all(f64::is_nan));

    let p = f64::from(P16::new(0.9).probability());
    assert_near(first[0], [1.0, p, sigma_v(0.9, raw.to_si().angular_rate.0), 0.0]);
    // Without a rate the velocity is not known.
    assert_near(first[1], [1.0, p, 100.0, 0.0]);
    assert_near(first[2], [1.0, p, sigma_v(0.9, stance.angular_rate.0), 0.0]);
    assert_near(first[3], DOUBTFUL);

    let p = P16::new(0.02).probability();
    assert_near(second[2], [0.0, f64::from(p), sigma_v(p, slip.angular_rate.0), 1.0]);
    assert!(silent.into_iter().all(|foot| foot[..3] == DOUBTFUL[..3]), "{silent:?}");
    assert_near(swapped[1], UNKNOWN);
    assert_near(unplugged[0], DOUBTFUL);
    let standing = [1.0, f64::from(P16::new(0.9).probability()), 100.0, 0.0];
    assert_near(on_time[2], standing);
    assert_near(set_back[2], DOUBTFUL);
    assert_near(again[2], standing);
}

#[test]
fn package_has_the_decoder_of_the_wire() {
    for file in ["footfall.c", "footfall.h"] {
        let source = std::fs::read_to_string(Path::new(WIRE).join(file)).expect(file);
        assert_current(&Path::new(DECODER).join(file), &source);
    }
}

#[test]
fn parameters_of_sigma_v_have_the_ranges_of_the_estimator() {
    let component = std::fs::read_to_string(Path::new(PACKAGE).join("src/footfall_sensor.cpp"));
    let component = component.expect("a source");
    for (name, parameter) in [
        ("velocity.speed", Parameter::VelocitySpeed),
        ("velocity.lever", Parameter::VelocityLever),
        ("velocity.floor", Parameter::VelocityFloor),
    ] {
        let Row { least, most, .. } = parameter.row();
        let line = component.lines().find(|line| line.contains(&format!("\"{name}\"")));
        let (_, arguments) = line.expect(name).rsplit_once("velocity_.").expect("its default");
        let range = arguments.trim_end_matches(");").split(", ").skip(1);
        let range: Vec<f32> = range.map(|limit| limit.parse().expect("a number")).collect();
        assert_eq!(range, [least, most], "{name}");
    }
}

#[test]
fn broadcaster_publishes_each_interface_of_each_foot() {
    let read = |file: &str| std::fs::read_to_string(Path::new(PACKAGE).join(file)).expect(file);
    // The rows of the component's table: {"contact", &FootValues::contact}.
    let component = read("src/footfall_sensor.cpp");
    let row = |line: &str| {
        Some(line.trim().strip_prefix("{\"")?.split_once("\", &FootValues::")?.0.to_owned())
    };
    let interfaces: Vec<String> = component.lines().filter_map(row).collect();
    assert_eq!(interfaces.len(), INTERFACES);
    let feet = ["FL", "FR", "RL", "RR"];
    let expected =
        feet.iter().flat_map(|foot| interfaces.iter().map(move |name| format!("{foot}/{name}")));
    let parameters = read("config/feet.yaml");
    let item = |line: &str| Some(line.trim().strip_prefix("- ")?.to_owned());
    let published: Vec<String> = parameters.lines().filter_map(item).collect();
    assert!(expected.eq(published.iter().cloned()), "{published:?}");
    let described = read("urdf/feet.ros2_control.xacro");
    for name in interfaces {
        assert!(described.contains(&format!("<state_interface name=\"{name}\"/>")), "{name}");
    }
    for foot in feet {
        assert!(described.contains(&format!("foot=\"{foot}\"")), "{foot}");
    }
}
