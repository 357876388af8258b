//! PDOs out, the load in.

use canopen_rs::pdo::{MappingEntry, PdoMapping};
use canopen_rs::{Entry as PeerEntry, ObjectDictionary, pdo as peer_pdo};
use estimator_core::{
    AngularRate, ContactEstimate, Decision, LinearAcceleration, PerAxis, Probabilities, Quaternion,
    Timestamp, Vec3, VelocitySigma,
};
use wire::dictionary::{self, Concern, index};
use wire::node::NmtCommand;
use wire::pdo::{Contact, Health, Load, PDOS};
use wire::{AbortCode, Address, Counter, Event, Fault, Outcome, Pdo, Value};

use super::master::{
    ID, Node, accepted, emergencies, node, peer_address, read, refused, send, tick, write,
};

#[test]
fn pdos_match_the_mappings_of_the_dictionary() {
    let estimate = ContactEstimate {
        timestamp: Timestamp::from_micros(5_123_456),
        probabilities: Probabilities {
            axes: PerAxis::from_array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6]),
            tangential: 0.7,
            vertical: 0.8,
            stable: 0.9,
        },
        decision: Decision::Stable,
        orientation: Quaternion { w: 0.5, x: -0.5, y: 0.5, z: -0.5 },
        linear_acceleration: LinearAcceleration(Vec3::new(1.0, -2.0, 3.0)),
        angular_rate: AngularRate(Vec3::new(-0.1, 0.2, -0.3)),
        gyro_bias: AngularRate(Vec3::new(0.01, -0.02, 0.03)),
        ..Default::default()
    };
    let mut node = node();
    node.command(NmtCommand::StartRemoteNode);
    send(&mut node, 0x80, &[1]);
    let mut last = [None; PDOS];
    for _ in 0..1000 {
        for frame in tick(&mut node, &estimate) {
            if let Some((pdo, _)) = Pdo::from_cob_id(frame.id()) {
                last[pdo as usize] = Some(frame);
            }
        }
    }
    // The peer packs the same objects, read one by one over SDO, by the mapping in 0x1A00.
    let mut od = ObjectDictionary::<64>::new();
    for (address, entry) in dictionary::entries().filter(|(_, entry)| entry.is_mappable()) {
        let value = read(&mut node, address, entry.data_type()).expect("readable");
        od.insert(peer_address(address), PeerEntry::ro(value)).expect("room");
    }
    for pdo in Pdo::ALL {
        let mut mapping = PdoMapping::<8>::new();
        for (address, entry) in dictionary::entries() {
            if address.index == index::TPDO_MAPPING + pdo as u16 {
                let entry = MappingEntry::from_u32(entry.default.to_raw());
                mapping.push(entry).expect("it fits");
            }
        }
        let mut packed = [0; 8];
        let length = peer_pdo::pack(&mapping, &od, &mut packed).expect("it packs");
        assert_eq!(length, 8);
        let mut frame = *last[pdo as usize].expect("sent").data8().expect("full");
        if pdo == Pdo::Contact {
            // All objects are of the newest tick. So is TPDO1, because it is sent each tick.
            assert_eq!(Contact::decode(&frame).stable, wire::pdo::P16::new(0.9));
        }
        if pdo == Pdo::Health {
            let clock = Health::decode(&frame).clock;
            assert_eq!((clock.sync, clock.time.0), (1, 500_000));
            frame[1] = packed[1];
        }
        assert_eq!(packed, frame, "{pdo:?}");
    }
}

#[test]
fn health_counts_the_frames_dropped_on_either_line() {
    let mut node = node();
    node.command(NmtCommand::StartRemoteNode);
    let counters = &mut node.published.counters;
    counters.add(Counter::CanDropped, 3);
    counters.add(Counter::UartDropped, 4);
    counters.add(Counter::UartRefused, 100);
    let mut dropped = None;
    for _ in 0..100 {
        node.tick(|_, frame| {
            if let Some((Pdo::Health, _)) = Pdo::from_cob_id(frame.id()) {
                dropped = frame.data8().map(|data| Health::decode(data).dropped);
            }
        });
    }
    assert_eq!(dropped, Some(7));
}

#[test]
fn streams_have_their_periods_and_different_phases() {
    let mut node = node();
    node.command(NmtCommand::StartRemoteNode);
    let mut counts = [0; PDOS];
    let mut most = 0;
    let mut sequence = None;
    for _ in 0..10_000 {
        let frames = tick(&mut node, &ContactEstimate::default());
        most = most.max(frames.len());
        for frame in frames {
            let Some((pdo, _)) = Pdo::from_cob_id(frame.id()) else {
                continue;
            };
            counts[pdo as usize] += 1;
            if pdo == Pdo::Contact {
                let contact = Contact::decode(frame.data8().expect("full"));
                let next = sequence.map_or(0, |last: u8| last.wrapping_add(1));
                assert_eq!(contact.sequence, next);
                sequence = Some(contact.sequence);
            }
        }
    }
    assert_eq!(counts, [10_000, 500, 500, 500, 500, 10, 100]);
    assert!(most <= 3, "{most} frames on one tick");
}

#[test]
fn motion_is_sent_with_its_contact_at_each_period() {
    for period in [1, 2, 4, 5, 20] {
        let mut node = node();
        accepted(&mut node, Address::new(index::TPDO, 5), Value::U16(period));
        node.command(NmtCommand::StartRemoteNode);
        let mut counts = [0; PDOS];
        for _ in 0..1_000 {
            let frames = tick(&mut node, &ContactEstimate::default());
            let pdos = || frames.iter().filter_map(|frame| Pdo::from_cob_id(frame.id()));
            let with_contact = pdos().any(|(pdo, _)| pdo == Pdo::Contact);
            for (pdo, _) in pdos() {
                counts[pdo as usize] += usize::from(with_contact);
            }
        }
        assert_eq!(counts[1..5], [50; 4], "{period} ms");
    }
}

#[test]
fn a_pdo_is_switched_off_slowed_down_and_tied_to_sync() {
    let mut node = node();
    let contact = index::TPDO;
    let off = 0xC000_0180 + u32::from(ID);
    let address = Address::new(contact, 1);
    let switched_off = write(&mut node, address, Value::U32(off));
    let changed = Event::Changed { address, concern: Concern::Stream };
    assert_eq!(switched_off, (Ok(()), vec![changed]));
    accepted(&mut node, Address::new(contact + 1, 5), Value::U16(3));
    accepted(&mut node, Address::new(contact + 6, 2), Value::U8(2));
    for (sub, value, code) in [
        (2, Value::U8(0), AbortCode::InvalidValue),
        (2, Value::U8(241), AbortCode::InvalidValue),
        (2, Value::U8(253), AbortCode::InvalidValue),
        (5, Value::U16(10_001), AbortCode::TooHigh),
        (1, Value::U32(0x181), AbortCode::InvalidValue),
    ] {
        assert_eq!(refused(&mut node, Address::new(contact, sub), value), code);
    }
    node.command(NmtCommand::StartRemoteNode);
    let mut counts = [0; PDOS];
    for i in 0..300 {
        if i % 10 == 0 {
            let sync = send(&mut node, 0x80, &[(i / 10) as u8]);
            assert_eq!(sync.event, Some(Event::Sync(Some((i / 10) as u8))));
        }
        for frame in tick(&mut node, &ContactEstimate::default()) {
            if let Some((pdo, _)) = Pdo::from_cob_id(frame.id()) {
                counts[pdo as usize] += 1;
            }
        }
    }
    assert_eq!((counts[0], counts[1], counts[6]), (0, 100, 15));
}

#[test]
fn the_load_is_received_over_rpdo1_when_operational() {
    let mut node = node();
    let rpdo = 0x200 + u16::from(ID);
    assert_eq!(send(&mut node, rpdo, &Load(5.0).encode()), Outcome::default());
    node.command(NmtCommand::StartRemoteNode);
    let outcome = send(&mut node, rpdo, &Load(5.0).encode());
    assert_eq!(outcome.event, Some(Event::Load(Load(5.0))));
    assert_eq!(node.load(), Some(Load(5.0)));
    let outcome = send(&mut node, rpdo, &f32::NAN.to_le_bytes());
    assert_eq!(outcome, Outcome::default());
    let emergency = send(&mut node, rpdo, &[1, 2]).reply.expect("an emergency");
    assert_eq!(emergency.data()[..2], [0x10, 0x82]);
    let cleared = send(&mut node, rpdo, &Load(6.0).encode()).reply;
    assert_eq!(cleared.expect("all clear").data()[..2], [0, 0]);
    assert_eq!(node.load(), Some(Load(6.0)));
}

#[test]
fn a_load_is_valid_for_the_event_timer() {
    let rpdo = 0x200 + u16::from(ID);
    let object = Address::new(index::LOAD, 0);
    let is_nan =
        |node: &mut Node| matches!(node.read(object), Ok(Value::F32(load)) if load.is_nan());
    let mut node = node();
    assert_eq!(node.load(), None, "no load has come yet");
    assert!(is_nan(&mut node));
    let source = Address::new(index::LOAD_INPUT, 1);
    accepted(&mut node, source, Value::U8(2));
    node.command(NmtCommand::StartRemoteNode);
    assert_eq!(emergencies(&mut node, 200), [[0; 8]; 0], "the timer starts with the first");
    send(&mut node, rpdo, &Load(5.0).encode());
    assert_eq!(emergencies(&mut node, 100), [[0; 8]; 0]);
    assert_eq!(node.load(), Some(Load(5.0)));
    // A value that is not a number does not restart the timer.
    send(&mut node, rpdo, &f32::NAN.to_le_bytes());
    assert_eq!(emergencies(&mut node, 50), [[0x50, 0x82, 0x11, 21, 100, 0, 0, 0]]);
    assert_eq!(node.load(), None);
    assert!(is_nan(&mut node));
    assert_eq!(send(&mut node, rpdo, &Load(6.0).encode()).reply, None);
    assert_eq!(emergencies(&mut node, 1), [[0, 0, 0, 21, 0, 0, 0, 0]]);
    assert_eq!(node.load(), Some(Load(6.0)));
    // A load written by SDO expires after the same time. Unless the source of the load is CAN, its expiry raises no fault.
    node.command(NmtCommand::EnterPreOperational);
    accepted(&mut node, source, Value::U8(1));
    accepted(&mut node, object, Value::F32(7.0));
    assert_eq!(node.load(), Some(Load(7.0)));
    node.command(NmtCommand::StartRemoteNode);
    assert_eq!(emergencies(&mut node, 200), [[0; 8]; 0]);
    assert_eq!(node.load(), None);
}

#[test]
fn a_good_load_ends_both_faults_of_loads() {
    let rpdo = 0x200 + u16::from(ID);
    let mut node = node();
    accepted(&mut node, Address::new(index::LOAD_INPUT, 1), Value::U8(2));
    node.command(NmtCommand::StartRemoteNode);
    send(&mut node, rpdo, &Load(5.0).encode());
    send(&mut node, rpdo, &[1, 2]).reply.expect("a wrong length");
    assert_eq!(emergencies(&mut node, 101).len(), 1, "a timeout");
    let ended = send(&mut node, rpdo, &Load(6.0).encode()).reply.expect("one of them ends");
    assert_eq!(ended.data(), [0, 0, 0x11, 19, 0, 0, 0, 0], "the other is active");
    assert_eq!(emergencies(&mut node, 2), [[0, 0, 0, 21, 0, 0, 0, 0]], "none is active");
    assert!(node.faults().is_empty());
}

#[test]
fn no_load_is_valid_for_longer_than_a_second() {
    let mut node = node();
    node.command(NmtCommand::EnterPreOperational);
    let timer = Address::new(index::RPDO, 5);
    for (limit, code) in
        [(0, AbortCode::TooLow), (1_001, AbortCode::TooHigh), (u16::MAX, AbortCode::TooHigh)]
    {
        assert_eq!(refused(&mut node, timer, Value::U16(limit)), code);
    }
    accepted(&mut node, timer, Value::U16(1_000));
    let object = Address::new(index::LOAD, 0);
    accepted(&mut node, object, Value::F32(7.0));
    emergencies(&mut node, 1_000);
    assert_eq!(node.load(), Some(Load(7.0)));
    emergencies(&mut node, 1);
    assert_eq!(node.load(), None);
    // A slower board has fewer ticks in the same time.
    node.set_tick(2_400);
    accepted(&mut node, object, Value::F32(7.0));
    emergencies(&mut node, 416);
    assert_eq!(node.load(), Some(Load(7.0)));
    emergencies(&mut node, 1);
    assert_eq!(node.load(), None);
}

#[test]
fn loads_outside_the_limits_are_refused_over_sdo() {
    let mut node = node();
    let object = Address::new(index::LOAD, 0);
    for (load, code) in [
        (-1.1e9, AbortCode::TooLow),
        (1.1e9, AbortCode::TooHigh),
        (f32::NAN, AbortCode::InvalidValue),
    ] {
        assert_eq!(refused(&mut node, object, Value::F32(load)), code);
    }
    assert_eq!(node.load(), None);
}

#[test]
fn a_fault_of_the_sensor_prevents_stable_in_every_frame() {
    let estimate = ContactEstimate {
        probabilities: Probabilities { stable: 1.0, ..Default::default() },
        decision: Decision::Stable,
        ..Default::default()
    };
    let mut node = node();
    node.command(NmtCommand::StartRemoteNode);
    node.raise(Fault::SensorFrozen, 0);
    let frames = tick(&mut node, &estimate);
    let contact = Contact::decode(frames[0].data8().expect("full"));
    assert_eq!(contact.stable.0, 0);
    assert_eq!(contact.status.decision(), Decision::NotStable);
    node.clear(Fault::SensorFrozen);
    let frames = tick(&mut node, &estimate);
    let contact = Contact::decode(frames[0].data8().expect("full"));
    assert_eq!(contact.stable.0, u16::MAX);
    assert_eq!(contact.status.decision(), Decision::Stable);
}

#[test]
fn zero_velocity_sigma_is_that_of_the_newest_estimate() {
    let object = Address::new(index::VELOCITY_SIGMA, 0);
    let mut node = node();
    assert_eq!(node.read(object), Ok(Value::F32(100.0)));
    let estimate =
        ContactEstimate { velocity_sigma: VelocitySigma(0.04), ..ContactEstimate::default() };
    tick(&mut node, &estimate);
    assert_eq!(node.read(object), Ok(Value::F32(0.04)));
    node.raise(Fault::SensorFrozen, 0);
    assert_eq!(node.read(object), Ok(Value::F32(100.0)));
}
