//! Four feet as one robot, through the commands of `footfall`: for tests of boards that stream them.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value as Json;

/// Names of the feet.
pub const FEET: [&str; 4] = ["FL", "FR", "RL", "RR"];

/// A robot that walks, and the program that reads it.
#[derive(Clone, Copy, Debug)]
pub struct OneRobot<'a> {
    /// `footfall`, with all features.
    pub program: &'a Path,
    /// Folder for files.
    pub folder: &'a Path,
    /// Sources of its feet: a line each, or a bus.
    pub sources: &'a [String],
    /// Contacts that a foot sends in a second.
    pub rate: f64,
}

impl OneRobot<'_> {
    /// Runs `footfall`; returns its output and its messages.
    ///
    /// # Panics
    /// It fails.
    #[must_use]
    pub fn footfall(&self, arguments: &[&str]) -> (String, String) {
        let output = Command::new(self.program)
            .args(arguments)
            .current_dir(self.folder)
            .stdin(Stdio::null())
            .output()
            .expect("the program runs");
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
        let (printed, said) = (text(output.stdout), text(output.stderr));
        assert!(output.status.success(), "{arguments:?}: {printed}{said}");
        (printed, said)
    }

    /// Runs a command that reads all feet.
    fn of_all(&self, command: &str, options: &[&str]) -> String {
        let sources = self.sources.iter().map(String::as_str);
        let arguments: Vec<&str> = [command].into_iter().chain(sources).collect();
        let (printed, said) = self.footfall(&[&arguments[..], options].concat());
        // Boards send their samples only if they are asked to.
        let is_expected = |line: &str| line.contains("the foot sent no samples");
        assert!(said.lines().all(is_expected), "{command}: {said}");
        printed
    }

    /// Watches the robot, records it, publishes it, replays its recording and calibrates it. Each time it must have its four
    /// feet, without missing contacts.
    ///
    /// # Panics
    /// A foot is not there as it should be.
    pub fn walk(&self) {
        let lines = self.of_all("monitor", &["--json", "--seconds", "3"]);
        let lines: Vec<Json> =
            lines.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
        for foot in FEET {
            let of_foot = |line: &&Json| line["foot"] == foot && line["rate_hz"].is_number();
            let line =
                lines.iter().rfind(of_foot).unwrap_or_else(|| panic!("no {foot}: {lines:#?}"));
            let rate = line["rate_hz"].as_f64().expect("a number");
            assert!((rate / self.rate - 1.0).abs() < 0.02, "{line}");
            assert_eq!((&line["missing"], &line["dropped"]), (&0.into(), &0.into()), "{line}");
        }

        const SECONDS: f64 = 6.0;
        let options = ["--seconds", "6", "--compat", "champ", "-o", "robot.mcap"];
        let report = self.of_all("record", &options);
        let published =
            self.of_all("ros2", &["--seconds", "3", "--compat", "champ", "--network", "127.0.0.1"]);
        for (report, seconds) in [(&report, SECONDS), (&published, 3.0)] {
            let least = 0.9 * seconds * self.rate;
            for foot in FEET {
                let contacts = count(report, &format!("/footfall/{foot}/contact"));
                assert!(contacts as f64 > least, "{foot}: {contacts}\n{report}");
            }
            // A message for each round of contacts.
            let of_all = count(report, "/foot_contacts");
            assert!(of_all as f64 > 0.8 * least, "{of_all}\n{report}");
            let lines = report.lines().filter(|line| line.ends_with("/contact"));
            assert_eq!(lines.count(), FEET.len(), "{report}");
        }

        let (replayed, _) = self.footfall(&["replay", "robot.mcap", "--topic", "all", "--json"]);
        let replayed: Json = serde_json::from_str(&replayed).expect("JSON");
        let recordings = replayed["recordings"].as_array().expect("recordings");
        assert_eq!(recordings.len(), FEET.len(), "{replayed:#}");
        for recording in recordings {
            let samples = recording["samples"].as_f64().expect("a number");
            assert!(samples > 0.9 * SECONDS * self.rate, "{recording:#}");
        }
        let _ = fs::remove_file(self.folder.join("robot.mcap"));
        self.calibrate();
    }

    /// Makes each foot keep its learnt values. The feet walk, so no foot finds its axes.
    fn calibrate(&self) {
        for (index, foot) in FEET.into_iter().enumerate() {
            let node = (0x11 + index).to_string();
            let of_foot = match self.sources {
                [bus] => vec![bus.as_str(), "--node", &node],
                lines => vec![lines[index].as_str()],
            };
            let options = ["--write", "--seconds", "2", "--json"];
            let (report, said) = self.footfall(&[&["calibrate"], &of_foot[..], &options].concat());
            let report: Json = serde_json::from_str(&report).expect("JSON");
            assert_eq!(report["written"], true, "{foot}: {said}");
            assert!(report["feet"][foot]["learnt"].is_object(), "{report:#}");
        }
    }

    /// Runs the steps of the acceptance that need no person, on a source whose foot stands still.
    ///
    /// # Panics
    /// It is not accepted.
    pub fn accept(&self, source: &str) {
        let only = ["accept", source, "--only", "board,still", "--json", "--seconds", "60"];
        let (report, said) = self.footfall(&only);
        let report: Json = serde_json::from_str(&report).expect("JSON");
        assert_eq!((&report["accepted"], &report["out"]), (&true.into(), &0.into()), "{said}");
    }
}

/// Number before a topic in a report; 0 without one.
fn count(report: &str, topic: &str) -> u64 {
    let found = report.lines().filter_map(|line| {
        let (count, of) = line.trim().split_once(' ')?;
        (of.trim() == topic).then(|| count.parse::<u64>().expect("a number"))
    });
    found.sum()
}
