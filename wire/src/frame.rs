//! A classic CAN data frame with a standard identifier.

/// Up to eight bytes under an 11-bit identifier.
///
/// The frame is aligned to words, so that a microcontroller copies it by three loads and stores.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(align(4))]
pub struct CanFrame {
    id: u16,
    length: u8,
    data: [u8; 8],
}

impl CanFrame {
    /// Creates a frame; `None` if the identifier has more than 11 bits or there are more than 8 bytes.
    #[must_use]
    pub fn new(id: u16, data: &[u8]) -> Option<Self> {
        if id > 0x7FF || data.len() > 8 {
            return None;
        }
        let mut bytes = [0; 8];
        for (to, from) in bytes.iter_mut().zip(data) {
            *to = *from;
        }
        Some(Self { id, length: data.len() as u8, data: bytes })
    }

    /// Creates a frame of a node. The identifiers of the connection set always fit.
    pub(crate) const fn of<const N: usize>(id: u16, data: [u8; N]) -> Self {
        const { assert!(N <= 8) };
        let mut bytes = [0; 8];
        if let Some(head) = bytes.first_chunk_mut::<N>() {
            *head = data;
        }
        Self { id: id & 0x7FF, length: N as u8, data: bytes }
    }

    /// The identifier (CANopen: COB-ID).
    #[must_use]
    pub const fn id(&self) -> u16 {
        self.id
    }

    /// The data bytes.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        self.data.get(..usize::from(self.length)).unwrap_or(&[])
    }

    /// The eight data bytes; `None` if the frame has fewer.
    #[must_use]
    pub const fn data8(&self) -> Option<&[u8; 8]> {
        if self.length == 8 { Some(&self.data) } else { None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oversized_identifiers_and_data_are_rejected() {
        let frame = CanFrame::new(0x7FF, &[1, 2, 3]).expect("it fits");
        assert_eq!((frame.id(), frame.data()), (0x7FF, &[1, 2, 3][..]));
        assert_eq!(frame, CanFrame::of(0x7FF, [1, 2, 3]));
        assert_eq!(CanFrame::new(0x800, &[]), None);
        assert_eq!(CanFrame::new(0, &[0; 9]), None);
    }
}
