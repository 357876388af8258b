//! NMT states, boot-up, heartbeat, SYNC and time.

use canopen_rs::lss;
use canopen_rs::time::TimeOfDay;
use estimator_core::ContactEstimate;
use wire::dictionary::index;
use wire::node::{NmtCommand, NmtState};
use wire::{Address, BootCause, CanFrame, Event, Outcome, Pdo, Settings, Value};

use super::master::{ID, NOW, Node, accepted, node, send, tick};

#[test]
fn with_autostart_the_node_boots_and_streams() {
    let mut node = Node::new(Settings::default(), 1);
    let boot = node.boot(BootCause::PowerUp).expect("a boot-up message");
    assert_eq!((boot.id(), boot.data()), (0x700 + u16::from(ID), &[0][..]));
    assert_eq!(node.state(), NmtState::Operational);
    let frames = tick(&mut node, &ContactEstimate::default());
    assert_eq!(frames[0].id(), 0x180 + u16::from(ID));
}

#[test]
fn without_autostart_the_node_waits_for_the_master() {
    let mut settings = Settings::default();
    let autostart = Address::new(index::AUTOSTART, 0);
    assert_eq!(settings.set(autostart, Value::U8(0)), Ok(()));
    let mut node = Node::new(settings, 1);
    node.boot(BootCause::PowerUp);
    assert_eq!(node.state(), NmtState::PreOperational);
    assert_eq!(tick(&mut node, &ContactEstimate::default()), []);
    let started = send(&mut node, 0, &[1, 0]);
    assert_eq!(started.event, Some(Event::State(NmtState::Operational)));
    assert!(!tick(&mut node, &ContactEstimate::default()).is_empty());
}

#[test]
fn a_master_resets_configures_and_starts_the_node() {
    let mut node = Node::new(Settings::default(), 1);
    node.boot(BootCause::PowerUp);
    assert_eq!(node.state(), NmtState::Operational);
    let reset = send(&mut node, 0, &[0x82, ID]);
    assert_eq!(reset.event, Some(Event::ResetCommunication));
    node.set_settings(Settings::default());
    assert!(node.boot(BootCause::Commanded).is_some());
    assert_eq!(node.state(), NmtState::PreOperational);
    let heartbeat = Address::new(index::HEARTBEAT, 0);
    accepted(&mut node, heartbeat, Value::U16(100));
    assert_eq!(tick(&mut node, &ContactEstimate::default()), []);
    let started = send(&mut node, 0, &[1, ID]);
    assert_eq!(started.event, Some(Event::State(NmtState::Operational)));
    assert!(!tick(&mut node, &ContactEstimate::default()).is_empty());
}

#[test]
fn the_heartbeat_reports_the_state_at_its_period() {
    let mut node = node();
    let period = Address::new(index::HEARTBEAT, 0);
    accepted(&mut node, period, Value::U16(50));
    for (command, state) in [
        (NmtCommand::EnterPreOperational, 0x7F),
        (NmtCommand::StartRemoteNode, 0x05),
        (NmtCommand::StopRemoteNode, 0x04),
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
fn nmt_commands_for_others_are_ignored_and_resets_reported() {
    let mut node = node();
    for ignored in [&[1, 0x12][..], &[1], &[], &[9, ID], &[1, 200]] {
        assert_eq!(send(&mut node, 0, ignored), Outcome::default());
        assert_eq!(node.state(), NmtState::PreOperational);
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
    node.command(NmtCommand::StopRemoteNode);
    let request = [0x40, 0, 0x10, 0, 0, 0, 0, 0];
    assert_eq!(send(&mut node, 0x600 + u16::from(ID), &request), Outcome::default());
}

#[test]
fn each_foot_boots_with_its_own_id() {
    let mut node = node();
    let foot = Address::new(index::FOOT, 0);
    accepted(&mut node, foot, Value::U8(2));
    let boot = node.boot(BootCause::Commanded).expect("a boot-up message");
    assert_eq!(boot.id(), 0x712);
}

#[test]
fn sync_and_time_are_passed_on() {
    let mut node = node();
    assert_eq!(send(&mut node, 0x80, &[]).event, Some(Event::Sync(None)));
    let time = TimeOfDay::new(12_345_678, 15_000);
    assert_eq!(send(&mut node, 0x100, &time.encode()).event, Some(Event::Time(time)));
    assert_eq!(send(&mut node, 0x100, &[1, 2]), Outcome::default());
    // The time stamp is kept, with its reception time.
    assert_eq!(node.time(), Some((time, NOW)));
    for (sub, value) in
        [(1, Value::U16(15_000)), (2, Value::U32(12_345_678)), (3, Value::U32(500_000))]
    {
        assert_eq!(node.read(Address::new(index::TIME, sub)), Ok(value));
    }
}

#[test]
fn a_boot_resets_pending_transfers_and_stores() {
    let mut node = node();
    let sdo = 0x600 + u16::from(ID);
    // Begins a transfer and a store, and leaves a heartbeat and a frame for a SYNC due.
    send(&mut node, sdo, &[0x40, 0x08, 0x10, 0, 0, 0, 0, 0]);
    send(&mut node, 0x7E5, &lss::encode_switch_global(true));
    send(&mut node, 0x7E5, &lss::encode_store());
    let sync = Address::new(index::TPDO + 6, 2);
    assert!(node.write(sync, &[1]).is_ok());
    node.command(NmtCommand::StartRemoteNode);
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
    assert_eq!(node.answer(Ok(())), None);
}

#[test]
fn a_sync_in_pre_operational_requests_nothing() {
    let mut node = node();
    let sync = Address::new(index::TPDO + 6, 2);
    assert!(node.write(sync, &[1]).is_ok());
    send(&mut node, 0x80, &[]);
    node.command(NmtCommand::StartRemoteNode);
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
