//! The time of a SYNC is the time of its end, also in the middle of a tick.

use crate::common::{MILLISECOND, boot_product, product, run};
use virtual_board::emulator::part::can::{BusFrame, TimedFrame};
use virtual_board::emulator::time::PER_SECOND;
use wire::pdo::{Health, Pdo};

const MICROSECOND: u64 = PER_SECOND / 1_000_000;

/// Duration of a bit at 1 Mbit/s.
const BIT: u64 = MICROSECOND;

/// Steps of the phase in the tick, µs; all phases are covered once.
const PHASE_STEP_US: u64 = 25;

/// Largest difference between the delays of two SYNCs, µs: the steps of the reported time are 10 µs, and the interrupt
/// waits for others.
const SPREAD_US: u64 = 14;

/// Pause between two frames, bits.
const PAUSE: u64 = 3;

/// Returns whether a frame of the foot was on the bus between two times.
fn is_busy(sent: &[TimedFrame], from: u64, to: u64) -> bool {
    let overlaps = |sent: &TimedFrame| {
        let begin = sent.time - sent.frame.bits() * BIT;
        begin < to && from < sent.time + PAUSE * BIT
    };
    sent.iter().any(overlaps)
}

#[test]
fn a_sync_has_the_time_of_its_end_at_each_phase() {
    let elf = product();
    let mut board = boot_product(&elf);
    run(&mut board, 1_000);
    let id = u32::from(Pdo::Health.base()) + 0x11;
    let mut delays = Vec::new();
    for number in 1..=(1_000 / PHASE_STEP_US) as u8 {
        board.take_can();
        let phase_us = PHASE_STEP_US * u64::from(number);
        let begin =
            (board.now() + MILLISECOND).next_multiple_of(MILLISECOND) + phase_us * MICROSECOND;
        let sync = BusFrame::new(0x080, &[number]);
        let end = begin + sync.bits() * BIT;
        board.push_can_at(sync, begin);
        run(&mut board, 150);
        let sent = board.take_can();
        let health = sent.iter().filter(|sent| sent.frame.id == id);
        let mut health = health.filter_map(|sent| sent.frame.data.as_slice().try_into().ok());
        let clock = health.find_map(|data: [u8; 8]| {
            let clock = Health::decode(&data).clock;
            (clock.sync == number).then_some(clock.time.0)
        });
        let reported_us = 10 * u64::from(clock.expect("a health frame with this SYNC"));
        // The health frame waits while another frame is on the bus.
        if !is_busy(&sent, begin, end) {
            delays.push(reported_us + 1_000_000 - end / MICROSECOND);
        }
    }
    assert!(delays.len() > 20, "{} SYNCs met an idle bus", delays.len());
    let (least, most) = (delays.iter().min(), delays.iter().max());
    let spread = most.zip(least).map(|(most, least)| most - least);
    assert!(spread <= Some(SPREAD_US), "{spread:?} µs: {delays:?}");
}
