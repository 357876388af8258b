//! A master that updates a foot, with its board and images.

use bootloader::image::Refusal;
use lsm6dsox::sim::Stimulus;
use virtual_board::emulator::board::{Board, BoardOptions};
use virtual_board::emulator::part::can::{BusFrame, TimedFrame};
use virtual_board::emulator::time::PER_SECOND;
use virtual_board::emulator::wiring::Wiring;
use wire::dictionary::{Address, SIGNATURE_STORE, index};
use wire::node::NmtCommand;
use wire::uart::{ConfigGet, ConfigSet, Message, NmtRequest, encode};
use wire::value::Value;

pub use crate::common::image::{
    NEW, OLD, changed_image, image_beginning_with, new_image, number_of, origin,
};
pub use crate::common::rig::sdo;
use crate::common::rig::{OPERATIONAL, PRE_OPERATIONAL};
use crate::common::{build_bootloader, options, run};

const NODE: u8 = 0x11;

/// Commands of object 0x1F51.
pub const STOP: u8 = 0;
pub const START: u8 = 1;
pub const CLEAR: u8 = 3;
pub const CONFIRM: u8 = 0x80;

/// Longest time from the start of an update to the boot-up of the new program, ms: three sectors erased, and two
/// programs copied.
pub const INSTALLED_MS: u32 = 15_000;

/// Timeout of an answer, ms: the shortest of the masters that update feet is Lely's, 100 ms for each of its attempts
/// (`LELY_CO_NMT_TIMEOUT`); the timeout of Zephyr's script is 1 s.
const ANSWER_MS: u32 = 100;

pub fn bootloader(wiring: &Wiring) -> Vec<u8> {
    std::fs::read(build_bootloader(wiring)).expect("it was built")
}

/// Segment of a block.
pub fn segment(number: u8, bytes: &[u8], is_last: bool) -> [u8; 8] {
    let mut request = [0; 8];
    request[0] = number | u8::from(is_last) << 7;
    request[1..=bytes.len()].copy_from_slice(bytes);
    request
}

/// Where the master and the bootloader talk.
enum Way {
    Bus,
    /// Over the serial line, in lines of text. The text is the incomplete line received so far.
    Serial(String),
}

/// A master of the foot.
pub struct Master {
    pub board: Board,
    way: Way,
    /// Node id of the foot.
    pub node: u8,
    /// Frames of other nodes in each millisecond.
    pub traffic: u16,
}

impl Master {
    /// Master of the reference board with this program.
    pub fn of(program: &[u8]) -> Self {
        Self::with(Wiring::reference(), Some(program), |_| ())
    }

    /// Master of a board with its bootloader, at rest, and with a program or without.
    pub fn with(
        wiring: &'static Wiring,
        program: Option<&[u8]>,
        change: impl FnOnce(&mut BoardOptions),
    ) -> Self {
        let mut options = options();
        options.wiring = Some(wiring);
        change(&mut options);
        let (bootloader, at_rest) = (bootloader(wiring), |_| Stimulus::REST);
        let (first, second) = match program {
            Some(program) => (Some(&bootloader[..]), program),
            None => (None, &bootloader[..]),
        };
        let board = Board::with_bootloader(first, second, options, at_rest);
        Self::new(board.expect("it fits"))
    }

    pub fn new(board: Board) -> Self {
        Self { board, way: Way::Bus, node: NODE, traffic: 0 }
    }

    /// Stops the program over its serial line, and opens the line of the bootloader.
    pub fn stop_over_serial_line(&mut self) {
        let stop = Message::ConfigSet(ConfigSet {
            address: Address::new(index::PROGRAM_CONTROL, 1),
            value: Value::U8(STOP).into(),
        });
        let pause = Message::Nmt(NmtRequest(NmtCommand::EnterPreOperational));
        for (sequence, message) in [pause, stop].iter().enumerate() {
            let bytes = encode(sequence as u16, message);
            self.board.push_uart(bytes.as_bytes());
            self.run(20);
        }
        self.run(500);
        self.open_serial_line();
    }

    /// Sends a request to the program over its serial line.
    pub fn request_over_serial_line(&mut self) {
        let address = Address::new(index::PROGRAM_ID, 1);
        let bytes = encode(0, &Message::ConfigGet(ConfigGet { address }));
        self.board.push_uart(bytes.as_bytes());
    }

    /// Opens the serial line of the bootloader.
    pub fn open_serial_line(&mut self) {
        self.board.take_uart();
        self.board.push_uart(b"\r\r\rC\rS8\rO\r");
        // An erase comes first.
        self.run(2_500);
        let answers: Vec<u8> = self.board.take_uart().iter().map(|sent| sent.byte).collect();
        // A line that was broken off is refused before them.
        let are_done = answers.windows(3).any(|three| three == b"\r\r\r");
        assert!(are_done, "{answers:02x?}");
        self.way = Way::Serial(String::new());
    }

    /// Returns to the bus.
    pub fn turn_to_bus(&mut self) {
        self.way = Way::Bus;
        self.board.take_can();
    }

    /// Takes the frames that the foot has sent.
    fn take(&mut self) -> Vec<BusFrame> {
        let Way::Serial(text) = &mut self.way else {
            let sent = self.board.take_can().into_iter();
            return sent.map(|sent| sent.frame).collect();
        };
        let bytes = self.board.take_uart();
        text.extend(bytes.iter().map(|sent| char::from(sent.byte)));
        let Some((lines, rest)) = text.rsplit_once('\r') else {
            return Vec::new();
        };
        let frames = lines.split('\r').filter_map(|line| wire::slcan::decode(line.as_bytes()));
        let frames = frames.map(|frame| BusFrame::of(&frame)).collect();
        *text = rest.to_owned();
        frames
    }

    /// Runs for some milliseconds, with the traffic of other nodes.
    pub fn run(&mut self, ms: u32) {
        for _ in 0..ms {
            for k in 0..self.traffic {
                // Process data and SDOs of another node.
                let id = [0x192, 0x612, 0x592, 0x212][usize::from(k % 4)];
                self.board.push_can(BusFrame::new(id, &[k as u8; 8]));
            }
            run(&mut self.board, 1);
        }
    }

    pub fn push(&mut self, request: &[u8; 8]) {
        let frame = BusFrame::new(0x600 + u16::from(self.node), request);
        match self.way {
            Way::Bus => self.board.push_can(frame),
            Way::Serial(_) => self.board.push_uart(&frame.line()),
        }
    }

    /// Sends a request, and returns the answer within `ms`.
    pub fn ask_within(&mut self, request: &[u8; 8], ms: u32) -> Option<[u8; 8]> {
        self.take();
        self.push(request);
        self.answer(ms)
    }

    pub fn answer(&mut self, ms: u32) -> Option<[u8; 8]> {
        for _ in 0..ms {
            self.run(1);
            let frames = self.take();
            let answer = frames.iter().find(|frame| frame.id == 0x580 + u32::from(self.node));
            if let Some(frame) = answer {
                return frame.data.as_slice().try_into().ok();
            }
        }
        None
    }

    pub fn ask(&mut self, request: &[u8; 8]) -> [u8; 8] {
        self.ask_within(request, ANSWER_MS).expect("an answer")
    }

    pub fn control(&mut self, command: u8) -> [u8; 8] {
        self.ask(&sdo(0x2F, index::PROGRAM_CONTROL, 1, command.into()))
    }

    pub fn number(&mut self, index: u16) -> u32 {
        self.number_at(index, 1)
    }

    pub fn number_at(&mut self, index: u16, subindex: u8) -> u32 {
        let [kind, .., a, b, c, d] = self.ask(&sdo(0x40, index, subindex, 0));
        assert_eq!(kind, 0x43, "{index:#06x}:{subindex}");
        u32::from_le_bytes([a, b, c, d])
    }

    /// Stores the settings.
    pub fn store(&mut self) {
        let request = sdo(0x23, index::STORE, 1, SIGNATURE_STORE);
        let answer = self.ask_within(&request, 2_000).expect("an answer");
        assert_eq!(answer[0], 0x60);
    }

    pub fn status(&mut self) -> Option<Refusal> {
        Refusal::from_flash_status(self.number(index::FLASH_STATUS))
    }

    fn nmt(&mut self, command: u8) {
        self.board.push_can(BusFrame::new(0, &[command, self.node]));
        self.run(5);
    }

    pub fn pause(&mut self) {
        self.nmt(PRE_OPERATIONAL);
    }

    pub fn operate(&mut self) {
        self.nmt(OPERATIONAL);
    }

    /// Waits for the boot-up message, and returns the time until it, ms.
    pub fn boot_up(&mut self, ms: u32) -> u32 {
        let id = 0x700 + u32::from(self.node);
        let boots = |sent: &TimedFrame| sent.frame.id == id && sent.frame.data == [0];
        for passed in 0..ms {
            self.run(1);
            if self.board.take_can().iter().any(boots) {
                return passed;
            }
        }
        panic!("no boot-up message within {ms} ms");
    }

    /// Waits for a contact, and returns the time since `since`, ms.
    pub fn contact(&mut self, since: u64, ms: u32) -> u64 {
        self.board.take_can();
        for _ in 0..ms {
            self.run(1);
            let frames = self.board.take_can();
            if frames.iter().any(|sent| sent.frame.id == 0x180 + u32::from(self.node)) {
                return (self.board.now() - since) * 1000 / PER_SECOND;
            }
        }
        panic!("no contact within {ms} ms");
    }

    /// Stops the program.
    pub fn stop(&mut self) {
        self.pause();
        assert_eq!(self.control(STOP)[0], 0x60);
    }

    /// Clears the slot, and sends an image that is accepted.
    pub fn load(&mut self, image: &[u8]) {
        assert_eq!(self.control(CLEAR)[0], 0x60);
        assert_eq!(self.send(image)[0], 0xA1);
        assert_eq!(self.status(), None);
    }

    /// Loads an image, and starts its install.
    pub fn install(&mut self, image: &[u8]) {
        self.load(image);
        assert_eq!(self.control(START)[0], 0x60);
    }

    /// Waits until the new version has been installed.
    pub fn updated(&mut self) {
        self.boot_up(INSTALLED_MS);
        assert_eq!(self.version(), NEW);
    }

    /// Begins a block download of this many bytes. Returns the number of segments in a block, or an abort.
    pub fn begin(&mut self, size: usize) -> Result<usize, [u8; 8]> {
        let [a, b, c, d] = (size as u32).to_le_bytes();
        let answer = self.ask(&[0xC2, 0x50, 0x1F, 1, a, b, c, d]);
        match answer[0] {
            0x80 => Err(answer),
            _ => Ok(usize::from(answer[4])),
        }
    }

    /// Begins a block download, and sends its first block.
    pub fn begin_with_a_block(&mut self, image: &[u8]) {
        let size = self.begin(image.len()).expect("a block");
        let block: Vec<&[u8]> = image.chunks(7).take(size).collect();
        self.push_segments(&block);
        let answer = self.answer(500).expect("an answer to a block");
        assert_eq!(answer[0], 0xA2);
    }

    /// Sends segments, none of which is the last one.
    pub fn push_segments(&mut self, segments: &[&[u8]]) {
        self.take();
        for (number, bytes) in (1..).zip(segments) {
            self.push(&segment(number, bytes, false));
        }
    }

    /// Sends an image by block download.
    pub fn send(&mut self, image: &[u8]) -> [u8; 8] {
        self.send_with(image, |master, _, _, request| {
            master.push(request);
            true
        })
    }

    /// Sends an image, each segment by `push`, which also gets the numbers of the block and of the segment in it, and
    /// returns whether it has sent it.
    pub fn send_with(
        &mut self,
        image: &[u8],
        mut push: impl FnMut(&mut Self, usize, usize, &[u8; 8]) -> bool,
    ) -> [u8; 8] {
        let size = match self.begin(image.len()) {
            Ok(size) => size,
            Err(abort) => return abort,
        };
        let segments: Vec<&[u8]> = image.chunks(7).collect();
        let (mut done, mut number) = (0, 0);
        while done < segments.len() {
            self.take();
            let block = &segments[done..segments.len().min(done + size)];
            let mut is_whole = true;
            for (k, bytes) in block.iter().enumerate() {
                let is_last = done + k + 1 == segments.len();
                is_whole &= push(self, number, k, &segment(k as u8 + 1, bytes, is_last));
            }
            let answer = self.answer(1_000).expect("an answer to a block");
            if answer[0] == 0x80 {
                return answer;
            }
            let received = usize::from(answer[1]);
            assert_eq!((answer[0], received == block.len()), (0xA2, is_whole));
            // Segments behind a lost one are sent again.
            done += received;
            number += 1;
        }
        let unused = (7 - segments.last().map_or(7, |bytes| bytes.len())) as u8;
        // The program is hashed before the answer.
        self.ask_within(&[0xC1 | unused << 2, 0, 0, 0, 0, 0, 0, 0], 500)
            .expect("an answer to the end")
    }

    /// Text of object 0x100A.
    pub fn version(&mut self) -> String {
        let size = self.ask(&[0x40, 0x0A, 0x10, 0, 0, 0, 0, 0])[4];
        let answer = self.ask(&[0x60, 0, 0, 0, 0, 0, 0, 0]);
        String::from_utf8_lossy(&answer[1..=usize::from(size)]).into_owned()
    }

    pub fn contacts(&mut self, ms: u32) -> usize {
        self.board.take_can();
        self.run(ms);
        let frames = self.board.take_can();
        let id = 0x180 + u32::from(self.node);
        frames.iter().filter(|sent| sent.frame.id == id).count()
    }
}
