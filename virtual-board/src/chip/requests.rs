//! Who asks which stream of DMA.

/// Who asks a stream of DMA to move an item (RM0090, tables 42 and 43).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Request {
    SpiReceive(usize),
    SpiTransmit(usize),
    UsartReceive(usize),
    UsartTransmit(usize),
}

/// Who asks a stream for its items; `None` where no model does.
pub(super) const fn request(controller: usize, stream: usize, channel: u32) -> Option<Request> {
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
