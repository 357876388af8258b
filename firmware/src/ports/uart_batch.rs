//! Frames for the serial line, combined into one transfer.

use heapless::Vec;
use wire::uart;

use super::UartQueue;
use crate::outlet::Lane;

/// Frames sent to the serial line in one transfer: faults first, the contact, then others, not more
/// than [`BYTES`](Self::BYTES) together. A contact is never more than a tick old when it is sent:
/// the next one replaces it in the queue.
#[derive(Debug, Default)]
pub struct UartBatch {
    bytes: Vec<u8, { uart::MAX_FRAME }>,
    /// Consecutive batches with a contact that had no room for all frames.
    crowded: u8,
}

impl UartBatch {
    /// Maximum size of a batch of several frames, bytes: less than a tick takes at 1 Mbaud, so that no contact
    /// is dropped there, and enough for a contact and a raw sample.
    pub const BYTES: usize = 96;

    /// After N batches without room for all frames, one batch may be as long as the longest frame, and
    /// if that is not enough, the next one goes without the contact: a line filled by contacts alone
    /// still sends responses.
    const CROWDED: u8 = 4;

    pub(super) fn fill(&mut self, queue: &UartQueue) -> &[u8] {
        let without_contact = self.crowded > Self::CROWDED;
        let most = if self.crowded == Self::CROWDED { uart::MAX_FRAME } else { Self::BYTES };
        self.bytes.clear();
        let (mut with_contact, mut crowded) = (false, 0);
        queue.take_all(|lane, frame| {
            let bytes = frame.as_bytes();
            if lane == Lane::Estimate {
                if without_contact {
                    return false;
                }
                with_contact = true;
            } else if !self.bytes.is_empty() && self.bytes.len() + bytes.len() > most {
                crowded = if with_contact { self.crowded + 1 } else { 0 };
                return false;
            }
            self.bytes.extend_from_slice(bytes).is_ok()
        });
        self.crowded = crowded;
        &self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ports::Ports;
    use std::vec::Vec;
    use wire::uart::{ContactMessage, Decoder, LogMessage, MAX_LOG, Message};

    fn contact(ports: &Ports, sequence: u16) -> u32 {
        ports.push_uart(Lane::Estimate, sequence, &Message::Contact(ContactMessage::default()))
    }

    fn line(ports: &Ports, sequence: u16, length: usize) {
        let text = "x".repeat(length);
        ports.push_uart(Lane::Answer, sequence, &Message::Log(LogMessage::new(1, &text)));
    }

    /// Sequence numbers and length of the next batch.
    fn taken(ports: &Ports, batch: &mut UartBatch) -> (Vec<u16>, usize) {
        let mut decoder = Decoder::new();
        let bytes = ports.take_uart(batch);
        let frames = bytes.iter().filter_map(|byte| decoder.push(*byte));
        let frames = frames.map(|frame| frame.expect("a sound frame").sequence);
        (frames.collect(), bytes.len())
    }

    #[test]
    fn the_newest_contact_goes_first_and_replaces_the_previous() {
        let (ports, mut batch) = (Ports::new(), UartBatch::default());
        line(&ports, 1, 20);
        assert_eq!(contact(&ports, 2), 0);
        assert_eq!(contact(&ports, 3), 1);
        assert_eq!(taken(&ports, &mut batch).0, [3, 1]);
        assert_eq!(taken(&ports, &mut batch).0, []);
    }

    #[test]
    fn several_frames_take_less_than_a_tick_and_one_may_exceed_it() {
        let (ports, mut batch) = (Ports::new(), UartBatch::default());
        for sequence in 0..4 {
            line(&ports, sequence, 30);
        }
        line(&ports, 4, MAX_LOG);
        let batches: Vec<_> = (0..4).map(|_| taken(&ports, &mut batch)).collect();
        let frames = batches.iter().flat_map(|(frames, _)| frames);
        assert!(frames.copied().eq(0..5));
        for (frames, bytes) in batches {
            assert!(frames.len() <= 1 || bytes <= UartBatch::BYTES);
        }
    }

    #[test]
    fn a_batch_of_exactly_the_maximum_is_one_transfer() {
        let (ports, mut batch) = (Ports::new(), UartBatch::default());
        line(&ports, 0, 30);
        let (_, first) = taken(&ports, &mut batch);
        let overhead = first - 30;
        for (excess, frames) in [(0, 2), (1, 1)] {
            let (ports, mut batch) = (Ports::new(), UartBatch::default());
            line(&ports, 0, 30);
            line(&ports, 1, UartBatch::BYTES - first - overhead + excess);
            assert_eq!(taken(&ports, &mut batch).0.len(), frames);
        }
    }

    #[test]
    fn a_line_that_fits_the_longest_batch_goes_with_the_contact() {
        let (ports, mut batch) = (Ports::new(), UartBatch::default());
        line(&ports, 1_000, 60);
        let mut rounds = (0..20).map(|round| {
            assert_eq!(contact(&ports, round), 0, "no contact is dropped");
            taken(&ports, &mut batch)
        });
        let (frames, bytes) = rounds.find(|(frames, _)| frames.contains(&1_000)).expect("it goes");
        assert_eq!(frames, [u16::from(UartBatch::CROWDED), 1_000]);
        assert!(bytes > UartBatch::BYTES);
    }

    #[test]
    fn contacts_that_fill_the_line_do_not_block_other_frames() {
        let (ports, mut batch) = (Ports::new(), UartBatch::default());
        line(&ports, 1_000, MAX_LOG);
        let rounds = (0..20).take_while(|round| {
            contact(&ports, *round);
            taken(&ports, &mut batch).0 != [1_000]
        });
        assert_eq!(rounds.count(), usize::from(UartBatch::CROWDED) + 1);
        // The next batch starts with the contact again.
        contact(&ports, 30);
        assert_eq!(taken(&ports, &mut batch).0, [30]);
    }
}
