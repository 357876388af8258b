//! Layer setting services (CiA 305): a master assigns the node id.

use canopen_rs::lss::{LSS_SLAVE_COB_ID, LssAddress, LssSlave, LssState, UNCONFIGURED_NODE_ID};

use super::device::Device;
use super::{Event, Outcome};
use crate::abort::AbortCode;
use crate::dictionary::{Address, Concern, PRODUCT_CODE, REVISION, VENDOR_ID, index};
use crate::foot::NodeId;
use crate::frame::CanFrame;
use crate::settings::Settings;
use crate::value::Value;

/// LSS slave of a foot, with the node id that a master has assigned.
#[derive(Debug)]
pub(super) struct Lss {
    slave: LssSlave,
    /// Node id assigned by LSS since power-up, kept over a reset of the communication; `Some(None)` if LSS has removed
    /// it.
    assigned: Option<Option<NodeId>>,
}

/// Requests of the master.
const LSS_FASTSCAN: u8 = 0x51;
const LSS_CONFIGURE_NODE_ID: u8 = 0x11;
const LSS_CONFIGURE_BIT_TIMING: u8 = 0x13;
const LSS_STORE: u8 = 0x17;

/// Address of the setting of the node id.
pub(super) const NODE_ID: Address = Address::new(index::NODE_ID, 0);

impl Lss {
    /// Creates a slave without an assigned id. `id` is the node id of the settings.
    pub(super) fn new(id: Option<NodeId>, serial: u32) -> Self {
        Self { slave: slave(id, serial), assigned: None }
    }

    /// Starts the slave again with the node id that applies now. It keeps the assigned id.
    pub(super) fn restart(&mut self, id: Option<NodeId>, serial: u32) {
        self.slave = slave(id, serial);
    }

    /// Writes the assigned node id to the settings, if there is one.
    pub(super) fn apply_assigned_id(&self, settings: &mut Settings) {
        if let Some(id) = self.assigned {
            // LSS accepts only ids that the setting accepts.
            let _ = settings.set(NODE_ID, id_setting(id));
        }
    }

    /// Forgets the assigned node id.
    pub(super) const fn forget_assigned_id(&mut self) {
        self.assigned = None;
    }

    /// Handles a request of the master. A store that it requests is answered by [`answer_to_store`].
    pub(super) fn handle(&mut self, request: &[u8; 8], device: &mut Device) -> Outcome {
        // The number of the bit to check is 31 to 0, or 0x80 in the first request (CiA 305).
        if let [LSS_FASTSCAN, _, _, _, _, 0x20..=0x7F | 0x81.., ..] = *request {
            return Outcome::default();
        }
        let [service, ..] = *request;
        let configuring = self.slave.state() == LssState::Configuration;
        if configuring {
            let refused = |error, specific| Outcome {
                reply: Some(CanFrame::of(
                    LSS_SLAVE_COB_ID,
                    [service, error, specific, 0, 0, 0, 0, 0],
                )),
                event: None,
            };
            match service {
                // 255: refused for a device-specific reason.
                LSS_CONFIGURE_NODE_ID if device.settings.is_locked() => {
                    return refused(255, 1);
                }
                // Error 1 means not supported, because the bit rate is a setting (0x2002).
                LSS_CONFIGURE_BIT_TIMING => return refused(1, 0),
                // Error 2 means that the storage medium cannot be accessed, because another store is pending.
                LSS_STORE if device.pending.is_some() => return refused(2, 0),
                LSS_STORE => return Outcome { reply: None, event: Some(Event::Store) },
                _ => {}
            }
        }
        let answer = self.slave.handle(request);
        let accepted = matches!(answer, Some([LSS_CONFIGURE_NODE_ID, 0, ..]));
        let mut event = None;
        if accepted {
            // The id is also written to the settings, so that a store keeps it.
            let id = NodeId::new(self.slave.pending_node_id());
            self.assigned = Some(id);
            let set = device.settings.set(NODE_ID, id_setting(id));
            let changed = Event::Changed { address: NODE_ID, concern: Concern::Node };
            event = set.is_ok().then_some(changed);
        }
        // A node without an id boots as soon as it has one and the LSS configuration has ended (CiA 305).
        let left = configuring && self.slave.state() == LssState::Waiting;
        if left && device.id.is_none() && matches!(self.assigned, Some(Some(_))) {
            event = Some(Event::ResetCommunication);
        }
        Outcome { reply: answer.map(|answer| CanFrame::of(LSS_SLAVE_COB_ID, answer)), event }
    }
}

/// Response to the master whose store has ended.
pub(super) fn answer_to_store(result: Result<(), AbortCode>) -> CanFrame {
    // Error 2 means that the storage medium cannot be accessed.
    let error = if result.is_ok() { 0 } else { 2 };
    CanFrame::of(LSS_SLAVE_COB_ID, [LSS_STORE, error, 0, 0, 0, 0, 0, 0])
}

/// Value of the node id setting for this id.
fn id_setting(id: Option<NodeId>) -> Value {
    Value::U8(id.map_or(UNCONFIGURED_NODE_ID, NodeId::get))
}

/// LSS slave of a foot with this id and serial number.
fn slave(id: Option<NodeId>, serial: u32) -> LssSlave {
    let address = LssAddress {
        vendor_id: VENDOR_ID,
        product_code: PRODUCT_CODE,
        revision_number: REVISION,
        serial_number: serial,
    };
    LssSlave::new(address, id.map_or(UNCONFIGURED_NODE_ID, NodeId::get))
}
