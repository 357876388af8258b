//! Recordings with labels, made up, in all the files that `footfall evaluate` reads.

use std::fs;

use recordings::input::pce::LabelScheme;
use scoring::labelled::GRAVITY_REMOVED;
use scoring::sets::{File, Layout, files};

use super::Bench;

/// A bench with recordings in a folder `data`: standing and swinging by turns.
pub fn bench() -> Bench {
    let bench = Bench::new();
    for file in files() {
        let path = bench.path("data").join(file.path);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, content(&file)).expect("a recording");
    }
    let marker = bench.path("data/robots/atlas500").join(GRAVITY_REMOVED);
    fs::write(marker, "").expect("a file");
    bench
}

fn content(file: &File) -> String {
    let (header, per_turn) = match file.layout {
        Layout::Robot(LabelScheme::StableOrNot) => ("", 300),
        Layout::Robot(LabelScheme::ContactClass) => ("", 30),
        Layout::Walk => ("t,ax,ay,az,wx,wy,wz,speed,label\n", 60),
        Layout::Foot { .. } => ("t,ax,ay,az,wx,wy,wz,force,label\n", 60),
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
            Layout::Robot(scheme) => {
                let label = match (scheme, stands) {
                    (LabelScheme::StableOrNot, true) | (LabelScheme::ContactClass, false) => 1,
                    (LabelScheme::StableOrNot, false) | (LabelScheme::ContactClass, true) => 0,
                };
                format!("{},{},{label}\n", cells(wrench), cells(motion))
            }
            Layout::Foot { .. } if file.path.contains("atlas500") => {
                let time = f64::from(k) / 200.0;
                format!("{time},{},0.0,{}\n", cells(motion), i32::from(stands))
            }
            Layout::Walk | Layout::Foot { .. } => {
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
