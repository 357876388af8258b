//! Faults and the emergencies that report them.

use canopen_rs::Value as PeerValue;
use wire::dictionary::index;
use wire::node::NmtCommand;
use wire::{AbortCode, Address, BootCause, DataType, Fault, Settings, Value};

use super::master::{ID, Node, accepted, emergencies, node, read, refused};

#[test]
fn a_held_back_fault_is_active_and_reported_on_release() {
    let mut node = node();
    node.raise_held_back(Fault::CanBusOff, 7);
    assert!(node.faults().contains(Fault::CanBusOff));
    assert!(emergencies(&mut node, 3).is_empty());
    node.release(Fault::CanBusOff);
    assert_eq!(emergencies(&mut node, 3), [[0x40, 0x81, 0x11, 18, 7, 0, 0, 0]]);
    // A fault that was reported is also reported as cleared.
    node.raise_held_back(Fault::CanBusOff, 8);
    assert!(node.clear(Fault::CanBusOff).is_some());
    // A fault that ends before it is reported is never reported.
    node.raise_held_back(Fault::CanBusOff, 9);
    assert_eq!(node.clear(Fault::CanBusOff), None);
    assert!(emergencies(&mut node, 3).is_empty());
}

#[test]
fn faults_are_reported_once_remembered_and_cleared() {
    let mut node = node();
    let raised = node.raise(Fault::SensorSilent, 5000).expect("an emergency");
    assert_eq!(raised.id(), 0x80 + u16::from(ID));
    assert_eq!(raised.data(), [0x01, 0x70, 0x81, 0, 0x88, 0x13, 0, 0]);
    assert_eq!(node.raise(Fault::SensorSilent, 6000), None, "reported already");
    node.raise(Fault::CanBusOff, 1).expect("another");
    let register = read(&mut node, Address::new(0x1001, 0), DataType::Unsigned8);
    assert_eq!(register, Ok(PeerValue::Unsigned8(0x91)));
    let history = |node: &mut Node| {
        (0..3)
            .map(|sub| {
                let data_type = if sub == 0 { DataType::Unsigned8 } else { DataType::Unsigned32 };
                read(node, Address::new(0x1003, sub), data_type)
            })
            .collect::<Vec<_>>()
    };
    assert_eq!(
        history(&mut node),
        [
            Ok(PeerValue::Unsigned8(2)),
            Ok(PeerValue::Unsigned32(18 << 16 | 0x8140)),
            Ok(PeerValue::Unsigned32(0x7001)),
        ]
    );
    let bits = read(&mut node, Address::new(index::FAULTS, 0), DataType::Unsigned32);
    assert_eq!(bits, Ok(PeerValue::Unsigned32(1 << 18 | 1)));
    let cleared = node.clear(Fault::SensorSilent).expect("an emergency");
    assert_eq!(cleared.data(), [0, 0, 0x11, 0, 0, 0, 0, 0]);
    assert_eq!(node.clear(Fault::SensorSilent), None);
    let forget = Address::new(0x1003, 0);
    assert_eq!(refused(&mut node, forget, Value::U8(1)), AbortCode::InvalidValue);
    accepted(&mut node, forget, Value::U8(0));
    assert_eq!(history(&mut node)[0], Ok(PeerValue::Unsigned8(0)));
}

#[test]
fn faults_before_the_boot_are_reported_after_each_boot() {
    let mut node = Node::new(Settings::default(), 1);
    assert_eq!(node.raise(Fault::Panic, 0x0800_4321), None, "not booted yet");
    assert_eq!(node.raise(Fault::CrystalMissing, 0), None);
    for _ in 0..2 {
        node.boot(BootCause::PowerUp);
        assert_eq!(
            emergencies(&mut node, 10),
            [[0x01, 0x50, 0x81, 9, 0, 0, 0, 0], [0x01, 0x61, 0x81, 12, 0x21, 0x43, 0, 8]],
            "each of the two once"
        );
    }
    assert!(node.clear(Fault::Panic).is_some());
    // A fault that could not be reported is not reported as cleared either.
    node.command(NmtCommand::StopRemoteNode);
    assert_eq!(node.raise(Fault::LateTick, 1200), None);
    assert_eq!(node.clear(Fault::LateTick), None);
}
