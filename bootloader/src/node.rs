//! The CANopen node of the bootloader: boot-up, heartbeat, NMT, LSS and SDO.

use canopen_rs::lss::{self, LssAddress, LssSlave};
use canopen_rs::nmt::{self, NmtCommand};
use wire::CanFrame;
use wire::dictionary::{Address, PRODUCT_CODE, REVISION, VENDOR_ID, index};
use wire::domain::DomainServer;
use wire::foot::{Foot, NodeId, cob_id};
use wire::sdo::written;

use crate::device::{Action, Device, HEARTBEAT_MS, Restart};
use crate::flash::Flash;
use crate::image::{Board, Refusal};
use crate::update::ProgramState;

/// Time without a request after which a transfer is discarded, ms.
const GIVE_UP_MS: u32 = 5_000;

/// Time without a program control or data after which a program that can run is restarted, ms.
const RETURN_MS: u32 = 60_000;

/// A line of the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// The bus.
    Can,
    /// The serial line. This is its only node.
    Serial,
}

/// A frame that is not requested.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Message {
    /// The boot-up message.
    BootUp,
    /// The heartbeat.
    Heartbeat,
    /// Response to the request by which a master has stopped the program.
    Stopped,
}

/// The node.
pub struct Node<F> {
    id: Option<NodeId>,
    lss: LssSlave,
    sdo: DomainServer,
    device: Device<F>,
    /// Time since the last request, ms.
    idle_ms: u32,
    /// Time since a master has controlled or sent a program, ms.
    unused_ms: u32,
    /// Time since the last heartbeat, ms.
    heartbeat_ms: u16,
    action: Option<Action>,
}

impl<F: Flash> Node<F> {
    /// Creates a node; `id` is the node id in the settings.
    pub fn new(
        id: Option<NodeId>,
        flash: F,
        board: Board,
        serial: u32,
        key: &'static [u8; 32],
    ) -> Self {
        let address = LssAddress {
            vendor_id: VENDOR_ID,
            product_code: PRODUCT_CODE,
            revision_number: REVISION,
            serial_number: serial,
        };
        Self {
            id,
            lss: LssSlave::new(address, id.map_or(lss::UNCONFIGURED_NODE_ID, NodeId::get)),
            sdo: DomainServer::new(),
            device: Device::new(flash, board, serial, key),
            idle_ms: 0,
            unused_ms: 0,
            heartbeat_ms: 0,
            action: None,
        }
    }

    /// Returns the flash.
    pub fn release(self) -> F {
        self.device.flash
    }

    /// Id of the node on a line; `None` on a bus until LSS has assigned one. On a serial line the node is alone and
    /// always has one.
    #[must_use]
    pub fn id(&self, line: Line) -> Option<NodeId> {
        self.id.or(match line {
            Line::Can => None,
            Line::Serial => Some(Foot::default().default_node_id()),
        })
    }

    /// Prepares for a download.
    pub fn boot(&mut self, program: ProgramState) {
        self.device.find_running(program);
        // Kept, because the next start may need the new program.
        if program != ProgramState::Unsettled {
            self.action = Some(Action::Clear);
        }
        match program {
            ProgramState::Missing(Some(why)) => self.device.explain(why),
            ProgramState::Unsettled => self.device.explain(Refusal::FlashFailed),
            ProgramState::CanRun | ProgramState::Missing(None) => {}
        }
    }

    /// Returns the frame of a message on a line; `None` if the node has no id.
    #[must_use]
    pub fn frame(&self, message: Message, line: Line) -> Option<CanFrame> {
        let id = self.id(line)?;
        let heartbeat = id.cob_id(cob_id::HEARTBEAT);
        match message {
            Message::BootUp => CanFrame::new(heartbeat, &nmt::BOOTUP_FRAME),
            Message::Heartbeat => {
                CanFrame::new(heartbeat, &nmt::encode_heartbeat(self.device.state()))
            }
            Message::Stopped => CanFrame::new(
                id.cob_id(cob_id::SDO_RESPONSE),
                &written(Address::new(index::PROGRAM_CONTROL, 1)),
            ),
        }
    }

    /// Handles a frame received on a line. Returns the response.
    pub fn receive(&mut self, frame: &CanFrame, line: Line) -> Option<CanFrame> {
        if frame.id() == cob_id::LSS_MASTER {
            return self.receive_lss(frame.data8()?, line);
        }
        let id = self.id(line)?;
        if frame.id() == nmt::NMT_COMMAND_COB_ID {
            let (command, target) = nmt::decode_command(frame.data().first_chunk()?).ok()?;
            let is_own = target.raw() == 0 || target.raw() == id.get();
            let resets = [NmtCommand::ResetNode, NmtCommand::ResetCommunication];
            if is_own && resets.contains(&command) {
                self.plan(Action::Restart(Restart::ByMaster));
            }
            return None;
        }
        if frame.id() != id.cob_id(cob_id::SDO_REQUEST) {
            return None;
        }
        let answer = self.sdo.handle(frame.data8()?, &mut self.device);
        let is_used = self.device.take_use();
        if is_used {
            self.unused_ms = 0;
        }
        // A read by another client during a block is ignored, and so does not prolong a transfer whose master is gone.
        if is_used || answer.is_some() {
            self.idle_ms = 0;
        }
        if let Some(action) = self.device.take_action() {
            self.plan(action);
        }
        CanFrame::new(id.cob_id(cob_id::SDO_RESPONSE), &answer?)
    }

    /// Plans an action. A restart that has been answered is not revoked, and its reason does not change.
    const fn plan(&mut self, action: Action) {
        if !matches!(self.action, Some(Action::Restart(_))) {
            self.action = Some(action);
        }
    }

    fn receive_lss(&mut self, request: &[u8; 8], line: Line) -> Option<CanFrame> {
        const FASTSCAN: u8 = 0x51;
        const CONFIGURE_BIT_TIMING: u8 = 0x13;
        const STORE: u8 = 0x17;
        // The number of the bit to check is 31 to 0, or 0x80 in the first request (CiA 305).
        if let [FASTSCAN, _, _, _, _, 0x20..=0x7F | 0x81.., ..] = *request {
            return None;
        }
        let configuring = self.lss.state() == lss::LssState::Configuration;
        let [service, ..] = *request;
        // Error 1 means not supported, because the settings belong to the program.
        let answer = if configuring && matches!(service, CONFIGURE_BIT_TIMING | STORE) {
            [service, 1, 0, 0, 0, 0, 0, 0]
        } else {
            match self.lss.handle(request) {
                Some(answer) => answer,
                None => return self.take_id(configuring, line),
            }
        };
        CanFrame::new(lss::LSS_SLAVE_COB_ID, &answer)
    }

    /// Takes the id assigned by LSS once LSS has left the configuration. Then returns the boot-up message.
    fn take_id(&mut self, configuring: bool, line: Line) -> Option<CanFrame> {
        let left = configuring && self.lss.state() == lss::LssState::Waiting;
        if !left || self.id.is_some() {
            return None;
        }
        self.id = Some(NodeId::new(self.lss.pending_node_id())?);
        // The id is adopted, so that masters that look for nodes without an id do not find this one again.
        self.lss.adopt_pending();
        self.frame(Message::BootUp, line)
    }

    /// Advances by one millisecond. Returns the heartbeat when it is due.
    pub fn tick(&mut self, program: ProgramState) -> Option<Message> {
        self.idle_ms = self.idle_ms.saturating_add(1);
        if self.idle_ms == GIVE_UP_MS && self.sdo.give_up() {
            self.plan(Action::Clear);
        }
        self.unused_ms = self.unused_ms.saturating_add(1);
        if self.unused_ms == RETURN_MS && !matches!(program, ProgramState::Missing(_)) {
            self.plan(Action::Restart(Restart::AfterSilence));
        }
        self.heartbeat_ms = self.heartbeat_ms.saturating_add(1);
        if self.heartbeat_ms < HEARTBEAT_MS {
            return None;
        }
        self.heartbeat_ms = 0;
        Some(Message::Heartbeat)
    }

    /// Takes a restart that is to follow the last response. Performs a pending erase itself.
    pub fn take_restart(&mut self) -> Option<Restart> {
        match self.action.take()? {
            Action::Clear => {
                self.device.clear();
                None
            }
            Action::Restart(restart) => Some(restart),
        }
    }
}
