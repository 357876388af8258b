//! Disturbances of an update: each row on the ELFs that are flashed, compared with the stored results.

use bootloader::flash::{SLOT_SIZE, Slot};
use bootloader::image::{HEADER, Refusal};
use program_images::{DEVELOPMENT_KEY, image};
use results::{Measurement, rounded};
use serde_json::Value;
use virtual_board::emulator::board::Injection;
use virtual_board::emulator::corner::Corner;
use virtual_board::emulator::part::can::BusFault;
use virtual_board::emulator::part::rcc::ResetCause;
use virtual_board::emulator::part::usart::LineFault;
use virtual_board::emulator::wiring::Wiring;
use virtual_board::product::on_all_cores;

use super::master::{
    CLEAR, INSTALLED_MS, Master, NEW, OLD, START, image_beginning_with, new_image, origin, segment,
};
use crate::common::products;
use crate::digest::assert_reproduced_on;

/// A row: its name in the table, its description, and how it is run.
struct Row {
    name: &'static str,
    disturbance: &'static str,
    /// Version that is to run afterwards, and reason that is to be reported.
    version: &'static str,
    status: Option<Refusal>,
    run: fn(&Run) -> Outcome,
}

const fn row(
    name: &'static str,
    disturbance: &'static str,
    version: &'static str,
    status: Option<Refusal>,
    run: fn(&Run) -> Outcome,
) -> Row {
    Row { name, disturbance, version, status, run }
}

/// Data shared by the rows.
struct Run<'a> {
    wiring: &'static Wiring,
    corner: Corner,
    elf: &'a [u8],
    /// The product with another version.
    new: &'a [u8],
    /// Program of another board.
    other_board: &'a [u8],
}

/// State of the foot after a row.
#[derive(Debug)]
struct Outcome {
    /// Version that runs after the disturbance.
    version: String,
    /// Reason in object 0x1F57.
    status: Option<Refusal>,
    /// Time without contacts, ms; `None` if the bootloader waits for an update.
    silent_ms: Option<u64>,
}

impl Run<'_> {
    /// Returns a foot that runs the product and is stopped for an update, and the time of the stop.
    fn stopped(&self) -> (Master, u64) {
        let mut master = self.foot(Some(self.elf));
        master.run(500);
        let at = master.board.now();
        master.stop();
        (master, at)
    }

    fn foot(&self, program: Option<&[u8]>) -> Master {
        Master::with(self.wiring, program, |options| {
            options.set_corner(self.corner);
        })
    }

    /// Board with a bootloader alone, which waits for a program.
    fn without_program(&self) -> Master {
        let mut master = self.foot(None);
        master.boot_up(1_000);
        master
    }

    /// Foot to which the new program was sent.
    fn sent(&self) -> (Master, u64) {
        let (mut master, at) = self.stopped();
        master.load(self.new);
        (master, at)
    }

    /// Sends an image that is refused, and starts the old program.
    fn refused(&self, image: &[u8]) -> Outcome {
        let (mut master, at) = self.stopped();
        master.send(image);
        let status = master.status();
        assert_eq!(master.control(START)[0], 0x60);
        let mut outcome = started(&mut master, at);
        outcome.status = status;
        outcome
    }
}

/// Waits until the foot streams, and reads which program it runs.
fn started(master: &mut Master, since: u64) -> Outcome {
    master.boot_up(INSTALLED_MS + 10_000);
    streaming(master, since)
}

fn streaming(master: &mut Master, since: u64) -> Outcome {
    master.operate();
    Outcome {
        silent_ms: Some(master.contact(since, 5_000)),
        version: master.version(),
        status: master.status(),
    }
}

/// Requires that a second attempt installs the new program.
fn next_attempt(master: &mut Master, new: &[u8]) {
    master.install(new);
    master.updated();
}

/// Requires that an update installs the new program while the old one runs again.
fn next_update(master: &mut Master, new: &[u8]) {
    master.stop();
    next_attempt(master, new);
}

fn undisturbed(run: &Run) -> Outcome {
    let (mut master, at) = run.sent();
    assert_eq!(master.control(START)[0], 0x60);
    let outcome = started(&mut master, at);
    // After ten seconds the program has confirmed itself, so four more starts do not restore the previous one.
    assert!(master.contacts(10_500) > 9_000);
    for _ in 0..4 {
        master.board.inject(Injection::Reset);
        // A larger program takes longer: its hash is checked.
        let ms = master.boot_up(1_000);
        assert!((130..180).contains(&ms), "{ms} ms: docs/guide/update.md");
    }
    assert_eq!((master.version().as_str(), master.status()), (NEW, None));
    // An older image is refused from now on.
    master.stop();
    let older = image(run.elf, &origin(50), DEVELOPMENT_KEY).expect("a program");
    master.send(&older);
    assert_eq!(master.status(), Some(Refusal::Older));
    outcome
}

fn beside_traffic(run: &Run) -> Outcome {
    let mut master = run.foot(Some(run.elf));
    master.traffic = 3;
    master.run(500);
    let at = master.board.now();
    master.stop();
    master.install(run.new);
    started(&mut master, at)
}

/// Cuts the supply at an operation of the flash that a command to a foot with a new program begins.
fn cut(run: &Run, operation: u64, command: u8) -> Outcome {
    let (mut master, at) = run.sent();
    master.board.inject(Injection::CutInFlash(operation));
    master.board.take_can();
    master.push(&[0x2F, 0x51, 0x1F, 1, command, 0, 0, 0]);
    let outcome = started(&mut master, at);
    let resets = master.board.resets();
    let cuts = resets.iter().filter(|(_, cause)| *cause == ResetCause::PowerOn);
    assert_eq!(cuts.count(), 1, "operation {operation}");
    let slot = master.board.memory(Slot::Running.start(), SLOT_SIZE as usize);
    assert!(outcome.version == OLD || slot.expect("flash").starts_with(run.new));
    outcome
}

/// Cuts the supply while the image is received; the next attempt succeeds.
fn cut_in_download(run: &Run) -> Outcome {
    let (mut master, at) = run.stopped();
    assert_eq!(master.control(CLEAR)[0], 0x60);
    master.board.inject(Injection::CutInFlash(5_000));
    let size = master.begin(run.new.len()).expect("a block");
    let segments: Vec<&[u8]> = run.new.chunks(7).collect();
    for block in segments.chunks(size).take(30) {
        master.push_segments(block);
        if master.answer(500).is_none() {
            break;
        }
    }
    let cut = master.board.resets();
    assert_eq!(cut.last().map(|(_, cause)| *cause), Some(ResetCause::PowerOn));
    let outcome = streaming(&mut master, at);
    next_update(&mut master, run.new);
    outcome
}

/// Sends a program that never confirms itself, and waits for the previous one.
fn never_confirmed(run: &Run, code: &[u8]) -> Outcome {
    let (mut master, at) = run.stopped();
    master.install(&image_beginning_with(run.elf, code));
    // Three periods of the bootloader's watchdog, two installs.
    master.boot_up(90_000);
    let outcome = streaming(&mut master, at);
    next_update(&mut master, run.new);
    outcome
}

/// Switches the new program off three times before it is confirmed.
fn switched_off(run: &Run) -> Outcome {
    let (mut master, at) = run.sent();
    assert_eq!(master.control(START)[0], 0x60);
    master.boot_up(INSTALLED_MS);
    for _ in 0..2 {
        assert_eq!(master.version(), NEW);
        master.board.inject(Injection::Reset);
        master.boot_up(1_000);
    }
    master.board.inject(Injection::Reset);
    started(&mut master, at)
}

/// Lets the new program run without another node on its bus for longer than a trial, and resets it three times.
fn without_bus(run: &Run, serial_line: SerialLine) -> Outcome {
    let (mut master, at) = run.sent();
    assert_eq!(master.control(START)[0], 0x60);
    master.board.inject(Injection::Bus(BusFault::NoAcknowledge));
    master.run(INSTALLED_MS);
    if serial_line == SerialLine::Requests {
        master.request_over_serial_line();
    }
    master.run(11_000);
    for _ in 0..2 {
        master.board.inject(Injection::Reset);
        master.run(1_000);
    }
    master.board.inject(Injection::Reset);
    master.board.inject(Injection::Clear);
    started(&mut master, at)
}

/// Use of the serial line.
#[derive(Clone, Copy, PartialEq, Eq)]
enum SerialLine {
    /// The foot sends its messages, which may reach a receiver or not.
    Listens,
    /// A request reaches the foot.
    Requests,
}

/// The master vanishes in the middle of the transfer.
fn vanished(run: &Run) -> Outcome {
    let (mut master, at) = run.stopped();
    let size = master.begin(run.new.len()).expect("a block");
    let segments: Vec<&[u8]> = run.new.chunks(7).take(size - 10).collect();
    master.push_segments(&segments);
    // The bootloader waits a minute.
    master.boot_up(80_000);
    let outcome = streaming(&mut master, at);
    next_update(&mut master, run.new);
    outcome
}

/// The master aborts a block; the next attempt succeeds.
fn aborted(run: &Run) -> Outcome {
    let (mut master, at) = run.stopped();
    master.begin_with_a_block(run.new);
    master.push(&[0x80, 0x50, 0x1F, 1, 0, 0, 0, 0x08]);
    master.run(5);
    next_attempt(&mut master, run.new);
    streaming(&mut master, at)
}

/// Updates a foot without a bus over the serial line, and breaks the line in the middle of a block.
fn over_serial_line(run: &Run) -> Outcome {
    let no_bus = Injection::Bus(BusFault::NoAcknowledge);
    let mut master = run.foot(Some(run.elf));
    master.run(500);
    master.board.inject(no_bus);
    let at = master.board.now();
    master.stop_over_serial_line();
    master.begin(run.new.len()).expect("a block");
    for (bytes, number) in run.new.chunks(7).zip(1..=20) {
        master.push(&segment(number, bytes, false));
    }
    master.run(2);
    master.board.inject(Injection::Line(LineFault::Open));
    master.run(20);
    master.board.inject(Injection::Clear);
    master.board.inject(no_bus);
    master.open_serial_line();
    master.push(&[0x80, 0x50, 0x1F, 1, 0, 0, 4, 5]);
    master.install(run.new);
    // The bus has not taken the bootloader's own boot-up message. The restart of the bootloader discards it.
    master.run(50);
    master.board.inject(Injection::Clear);
    master.turn_to_bus();
    started(&mut master, at)
}

/// Of each block, a segment comes twice and one is lost, and is sent again.
fn disturbed_segments(run: &Run) -> Outcome {
    let (mut master, at) = run.stopped();
    assert_eq!(master.control(CLEAR)[0], 0x60);
    let answer = master.send_with(run.new, |master, number, k, request| {
        let is_lost = number % 2 == 0 && k == 63;
        let copies = if is_lost { 0 } else { 1 + u32::from(k == 1) };
        (0..copies).for_each(|_| master.push(request));
        !is_lost
    });
    assert_eq!(answer[0], 0xA1);
    assert_eq!(master.status(), None);
    assert_eq!(master.control(START)[0], 0x60);
    started(&mut master, at)
}

/// A second master begins its own transfer in the middle of the first; the next attempt succeeds.
fn two_masters(run: &Run) -> Outcome {
    let (mut master, at) = run.stopped();
    master.begin_with_a_block(run.new);
    // To the foot, the second master's request is a segment out of order, so the foot asks for the block again. That
    // is no answer to a request, so the second master aborts. The next segment of the first master is answered by an
    // abort, too.
    let answer = master.ask(&[0xC2, 0x50, 0x1F, 1, 0, 0, 1, 0]);
    assert_eq!(answer[0], 0xA2, "{answer:02x?}");
    master.push(&[0x80, 0x50, 0x1F, 1, 0, 0, 0, 0x08]);
    let answer = master.ask(&[1, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(answer[0], 0x80, "{answer:02x?}");
    next_attempt(&mut master, run.new);
    streaming(&mut master, at)
}

/// Installs over a bad cell in the sector for the previous program.
fn over_bad_cell(run: &Run) -> Outcome {
    let (mut master, at) = run.sent();
    let vectors = Slot::Previous.start() + HEADER as u32;
    master.board.cpu().machine().chip.flash.bad_cell = Some(vectors);
    assert_eq!(master.control(START)[0], 0x60);
    started(&mut master, at)
}

/// A board without a program.
fn without_program(run: &Run) -> Outcome {
    let mut master = run.without_program();
    let at = master.board.now();
    assert_eq!(master.send(run.new)[0], 0xA1);
    assert_eq!(master.control(START)[0], 0x60);
    started(&mut master, at)
}

/// Returns a foot whose new program has confirmed itself and then has one flipped bit, and the time of the flip.
fn decay(mut master: Master) -> (Master, u64) {
    master.boot_up(INSTALLED_MS);
    master.operate();
    assert!(master.contacts(10_500) > 9_000);
    let at = Slot::Running.start() + 1_000;
    let [byte, ..] = master.board.memory(at, 1).expect("flash")[..] else {
        panic!("no flash");
    };
    master.board.cpu().memory().write(at, &[byte ^ 4]);
    let since = master.board.now();
    master.board.inject(Injection::Reset);
    (master, since)
}

fn decayed(run: &Run) -> Outcome {
    let (mut master, _) = run.sent();
    assert_eq!(master.control(START)[0], 0x60);
    let (mut master, at) = decay(master);
    started(&mut master, at)
}

/// A foot that waits in its bootloader, with the reason, and takes the next program.
fn in_bootloader(mut master: Master, new: &[u8]) -> Outcome {
    let status = master.status();
    next_attempt(&mut master, new);
    Outcome { version: NO_PROGRAM.to_owned(), status, silent_ms: None }
}

fn decayed_alone(run: &Run) -> Outcome {
    let mut master = run.without_program();
    master.install(run.new);
    let (mut master, _) = decay(master);
    master.boot_up(1_000);
    assert_eq!(master.contacts(1_000), 0);
    in_bootloader(master, run.new)
}

/// Two programs that never confirm themselves, on a board without another program.
fn dead_alone(run: &Run) -> Outcome {
    let mut master = run.without_program();
    for instruction in [BRANCH_TO_ITSELF, UNDEFINED] {
        master.install(&image_beginning_with(run.elf, &instruction));
        // The bootloader's own, after three starts.
        master.boot_up(90_000);
        assert_eq!(master.contacts(1_000), 0);
    }
    in_bootloader(master, run.new)
}

fn changed_byte(image: &[u8], at: usize, bits: u8) -> Vec<u8> {
    let mut changed = image.to_vec();
    changed[at] ^= bits;
    changed
}

fn forged(run: &Run) -> Vec<u8> {
    image(run.elf, &origin(100), &[9; 32]).expect("a program")
}

/// A branch to itself, and an undefined instruction.
pub const BRANCH_TO_ITSELF: [u8; 2] = [0xFE, 0xE7];
const UNDEFINED: [u8; 2] = [0x00, 0xDE];

/// Erases sectors 0 and 1 and programs the first word of sector 0, in words of 32 bits; then a branch to itself.
#[rustfmt::skip]
const WRITES_BOOTLOADER: [u8; 70] = [
    0x43, 0xF6, 0x00, 0x40, 0xC4, 0xF2, 0x02, 0x00, // movw, movt r0, 0x40023C00: FLASH
    0x40, 0xF2, 0x23, 0x11, 0xC4, 0xF2, 0x67, 0x51, // movw, movt r1, 0x45670123
    0x41, 0x60,                                     // str r1, [r0, KEYR]
    0x48, 0xF6, 0xAB, 0x11, 0xCC, 0xF6, 0xEF, 0x51, // movw, movt r1, 0xCDEF89AB
    0x41, 0x60,                                     // str r1, [r0, KEYR]
    0x40, 0xF2, 0x02, 0x23, 0xC0, 0xF2, 0x01, 0x03, // movw, movt r3, STRT | PSIZE32 | SER
    0x03, 0x61,                                     // str r3, [r0, CR]: sector 0
    0xC2, 0x68, 0xD2, 0x03, 0xFC, 0xD4,             // while [r0, SR] has BSY
    0x08, 0x33, 0x03, 0x61,                         // adds r3, 8; str r3, [r0, CR]: sector 1
    0xC2, 0x68, 0xD2, 0x03, 0xFC, 0xD4,             // while [r0, SR] has BSY
    0x40, 0xF2, 0x01, 0x23, 0x03, 0x61,             // movw r3, PSIZE32 | PG; str r3, [r0, CR]
    0x00, 0x22, 0x4F, 0xF0, 0x00, 0x61, 0x0A, 0x60, // movs r2, 0; mov r1, 0x08000000; str r2, [r1]
    0xFE, 0xE7,                                     // a branch to itself
];

/// Version where the bootloader waits for a program.
const NO_PROGRAM: &str = "none";

#[rustfmt::skip]
const ROWS: [Row; 31] = [
    row("none", "nothing; then four more starts, and an older image, which is refused", NEW, None, undisturbed),
    row("traffic", "three frames of other nodes in each millisecond", NEW, None, beside_traffic),
    row("serial-line", "no bus; the serial line breaks in the middle of a block", NEW, None, over_serial_line),
    row("power-cut-clear", "power cut in the erase for the image", OLD, None, |run| cut(run, 1, CLEAR)),
    row("power-cut-download", "power cut while the image is received", OLD, None, cut_in_download),
    row("power-cut:1", "power cut in the mark of the confirmed program", OLD, None, |run| cut(run, 1, START)),
    row("power-cut:2", "power cut in the first record of the install", OLD, None, |run| cut(run, 2, START)),
    row("power-cut:4", "power cut in the erase for the previous program", NEW, None, |run| cut(run, 4, START)),
    row("power-cut:1000", "power cut in the copy of the previous program", NEW, None, |run| cut(run, 1_000, START)),
    row("power-cut:30000", "power cut in the copy of the new program", NEW, None, |run| cut(run, 30_000, START)),
    row("hangs", "the new program hangs",
        OLD, Some(Refusal::NotConfirmed), |run| never_confirmed(run, &BRANCH_TO_ITSELF)),
    row("crashes", "the new program crashes in its first instruction",
        OLD, Some(Refusal::NotConfirmed), |run| never_confirmed(run, &UNDEFINED)),
    row("writes-bootloader", "the new program erases and writes the sectors of the bootloader, and hangs",
        OLD, Some(Refusal::NotConfirmed), |run| never_confirmed(run, &WRITES_BOOTLOADER)),
    row("dead-alone", "a program hangs, and the next crashes, on a board that has no other",
        NO_PROGRAM, Some(Refusal::NotConfirmed), dead_alone),
    row("switched-off", "the new program is reset three times before it is confirmed",
        OLD, Some(Refusal::NotConfirmed), switched_off),
    row("unreachable", "the new program has no other node on its bus, nor a request on its serial line; three resets",
        OLD, Some(Refusal::NotConfirmed), |run| without_bus(run, SerialLine::Listens)),
    row("request", "the same, but for one request on the serial line",
        NEW, None, |run| without_bus(run, SerialLine::Requests)),
    row("master-gone", "the master vanishes in the middle of the transfer", OLD, None, vanished),
    row("aborted", "the master aborts a block, and tries again", NEW, None, aborted),
    row("segments", "a segment of every second block is lost, one of each comes twice", NEW, None, disturbed_segments),
    row("two-masters", "a second master begins a transfer in the middle of the first, which tries again",
        NEW, None, two_masters),
    row("bad-cell", "a bad cell in the sector for the previous program", OLD, Some(Refusal::FlashFailed), over_bad_cell),
    row("no-program", "the board has a bootloader alone", NEW, None, without_program),
    row("decayed", "a bit of the running program flips", OLD, Some(Refusal::Decayed), decayed),
    row("decayed-alone", "the same without a previous program", NO_PROGRAM, Some(Refusal::Decayed), decayed_alone),
    row("other-board", "image for another board", OLD, Some(Refusal::OtherBoard), |run| run.refused(run.other_board)),
    row("short", "image cut off", OLD, Some(Refusal::WrongLength), |run| run.refused(&run.new[..5_000])),
    row("changed", "image with one changed bit",
        OLD, Some(Refusal::WrongHash), |run| run.refused(&changed_byte(run.new, 5_000, 1))),
    row("unsigned", "image without a signature",
        OLD, Some(Refusal::Unsigned), |run| run.refused(&changed_byte(run.new, 9, run.new[9]))),
    row("forged", "image signed with another key", OLD, Some(Refusal::WrongSignature), |run| run.refused(&forged(run))),
    row("no-image", "a file that is no image", OLD, Some(Refusal::NotAnImage), |run| run.refused(&[0x7F; 900])),
];

/// Longest time without contacts, ms, in any row: the bootloader waits a minute for a master, and a program that
/// hangs is given three periods of the watchdog, between two installs.
const SILENT_MS: u64 = 90_000;

/// Rows for the boards other than the reference board: the rows that depend on the board's own wires, crystal and
/// program. The library and the chip are the same.
const OF_OTHER_BOARDS: &str = "none serial-line power-cut:30000 crashes no-program other-board";

/// Runs rows on a board in a corner, and returns their figures. Fails if a row does not have the promised outcome.
fn run_rows(
    [(wiring, elf), (_, other)]: [&(&'static Wiring, Vec<u8>); 2],
    corner: Corner,
    rows: &[&Row],
) -> Vec<Figures> {
    let mut wrong = Vec::new();
    let other_board = image(other, &origin(100), DEVELOPMENT_KEY);
    let run = Run {
        wiring,
        corner,
        elf,
        new: &new_image(elf),
        other_board: &other_board.expect("a program"),
    };
    let outcomes = on_all_cores(rows, |row| (row.run)(&run));
    let mut all = Vec::new();
    for (row, outcome) in rows.iter().zip(outcomes) {
        if (outcome.version.as_str(), outcome.status) != (row.version, row.status)
            || outcome.silent_ms > Some(SILENT_MS)
        {
            let (board, corner) = (wiring.name, corner.name());
            wrong.push(format!("{board} {corner} {}: {outcome:?}", row.name));
        }
        all.push(figures(row, &outcome));
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    all
}

/// Figures of a row, by their keys in the stored result.
type Figures = Vec<(&'static str, Value)>;

fn figures(row: &Row, outcome: &Outcome) -> Figures {
    let program = match outcome.version.as_str() {
        OLD => "old",
        NEW => "new",
        _ => NO_PROGRAM,
    };
    let silent_s = outcome.silent_ms.map(|ms| rounded(ms as f64 / 1000.0, 1));
    vec![
        ("name", row.name.into()),
        ("disturbance", row.disturbance.into()),
        ("runs_afterwards", program.into()),
        ("reason", outcome.status.map_or("", Refusal::words).into()),
        ("without_contacts_s", silent_s.into()),
    ]
}

/// Rows of the default run: a power cut in each phase of an update, a program that does not work, and a bad cell. An
/// update without a disturbance, and a refusal, are in `foot_is_updated_over_can`.
const BY_DEFAULT: &str =
    "power-cut-clear power-cut-download power-cut:1000 power-cut:30000 crashes bad-cell";

/// Rows with these names.
fn named(names: &str) -> Vec<&'static Row> {
    let row = |name| {
        let mut rows = ROWS.iter();
        rows.find(|row| row.name == name).unwrap_or_else(|| panic!("no row {name}"))
    };
    names.split([' ', ',']).map(row).collect()
}

/// All rows, or the rows that `FOOTFALL_UPDATE_ROWS` names, separated by commas.
fn chosen() -> Vec<&'static Row> {
    match std::env::var("FOOTFALL_UPDATE_ROWS") {
        Ok(names) => named(&names),
        Err(_) => ROWS.iter().collect(),
    }
}

/// Programs that a row runs on a board: its own, and one of another board that it refuses.
fn programs([(wiring, _), (other, _)]: [&(&'static Wiring, Vec<u8>); 2]) -> [String; 3] {
    [wiring.program.to_owned(), format!("bootloader-{}", wiring.name), other.program.to_owned()]
}

#[test]
fn foot_runs_a_whole_program_after_a_power_cut_in_each_phase() {
    let products = products();
    let [reference, other, ..] = &products[..] else {
        return;
    };
    let rows = named(BY_DEFAULT);
    run_rows([reference, other], Corner::Typical, &rows);
}

#[test]
#[ignore = "full: every disturbance of an update, 5 minutes"]
fn foot_runs_a_whole_program_after_any_update() {
    let products = products();
    let [reference, other, ..] = &products[..] else {
        return;
    };
    let rows = chosen();
    let mut result =
        Measurement::new("updates", "What a foot runs after each disturbance of an update.")
            .measured_by(&command("foot_runs_a_whole_program_after_any_update"));
    for row in run_rows([reference, other], Corner::Typical, &rows) {
        result.row(row);
    }
    if rows.len() == ROWS.len() {
        assert_reproduced_on(&programs([reference, other]), result);
    }
}

/// Command that runs one of the tests of this file.
fn command(test: &str) -> String {
    format!("cargo test -p virtual-board update::matrix::{test} -- --ignored")
}

#[test]
#[ignore = "full: updates of the other boards, 2 minutes"]
fn foot_of_any_board_runs_a_whole_program() {
    let products = products();
    let [reference, others @ ..] = &products[..] else {
        return;
    };
    let rows = named(OF_OTHER_BOARDS);
    let mut ran = Vec::new();
    for board in others {
        run_rows([board, reference], Corner::Typical, &rows);
        ran.extend(programs([board, reference]));
    }
    let names: Vec<&str> = rows.iter().map(|row| row.name).collect();
    let boards: Vec<&str> = others.iter().map(|(wiring, _)| wiring.name).collect();
    let result = Measurement::new(
        "updates-others",
        "Disturbances of an update in which the wires, crystal and program of a board matter, on the boards other than \
         the reference: each ends as on the reference.",
    )
    .measured_by(&command("foot_of_any_board_runs_a_whole_program"))
    .value("boards", boards)
    .value("rows", names);
    assert_reproduced_on(&ran, result);
}

/// Runs all rows on each board in each corner of the chip, except the combinations that `updates` covers.
#[test]
#[ignore = "full: every disturbance of an update on each board in each corner of the chip, half an hour"]
fn foot_runs_a_whole_program_in_every_corner_of_the_chip() {
    let products = products();
    let [reference, other, ..] = &products[..] else {
        return;
    };
    let rows: Vec<&Row> = ROWS.iter().collect();
    let mut result = Measurement::new(
        "update-corners",
        "All disturbances of an update on each board in each corner of the chip.",
    )
    .measured_by(&command("foot_runs_a_whole_program_in_every_corner_of_the_chip"));
    for (boards, corners) in [
        ([reference, other], &[Corner::Fast, Corner::Slow][..]),
        ([other, reference], &Corner::ALL[..]),
    ] {
        for corner in corners {
            // A row that is not as promised fails the test.
            run_rows(boards, *corner, &rows);
            result.row([
                ("board", boards[0].0.name.into()),
                ("corner", corner.name().into()),
                ("rows", ROWS.len().into()),
                ("not_as_promised", 0.into()),
            ]);
        }
    }
    let mut ran = programs([reference, other]).to_vec();
    ran.push(format!("bootloader-{}", other.0.name));
    assert_reproduced_on(&ran, result);
}
