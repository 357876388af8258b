//! DMA: the mapping of peripheral requests to streams, and the transfer of items.

use super::Chip;
use crate::emulator::memory::{CCM, Memory};

/// A peripheral's request to move an item (RM0090, tables 42 and 43).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Request {
    SpiReceive(usize),
    SpiTransmit(usize),
    UsartReceive(usize),
    UsartTransmit(usize),
}

/// The request that a stream serves on a channel; `None` if it is not modelled.
const fn request(controller: usize, stream: usize, channel: u32) -> Option<Request> {
    use Request::{SpiReceive, SpiTransmit, UsartReceive, UsartTransmit};
    Some(match (controller, stream, channel) {
        (1, 0 | 2, 3) => SpiReceive(0),
        (1, 3 | 5, 3) => SpiTransmit(0),
        (1, 2 | 5, 4) => UsartReceive(0),
        (1, 7, 4) => UsartTransmit(0),
        (1, 1 | 2, 5) => UsartReceive(3),
        (1, 6 | 7, 5) => UsartTransmit(3),
        (0, 3, 0) => SpiReceive(1),
        (0, 4, 0) => SpiTransmit(1),
        (0, 0 | 2, 0) => SpiReceive(2),
        (0, 5 | 7, 0) => SpiTransmit(2),
        (0, 5, 4) => UsartReceive(1),
        (0, 6, 4) => UsartTransmit(1),
        (0, 1, 4) => UsartReceive(2),
        (0, 3, 4) => UsartTransmit(2),
        _ => return None,
    })
}

impl Chip {
    /// Moves items until no request is left.
    pub(super) fn serve_dma(&mut self, memory: &mut dyn Memory, now: u64) -> Result<(), String> {
        loop {
            let mut moved = false;
            for controller in 0..2 {
                for stream in self.dmas[controller].running() {
                    let Some(channel) = self.dmas[controller].streams[stream].channel() else {
                        continue;
                    };
                    let Some(request) = request(controller, stream, channel) else {
                        return Err(format!(
                            "DMA{} stream {stream} has no model of channel {channel}",
                            controller + 1
                        ));
                    };
                    if self.is_requested(request) {
                        self.move_item(controller, stream, memory, now)?;
                        moved = true;
                    }
                }
            }
            if !moved {
                return Ok(());
            }
        }
    }

    fn is_requested(&self, request: Request) -> bool {
        match request {
            Request::SpiReceive(index) => self.spis[index].has_byte(),
            Request::SpiTransmit(index) => self.spis[index].wants_byte(),
            Request::UsartReceive(index) => self.usarts[index].has_byte(),
            Request::UsartTransmit(index) => self.usarts[index].wants_byte(),
        }
    }

    /// Moves one item of a stream.
    fn move_item(
        &mut self,
        controller: usize,
        stream: usize,
        memory: &mut dyn Memory,
        now: u64,
    ) -> Result<(), String> {
        let running = &self.dmas[controller].streams[stream];
        if controller == 1 && self.failing_streams[stream] && running.is_half_done() {
            self.dmas[controller].moved(stream, false);
            return Ok(());
        }
        let item = running.item();
        let mut bytes = [0; 4];
        // Only the core reaches CCM RAM.
        let reachable = !CCM.contains(item.memory);
        let worked = if item.to_peripheral {
            let read = reachable
                && bytes.get_mut(..item.size).is_some_and(|bytes| memory.read(item.memory, bytes));
            if read {
                self.write_part(
                    memory,
                    now,
                    item.peripheral,
                    item.size,
                    u32::from_le_bytes(bytes),
                )?;
            }
            read
        } else {
            let value = self.read_part(now, item.peripheral)?;
            bytes = value.to_le_bytes();
            reachable
                && bytes.get(..item.size).is_some_and(|bytes| memory.write(item.memory, bytes))
        };
        self.dmas[controller].moved(stream, worked);
        if !worked {
            return Err(format!("DMA cannot reach {:#010x}", item.memory));
        }
        Ok(())
    }
}
