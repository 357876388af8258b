//! Objects with the values learnt by the estimator.

use canopen_rs::Value as PeerValue;
use estimator_core::Learnt;
use wire::dictionary::index;
use wire::node::{Calibration, CalibrationState, NmtCommand};
use wire::{AbortCode, Address, DataType, Event, Settings, Value};

use super::master::{Node, node, read, refused, write};

/// Learnt values of a foot that has walked for a while.
fn learnt() -> Learnt {
    Learnt::from_array([-1.0, 2.0, -4.5, 4.0, 3.0])
}

const KEEP: Value = Value::U8(1);
const FORGET: Value = Value::U8(2);

#[test]
fn learnt_values_can_be_read_kept_and_forgotten() {
    let mut node = node();
    let command = Address::new(index::CALIBRATION, 1);
    let state = |node: &mut Node, expected: CalibrationState| {
        let address = Address::new(index::CALIBRATION, 2);
        assert_eq!(node.read(address), Ok(Value::U8(expected.code())));
    };
    state(&mut node, CalibrationState::Settling);
    assert_eq!(refused(&mut node, command, KEEP), AbortCode::InvalidValue);
    for (value, code) in [(0, AbortCode::TooLow), (3, AbortCode::TooHigh)] {
        assert_eq!(refused(&mut node, command, Value::U8(value)), code);
    }
    node.published.learnt = learnt();
    state(&mut node, CalibrationState::Settled);
    for (subindex, number) in (3..).zip(learnt().to_array()) {
        let address = Address::new(index::CALIBRATION, subindex);
        let expected = Ok(PeerValue::Real32(number));
        assert_eq!(read(&mut node, address, DataType::Real32), expected);
    }
    node.command(NmtCommand::StartRemoteNode);
    for value in [KEEP, FORGET] {
        assert_eq!(refused(&mut node, command, value), AbortCode::DeviceState);
    }
    node.command(NmtCommand::EnterPreOperational);
    assert_eq!(node.settings().params().params.learnt, None);
    let (result, events) = write(&mut node, command, KEEP);
    assert_eq!((result, events), (Ok(()), vec![Event::Calibration(Calibration::Keep)]));
    assert_eq!(node.settings().params().params.learnt, Some(learnt()));
    let (result, events) = write(&mut node, command, FORGET);
    assert_eq!((result, events), (Ok(()), vec![Event::Calibration(Calibration::Forget)]));
    assert_eq!(node.settings(), &Settings::default());
    // The command is also refused before new values are published.
    state(&mut node, CalibrationState::Settling);
    assert_eq!(refused(&mut node, command, KEEP), AbortCode::InvalidValue);
}

#[test]
fn the_calibration_is_frozen_if_learning_is_disabled() {
    for (subindex, value) in [(1, 1), (2, 0)] {
        let mut node = node();
        node.published.learnt = learnt();
        let address = Address::new(index::ESTIMATION, subindex);
        assert!(node.write(address, &[value]).is_ok());
        let state = node.read(Address::new(index::CALIBRATION, 2));
        assert_eq!(state, Ok(Value::U8(CalibrationState::Frozen.code())));
    }
}

#[test]
fn learnt_values_outside_the_limits_are_refused() {
    let mut node = node();
    let mut numbers = learnt().to_array();
    numbers[1] = 10.0;
    node.published.learnt = Learnt::from_array(numbers);
    let command = Address::new(index::CALIBRATION, 1);
    assert_eq!(refused(&mut node, command, KEEP), AbortCode::TooHigh);
    assert_eq!(node.settings(), &Settings::default());
}

#[test]
fn the_lock_refuses_calibration_commands() {
    let mut node = node();
    node.published.learnt = learnt();
    assert!(node.write(Address::new(index::LOCK, 0), &[1]).is_ok());
    let command = Address::new(index::CALIBRATION, 1);
    for value in [KEEP, FORGET] {
        assert_eq!(refused(&mut node, command, value), AbortCode::Locked);
    }
    assert_eq!(node.settings().params().params.learnt, None);
}
