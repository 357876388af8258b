//! A foot: a board in a thread of its own, which runs one slice of time after the other.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use gait::GaitName;
use wire::{Address, Foot as Position, Value};

use super::MILLISECOND;
use super::walk::Walk;
use crate::board::{Board, BoardOptions};
use crate::fault::Fault;
use crate::part::can::TimedFrame;
use crate::part::rcc::ResetCause;
use crate::scenario::{BEFORE_MS, Problem, Step};
use crate::time::{PER_SECOND, from_us};

/// How long a board is given to take its settings, and to store them, ms.
const SETTING_MS: u64 = 100;

/// A frame that could not reach the board for so long has been given up by its sender, ms: the firmware
/// drops its own after that time.
const GIVEN_UP_MS: u64 = 20;

/// The first word of the chips' unique numbers: that of the first foot, the others follow.
const FIRST_NUMBER: u32 = 0x0034_001F;

/// What a foot is made with.
#[derive(Clone)]
pub struct Make {
    /// The program.
    pub elf: Arc<[u8]>,
    /// The board.
    pub options: BoardOptions,
    /// Which foot it is.
    pub position: Position,
    /// What it has stored in its flash besides defaults.
    pub settings: Vec<(Address, Value)>,
    /// How it walks.
    pub gait: GaitName,
    /// What its steps are drawn from.
    pub seed: u64,
    /// How much later than others it takes its first step, s.
    pub phase_s: f64,
}

/// What a foot is told to do.
#[derive(Clone, Copy)]
pub enum Order {
    /// To walk in another way.
    Gait(GaitName),
    /// To have a fault, or none.
    Fault(Fault),
    /// To be without supply for a moment, and to be whole again.
    PowerCycle,
}

/// A slice of time.
pub struct Slice {
    /// Its end, in units of [`time`](crate::time).
    pub until: u64,
    /// Frames that the other nodes send.
    pub frames: Vec<TimedFrame>,
    /// Bytes that come over the serial line.
    pub bytes: Vec<u8>,
    /// What it is told to do.
    pub orders: Vec<Order>,
}

/// What a foot did in a slice.
#[derive(Default)]
pub struct Ran {
    /// Frames that it sent, and when they ended.
    pub frames: Vec<TimedFrame>,
    /// Bytes that it sent over the serial line.
    pub bytes: Vec<u8>,
    /// Bytes that are still on their way to it.
    pub bytes_incoming: usize,
    /// The rate of its CAN controller, bit/s; `None` where it is off the bus.
    pub bit_rate: Option<u32>,
    /// The load on the foot, N.
    pub load: f64,
    /// Why it was reset.
    pub resets: Vec<ResetCause>,
}

/// A foot that runs.
pub struct Foot {
    slices: Sender<Slice>,
    ran: Receiver<Result<Ran, Problem>>,
}

impl Foot {
    /// Makes a foot: its settings are stored by the program itself, then it is switched on.
    #[must_use]
    pub fn start(make: Make) -> Self {
        let (slices, of_foot) = channel();
        let (to_robot, ran) = channel();
        thread::spawn(move || {
            let mut runner = match Runner::new(make) {
                Ok(runner) => runner,
                Err(problem) => {
                    // Where the robot is gone nobody wants to know.
                    let _ = to_robot.send(Err(problem));
                    return;
                }
            };
            if to_robot.send(Ok(Ran::default())).is_err() {
                return;
            }
            for slice in of_foot {
                if to_robot.send(runner.run(slice)).is_err() {
                    return;
                }
            }
        });
        Self { slices, ran }
    }

    /// Gives it a slice to run; [`finish`](Self::finish) waits for it.
    pub fn begin(&self, slice: Slice) {
        // One that is gone has said why, or `finish` says so.
        let _ = self.slices.send(slice);
    }

    /// Waits until it is made, or has run its slice.
    ///
    /// # Errors
    /// As [`Board::run_for`], and where its program does not fit or does not store its settings.
    pub fn finish(&self) -> Result<Ran, Problem> {
        let gone = || Err(Problem::Elf("the thread of the board has ended".into()));
        self.ran.recv().unwrap_or_else(|_| gone())
    }
}

/// The board and what it feels.
struct Runner {
    make: Make,
    walk: Rc<RefCell<Walk>>,
    board: Board,
    /// When it was switched on.
    on_since: u64,
    /// What is to be done, and when.
    steps: VecDeque<(u64, Step)>,
    resets: usize,
}

impl Runner {
    fn new(make: Make) -> Result<Self, Problem> {
        let pages = stored(&make.elf, &make.settings)?;
        let walk = Walk::new(make.gait, make.seed, make.phase_s);
        let walk = Rc::new(RefCell::new(walk));
        let board = switched_on(&make, make.options, &walk, 0, &pages)?;
        Ok(Self {
            make,
            walk,
            board,
            on_since: 0,
            steps: VecDeque::new(),
            resets: 0,
        })
    }

    fn now(&self) -> u64 {
        self.on_since + self.board.now()
    }

    fn run(&mut self, slice: Slice) -> Result<Ran, Problem> {
        for order in slice.orders {
            self.obey(order)?;
        }
        for TimedFrame { time, frame } in slice.frames {
            self.board
                .push_can_at(frame, time.saturating_sub(self.on_since));
        }
        if !slice.bytes.is_empty() {
            self.board.push_uart(&slice.bytes);
        }
        while let Some(&(at, step)) = self.steps.front().filter(|(at, _)| *at <= slice.until) {
            self.run_until(at)?;
            self.steps.pop_front();
            step.act(&mut self.board);
        }
        self.run_until(slice.until)?;
        let now = self.board.now();
        self.board
            .withdraw_can(now.saturating_sub(GIVEN_UP_MS * MILLISECOND));
        // Kept until taken.
        self.board.take_can_requests();
        let load = self.walk.borrow_mut().at(seconds(self.now())).load;
        let resets = self.board.resets();
        let new = resets.iter().skip(self.resets).map(|(_, cause)| *cause);
        let ran = Ran {
            frames: self.sent_frames(),
            bytes: self
                .board
                .take_uart()
                .iter()
                .map(|timed| timed.byte)
                .collect(),
            bytes_incoming: self.board.uart_incoming(),
            bit_rate: self.board.can_bit_rate(),
            load,
            resets: new.collect(),
        };
        self.resets = resets.len();
        Ok(ran)
    }

    fn sent_frames(&mut self) -> Vec<TimedFrame> {
        let mut frames = self.board.take_can();
        for sent in &mut frames {
            sent.time += self.on_since;
        }
        frames
    }

    fn run_until(&mut self, until: u64) -> Result<(), Problem> {
        self.board.run_until(until.saturating_sub(self.on_since))?;
        Ok(())
    }

    fn obey(&mut self, order: Order) -> Result<(), Problem> {
        match order {
            Order::Gait(gait) => self.walk.borrow_mut().change(gait),
            Order::PowerCycle => self.switch_on(self.make.options)?,
            Order::Fault(fault) => {
                let mut at = self.now();
                if fault.needs_power_up() {
                    let mut options = self.make.options;
                    fault.change(&mut options, BEFORE_MS as u32 * 1000);
                    self.switch_on(options)?;
                    let is_from_the_start = fault.scenario().is_some_and(|row| row.at_power_up);
                    if !is_from_the_start {
                        at += BEFORE_MS * MILLISECOND;
                    }
                }
                for &step in fault.before() {
                    step.act(&mut self.board);
                }
                if !fault.before().is_empty() {
                    at += SETTING_MS * MILLISECOND;
                }
                let steps = fault.steps().into_iter();
                let steps = steps.map(|(us, step)| (at + from_us(us), step));
                self.steps.extend(steps);
                self.steps.make_contiguous().sort_by_key(|(at, _)| *at);
            }
        }
        Ok(())
    }

    /// Switches the board off and on again, as a particular one. Its flash keeps what it holds.
    fn switch_on(&mut self, options: BoardOptions) -> Result<(), Problem> {
        let pages = self.board.settings();
        let now = self.now();
        self.board = switched_on(&self.make, options, &self.walk, now, &pages)?;
        self.on_since = now;
        self.steps.clear();
        self.resets = 0;
        Ok(())
    }
}

fn seconds(time: u64) -> f64 {
    time as f64 / PER_SECOND as f64
}

/// A board that is switched on at a time, with what its pages with settings hold.
fn switched_on(
    make: &Make,
    options: BoardOptions,
    walk: &Rc<RefCell<Walk>>,
    now: u64,
    pages: &[u8],
) -> Result<Board, Problem> {
    let (walk, on_since_s) = (Rc::clone(walk), seconds(now));
    let motion = move |time_s: f64| {
        let state = walk.borrow_mut().at(on_since_s + time_s);
        gait::sensor::felt_by(&state, crate::motion::TEMPERATURE)
    };
    let board = Board::with_motion(&make.elf, options, motion);
    let mut board = board.map_err(|error| Problem::Elf(error.to_string()))?;
    board.set_settings(pages);
    board.set_serial_number(FIRST_NUMBER + u32::from(make.position.code()) - 1);
    Ok(board)
}

/// The pages with settings of a board whose program has stored these; blank where there are none.
fn stored(elf: &[u8], settings: &[(Address, Value)]) -> Result<Vec<u8>, Problem> {
    if settings.is_empty() {
        return Ok(Vec::new());
    }
    let mut board = Board::from_elf(elf).map_err(|error| Problem::Elf(error.to_string()))?;
    board.run_until(BEFORE_MS * MILLISECOND)?;
    for &(address, value) in settings {
        Step::Set(address, value).act(&mut board);
        board.run_for(SETTING_MS * MILLISECOND)?;
    }
    Step::StoreStopped.act(&mut board);
    board.run_for(SETTING_MS * MILLISECOND)?;
    let pages = board.settings();
    if pages.iter().all(|byte| *byte == 0xFF) {
        return Err(Problem::Elf(
            "the program does not store its settings".into(),
        ));
    }
    Ok(pages)
}
