//! Bus load with all possible traffic, from the longest stuffed frames.

use wire::Settings;
use wire::settings::longest_frame;

const BIT_RATE: f64 = 1.0e6;
const FEET: f64 = 4.0;
const SYNC_HZ: f64 = 100.0;

fn longest(bytes: u32) -> f64 {
    f64::from(longest_frame(bytes))
}

#[test]
fn four_feet_and_all_other_traffic_use_less_than_75_percent() {
    let settings = Settings::default();
    // TPDOs and heartbeat.
    let streams = f64::from(settings.worst_load());
    // An emergency per second, and a master that reads an object of each foot ten times a second.
    let emergency = longest(8);
    let sdo = 2.0 * longest(8) * 10.0;
    // The robot sends the load of each foot at 100 Hz.
    let load = longest(4) * 100.0;
    let foot = streams + emergency + sdo + load;
    // SYNC with a counter, and one time stamp a second.
    let bus = FEET * foot + longest(1) * SYNC_HZ + longest(6);
    let share = bus / BIT_RATE;
    let contact = FEET * longest(8) * 1000.0 / BIT_RATE;
    println!("contact alone {contact:.3}, everything {share:.3} of the bus");
    assert!((0.53..0.55).contains(&contact), "contact takes {contact}");
    assert!(share < 0.75, "the bus is {share} full");
    assert!((0.70..0.715).contains(&share), "README.md says 71 %");
}

#[test]
fn a_slower_bus_carries_fewer_feet() {
    let streams = f64::from(Settings::default().worst_load());
    let feet = [1000, 500, 250, 125].map(|rate| (0.75 * f64::from(rate) * 1000.0 / streams) as u32);
    assert_eq!(feet, [4, 2, 1, 0], "README.md says so");
}
