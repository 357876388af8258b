//! LSS: assignment of the node id.

use canopen_rs::lss;
use estimator_core::ContactEstimate;
use wire::dictionary::{self, Concern, index};
use wire::node::{NmtCommand, NmtState};
use wire::{AbortCode, Address, BootCause, Event, Fault, Outcome, Settings, Value};

use super::master::{ID, Node, node, send, tick};

#[test]
fn lss_assigns_the_node_id() {
    let mut node = node();
    let address = lss::LssAddress {
        vendor_id: dictionary::VENDOR_ID,
        product_code: dictionary::PRODUCT_CODE,
        revision_number: dictionary::REVISION,
        serial_number: 0xC0FFEE,
    };
    let other = lss::LssAddress { serial_number: 1, ..address };
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
    let id_changed = Event::Changed { address: setting, concern: Concern::Node };
    assert_eq!(changed.event, Some(id_changed));
    let bad = send(&mut node, 0x7E5, &lss::encode_configure_node_id(200));
    assert_eq!(bad.reply.expect("an answer").data()[..2], [0x11, 1]);
    let timing = send(&mut node, 0x7E5, &[0x13, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(timing.reply.expect("an answer").data()[..2], [0x13, 1]);
    let stored = send(&mut node, 0x7E5, &lss::encode_store());
    assert_eq!((stored.reply, stored.event), (None, Some(Event::Store)));
    assert_eq!(node.answer(Ok(())).expect("an answer").data()[..2], [0x17, 0]);
    // The setting was changed by other means, but the id assigned by LSS takes precedence.
    assert!(node.write(setting, &[0x33]).is_ok());
    let again = send(&mut node, 0x7E5, &lss::encode_configure_node_id(0x22));
    assert_eq!(again.event, Some(id_changed));
    // The old id applies until the reset.
    assert_eq!(node.id().map(wire::NodeId::get), Some(ID));
    assert_eq!(node.boot(BootCause::Commanded).expect("a boot-up message").id(), 0x722);
}

#[test]
fn a_store_that_fails_is_reported_over_lss() {
    let mut node = node();
    send(&mut node, 0x7E5, &lss::encode_switch_global(true));
    send(&mut node, 0x7E5, &lss::encode_store());
    let answer = node.answer(Err(AbortCode::Hardware)).expect("an answer");
    assert_eq!(answer.data()[..2], [0x17, 2]);
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
fn a_foot_without_an_id_is_found_by_fastscan_and_stays_silent() {
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
    while let Some(mut request) = master.next_request() {
        if request[5] == lss::FASTSCAN_INIT {
            assert_eq!(send(&mut node, 0x7E5, &request).reply, None, "undefined");
            request[5] = 0x80;
        }
        let answered = send(&mut node, 0x7E5, &request).reply.is_some();
        master.on_response(answered);
    }
    assert!(master.found());
    assert_eq!(master.address().serial_number, 0xABCD_1234);
    send(&mut node, 0x7E5, &lss::encode_configure_node_id(5));
    // The node boots when the configuration is over, with the stored settings, which do not contain the id.
    let over = send(&mut node, 0x7E5, &lss::encode_switch_global(false));
    assert_eq!(over.event, Some(Event::ResetCommunication));
    node.set_settings(settings);
    let boot = node.boot(BootCause::Commanded).expect("a boot-up message");
    assert_eq!(boot.id(), 0x705);
    assert_eq!(node.state(), NmtState::PreOperational);
    send(&mut node, 0x7E5, &lss::encode_switch_global(true));
    let over = send(&mut node, 0x7E5, &lss::encode_switch_global(false));
    assert_eq!(over, Outcome::default(), "only once");
}

#[test]
fn a_foot_without_an_id_is_configured_over_uart() {
    let mut settings = Settings::default();
    let id = Address::new(index::NODE_ID, 0);
    assert_eq!(settings.set(id, Value::U8(255)), Ok(()));
    let mut node = Node::new(settings, 1);
    node.boot(BootCause::PowerUp);
    let changed = Event::Changed { address: id, concern: Concern::Node };
    assert_eq!(node.write(id, &[7]), Ok(Some(changed)));
    let reset = node.command(NmtCommand::ResetCommunication);
    assert_eq!(reset, Some(Event::ResetCommunication));
    let boot = node.boot(BootCause::Commanded).expect("a boot-up message");
    assert_eq!(boot.id(), 0x707);
    node.command(NmtCommand::StartRemoteNode);
    assert_eq!(node.write(id, &[8]), Err(AbortCode::DeviceState));
}

#[test]
fn an_unstored_id_from_lss_applies_until_power_off() {
    let id = Address::new(index::NODE_ID, 0);
    let reset = |node: &mut Node| {
        node.command(NmtCommand::ResetCommunication);
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
    // A later write takes precedence, as do the defaults.
    assert!(node.write(id, &[0x33]).is_ok());
    assert_eq!(reset(&mut node), 0x711, "the written one was not stored");
    send(&mut node, 0x7E5, &lss::encode_switch_global(true));
    send(&mut node, 0x7E5, &lss::encode_configure_node_id(0x22));
    node.command(NmtCommand::ResetNode);
    assert_eq!(reset(&mut node), 0x711, "as after power-off");
}
