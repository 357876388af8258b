//! How full the bus is when everything that can be said is said, from the longest stuffed frames.

use wire::settings::Trigger;
use wire::{Pdo, Settings};

const BIT_RATE: f64 = 1.0e6;
const FEET: f64 = 4.0;
const SYNC_HZ: f64 = 100.0;

/// The longest a standard data frame can be on the wire, bits: 34 bits are stuffed before the
/// data, one more with every four bits after the first; then delimiter, acknowledgement, end of
/// frame and the space between frames. (Davis, Burns, Bril, Lukkien: *Controller Area Network
/// (CAN) schedulability analysis*, 2007, equation 1.)
fn longest(bytes: u32) -> f64 {
    f64::from(8 * bytes + 13 + 34 + (34 + 8 * bytes - 1) / 4)
}

#[test]
fn a_frame_of_eight_bytes_is_at_most_135_bits() {
    assert_eq!(longest(8), 135.0);
}

#[test]
fn four_feet_and_all_else_stay_under_three_quarters_of_the_bus() {
    let settings = Settings::default();
    let streams: f64 = Pdo::ALL
        .into_iter()
        .map(|pdo| match settings.trigger(pdo) {
            Trigger::Off => 0.0,
            Trigger::Ticks(period) => longest(8) * 1000.0 / f64::from(period),
            Trigger::Sync(every) => longest(8) * SYNC_HZ / f64::from(every),
        })
        .sum();
    let heartbeat = longest(1) * 1000.0 / f64::from(settings.heartbeat_ms());
    // An emergency each second, and a master that reads an object of each foot ten times a second.
    let emergency = longest(8);
    let sdo = 2.0 * longest(8) * 10.0;
    // The robot tells the load of each foot at 100 Hz.
    let load = longest(4) * 100.0;
    let foot = streams + heartbeat + emergency + sdo + load;
    // SYNC with a counter, and one time stamp a second.
    let bus = FEET * foot + longest(1) * SYNC_HZ + longest(6);
    let share = bus / BIT_RATE;
    let contact = FEET * longest(8) * 1000.0 / BIT_RATE;
    println!("contact alone {contact:.3}, everything {share:.3} of the bus");
    assert!((0.53..0.55).contains(&contact), "contact takes {contact}");
    assert!(share < 0.75, "the bus is {share} full");
    assert!((0.70..0.715).contains(&share), "README.md says 71 %");
}
