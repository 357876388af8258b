//! Layer setting services (CiA 305): a master assigns the node id.

use canopen_rs::lss::{self, LssAddress, LssSlave, LssState};

use super::{NODE_ID, Node, Waiting};
use crate::dictionary::{PRODUCT_CODE, REVISION, VENDOR_ID};
use crate::foot::NodeId;
use crate::frame::CanFrame;
use crate::node::event::{Event, Outcome};
use crate::value::Value;

const LSS_FASTSCAN: u8 = 0x51;
const LSS_CONFIGURE_NODE_ID: u8 = 0x11;
const LSS_CONFIGURE_BIT_TIMING: u8 = 0x13;
pub(super) const LSS_STORE: u8 = 0x17;

impl Node {
    pub(super) fn receive_lss(&mut self, frame: &CanFrame) -> Outcome {
        let Some(request) = frame.data8() else {
            return Outcome::default();
        };
        // Bits 31 to 0, and 0x80 in the first request (CiA 305).
        if let [LSS_FASTSCAN, _, _, _, _, 0x20..=0x7F | 0x81.., ..] = *request {
            return Outcome::default();
        }
        let [service, ..] = *request;
        let configuring = self.lss.state() == LssState::Configuration;
        if configuring {
            let refused = |error, specific| Outcome {
                reply: Some(CanFrame::of(
                    lss::LSS_SLAVE_COB_ID,
                    [service, error, specific, 0, 0, 0, 0, 0],
                )),
                event: None,
            };
            match service {
                // 255: refused for a device-specific reason.
                LSS_CONFIGURE_NODE_ID if self.device.settings.is_locked() => {
                    return refused(255, 1);
                }
                // 1: not supported. The bit rate is a setting (0x2002).
                LSS_CONFIGURE_BIT_TIMING => return refused(1, 0),
                // 2: the storage medium cannot be accessed, because another store is pending.
                LSS_STORE if self.waiting != Waiting::None => return refused(2, 0),
                LSS_STORE => {
                    self.waiting = Waiting::Lss;
                    return super::event(Some(Event::Store));
                }
                _ => {}
            }
        }
        let answer = self.lss.handle(request);
        let accepted = matches!(answer, Some([LSS_CONFIGURE_NODE_ID, 0, ..]));
        let mut event = None;
        if accepted {
            // Also in the settings, so that a store keeps it.
            let id = NodeId::new(self.lss.pending_node_id());
            self.given = Some(id);
            let set = self.device.settings.set(NODE_ID, id_setting(id));
            event = set.is_ok().then_some(Event::Changed(NODE_ID));
        }
        // A node without an id boots as soon as it has one and the configuration has ended (CiA 305).
        let left = configuring && self.lss.state() == LssState::Waiting;
        if left && self.device.id.is_none() && matches!(self.given, Some(Some(_))) {
            event = Some(Event::ResetCommunication);
        }
        Outcome { reply: answer.map(|answer| CanFrame::of(lss::LSS_SLAVE_COB_ID, answer)), event }
    }
}

/// Value of the node id setting for this id.
pub(super) fn id_setting(id: Option<NodeId>) -> Value {
    Value::U8(id.map_or(lss::UNCONFIGURED_NODE_ID, NodeId::get))
}

pub(super) fn lss_slave(id: Option<NodeId>, serial: u32) -> LssSlave {
    let address = LssAddress {
        vendor_id: VENDOR_ID,
        product_code: PRODUCT_CODE,
        revision_number: REVISION,
        serial_number: serial,
    };
    LssSlave::new(address, id.map_or(lss::UNCONFIGURED_NODE_ID, NodeId::get))
}
