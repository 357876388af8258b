//! Bytes on their way to a program, which are lost if the program is too slow.

/// Maximum number of bytes that wait for a program, in addition to the bytes that the system holds: half a second of a
/// busy bus.
const MOST_WAITING: usize = 64 * 1024;

/// Result of a write to a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sent {
    /// The bytes wait for the program, or no program has the line open.
    Taken,
    /// The bytes were lost: the program is too slow.
    Lost,
}

/// Bytes for a program that has a line open.
#[derive(Debug, Default)]
pub(super) struct Output {
    /// Bytes that the program has not taken yet.
    pub(super) waiting: Vec<u8>,
    /// Number of bytes lost because the program was too slow.
    pub(super) lost: u64,
}

impl Output {
    /// Adds bytes, all or none.
    pub(super) fn push(&mut self, bytes: &[u8]) -> Sent {
        if self.waiting.len() + bytes.len() > MOST_WAITING {
            self.lost += bytes.len() as u64;
            return Sent::Lost;
        }
        self.waiting.extend_from_slice(bytes);
        Sent::Taken
    }
}
