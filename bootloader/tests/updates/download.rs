//! Downloads over SDO into a simulated flash: complete, damaged, refused, abandoned, and with losses on the bus.

use crate::flash::{Chip, Cut, DEVELOPMENT, header, image, program, sign};
use bootloader::device::Restart;
use bootloader::flash::Slot;
use bootloader::image::{BROKEN_OFF, Board, HEADER, Header, Refusal};
use bootloader::journal::{Event, Progress, State};
use bootloader::node::{Line, Message, Node};
use bootloader::update::ProgramState::{CanRun, Missing, Unsettled};
use bootloader::update::{Start, settle};
use bootloader::verify::KEY;
use crc::{CRC_16_XMODEM, Crc};
use wire::foot::NodeId;
use wire::{AbortCode, CanFrame};

/// A master of one node, whose frames can be lost.
pub struct Master {
    pub node: Node<Chip>,
    /// Segments of block downloads sent so far. If `lose` is given, one in this many is lost.
    sent: u32,
    lose: Option<u32>,
    /// How often segments arrive.
    delivery: Delivery,
    check: Check,
}

/// CRC of a block download.
#[derive(Clone, Copy, PartialEq)]
enum Check {
    Crc,
    None,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Delivery {
    Once,
    Twice,
}

type Answer = Result<[u8; 8], AbortCode>;

impl Master {
    pub fn of(chip: Chip) -> Self {
        let id = NodeId::new(5);
        let mut node = Node::new(id, chip, Board::Reference, 77, KEY);
        node.boot(CanRun);
        let frame = |message| node.frame(message, Line::Can).expect("a node with an id");
        let boot = frame(Message::BootUp);
        assert_eq!((boot.id(), boot.data()), (0x705, [0].as_slice()));
        let stopped = frame(Message::Stopped);
        assert_eq!(stopped.data(), [0x60, 0x51, 0x1F, 1, 0, 0, 0, 0]);
        assert_eq!(node.take_restart(), None, "it clears the slot");
        Self { node, sent: 0, lose: None, delivery: Delivery::Once, check: Check::Crc }
    }

    pub fn send(&mut self, request: [u8; 8]) -> Option<[u8; 8]> {
        let frame = CanFrame::new(0x605, &request).expect("a frame");
        let answer = self.node.receive(&frame, Line::Can);
        assert_eq!(answer.as_ref().map_or(0x585, CanFrame::id), 0x585);
        answer.map(|frame| *frame.data8().expect("eight bytes"))
    }

    fn ask(&mut self, request: [u8; 8]) -> Answer {
        let answer = self.send(request).expect("an answer");
        if answer[0] != 0x80 {
            return Ok(answer);
        }
        assert_eq!(self.node.take_restart(), None, "erased after a refusal");
        let code = u32::from_le_bytes(answer[4..].try_into().expect("four"));
        Err(AbortCode::from_code(code).expect("a known code"))
    }

    fn control(&mut self, command: u8) -> Answer {
        self.ask([0x2F, 0x51, 0x1F, 1, command, 0, 0, 0])
    }

    pub fn status(&mut self) -> Option<Refusal> {
        Refusal::from_flash_status(self.raw_status())
    }

    /// Value of object 0x1F57.
    fn raw_status(&mut self) -> u32 {
        let answer = self.ask([0x40, 0x57, 0x1F, 1, 0, 0, 0, 0]).expect("it reads");
        u32::from_le_bytes(answer[4..].try_into().expect("four"))
    }

    fn segmented(&mut self, image: &[u8]) -> Result<(), AbortCode> {
        let [a, b, c, d] = (image.len() as u32).to_le_bytes();
        self.ask([0x21, 0x50, 0x1F, 1, a, b, c, d])?;
        let count = image.chunks(7).count();
        for (k, bytes) in image.chunks(7).enumerate() {
            let toggle = (k as u8 & 1) << 4;
            let last = u8::from(k + 1 == count);
            let mut request = [0; 8];
            request[0] = toggle | (7 - bytes.len() as u8) << 1 | last;
            request[1..=bytes.len()].copy_from_slice(bytes);
            assert_eq!(self.ask(request)?[0], 0x20 | toggle);
        }
        Ok(())
    }

    fn block(&mut self, image: &[u8]) -> Result<(), AbortCode> {
        let [a, b, c, d] = (image.len() as u32).to_le_bytes();
        let crc = u8::from(self.check == Check::Crc) << 2;
        let answer = self.ask([0xC2 | crc, 0x50, 0x1F, 1, a, b, c, d])?;
        assert_eq!(answer[..4], [0xA4, 0x50, 0x1F, 1]);
        let segments: Vec<&[u8]> = image.chunks(7).collect();
        let (mut done, mut size) = (0, usize::from(answer[4]));
        while done < segments.len() {
            let block = &segments[done..segments.len().min(done + size)];
            let mut answer = None;
            for (k, bytes) in block.iter().enumerate() {
                let is_last = done + k + 1 == segments.len();
                let mut request = [(k as u8 + 1) | u8::from(is_last) << 7, 0, 0, 0, 0, 0, 0, 0];
                request[1..=bytes.len()].copy_from_slice(bytes);
                self.sent += 1;
                let random = self.sent.wrapping_mul(0x9E37_79B9) >> 16;
                let is_lost = self.lose.is_some_and(|one| random.is_multiple_of(one));
                // A lost last segment would leave the sub-block without an answer, for which a client has a timeout.
                if !is_lost || k + 1 == block.len() {
                    answer = self.send(request);
                    if self.delivery == Delivery::Twice {
                        assert_eq!(self.send(request), None, "segment {k}");
                    }
                }
            }
            let answer = answer.expect("an answer to a sub-block");
            if answer[0] == 0x80 {
                assert_eq!(self.node.take_restart(), None);
                let code = u32::from_le_bytes(answer[4..].try_into().expect("four"));
                return Err(AbortCode::from_code(code).expect("a known code"));
            }
            assert_eq!(answer[0], 0xA2);
            done += usize::from(answer[1]);
            size = usize::from(answer[2]);
        }
        let unused = (7 - segments.last().map_or(7, |bytes| bytes.len())) as u8;
        let [low, high] = match self.check {
            Check::Crc => Crc::<u16>::new(&CRC_16_XMODEM).checksum(image).to_le_bytes(),
            Check::None => [0; 2],
        };
        let answer = self.ask([0xC1 | unused << 2, low, high, 0, 0, 0, 0, 0])?;
        assert_eq!(answer[0], 0xA1);
        Ok(())
    }
}

fn chip() -> Chip {
    Chip::running(&image(2, 200))
}

#[test]
fn downloaded_program_is_installed_by_start() {
    let new = image(3, 300);
    for by_block in [false, true] {
        let mut master = Master::of(chip());
        let sent = if by_block { master.block(&new) } else { master.segmented(&new) };
        assert_eq!(sent, Ok(()));
        assert_eq!(master.status(), None);
        assert_eq!(master.node.take_restart(), None);
        assert!(master.control(1).is_ok());
        assert_eq!(master.node.take_restart(), Some(Restart::ByMaster));
        let mut chip = master.node.release();
        assert_eq!(State::read(&chip).progress, Progress::Installing);
        chip.runs(&new);
    }
}

#[test]
fn end_with_the_bytes_of_the_last_segment_is_taken() {
    // If a block ends with segment 65 + 4 n, and that has n unused bytes, the segment begins as the end of a download does.
    for unused in 0..7 {
        let mut lengths = (1..=4_usize).map(|blocks| 7 * (127 * blocks + 65 + 4 * unused) - unused);
        let length = lengths.find(|length| length % 4 == 0).expect("whole words");
        let mut program = program(5, length - HEADER);
        program.truncate(program.len() - 7);
        program.extend([0; 7]);
        let new = sign(header(&program, 300), &program, DEVELOPMENT);
        let mut master = Master::of(chip());
        master.check = Check::None;
        assert_eq!(master.block(&new), Ok(()), "{unused} unused");
        assert!(master.node.release().holds(Slot::New, &new), "{unused}");
    }
}

#[test]
fn segment_without_a_number_ends_the_download() {
    let mut master = Master::of(chip());
    assert!(master.ask([0xC6, 0x50, 0x1F, 1, 44, 2, 0, 0]).is_ok());
    assert_eq!(master.send([1, 0, 0, 0, 0, 0, 0, 0]), None);
    let answer = master.ask([0, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(answer, Err(AbortCode::SequenceNumber));
    assert_eq!(master.block(&image(3, 300)), Ok(()));
}

#[test]
fn unsuitable_images_are_refused_before_they_are_installed() {
    let program = program(3, 412);
    let good = header(&program, 300);
    let signed = |header: Header| sign(header, &program, DEVELOPMENT);
    let mut changed = signed(good);
    changed[600] ^= 1;
    let mut unsigned = signed(good);
    unsigned[9] = 0;
    let mut shortened = signed(good);
    shortened.truncate(700);
    let mut lengthened = signed(good);
    lengthened.extend([0; 4]);
    let other = Header { board: Board::Feather, ..good };
    let older = Header { sequence: 199, ..good };
    for (bytes, refusal) in [
        (signed(other), Refusal::OtherBoard),
        (signed(older), Refusal::Older),
        (sign(good, &program, &[9; 32]), Refusal::WrongSignature),
        (unsigned, Refusal::Unsigned),
        (changed, Refusal::WrongHash),
        (shortened, Refusal::WrongLength),
        (lengthened, Refusal::WrongLength),
        (vec![0x7F; 900], Refusal::NotAnImage),
        (vec![0; 200_000], Refusal::WrongLength),
        (vec![0; 100], Refusal::WrongLength),
    ] {
        for by_block in [false, true] {
            let mut master = Master::of(chip());
            let sent = if by_block { master.block(&bytes) } else { master.segmented(&bytes) };
            assert_eq!(sent, Err(AbortCode::CannotStore), "{refusal:?}");
            assert_eq!(master.status(), Some(refusal));
            // Nothing to install, and the next attempt succeeds.
            assert_eq!(master.segmented(&signed(good)), Ok(()), "{refusal:?}");
            assert_eq!(master.status(), None);
        }
    }
}

#[test]
fn start_without_a_download_keeps_the_program() {
    let mut master = Master::of(chip());
    assert!(master.control(1).is_ok());
    assert_eq!(master.node.take_restart(), Some(Restart::ByMaster));
    let mut chip = master.node.release();
    chip.runs(&image(2, 200));
    let mut master = Master::of(chip);
    assert_eq!(master.control(0x80), Err(AbortCode::DeviceState));
    assert_eq!(master.control(9), Err(AbortCode::InvalidValue));
    assert!(master.control(0).is_ok() && master.control(3).is_ok());
}

#[test]
fn silent_master_is_given_up() {
    let new = image(3, 300);
    for by_block in [false, true] {
        let mut master = Master::of(chip());
        let size = new.len() as u8;
        let begin = if by_block { 0xC6 } else { 0x21 };
        assert!(master.ask([begin, 0x50, 0x1F, 1, size, 0, 0, 0]).is_ok());
        let mut heartbeats = 0;
        for _ in 0..5_000 {
            heartbeats += u32::from(master.node.tick(CanRun).is_some());
        }
        assert_eq!(heartbeats, 10);
        assert_eq!(master.node.take_restart(), None);
        assert_eq!(master.block(&new), Ok(()));
        for ms in 1..=60_000 {
            master.node.tick(CanRun);
            let restart = master.node.take_restart();
            let expected = (ms == 60_000).then_some(Restart::AfterSilence);
            assert_eq!(restart, expected, "{ms} ms");
        }
        // Without a program there is nothing to return to.
        for _ in 0..100_000 {
            master.node.tick(Missing(None));
        }
        assert_eq!(master.node.take_restart(), None);
    }
}

/// End of a transfer that has begun with one segment of seven bytes.
#[derive(Clone, Copy, Debug)]
enum End {
    /// A request, and the code of its abort.
    Request([u8; 8], Option<AbortCode>),
    /// Five seconds without one.
    Silence,
}

#[test]
fn transfer_that_is_broken_off_is_seen_in_the_flash_status() {
    let abort = End::Request([0x80, 0x50, 0x1F, 1, 0, 0, 0, 8], None);
    let same_toggle = End::Request([0, 1, 2, 3, 4, 5, 6, 7], Some(AbortCode::ToggleBit));
    let no_number = End::Request([0; 8], Some(AbortCode::SequenceNumber));
    let too_long = End::Request([0x11, 0, 0, 0, 0, 0, 0, 0], Some(AbortCode::TooLong));
    let too_short = End::Request([0x1D, 0, 0, 0, 0, 0, 0, 0], Some(AbortCode::TooShort));
    for (command, size, ends) in [
        (0x21, 44, vec![abort, same_toggle, too_short, End::Silence]),
        (0x21, 8, vec![too_long]),
        (0xC6, 44, vec![abort, no_number, End::Silence]),
    ] {
        for end in ends {
            let mut master = Master::of(chip());
            assert_eq!(master.raw_status(), 0);
            let begin = [command, 0x50, 0x1F, 1, size, 2 * u8::from(size > 8), 0, 0];
            assert!(master.ask(begin).is_ok());
            let first = [u8::from(command == 0xC6), 1, 2, 3, 4, 5, 6, 7];
            master.send(first);
            match end {
                End::Request(request, None) => assert_eq!(master.send(request), None),
                End::Request(request, Some(code)) => assert_eq!(master.ask(request), Err(code)),
                End::Silence => {
                    for _ in 0..5_000 {
                        master.node.tick(CanRun);
                    }
                    assert_eq!(master.node.take_restart(), None);
                }
            }
            assert_eq!(master.raw_status(), BROKEN_OFF, "{command:#x} {end:?}");
            assert_eq!(master.status(), None, "it was not refused");
            // Nothing is installed, and the next attempt succeeds.
            assert!(master.control(3).is_ok());
            assert_eq!(master.raw_status(), 0);
            assert_eq!(master.block(&image(3, 300)), Ok(()));
            assert_eq!(master.raw_status(), 0);
        }
    }
    // A wrong CRC.
    let mut master = Master::of(chip());
    assert!(master.ask([0xC6, 0x50, 0x1F, 1, 7, 0, 0, 0]).is_ok());
    assert!(master.ask([0x81, 0, 0, 0, 0, 0, 0, 0]).is_ok());
    assert_eq!(master.ask([0xC1, 1, 2, 0, 0, 0, 0, 0]), Err(AbortCode::Crc));
    assert_eq!(master.raw_status(), BROKEN_OFF);
    // A segment without a transfer is refused, and the next attempt succeeds.
    let segment = [0x10, 0, 0, 0, 0, 0, 0, 0];
    assert_eq!(master.ask(segment), Err(AbortCode::Command));
    assert_eq!(master.block(&image(3, 300)), Ok(()));
}

#[test]
fn own_image_does_not_put_a_confirmed_program_on_trial() {
    let new = image(3, 300);
    let mut master = Master::of(Chip::running(&new));
    assert_eq!(master.block(&new), Ok(()));
    assert!(master.control(1).is_ok());
    let mut chip = master.node.release();
    assert_eq!(settle(&mut chip, KEY), Ok(Start::Program));
    assert_eq!(State::read(&chip).progress, Progress::Settled);
}

#[test]
fn failed_start_keeps_the_program_that_it_was_to_install() {
    let new = image(3, 300);
    let mut chip = chip().with(Slot::New, &new);
    chip.log(Event::Install);
    // The supply fails in the copy over the running program.
    chip.log(Event::Kept);
    chip.operations = 0;
    chip.cut = Some((5, Cut::Before));
    assert!(settle(&mut chip, KEY).is_err());
    chip.power_up();
    let mut node = Node::new(NodeId::new(5), chip, Board::Reference, 77, KEY);
    node.boot(Unsettled);
    assert_eq!(node.take_restart(), None);
    for _ in 0..60_000 {
        node.tick(Unsettled);
    }
    assert_eq!(node.take_restart(), Some(Restart::AfterSilence));
    let mut chip = node.release();
    chip.runs(&new);
}

#[test]
fn clear_that_the_flash_does_not_take_is_refused() {
    let mut chip = chip().with(Slot::New, &image(3, 300));
    chip.cut = Some((1, Cut::Before));
    let mut node = Node::new(NodeId::new(5), chip, Board::Reference, 77, KEY);
    node.boot(Unsettled);
    let mut master =
        Master { node, sent: 0, lose: None, delivery: Delivery::Once, check: Check::Crc };
    assert_eq!(master.status(), Some(Refusal::FlashFailed), "in the start");
    assert_eq!(master.control(3), Err(AbortCode::Hardware));
    assert_eq!(master.status(), Some(Refusal::FlashFailed));
}

#[test]
fn node_id_of_lss_is_taken_after_the_configuration() {
    let mut node = Node::new(None, chip(), Board::Reference, 77, KEY);
    node.boot(CanRun);
    assert_eq!(node.frame(Message::BootUp, Line::Can), None);
    let mut send = |data: [u8; 8]| {
        let frame = CanFrame::new(0x7E5, &data).expect("a frame");
        node.receive(&frame, Line::Can)
    };
    let mut scan = |bit| send([0x51, 0, 0, 0, 0, bit, 0, 0]);
    assert!(scan(0x80).is_some());
    assert_eq!([0x20, 0x7F, 0x81, 0xFF].map(scan), [const { None }; 4]);
    assert_eq!(send([4, 1, 0, 0, 0, 0, 0, 0]), None);
    let answer = send([0x11, 0x33, 0, 0, 0, 0, 0, 0]).expect("an answer");
    assert_eq!(answer.data()[..2], [0x11, 0]);
    let boot = send([4, 0, 0, 0, 0, 0, 0, 0]).expect("a boot-up message");
    assert_eq!((boot.id(), boot.data()), (0x733, [0].as_slice()));
    // A master that scans for nodes without an id finds none.
    assert_eq!(send([0x51, 0, 0, 0, 0, 0x80, 0, 0]), None);
    assert_eq!(node.id(Line::Can), NodeId::new(0x33));
}

#[test]
fn serial_line_is_answered_without_a_node_id() {
    let mut node = Node::new(None, chip(), Board::Reference, 77, KEY);
    node.boot(CanRun);
    let boot = node.frame(Message::BootUp, Line::Serial).expect("an id");
    assert_eq!(boot.id(), 0x711);
    let request = CanFrame::new(0x611, &[0x40, 0x18, 0x10, 4, 0, 0, 0, 0]).expect("a frame");
    assert_eq!(node.receive(&request, Line::Can), None);
    let answer = node.receive(&request, Line::Serial).expect("an answer");
    assert_eq!((answer.id(), answer.data()[4]), (0x591, 77));
}

#[test]
fn restart_by_nmt_is_by_a_master_after_any_silence() {
    for (program, silence_ms) in [(CanRun, 59_999), (Missing(None), 100_000)] {
        let mut master = Master::of(chip());
        for _ in 0..silence_ms {
            master.node.tick(program);
        }
        assert_eq!(master.node.take_restart(), None);
        let reset = CanFrame::new(0, &[0x81, 5]).expect("a frame");
        assert_eq!(master.node.receive(&reset, Line::Can), None);
        master.node.tick(program);
        assert_eq!(master.node.take_restart(), Some(Restart::ByMaster));
    }
}

#[test]
fn requests_that_only_read_do_not_keep_the_bootloader() {
    let mut master = Master::of(chip());
    for ms in 1..=60_000 {
        if ms % 1_000 == 0 {
            assert!(master.ask([0x40, 0x18, 0x10, 4, 0, 0, 0, 0]).is_ok());
        }
        master.node.tick(CanRun);
    }
    let restart = master.node.take_restart();
    assert_eq!(restart, Some(Restart::AfterSilence));
}

#[test]
fn reads_do_not_keep_a_block_transfer_without_its_master() {
    let mut master = Master::of(chip());
    assert!(master.ask([0xC6, 0x50, 0x1F, 1, 44, 2, 0, 0]).is_ok());
    let read = [0x40, 0x18, 0x10, 4, 0, 0, 0, 0];
    let answered = (0..5).any(|_| {
        for _ in 0..2_000 {
            master.node.tick(Missing(None));
        }
        master.send(read).is_some()
    });
    assert!(answered);
}

#[test]
fn refused_request_of_the_other_line_does_not_take_a_start_back() {
    let mut master = Master::of(chip().with(Slot::New, &image(3, 300)));
    assert_eq!(master.control(3).map(|answer| answer[0]), Ok(0x60));
    assert_eq!(master.block(&image(3, 300)), Ok(()));
    assert!(master.control(1).is_ok());
    let begin = CanFrame::new(0x605, &[0x21, 0x50, 0x1F, 1, 0, 0, 0, 0]).expect("a frame");
    let answer = master.node.receive(&begin, Line::Serial).expect("an answer");
    assert_eq!(answer.data()[0], 0x80);
    assert_eq!(master.node.take_restart(), Some(Restart::ByMaster));
    let mut chip = master.node.release();
    chip.runs(&image(3, 300));
}

#[test]
fn journal_filled_by_updates_without_a_power_cycle_is_erased() {
    // An update writes four records. With these four lengths of the journal, each of the records is once the last that
    // fits.
    for filled in 8_000..8_004 {
        let mut chip = chip();
        let mut state = State::read(&chip);
        for _ in 0..filled {
            state.append(Event::Confirmed, &mut chip).expect("room");
        }
        for update in 0..70 {
            let new = image(3 + update % 2, 300);
            let mut master = Master::of(chip);
            assert_eq!(master.block(&new), Ok(()));
            assert!(master.control(1).is_ok());
            chip = master.node.release();
            assert_eq!(settle(&mut chip, KEY), Ok(Start::Program), "{update}");
            assert!(chip.holds(Slot::Running, &new), "{update}");
            // The program confirms itself and is stopped, so that no start sees the journal with nothing in progress.
            chip.log(Event::Confirmed);
        }
    }
}

#[test]
fn segments_lost_or_sent_twice_are_each_taken_once() {
    // Long enough for some sub-blocks.
    let program = program(5, 5_000);
    let new = sign(header(&program, 300), &program, DEVELOPMENT);
    let lost = [2, 3, 5, 50, 127, 128, 200].map(|one| (Delivery::Once, Some(one)));
    let twice = [None, Some(3), Some(50)].map(|lose| (Delivery::Twice, lose));
    for (delivery, lose) in lost.into_iter().chain(twice) {
        let mut master = Master::of(chip());
        (master.delivery, master.lose) = (delivery, lose);
        assert_eq!(master.block(&new), Ok(()), "{delivery:?}, {lose:?}");
        assert!(master.node.release().holds(Slot::New, &new), "{lose:?}");
    }
}
