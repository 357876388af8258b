//! Settings of every kind over an update, over CAN and over the serial line.

use estimator_core::Learnt;
use virtual_board::emulator::part::can::BusFrame;
use wire::dictionary::index;

use super::master::{CONFIRM, INSTALLED_MS, Master, new_image, sdo};
use crate::common::product;

/// Node id that is not the default of any foot.
const NODE: u8 = 0x2A;

/// Settings: object, subindex, bytes. Learnt values take effect with their CRC.
fn settings() -> Vec<(u16, u8, Vec<u8>)> {
    let learnt = |(subindex, word): (u8, u32)| (index::LEARNT, subindex, word.to_le_bytes().into());
    let stored = Learnt::from_array([0.5, 2.0, -5.0, 4.0, 4.0]);
    let mut settings = vec![
        (index::NODE_ID, 0, vec![NODE]),
        (index::CAN_BIT_RATE, 0, 500_u16.to_le_bytes().into()),
        (index::UART_RATE, 0, 115_200_u32.to_le_bytes().into()),
        (index::BANDWIDTH, 2, 0.5_f32.to_le_bytes().into()),
    ];
    let numbers = stored.to_array().map(f32::to_bits).into_iter();
    settings.extend((1..).zip(numbers.chain([Learnt::VERSION, stored.crc()])).map(learnt));
    settings
}

/// Asserts that the foot has the settings, and uses the rate of the bus.
fn assert_kept(master: &mut Master, when: &str) {
    assert_eq!(master.board.can_bit_rate(), Some(500_000), "{when}");
    for (index, subindex, bytes) in settings() {
        let answer = master.ask(&sdo(0x40, index, subindex, 0));
        assert!(
            answer[4..4 + bytes.len()] == bytes[..],
            "{when}: {index:#06x}:{subindex} is {answer:02x?}"
        );
    }
}

#[test]
#[ignore = "full: updates over both lines"]
fn settings_of_every_kind_survive_updates() {
    let elf = product();
    let mut master = Master::of(&elf);
    master.run(500);
    master.pause();
    for (index, subindex, bytes) in settings() {
        let command = [0x2F, 0x2B, 0, 0x23][bytes.len() - 1];
        let mut request = sdo(command, index, subindex, 0);
        request[4..4 + bytes.len()].copy_from_slice(&bytes);
        let answer = master.ask(&request);
        assert_eq!(answer[0], 0x60, "{index:#06x}:{subindex}: {answer:02x?}");
    }
    master.store();
    master.board.push_can(BusFrame::new(0, &[0x81, 0]));
    master.node = NODE;
    master.boot_up(1_000);
    assert_kept(&mut master, "before");
    let image = new_image(&elf);
    master.stop();
    master.install(&image);
    master.updated();
    assert_kept(&mut master, "after an update over CAN");
    assert_eq!(master.control(CONFIRM)[0], 0x60);
    master.stop_over_serial_line();
    master.install(&image);
    master.turn_to_bus();
    master.boot_up(INSTALLED_MS);
    assert_kept(&mut master, "after an update over the serial line");
}
