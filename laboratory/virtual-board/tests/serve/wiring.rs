//! Load of a bus with the feet of each wiring that the guide describes.

use std::collections::BTreeMap;

use results::{Measurement, rounded};
use virtual_board::emulator::corner::Corner;
use virtual_board::emulator::time::{PER_SECOND, cycle};
use virtual_board::emulator::wiring::Wiring;
use virtual_board::product::serve::robot::{BoardRobot, ControlNode, RobotOptions};
use wire::dictionary::index;
use wire::{Address, Foot, Pdo, Value, pdo};

use crate::common::{is_built_here, product};
use crate::digest::digest_of;

/// Feet on one bus: the wiring, their number, the bit rate, kbit/s, and the period of a contact, ms.
type Profile = (&'static str, usize, u16, u16);

const PROFILES: [Profile; 3] = [
    ("one line past all feet", 4, 1000, 1),
    ("two lines, two feet on each", 2, 1000, 1),
    ("a star", 4, 500, 2),
];

/// Time from the start to the measurement, and its end, ms.
const FROM_MS: u64 = 1_000;
const UNTIL_MS: u64 = 3_500;

/// Share of the bus, %, up to which frames of low rank still get through.
const MOST_PERCENT: f64 = 80.0;

/// Frames that a bus has carried.
#[derive(Default)]
struct Carried {
    busy: u64,
    /// Times and sequence numbers of the contacts of each foot.
    contacts: BTreeMap<u32, Vec<(u64, u8)>>,
    dropped: u32,
}

fn carry((_, feet, kbit_s, period_ms): Profile, elf: &[u8]) -> Carried {
    let options = RobotOptions {
        feet,
        gait: gait::GaitName::Walk,
        seed: 1,
        corner: Corner::Typical,
        control: ControlNode::Present,
        settings: vec![
            (Address::new(index::CAN_BIT_RATE, 0), Value::U16(kbit_s)),
            (Address::new(index::TPDO, 5), Value::U16(period_ms)),
        ],
    };
    let robot = BoardRobot::start(elf.to_vec(), &options);
    let mut robot = robot.unwrap_or_else(|error| panic!("{error}"));
    let positions: Vec<Foot> = robot.positions().collect();
    let mut all = Carried::default();
    while robot.ms < UNTIL_MS {
        let is_measured = robot.ms >= FROM_MS;
        let happened = robot.step().unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(happened.resets, []);
        for carried in happened.carried.iter().filter(|_| is_measured) {
            assert_eq!(carried.bit_rate, u32::from(kbit_s) * 1000);
            let length = carried.frame.bits() * cycle(carried.bit_rate);
            all.busy += length;
            let Ok(data) = <[u8; 8]>::try_from(carried.frame.data.as_slice()) else {
                continue;
            };
            for foot in &positions {
                let node = foot.default_node_id();
                if carried.frame.id == u32::from(Pdo::Contact.cob_id(node)) {
                    let contact = pdo::Contact::decode(&data);
                    let contacts = all.contacts.entry(carried.frame.id).or_default();
                    contacts.push((carried.start + length, contact.sequence));
                } else if carried.frame.id == u32::from(Pdo::Health.cob_id(node)) {
                    all.dropped += u32::from(pdo::Health::decode(&data).dropped);
                }
            }
        }
    }
    assert_eq!((robot.bus.lost, all.contacts.len()), (0, feet));
    all
}

#[test]
fn bus_of_each_wiring_carries_all_contacts() {
    let elf = product();
    let mut result = Measurement::new(
        "bus-profiles",
        "Load of the CAN bus and times between contacts in each wiring, with all frames on and a robot that sends loads \
         and SYNCs at 100 Hz.",
    )
    .measured_by("cargo test -p virtual-board bus_of_each_wiring_carries_all_contacts")
    // The times of frames depend on the instructions of a tick.
    .tolerance("bus_load_percent", 0.05)
    .tolerance("longest_between_contacts_ms", 0.1);
    for profile in PROFILES {
        let (wiring, feet, kbit_s, period_ms) = profile;
        let all = carry(profile, &elf);
        let measured = (UNTIL_MS - FROM_MS) * PER_SECOND / 1000;
        let percent = 100.0 * all.busy as f64 / measured as f64;
        assert!(percent < MOST_PERCENT, "{wiring}: {percent} %");
        assert_eq!(all.dropped, 0, "{wiring}");
        let mut longest = 0;
        for contacts in all.contacts.values() {
            let expected = (UNTIL_MS - FROM_MS) / u64::from(period_ms);
            assert!(expected.abs_diff(contacts.len() as u64) <= 2, "{wiring}");
            for pair in contacts.windows(2) {
                let [(before, first), (after, second)] = pair else {
                    continue;
                };
                assert_eq!(first.wrapping_add(1), *second, "{wiring}");
                longest = longest.max(after - before);
            }
        }
        let longest_ms = longest as f64 * 1e3 / PER_SECOND as f64;
        result.row([
            ("wiring", wiring.into()),
            ("feet", feet.into()),
            ("bit_rate_kbit_s", kbit_s.into()),
            ("contact_period_ms", period_ms.into()),
            ("bus_load_percent", (percent.round() as u64).into()),
            ("longest_between_contacts_ms", rounded(longest_ms, 2).into()),
        ]);
    }
    if is_built_here() {
        let program = Wiring::reference().program;
        result.on_elf(program, digest_of(program)).assert_current();
    }
}
