//! The node as a master sees it, over frames; the SDO client and the PDO packing of `canopen-rs`
//! are the peers.

use canopen_rs::lss;
use canopen_rs::pdo::{self as peer_pdo, MappingEntry, PdoMapping};
use canopen_rs::sdo::{SdoClient, SdoEvent};
use canopen_rs::time::TimeOfDay;
use canopen_rs::{DataType as PeerType, Entry as PeerEntry, ObjectDictionary, Value as PeerValue};
use estimator_core::{
    AngularRate, ContactEstimate, Decision, Learnt, LinearAcceleration, PerAxis, Probabilities,
    Quaternion, Timestamp, Vec3,
};
use wire::dictionary::{
    self, Access, Limits, Role, SIGNATURE_BROWN_OUT, SIGNATURE_RESTORE, SIGNATURE_STORE, index,
};
use wire::node::{Calibration, CalibrationState, Command, Crash, State};
use wire::pdo::{Contact, Health, Load, PDOS};
use wire::{
    AbortCode, Address, BootCause, CanFrame, Counter, Counters, DataType, Event, Fault, Foot, Node,
    Outcome, Pdo, Settings, Stage, Value,
};

const ID: u8 = 0x11;
const NOW: Timestamp = Timestamp::from_micros(5_000_000);

/// A node in pre-operational state.
fn node() -> Node {
    let mut node = Node::new(Settings::default(), 0xC0FFEE);
    node.boot(BootCause::PowerUp);
    node.command(Command::EnterPreOperational);
    node
}

fn send(node: &mut Node, id: u16, data: &[u8]) -> Outcome {
    node.receive(&CanFrame::new(id, data).expect("a frame"), NOW)
}

/// Ticks once and returns what was sent.
fn tick(node: &mut Node, estimate: &ContactEstimate) -> Vec<CanFrame> {
    let mut frames = Vec::new();
    node.tick(estimate, 25.0, &Counters::default(), |frame| {
        frames.push(frame);
    });
    frames
}

fn peer_type(data_type: DataType) -> PeerType {
    PeerType::from_index(data_type.index()).expect("the peer has the type")
}

fn peer_value(value: Value) -> PeerValue {
    match value {
        Value::I16(value) => PeerValue::Integer16(value),
        Value::U8(value) => PeerValue::Unsigned8(value),
        Value::U16(value) => PeerValue::Unsigned16(value),
        Value::U32(value) => PeerValue::Unsigned32(value),
        Value::F32(value) => PeerValue::Real32(value),
        Value::Text(text) => {
            PeerValue::VisibleString(canopen_rs::ByteString::from_str(text).expect("it fits"))
        }
    }
}

fn peer_address(address: Address) -> canopen_rs::Address {
    canopen_rs::Address::new(address.index, address.subindex)
}

/// Runs a request of the peer's client against the node until it is over.
fn exchange(node: &mut Node, client: &mut SdoClient, request: [u8; 8]) -> (SdoEvent, Vec<Event>) {
    let (mut request, mut events) = (request, Vec::new());
    loop {
        let outcome = send(node, client.request_cob_id(), &request);
        events.extend(outcome.event);
        let reply = outcome.reply.or_else(|| node.finish(Ok(())));
        let reply = reply.expect("an answer");
        assert_eq!(reply.id(), client.response_cob_id());
        match client.on_response(reply.data8().expect("eight bytes")) {
            SdoEvent::Send(next) => request = next,
            over => return (over, events),
        }
    }
}

fn client() -> SdoClient {
    SdoClient::new(canopen_rs::NodeId::new(ID).expect("a node id"))
}

fn read(node: &mut Node, address: Address, data_type: DataType) -> Result<PeerValue, u32> {
    let mut client = client();
    let request = client.read(peer_address(address), peer_type(data_type));
    match exchange(node, &mut client, request).0 {
        SdoEvent::Complete(Some(value)) => Ok(value),
        SdoEvent::Aborted(code) => Err(code),
        other => panic!("{other:?}"),
    }
}

fn write(node: &mut Node, address: Address, value: Value) -> (Result<(), u32>, Vec<Event>) {
    let mut client = client();
    let request = client.write(peer_address(address), peer_value(value));
    let (over, events) = exchange(node, &mut client, request);
    let result = match over {
        SdoEvent::Complete(None) => Ok(()),
        SdoEvent::Aborted(code) => Err(code),
        other => panic!("{other:?}"),
    };
    (result, events)
}

fn refused(node: &mut Node, address: Address, value: Value) -> AbortCode {
    let (result, events) = write(node, address, value);
    assert_eq!(events, [], "a refused write is no event");
    let code = result.expect_err("refused");
    AbortCode::from_code(code).expect("a known code")
}

#[test]
fn it_boots_and_streams_by_itself() {
    let mut node = Node::new(Settings::default(), 1);
    let boot = node.boot(BootCause::PowerUp).expect("a boot-up message");
    assert_eq!((boot.id(), boot.data()), (0x700 + u16::from(ID), &[0][..]));
    assert_eq!(node.state(), State::Operational);
    let frames = tick(&mut node, &ContactEstimate::default());
    assert_eq!(frames[0].id(), 0x180 + u16::from(ID));
}

#[test]
fn without_autostart_it_waits_for_the_master() {
    let mut settings = Settings::default();
    let autostart = Address::new(index::AUTOSTART, 0);
    assert_eq!(settings.set(autostart, Value::U8(0)), Ok(()));
    let mut node = Node::new(settings, 1);
    node.boot(BootCause::PowerUp);
    assert_eq!(node.state(), State::PreOperational);
    assert_eq!(tick(&mut node, &ContactEstimate::default()), []);
    let started = send(&mut node, 0, &[1, 0]);
    assert_eq!(started.event, Some(Event::State(State::Operational)));
    assert!(!tick(&mut node, &ContactEstimate::default()).is_empty());
}

#[test]
fn a_master_resets_configures_and_starts_it() {
    let mut node = Node::new(Settings::default(), 1);
    node.boot(BootCause::PowerUp);
    assert_eq!(node.state(), State::Operational);
    let reset = send(&mut node, 0, &[0x82, ID]);
    assert_eq!(reset.event, Some(Event::ResetCommunication));
    node.set_settings(Settings::default());
    assert!(node.boot(BootCause::Commanded).is_some());
    assert_eq!(node.state(), State::PreOperational);
    let heartbeat = Address::new(index::HEARTBEAT, 0);
    assert_eq!(write(&mut node, heartbeat, Value::U16(100)).0, Ok(()));
    assert_eq!(tick(&mut node, &ContactEstimate::default()), []);
    let started = send(&mut node, 0, &[1, ID]);
    assert_eq!(started.event, Some(Event::State(State::Operational)));
    assert!(!tick(&mut node, &ContactEstimate::default()).is_empty());
}

#[test]
fn every_readable_object_is_read_by_the_peer_and_the_others_are_refused() {
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
    let serial = read(&mut node, Address::new(0x1018, 4), DataType::Unsigned32);
    assert_eq!(serial, Ok(PeerValue::Unsigned32(0xC0FFEE)));
    let missing = read(&mut node, Address::new(0x3000, 0), DataType::Unsigned8);
    assert_eq!(missing, Err(AbortCode::NoObject.code()));
    let missing = read(&mut node, Address::new(0x1018, 7), DataType::Unsigned8);
    assert_eq!(missing, Err(AbortCode::NoSubindex.code()));
}

#[test]
fn every_setting_takes_its_limits_and_refuses_what_lies_beyond() {
    for (address, entry) in dictionary::settings() {
        if entry.role == Role::PdoCobId {
            continue;
        }
        let mut node = node();
        let Some((low, high)) = entry.limits().range() else {
            assert_eq!(write(&mut node, address, entry.default).0, Ok(()));
            continue;
        };
        for value in [low, high] {
            let (result, events) = write(&mut node, address, value);
            // The load thresholds hold each other.
            if result == Err(AbortCode::Incompatible.code()) {
                let bit_rate = address.index == index::CAN_BIT_RATE && value == low;
                assert!(
                    address.index == index::LOAD_INPUT || bit_rate,
                    "{address:?}"
                );
                continue;
            }
            assert_eq!(result, Ok(()), "{address:?} {value:?}");
            assert_eq!(events, [Event::Changed(address)]);
            if address.index == index::LOCK && value == high {
                assert_eq!(
                    write(&mut node, address, low).0,
                    Ok(()),
                    "it can be unlocked"
                );
            }
        }
        let choice = matches!(entry.limits(), Limits::OneOf(_) | Limits::RangeWithout(_));
        let (below, above) = match (low, high) {
            (Value::U8(low), Value::U8(high)) => (
                low.checked_sub(1).map(Value::U8),
                high.checked_add(1).map(Value::U8),
            ),
            (Value::U16(low), Value::U16(high)) => (
                low.checked_sub(1).map(Value::U16),
                high.checked_add(1).map(Value::U16),
            ),
            (Value::U32(low), Value::U32(high)) => (
                low.checked_sub(1).map(Value::U32),
                high.checked_add(1).map(Value::U32),
            ),
            (Value::F32(low), Value::F32(high)) => {
                let nan = refused(&mut node, address, Value::F32(f32::NAN));
                assert_eq!(nan, AbortCode::InvalidValue);
                (
                    Some(Value::F32(low.next_down())),
                    Some(Value::F32(high.next_up())),
                )
            }
            other => panic!("{other:?}"),
        };
        let reason = |standard| {
            if choice {
                AbortCode::InvalidValue
            } else {
                standard
            }
        };
        if let Some(below) = below {
            assert_eq!(
                refused(&mut node, address, below),
                reason(AbortCode::TooLow)
            );
        }
        if let Some(above) = above {
            assert_eq!(
                refused(&mut node, address, above),
                reason(AbortCode::TooHigh)
            );
        }
    }
}

#[test]
fn settings_are_written_in_pre_operational_only() {
    let mut node = node();
    node.command(Command::StartRemoteNode);
    let before = node.settings().clone();
    for (address, entry) in dictionary::settings() {
        let code = refused(&mut node, address, entry.default);
        assert_eq!(code, AbortCode::DeviceState, "{address:?}");
    }
    assert_eq!(node.settings(), &before);
}

#[test]
fn the_lock_refuses_every_other_setting_and_the_defaults() {
    let mut node = node();
    let lock = Address::new(index::LOCK, 0);
    assert_eq!(write(&mut node, lock, Value::U8(1)).0, Ok(()));
    for (address, entry) in dictionary::settings().filter(|(address, _)| *address != lock) {
        let code = refused(&mut node, address, entry.default);
        assert_eq!(code, AbortCode::Locked, "{address:?}");
    }
    let restore = Address::new(index::RESTORE, 1);
    assert_eq!(
        refused(&mut node, restore, Value::U32(SIGNATURE_RESTORE)),
        AbortCode::Locked
    );
    // The lock itself can be stored, and taken off.
    let store = Address::new(index::STORE, 1);
    assert_eq!(
        write(&mut node, store, Value::U32(SIGNATURE_STORE)).0,
        Ok(())
    );
    assert_eq!(write(&mut node, lock, Value::U8(0)).0, Ok(()));
    let foot = Address::new(index::FOOT, 0);
    assert_eq!(write(&mut node, foot, Value::U8(3)).0, Ok(()));
    assert_eq!(node.settings().foot(), Foot::RearLeft);
}

#[test]
fn what_cannot_be_written_is_refused() {
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
    assert_eq!(
        refused(&mut node, highest, Value::U8(6)),
        AbortCode::ReadOnly
    );
    let wide = Address::new(index::FOOT, 0);
    assert_eq!(refused(&mut node, wide, Value::U16(1)), AbortCode::TooLong);
    let narrow = Address::new(index::WINDOW, 0);
    assert_eq!(
        refused(&mut node, narrow, Value::U16(1)),
        AbortCode::TooShort
    );
}

#[test]
fn storing_and_restoring_need_their_signatures() {
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
fn the_master_hears_of_a_store_that_failed() {
    let mut node = node();
    let request = [0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'];
    let outcome = send(&mut node, 0x600 + u16::from(ID), &request);
    assert_eq!((outcome.reply, outcome.event), (None, Some(Event::Store)));
    let answer = node.finish(Err(AbortCode::Hardware)).expect("an answer");
    assert_eq!(answer.data(), [0x80, 0x10, 0x10, 1, 0, 0, 6, 6]);
    assert_eq!(node.finish(Ok(())), None);
}

#[test]
fn pdos_are_what_the_mappings_of_the_dictionary_say() {
    let estimate = ContactEstimate {
        timestamp: Timestamp::from_micros(123_456_789),
        probabilities: Probabilities {
            axes: PerAxis::from_array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6]),
            tangential: 0.7,
            vertical: 0.8,
            stable: 0.9,
        },
        decision: Decision::Stable,
        orientation: Quaternion {
            w: 0.5,
            x: -0.5,
            y: 0.5,
            z: -0.5,
        },
        linear_acceleration: LinearAcceleration(Vec3::new(1.0, -2.0, 3.0)),
        angular_rate: AngularRate(Vec3::new(-0.1, 0.2, -0.3)),
        gyro_bias: AngularRate(Vec3::new(0.01, -0.02, 0.03)),
        ..Default::default()
    };
    let mut node = node();
    node.command(Command::StartRemoteNode);
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
        od.insert(peer_address(address), PeerEntry::ro(value))
            .expect("room");
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
            // The objects are those of the newest tick; so is TPDO1, which comes each tick.
            assert_eq!(Contact::decode(&frame).stable, wire::pdo::P16::new(0.9));
        }
        if pdo == Pdo::Health {
            let sync = Health::decode(&frame).sync;
            assert_eq!((sync.counter, sync.time.0), (1, 500_000));
            frame[1] = packed[1];
        }
        assert_eq!(packed, frame, "{pdo:?}");
    }
}

#[test]
fn streams_come_at_their_periods_and_not_all_on_one_tick() {
    let mut node = node();
    node.command(Command::StartRemoteNode);
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
fn a_pdo_is_switched_off_slowed_down_and_tied_to_sync() {
    let mut node = node();
    let contact = index::TPDO;
    let off = 0xC000_0180 + u32::from(ID);
    assert_eq!(
        write(&mut node, Address::new(contact, 1), Value::U32(off)).0,
        Ok(())
    );
    assert_eq!(
        write(&mut node, Address::new(contact + 1, 5), Value::U16(3)).0,
        Ok(())
    );
    assert_eq!(
        write(&mut node, Address::new(contact + 6, 2), Value::U8(2)).0,
        Ok(())
    );
    for (sub, value, code) in [
        (2, Value::U8(0), AbortCode::InvalidValue),
        (2, Value::U8(241), AbortCode::InvalidValue),
        (2, Value::U8(253), AbortCode::InvalidValue),
        (5, Value::U16(10_001), AbortCode::TooHigh),
        (1, Value::U32(0x181), AbortCode::InvalidValue),
    ] {
        assert_eq!(refused(&mut node, Address::new(contact, sub), value), code);
    }
    node.command(Command::StartRemoteNode);
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
fn the_heartbeat_tells_the_state_at_its_period() {
    let mut node = node();
    let period = Address::new(index::HEARTBEAT, 0);
    assert_eq!(write(&mut node, period, Value::U16(50)).0, Ok(()));
    for (command, state) in [
        (Command::EnterPreOperational, 0x7F),
        (Command::StartRemoteNode, 0x05),
        (Command::StopRemoteNode, 0x04),
    ] {
        node.command(command);
        let beats: Vec<CanFrame> = (0..500)
            .flat_map(|_| tick(&mut node, &ContactEstimate::default()))
            .filter(|frame| frame.id() == 0x700 + u16::from(ID))
            .collect();
        assert_eq!(beats.len(), 10);
        assert!(beats.iter().all(|beat| beat.data() == [state]));
    }
}

#[test]
fn nmt_commands_for_others_change_nothing_and_resets_are_reported() {
    let mut node = node();
    for ignored in [&[1, 0x12][..], &[1], &[], &[9, ID], &[1, 200]] {
        assert_eq!(send(&mut node, 0, ignored), Outcome::default());
        assert_eq!(node.state(), State::PreOperational);
    }
    let reset = send(&mut node, 0, &[0x82, ID]);
    assert_eq!(reset.event, Some(Event::ResetCommunication));
    assert_eq!(tick(&mut node, &ContactEstimate::default()), []);
    assert!(node.boot(BootCause::Commanded).is_some());
    let reset = send(&mut node, 0, &[0x81, 0]);
    assert_eq!(reset.event, Some(Event::ResetNode));
}

#[test]
fn sdo_is_not_served_when_stopped() {
    let mut node = node();
    node.command(Command::StopRemoteNode);
    let request = [0x40, 0, 0x10, 0, 0, 0, 0, 0];
    assert_eq!(
        send(&mut node, 0x600 + u16::from(ID), &request),
        Outcome::default()
    );
}

#[test]
fn a_withheld_fault_is_there_at_once_and_told_when_it_is_released() {
    let mut node = node();
    let emergencies = |node: &mut Node| {
        let mut frames = Vec::new();
        for _ in 0..3 {
            frames.extend(tick(node, &ContactEstimate::default()));
        }
        frames.retain(|frame| frame.id() == 0x80 + u16::from(ID));
        frames
    };
    node.raise_held_back(Fault::CanBusOff, 7);
    assert!(node.faults().contains(Fault::CanBusOff));
    assert_eq!(emergencies(&mut node), []);
    node.release(Fault::CanBusOff);
    let told = emergencies(&mut node);
    assert_eq!(told.len(), 1, "{told:?}");
    assert_eq!(told[0].data(), [0x40, 0x81, 0x11, 18, 7, 0, 0, 0]);
    // Whoever was told once is told that it is over.
    node.raise_held_back(Fault::CanBusOff, 8);
    assert!(node.clear(Fault::CanBusOff).is_some());
    // And nobody of what was over before anybody could be told.
    node.raise_held_back(Fault::CanBusOff, 9);
    assert_eq!(node.clear(Fault::CanBusOff), None);
    assert_eq!(emergencies(&mut node), []);
}

#[test]
fn faults_are_told_once_remembered_and_cleared() {
    let mut node = node();
    let raised = node.raise(Fault::SensorSilent, 5000).expect("an emergency");
    assert_eq!(raised.id(), 0x80 + u16::from(ID));
    assert_eq!(raised.data(), [0x01, 0x70, 0x81, 0, 0x88, 0x13, 0, 0]);
    assert_eq!(node.raise(Fault::SensorSilent, 6000), None, "told already");
    node.raise(Fault::CanBusOff, 1).expect("another");
    let register = read(&mut node, Address::new(0x1001, 0), DataType::Unsigned8);
    assert_eq!(register, Ok(PeerValue::Unsigned8(0x91)));
    let history = |node: &mut Node| {
        (0..3)
            .map(|sub| {
                let data_type = if sub == 0 {
                    DataType::Unsigned8
                } else {
                    DataType::Unsigned32
                };
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
    let bits = read(
        &mut node,
        Address::new(index::FAULTS, 0),
        DataType::Unsigned32,
    );
    assert_eq!(bits, Ok(PeerValue::Unsigned32(1 << 18 | 1)));
    let cleared = node.clear(Fault::SensorSilent).expect("an emergency");
    assert_eq!(cleared.data(), [0, 0, 0x11, 0, 0, 0, 0, 0]);
    assert_eq!(node.clear(Fault::SensorSilent), None);
    let forget = Address::new(0x1003, 0);
    assert_eq!(
        refused(&mut node, forget, Value::U8(1)),
        AbortCode::InvalidValue
    );
    assert_eq!(write(&mut node, forget, Value::U8(0)).0, Ok(()));
    assert_eq!(history(&mut node)[0], Ok(PeerValue::Unsigned8(0)));
}

#[test]
fn faults_from_before_the_boot_are_told_after_it_and_again_after_a_reset() {
    let mut node = Node::new(Settings::default(), 1);
    assert_eq!(
        node.raise(Fault::Panic, 0x0800_4321),
        None,
        "not booted yet"
    );
    assert_eq!(node.raise(Fault::CrystalMissing, 0), None);
    for _ in 0..2 {
        node.boot(BootCause::PowerUp);
        let told: Vec<CanFrame> = (0..10)
            .flat_map(|_| tick(&mut node, &ContactEstimate::default()))
            .filter(|frame| frame.id() == 0x80 + u16::from(ID))
            .collect();
        assert_eq!(told.len(), 2, "each of the two once");
        assert_eq!(told[0].data(), [0x01, 0x50, 0x81, 9, 0, 0, 0, 0]);
        assert_eq!(told[1].data(), [0x01, 0x61, 0x81, 12, 0x21, 0x43, 0, 8]);
    }
    assert!(node.clear(Fault::Panic).is_some());
    // One that nobody heard of goes unheard.
    node.command(Command::StopRemoteNode);
    assert_eq!(node.raise(Fault::LateTick, 1200), None);
    assert_eq!(node.clear(Fault::LateTick), None);
}

#[test]
fn with_a_fault_of_the_sensor_no_frame_says_stable() {
    let estimate = ContactEstimate {
        probabilities: Probabilities {
            stable: 1.0,
            ..Default::default()
        },
        decision: Decision::Stable,
        ..Default::default()
    };
    let mut node = node();
    node.command(Command::StartRemoteNode);
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
fn the_load_comes_over_rpdo1_when_operational() {
    let mut node = node();
    let rpdo = 0x200 + u16::from(ID);
    assert_eq!(
        send(&mut node, rpdo, &Load(5.0).encode()),
        Outcome::default()
    );
    node.command(Command::StartRemoteNode);
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
fn a_load_is_believed_for_as_long_as_the_event_timer_says() {
    let rpdo = 0x200 + u16::from(ID);
    let object = Address::new(index::LOAD, 0);
    let is_nan =
        |node: &mut Node| matches!(node.read(object), Ok(Value::F32(load)) if load.is_nan());
    let mut node = node();
    assert_eq!(node.load(), None, "nobody has said anything yet");
    assert!(is_nan(&mut node));
    let source = Address::new(index::LOAD_INPUT, 1);
    assert_eq!(write(&mut node, source, Value::U8(2)).0, Ok(()));
    node.command(Command::StartRemoteNode);
    assert_eq!(
        emergencies(&mut node, 200),
        [[0; 8]; 0],
        "the timer starts with the first"
    );
    send(&mut node, rpdo, &Load(5.0).encode());
    assert_eq!(emergencies(&mut node, 100), [[0; 8]; 0]);
    assert_eq!(node.load(), Some(Load(5.0)));
    // One that is not a number does not wind the timer up.
    send(&mut node, rpdo, &f32::NAN.to_le_bytes());
    assert_eq!(
        emergencies(&mut node, 50),
        [[0x50, 0x82, 0x11, 22, 100, 0, 0, 0]]
    );
    assert_eq!(node.load(), None);
    assert!(is_nan(&mut node));
    let cleared = send(&mut node, rpdo, &Load(6.0).encode()).reply;
    assert_eq!(cleared.expect("all clear").data()[..2], [0, 0]);
    assert_eq!(node.load(), Some(Load(6.0)));
    // Over SDO too, and whoever does not listen to CAN is not told.
    node.command(Command::EnterPreOperational);
    assert_eq!(write(&mut node, source, Value::U8(1)).0, Ok(()));
    assert_eq!(write(&mut node, object, Value::F32(7.0)).0, Ok(()));
    assert_eq!(node.load(), Some(Load(7.0)));
    node.command(Command::StartRemoteNode);
    assert_eq!(emergencies(&mut node, 200), [[0; 8]; 0]);
    assert_eq!(node.load(), None);
}

/// The emergencies of so many ticks.
fn emergencies(node: &mut Node, ticks: u32) -> Vec<[u8; 8]> {
    (0..ticks)
        .flat_map(|_| tick(node, &ContactEstimate::default()))
        .filter(|frame| frame.id() == 0x80 + u16::from(ID))
        .map(|frame| *frame.data8().expect("eight bytes"))
        .collect()
}

#[test]
fn no_load_is_believed_for_longer_than_a_second() {
    let mut node = node();
    node.command(Command::EnterPreOperational);
    let timer = Address::new(index::RPDO, 5);
    for (limit, code) in [
        (0, AbortCode::TooLow),
        (1_001, AbortCode::TooHigh),
        (u16::MAX, AbortCode::TooHigh),
    ] {
        assert_eq!(refused(&mut node, timer, Value::U16(limit)), code);
    }
    assert_eq!(write(&mut node, timer, Value::U16(1_000)).0, Ok(()));
    let object = Address::new(index::LOAD, 0);
    assert_eq!(write(&mut node, object, Value::F32(7.0)).0, Ok(()));
    emergencies(&mut node, 1_000);
    assert_eq!(node.load(), Some(Load(7.0)));
    emergencies(&mut node, 1);
    assert_eq!(node.load(), None);
}

#[test]
fn the_load_has_limits_over_sdo() {
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
fn each_foot_boots_with_its_own_id() {
    let mut node = node();
    let foot = Address::new(index::FOOT, 0);
    assert_eq!(write(&mut node, foot, Value::U8(2)).0, Ok(()));
    let boot = node.boot(BootCause::Commanded).expect("a boot-up message");
    assert_eq!(boot.id(), 0x712);
}

#[test]
fn sync_and_time_are_passed_on() {
    let mut node = node();
    assert_eq!(send(&mut node, 0x80, &[]).event, Some(Event::Sync(None)));
    let time = TimeOfDay::new(12_345_678, 15_000);
    assert_eq!(
        send(&mut node, 0x100, &time.encode()).event,
        Some(Event::Time(time))
    );
    assert_eq!(send(&mut node, 0x100, &[1, 2]), Outcome::default());
    // It is kept, with the moment at which it came.
    assert_eq!(node.time(), Some((time, NOW)));
    for (sub, value) in [
        (1, Value::U16(15_000)),
        (2, Value::U32(12_345_678)),
        (3, Value::U32(500_000)),
    ] {
        assert_eq!(node.read(Address::new(index::TIME, sub)), Ok(value));
    }
}

/// What a foot has learnt that has walked for a while.
fn learnt() -> Learnt {
    Learnt::from_array([
        -1.0, 2.0, 0.3, -2.5, 1.0, 0.4, -3.0, 1.5, 0.5, 4.0, 3.0, 20.0,
    ])
}

const KEEP: Value = Value::U8(1);
const FORGET: Value = Value::U8(2);

#[test]
fn what_the_foot_has_learnt_can_be_read_kept_and_forgotten() {
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
    node.set_learnt(learnt());
    state(&mut node, CalibrationState::Settled);
    for (subindex, number) in (3..).zip(learnt().to_array()) {
        let address = Address::new(index::CALIBRATION, subindex);
        let expected = Ok(PeerValue::Real32(number));
        assert_eq!(read(&mut node, address, DataType::Real32), expected);
    }
    node.command(Command::StartRemoteNode);
    for value in [KEEP, FORGET] {
        assert_eq!(refused(&mut node, command, value), AbortCode::DeviceState);
    }
    node.command(Command::EnterPreOperational);
    assert_eq!(node.settings().params().learnt, None);
    let (result, events) = write(&mut node, command, KEEP);
    assert_eq!(
        (result, events),
        (Ok(()), vec![Event::Calibration(Calibration::Keep)])
    );
    assert_eq!(node.settings().params().learnt, Some(learnt()));
    let (result, events) = write(&mut node, command, FORGET);
    assert_eq!(
        (result, events),
        (Ok(()), vec![Event::Calibration(Calibration::Forget)])
    );
    assert_eq!(node.settings(), &Settings::default());
    // Also before it is published again.
    state(&mut node, CalibrationState::Settling);
    assert_eq!(refused(&mut node, command, KEEP), AbortCode::InvalidValue);
}

#[test]
fn the_calibration_is_frozen_where_nothing_can_be_learnt() {
    for (subindex, value) in [(1, 1), (2, 0)] {
        let mut node = node();
        node.set_learnt(learnt());
        let address = Address::new(index::ESTIMATION, subindex);
        assert!(node.write(address, &[value]).is_ok());
        let state = node.read(Address::new(index::CALIBRATION, 2));
        assert_eq!(state, Ok(Value::U8(CalibrationState::Frozen.code())));
    }
}

#[test]
fn what_is_not_within_the_limits_of_the_settings_is_not_kept() {
    let mut node = node();
    let mut numbers = learnt().to_array();
    numbers[1] = 10.0;
    node.set_learnt(Learnt::from_array(numbers));
    let command = Address::new(index::CALIBRATION, 1);
    assert_eq!(refused(&mut node, command, KEEP), AbortCode::TooHigh);
    assert_eq!(node.settings(), &Settings::default());
}

#[test]
fn what_the_board_says_of_itself_can_be_read() {
    let mut node = node();
    node.set_stage(Stage::HoldStill);
    node.set_crash(Crash {
        fault: Fault::HardFault,
        program_counter: 0x0800_1234,
    });
    let mut counters = Counters::default();
    counters.add(Counter::CanBusOff, 3);
    node.tick(&ContactEstimate::default(), 0.0, &counters, |_| ());
    for (index, sub, expected) in [
        (index::STAGE, 0, Value::U8(2)),
        (index::LAST_CRASH, 1, Value::U16(0x6102)),
        (index::LAST_CRASH, 2, Value::U32(0x0800_1234)),
        (index::COUNTERS, Counter::CanBusOff as u8 + 1, Value::U32(3)),
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
    assert_eq!(event, Ok(Some(Event::Changed(window))));
    assert_eq!(node.read(window), Ok(Value::U32(20_000)));
    let too_long = node.write(window, &300_000_u32.to_le_bytes());
    assert_eq!(too_long, Err(AbortCode::TooHigh));
    // The codes are those of SDO.
    assert_eq!(node.write(window, &[1]), Err(AbortCode::TooShort));
    assert_eq!(node.write(window, &[1; 5]), Err(AbortCode::TooLong));
    node.command(Command::StartRemoteNode);
    let running = node.write(window, &20_000_u32.to_le_bytes());
    assert_eq!(running, Err(AbortCode::DeviceState));
    let store = Address::new(index::STORE, 1);
    assert_eq!(node.write(store, b"save"), Ok(Some(Event::Store)));
    assert_eq!(node.finish(Ok(())), None, "no master waits");
}

#[test]
fn lss_gives_a_foot_its_node_id() {
    let mut node = node();
    let address = lss::LssAddress {
        vendor_id: dictionary::VENDOR_ID,
        product_code: dictionary::PRODUCT_CODE,
        revision_number: dictionary::REVISION,
        serial_number: 0xC0FFEE,
    };
    let other = lss::LssAddress {
        serial_number: 1,
        ..address
    };
    for frame in lss::encode_switch_selective(&other) {
        assert_eq!(send(&mut node, 0x7E5, &frame), Outcome::default());
    }
    let mut reply = None;
    for frame in lss::encode_switch_selective(&address) {
        reply = send(&mut node, 0x7E5, &frame).reply;
    }
    assert_eq!(reply.expect("selected").data()[0], 0x44);
    let changed = send(&mut node, 0x7E5, &lss::encode_configure_node_id(0x22));
    assert_eq!(changed.reply.expect("an answer").data()[..2], [0x11, 0]);
    let setting = Address::new(index::NODE_ID, 0);
    assert_eq!(changed.event, Some(Event::Changed(setting)));
    let bad = send(&mut node, 0x7E5, &lss::encode_configure_node_id(200));
    assert_eq!(bad.reply.expect("an answer").data()[..2], [0x11, 1]);
    let timing = send(&mut node, 0x7E5, &[0x13, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(timing.reply.expect("an answer").data()[..2], [0x13, 1]);
    let stored = send(&mut node, 0x7E5, &lss::encode_store());
    assert_eq!((stored.reply, stored.event), (None, Some(Event::Store)));
    assert_eq!(
        node.finish(Ok(())).expect("an answer").data()[..2],
        [0x17, 0]
    );
    // The setting was changed by other means: LSS still has the last word.
    assert!(node.write(setting, &[0x33]).is_ok());
    let again = send(&mut node, 0x7E5, &lss::encode_configure_node_id(0x22));
    assert_eq!(again.event, Some(Event::Changed(setting)));
    // The old id counts until the reset.
    assert_eq!(node.id().map(wire::NodeId::get), Some(ID));
    assert_eq!(
        node.boot(BootCause::Commanded)
            .expect("a boot-up message")
            .id(),
        0x722
    );
}

#[test]
fn a_second_store_is_refused_while_the_first_lasts_and_both_are_answered() {
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
    let first = node.finish(Ok(())).expect("an answer");
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
    let answer = node.finish(Ok(())).expect("an answer");
    assert_eq!(answer.data()[..2], [0x17, 0]);
    assert_eq!(node.write(store, b"save"), Ok(Some(Event::Store)));
}

#[test]
fn a_store_that_fails_is_told_over_lss() {
    let mut node = node();
    send(&mut node, 0x7E5, &lss::encode_switch_global(true));
    send(&mut node, 0x7E5, &lss::encode_store());
    let answer = node.finish(Err(AbortCode::Hardware)).expect("an answer");
    assert_eq!(answer.data()[..2], [0x17, 2]);
}

#[test]
fn a_boot_forgets_what_was_going_on_before_it() {
    let mut node = node();
    let sdo = 0x600 + u16::from(ID);
    // A transfer, a store, the age of the heartbeat, and what a SYNC asked for.
    send(&mut node, sdo, &[0x40, 0x08, 0x10, 0, 0, 0, 0, 0]);
    send(&mut node, 0x7E5, &lss::encode_switch_global(true));
    send(&mut node, 0x7E5, &lss::encode_store());
    let sync = Address::new(index::TPDO + 6, 2);
    assert!(node.write(sync, &[1]).is_ok());
    node.command(Command::StartRemoteNode);
    for _ in 0..300 {
        tick(&mut node, &ContactEstimate::default());
    }
    send(&mut node, 0x80, &[]);
    node.boot(BootCause::PowerUp);
    let frames = tick(&mut node, &ContactEstimate::default());
    let health = Pdo::Health.cob_id(node.id().expect("an id"));
    assert!(frames.iter().all(|frame| frame.id() != health));
    let beats = (1..499)
        .flat_map(|_| tick(&mut node, &ContactEstimate::default()))
        .filter(|frame| frame.id() == 0x700 + u16::from(ID));
    assert_eq!(beats.count(), 0, "the period starts with the boot-up");
    let segment = send(&mut node, sdo, &[0x60, 0, 0, 0, 0, 0, 0, 0]).reply;
    assert_eq!(segment.expect("an answer").data()[0], 0x80);
    assert_eq!(node.finish(Ok(())), None);
}

#[test]
fn a_sync_in_pre_operational_asks_for_nothing() {
    let mut node = node();
    let sync = Address::new(index::TPDO + 6, 2);
    assert!(node.write(sync, &[1]).is_ok());
    send(&mut node, 0x80, &[]);
    node.command(Command::StartRemoteNode);
    let frames = tick(&mut node, &ContactEstimate::default());
    let health = Pdo::Health.cob_id(node.id().expect("an id"));
    assert!(frames.iter().all(|frame| frame.id() != health));
}

#[test]
fn nothing_is_sent_before_the_boot_up() {
    let mut node = Node::new(Settings::default(), 1);
    for _ in 0..2000 {
        assert_eq!(tick(&mut node, &ContactEstimate::default()), []);
    }
}

#[test]
fn a_client_that_gives_up_ends_its_transfer() {
    let mut node = node();
    let sdo = 0x600 + u16::from(ID);
    send(&mut node, sdo, &[0x40, 0x08, 0x10, 0, 0, 0, 0, 0]);
    let given_up = send(&mut node, sdo, &[0x80, 0x08, 0x10, 0, 0, 0, 4, 5]);
    assert_eq!(given_up, Outcome::default());
    let segment = send(&mut node, sdo, &[0x60, 0, 0, 0, 0, 0, 0, 0]).reply;
    assert_eq!(segment.expect("an answer").data()[0], 0x80);
}

#[test]
fn the_lock_keeps_a_calibration_from_being_kept_or_forgotten() {
    let mut node = node();
    node.set_learnt(learnt());
    assert!(node.write(Address::new(index::LOCK, 0), &[1]).is_ok());
    let command = Address::new(index::CALIBRATION, 1);
    for value in [KEEP, FORGET] {
        assert_eq!(refused(&mut node, command, value), AbortCode::Locked);
    }
    assert_eq!(node.settings().params().learnt, None);
}

#[test]
fn lss_respects_the_lock() {
    let mut node = node();
    assert!(node.write(Address::new(index::LOCK, 0), &[1]).is_ok());
    send(&mut node, 0x7E5, &lss::encode_switch_global(true));
    let refused = send(&mut node, 0x7E5, &lss::encode_configure_node_id(0x22));
    assert_eq!(refused.reply.expect("an answer").data()[..2], [0x11, 255]);
    assert_eq!(refused.event, None);
}

#[test]
fn a_foot_without_an_id_is_found_by_fastscan_and_says_nothing_else() {
    let mut settings = Settings::default();
    let id = Address::new(index::NODE_ID, 0);
    assert_eq!(settings.set(id, Value::U8(255)), Ok(()));
    let mut node = Node::new(settings.clone(), 0xABCD_1234);
    assert_eq!(node.boot(BootCause::PowerUp), None);
    for _ in 0..2000 {
        assert_eq!(tick(&mut node, &ContactEstimate::default()), []);
    }
    assert_eq!(send(&mut node, 0, &[1, 0]), Outcome::default());
    assert_eq!(node.raise(Fault::LateTick, 0), None);
    let mut master = lss::FastscanMaster::new();
    while let Some(request) = master.next_request() {
        let answered = send(&mut node, 0x7E5, &request).reply.is_some();
        master.on_response(answered);
    }
    assert!(master.found());
    assert_eq!(master.address().serial_number, 0xABCD_1234);
    send(&mut node, 0x7E5, &lss::encode_configure_node_id(5));
    // It boots when the configuration is over, with the stored settings, which do not know the id.
    let over = send(&mut node, 0x7E5, &lss::encode_switch_global(false));
    assert_eq!(over.event, Some(Event::ResetCommunication));
    node.set_settings(settings);
    let boot = node.boot(BootCause::Commanded).expect("a boot-up message");
    assert_eq!(boot.id(), 0x705);
    assert_eq!(node.state(), State::PreOperational);
    send(&mut node, 0x7E5, &lss::encode_switch_global(true));
    let over = send(&mut node, 0x7E5, &lss::encode_switch_global(false));
    assert_eq!(over, Outcome::default(), "only once");
}

#[test]
fn a_foot_without_an_id_is_set_up_over_uart() {
    let mut settings = Settings::default();
    let id = Address::new(index::NODE_ID, 0);
    assert_eq!(settings.set(id, Value::U8(255)), Ok(()));
    let mut node = Node::new(settings, 1);
    node.boot(BootCause::PowerUp);
    assert_eq!(node.write(id, &[7]), Ok(Some(Event::Changed(id))));
    let reset = node.command(Command::ResetCommunication);
    assert_eq!(reset, Some(Event::ResetCommunication));
    let boot = node.boot(BootCause::Commanded).expect("a boot-up message");
    assert_eq!(boot.id(), 0x707);
    node.command(Command::StartRemoteNode);
    assert_eq!(node.write(id, &[8]), Err(AbortCode::DeviceState));
}

#[test]
fn an_id_given_by_lss_counts_until_power_off_though_it_is_not_stored() {
    let id = Address::new(index::NODE_ID, 0);
    let reset = |node: &mut Node| {
        node.command(Command::ResetCommunication);
        node.set_settings(Settings::default());
        let boot = node.boot(BootCause::Commanded);
        boot.expect("a boot-up message").id()
    };
    let mut node = node();
    send(&mut node, 0x7E5, &lss::encode_switch_global(true));
    send(&mut node, 0x7E5, &lss::encode_configure_node_id(0x22));
    assert_eq!(reset(&mut node), 0x722);
    assert_eq!(node.read(id), Ok(Value::U8(0x22)));
    assert_eq!(reset(&mut node), 0x722, "and at each reset after it");
    // What is written later counts instead, as do the defaults.
    assert!(node.write(id, &[0x33]).is_ok());
    assert_eq!(reset(&mut node), 0x711, "the written one was not stored");
    send(&mut node, 0x7E5, &lss::encode_switch_global(true));
    send(&mut node, 0x7E5, &lss::encode_configure_node_id(0x22));
    node.command(Command::ResetNode);
    assert_eq!(reset(&mut node), 0x711, "as after power-off");
}

#[test]
fn a_node_takes_a_tenth_of_what_the_peers_takes() {
    const VALUES: usize = 252;
    let ours = size_of::<Node>();
    let counts = dictionary::OBJECTS
        .iter()
        .filter(|object| object.entries.iter().all(|entry| entry.subindex != 0))
        .count();
    assert_eq!(
        dictionary::entries().count() + counts,
        VALUES,
        "the size below"
    );
    let theirs = size_of::<canopen_rs::Node<VALUES>>();
    println!("a node takes {ours} bytes, the peer's {theirs}");
    assert!(ours < 1024, "a node takes {ours} bytes");
    assert!(theirs > 11 * 1024, "README.md says more than {theirs}");
}
