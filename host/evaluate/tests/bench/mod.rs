//! Temporary folder with synthetic recordings, in which `evaluate` runs.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use evaluate::labelled::GRAVITY_REMOVED;
use evaluate::sets::{File, FileLayout, files};
use recordings::input::published::simulated::LabelScheme;
use tempfile::TempDir;

pub struct Bench {
    folder: TempDir,
}

impl Bench {
    pub fn new() -> Self {
        Self {
            folder: tempfile::tempdir().expect("a temporary folder"),
        }
    }

    /// Creates all recordings in a folder `data`, with alternating stance and swing.
    pub fn with_recordings() -> Self {
        let bench = Self::new();
        for file in files() {
            let path = bench.path("data").join(file.path);
            fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            fs::write(path, content(&file)).expect("a recording");
        }
        let marker = bench.path("data/robots/atlas500").join(GRAVITY_REMOVED);
        fs::write(marker, "").expect("a file");
        bench
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).expect("a file that was just written")
    }

    fn run(&self, arguments: &str) -> Output {
        Command::new(env!("CARGO_BIN_EXE_evaluate"))
            .args(arguments.split_whitespace())
            .current_dir(&self.folder)
            .output()
            .expect("the program that was just built")
    }

    /// Standard output of a run that succeeds.
    pub fn stdout(&self, arguments: &str) -> String {
        let output = self.run(arguments);
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).expect("UTF-8")
    }

    /// Standard error of a run that fails and prints nothing else.
    pub fn error(&self, arguments: &str) -> String {
        let output = self.run(arguments);
        assert!(!output.status.success(), "{output:?}");
        assert!(output.stdout.is_empty(), "{output:?}");
        String::from_utf8(output.stderr).expect("UTF-8")
    }
}

fn content(file: &File) -> String {
    let (header, per_turn) = match file.layout {
        FileLayout::Robot(LabelScheme::StableOrNot) => ("", 300),
        FileLayout::Robot(LabelScheme::ContactClass) => ("", 30),
        FileLayout::Walk => ("t,ax,ay,az,wx,wy,wz,speed,label\n", 60),
        FileLayout::Foot { .. } => ("t,ax,ay,az,wx,wy,wz,force,label\n", 60),
    };
    let row = |k: u32| {
        let noise = 0.02 * (f64::from(k * 7919 % 1000) / 1000.0 - 0.5);
        let stands = (k / per_turn).is_multiple_of(2);
        let [wrench, motion] = if stands {
            let motion = [noise, noise, 0.0, 0.0, 0.0, 0.0];
            [[1.0, 2.0, 800.0, 3.0, 4.0, 5.0], motion]
        } else {
            let a = if k.is_multiple_of(2) { 8.0 } else { -8.0 };
            [[0.0; 6], [a, 7.0, 6.0, 3.0, 2.0, noise]]
        };
        match file.layout {
            FileLayout::Robot(scheme) => {
                let label = match (scheme, stands) {
                    (LabelScheme::StableOrNot, true) | (LabelScheme::ContactClass, false) => 1,
                    (LabelScheme::StableOrNot, false) | (LabelScheme::ContactClass, true) => 0,
                };
                format!("{},{},{label}\n", cells(wrench), cells(motion))
            }
            FileLayout::Foot { .. } if file.path.contains("atlas500") => {
                let time = f64::from(k) / 200.0;
                format!("{time},{},0.0,{}\n", cells(motion), i32::from(stands))
            }
            FileLayout::Walk | FileLayout::Foot { .. } => {
                let [ax, ay, az, wx, wy, wz] = motion;
                let force = cells([ax, ay, az - 9.81, wx, wy, wz]);
                let time = f64::from(k) / 200.0;
                format!("{time},{force},0.0,{}\n", i32::from(stands))
            }
        }
    };
    header.to_owned() + &(0..per_turn * 20).map(row).collect::<String>()
}

fn cells(values: [f64; 6]) -> String {
    values.map(|value| value.to_string()).join(",")
}
