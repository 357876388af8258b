//! Reading and writing objects over SDO and UART.

use canopen_rs::{Value as PeerValue, lss};
use wire::diagnosis::{Diagnosis, Reset};
use wire::dictionary::{
    self, Access, Concern, Limits, Role, SIGNATURE_BROWN_OUT, SIGNATURE_RESTORE, SIGNATURE_STORE,
    index,
};
use wire::node::{Crash, Finished, NmtCommand};
use wire::settings::UartStreams;
use wire::{AbortCode, Address, Counter, DataType, Event, Fault, Foot, Outcome, Stage, Value};

use super::master::{ID, accepted, node, peer_value, read, refused, send, write};

#[test]
fn readable_objects_are_read_by_the_peer_and_others_refused() {
    let mut node = node();
    for (address, entry) in dictionary::entries() {
        let value = read(&mut node, address, entry.data_type());
        if entry.access == Access::Wo {
            assert_eq!(value, Err(AbortCode::WriteOnly.code()), "{address:?}");
            continue;
        }
        let value = value.unwrap_or_else(|code| panic!("{address:?} is refused: {code:08X}"));
        if matches!(entry.role, Role::Constant | Role::Setting(_)) {
            assert_eq!(value, peer_value(entry.default), "{address:?}");
        }
        if matches!(entry.role, Role::CobId | Role::PdoCobId) {
            let id = entry.default.to_raw() + u32::from(ID);
            assert_eq!(value, PeerValue::Unsigned32(id), "{address:?}");
        }
    }
    let hash = read(&mut node, Address::new(0x2115, 0), DataType::Unsigned32);
    assert_eq!(hash, Ok(PeerValue::Unsigned32(node.settings().hash())));
    let serial = read(&mut node, Address::new(0x1018, 4), DataType::Unsigned32);
    assert_eq!(serial, Ok(PeerValue::Unsigned32(0xC0FFEE)));
    let missing = read(&mut node, Address::new(0x3000, 0), DataType::Unsigned8);
    assert_eq!(missing, Err(AbortCode::NoObject.code()));
    let missing = read(&mut node, Address::new(0x1018, 7), DataType::Unsigned8);
    assert_eq!(missing, Err(AbortCode::NoSubindex.code()));
}

#[test]
fn every_setting_takes_its_limits_and_refuses_values_beyond() {
    for (address, entry) in dictionary::settings() {
        if entry.role == Role::PdoCobId {
            continue;
        }
        let mut node = node();
        let Some((low, high)) = entry.limits().range() else {
            accepted(&mut node, address, entry.default);
            continue;
        };
        for value in [low, high] {
            let (result, events) = write(&mut node, address, value);
            // The load thresholds limit each other.
            if result == Err(AbortCode::Incompatible.code()) {
                let bit_rate = address.index == index::CAN_BIT_RATE && value == low;
                assert!(address.index == index::LOAD_INPUT || bit_rate, "{address:?}");
                continue;
            }
            assert_eq!(result, Ok(()), "{address:?} {value:?}");
            let concern = entry.concern().expect("a setting");
            assert_eq!(events, [Event::Changed { address, concern }]);
            if address.index == index::LOCK && value == high {
                accepted(&mut node, address, low);
            }
        }
        let choice = matches!(entry.limits(), Limits::OneOf(_) | Limits::RangeWithout(_));
        let (below, above) = match (low, high) {
            (Value::U8(low), Value::U8(high)) => {
                (low.checked_sub(1).map(Value::U8), high.checked_add(1).map(Value::U8))
            }
            (Value::U16(low), Value::U16(high)) => {
                (low.checked_sub(1).map(Value::U16), high.checked_add(1).map(Value::U16))
            }
            (Value::U32(low), Value::U32(high)) => {
                (low.checked_sub(1).map(Value::U32), high.checked_add(1).map(Value::U32))
            }
            (Value::F32(low), Value::F32(high)) => {
                let nan = refused(&mut node, address, Value::F32(f32::NAN));
                assert_eq!(nan, AbortCode::InvalidValue);
                (Some(Value::F32(low.next_down())), Some(Value::F32(high.next_up())))
            }
            other => panic!("{other:?}"),
        };
        let reason = |standard| {
            if choice { AbortCode::InvalidValue } else { standard }
        };
        if let Some(below) = below {
            assert_eq!(refused(&mut node, address, below), reason(AbortCode::TooLow));
        }
        if let Some(above) = above {
            assert_eq!(refused(&mut node, address, above), reason(AbortCode::TooHigh));
        }
    }
}

#[test]
fn the_lock_refuses_all_other_settings_and_the_defaults() {
    let mut node = node();
    let lock = Address::new(index::LOCK, 0);
    accepted(&mut node, lock, Value::U8(1));
    for (address, entry) in dictionary::settings().filter(|(address, _)| *address != lock) {
        let code = refused(&mut node, address, entry.default);
        assert_eq!(code, AbortCode::Locked, "{address:?}");
    }
    let restore = Address::new(index::RESTORE, 1);
    assert_eq!(refused(&mut node, restore, Value::U32(SIGNATURE_RESTORE)), AbortCode::Locked);
    // The lock itself can be stored and removed.
    let store = Address::new(index::STORE, 1);
    accepted(&mut node, store, Value::U32(SIGNATURE_STORE));
    accepted(&mut node, lock, Value::U8(0));
    let foot = Address::new(index::FOOT, 0);
    accepted(&mut node, foot, Value::U8(3));
    assert_eq!(node.settings().foot(), Foot::RearLeft);
}

#[test]
fn writes_of_read_only_objects_and_wrong_lengths_are_refused() {
    let mut node = node();
    for (address, entry) in dictionary::entries() {
        if matches!(entry.access, Access::Const | Access::Ro) {
            let value = match entry.default {
                Value::Text(_) => Value::U32(0),
                number => number,
            };
            assert_eq!(refused(&mut node, address, value), AbortCode::ReadOnly);
        }
    }
    let highest = Address::new(index::BANDWIDTH, 0);
    assert_eq!(refused(&mut node, highest, Value::U8(6)), AbortCode::ReadOnly);
    let wide = Address::new(index::FOOT, 0);
    assert_eq!(refused(&mut node, wide, Value::U16(1)), AbortCode::TooLong);
    let narrow = Address::new(index::WINDOW, 0);
    assert_eq!(refused(&mut node, narrow, Value::U16(1)), AbortCode::TooShort);
}

#[test]
fn store_and_restore_need_their_signatures() {
    let mut node = node();
    for (index, signature, event) in [
        (index::STORE, SIGNATURE_STORE, Event::Store),
        (index::RESTORE, SIGNATURE_RESTORE, Event::Restore),
        (index::SUPPLY, SIGNATURE_BROWN_OUT, Event::ProtectSupply),
    ] {
        let address = Address::new(index, if index == index::SUPPLY { 2 } else { 1 });
        for wrong in [0, 1, signature.swap_bytes(), signature ^ 0x2000_0000] {
            let code = refused(&mut node, address, Value::U32(wrong));
            assert_eq!(code, AbortCode::CannotStore);
        }
        let (result, events) = write(&mut node, address, Value::U32(signature));
        assert_eq!((result, events), (Ok(()), vec![event]));
        if index != index::SUPPLY {
            let reads = read(&mut node, address, DataType::Unsigned32);
            assert_eq!(reads, Ok(PeerValue::Unsigned32(1)));
        }
    }
}

#[test]
fn a_failed_store_is_reported_to_the_master() {
    let mut node = node();
    let request = [0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'];
    let outcome = send(&mut node, 0x600 + u16::from(ID), &request);
    assert_eq!((outcome.reply, outcome.event), (None, Some(Event::Store)));
    let answer = node.answer(Err(AbortCode::Hardware)).expect("an answer");
    assert_eq!(answer.data(), [0x80, 0x10, 0x10, 1, 0, 0, 6, 6]);
    assert_eq!(node.answer(Ok(())), None);
}

#[test]
fn the_state_of_the_board_can_be_read() {
    let mut node = node();
    node.published.stage = Stage::HoldStill;
    node.published.brown_out_level = 3;
    node.published.crash = Some(Crash { fault: Fault::HardFault, program_counter: 0x0800_1234 });
    node.published.counters.add(Counter::CanBusOff, 3);
    node.published.diagnosis = Diagnosis {
        reset: Reset::Watchdog,
        clock_khz: 160_000,
        bus_errors: [0, 0, 700],
        identity: 0x6C,
        noise: [33_000, 33_001, 33_002, 980, 981, 70_000],
        mean: [-2_049, 2, 3, 4, 5, 6],
        ..Diagnosis::default()
    };
    for (index, sub, expected) in [
        (index::STAGE, 0, Value::U8(2)),
        (index::SUPPLY, 1, Value::U8(3)),
        (index::LAST_CRASH, 1, Value::U16(0x6102)),
        (index::LAST_CRASH, 2, Value::U32(0x0800_1234)),
        (index::COUNTERS, Counter::CanBusOff as u8 + 1, Value::U32(3)),
        (index::DIAGNOSIS, 0, Value::U8(Diagnosis::HIGHEST_SUBINDEX)),
        (index::DIAGNOSIS, 1, Value::U8(4)),
        (index::DIAGNOSIS, 2, Value::U32(160_000)),
        (index::DIAGNOSIS, 16, Value::U16(700)),
        (index::DIAGNOSIS, 17, Value::U8(0x6C)),
        (index::DIAGNOSIS, 24, Value::U32(70_000)),
        (index::DIAGNOSIS, 25, Value::I16(-2_049)),
        (index::DIAGNOSIS, 30, Value::I16(6)),
    ] {
        let value = node.read(Address::new(index, sub));
        assert_eq!(value, Ok(expected));
    }
}

#[test]
fn uart_follows_the_same_rules() {
    let mut node = node();
    let window = Address::new(index::WINDOW, 0);
    let event = node.write(window, &20_000_u32.to_le_bytes());
    let changed = Event::Changed { address: window, concern: Concern::Estimator };
    assert_eq!(event, Ok(Some(changed)));
    assert_eq!(node.read(window), Ok(Value::U32(20_000)));
    let too_long = node.write(window, &300_000_u32.to_le_bytes());
    assert_eq!(too_long, Err(AbortCode::TooHigh));
    // The codes are the same as over SDO.
    assert_eq!(node.write(window, &[1]), Err(AbortCode::TooShort));
    assert_eq!(node.write(window, &[1; 5]), Err(AbortCode::TooLong));
    node.command(NmtCommand::StartRemoteNode);
    let running = node.write(window, &20_000_u32.to_le_bytes());
    assert_eq!(running, Err(AbortCode::DeviceState));
    let store = Address::new(index::STORE, 1);
    assert_eq!(node.write(store, b"save"), Ok(Some(Event::Store)));
    assert_eq!(node.finish(Ok(())), Some(Finished::Written(store)), "no master waits");
}

#[test]
fn each_stream_of_the_serial_line_has_its_period() {
    let mut node = node();
    for (subindex, ticks) in [(1, 2_u16), (2, 30), (3, 400)] {
        let address = Address::new(index::UART_STREAMS, subindex);
        let event = node.write(address, &ticks.to_le_bytes());
        let changed = Event::Changed { address, concern: Concern::Stream };
        assert_eq!(event, Ok(Some(changed)));
    }
    let streams = UartStreams { contact: 2, raw: 30, health: 400 };
    assert_eq!(node.settings().uart_streams(), streams);
}

#[test]
fn a_second_store_is_refused_while_the_first_is_pending() {
    let sdo = 0x600 + u16::from(ID);
    let save = [0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'];
    let load = [0x23, 0x11, 0x10, 1, b'l', b'o', b'a', b'd'];
    let mut node = node();
    send(&mut node, 0x7E5, &lss::encode_switch_global(true));
    // SDO first, LSS second.
    assert_eq!(send(&mut node, sdo, &save).event, Some(Event::Store));
    let second = send(&mut node, 0x7E5, &lss::encode_store());
    assert_eq!(second.event, None);
    assert_eq!(second.reply.expect("an answer").data()[..2], [0x17, 2]);
    let first = node.answer(Ok(())).expect("an answer");
    assert_eq!(first.data(), [0x60, 0x10, 0x10, 1, 0, 0, 0, 0]);
    // LSS first, SDO and UART second.
    let first = send(&mut node, 0x7E5, &lss::encode_store());
    assert_eq!((first.reply, first.event), (None, Some(Event::Store)));
    for request in [save, load] {
        let second = send(&mut node, sdo, &request);
        assert_eq!(second.event, None);
        let answer = second.reply.expect("an answer");
        assert_eq!(answer.data()[..1], [0x80]);
        assert_eq!(answer.data()[4..], [0, 0, 6, 6]);
    }
    let store = Address::new(index::STORE, 1);
    assert_eq!(node.write(store, b"save"), Err(AbortCode::Hardware));
    let answer = node.answer(Ok(())).expect("an answer");
    assert_eq!(answer.data()[..2], [0x17, 0]);
    assert_eq!(node.write(store, b"save"), Ok(Some(Event::Store)));
}

#[test]
fn an_abort_of_the_client_ends_its_transfer() {
    let mut node = node();
    let sdo = 0x600 + u16::from(ID);
    send(&mut node, sdo, &[0x40, 0x08, 0x10, 0, 0, 0, 0, 0]);
    let given_up = send(&mut node, sdo, &[0x80, 0x08, 0x10, 0, 0, 0, 4, 5]);
    assert_eq!(given_up, Outcome::default());
    let segment = send(&mut node, sdo, &[0x60, 0, 0, 0, 0, 0, 0, 0]).reply;
    assert_eq!(segment.expect("an answer").data()[0], 0x80);
}
