//! A foot of the robot: a board in its own thread, which runs one time slice at a time, and the motion that its sensor
//! measures.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use gait::{EndlessGait, GaitName};
use wire::{Address, Foot as Position, Value};

use super::MILLISECOND;
use super::hands::{Hands, Side};
use crate::emulator::board::{Board, BoardOptions};
use crate::emulator::part::can::TimedFrame;
use crate::emulator::part::rcc::ResetCause;
use crate::emulator::time::{PER_SECOND, from_us};
use crate::product::fault::SelectedFault;
use crate::product::motion::TEMPERATURE;
use crate::product::scenario::{BEFORE_MS, ScenarioError, ScenarioStep};

/// Handle of a foot whose board runs in a thread.
pub struct BoardFoot {
    inputs: Sender<SliceInput>,
    outputs: Receiver<Result<SliceOutput, ScenarioError>>,
}

impl BoardFoot {
    /// Starts a foot: its firmware stores its settings, then it is switched on.
    #[must_use]
    pub fn start(options: BoardFootOptions) -> Self {
        let (inputs, from_robot) = channel();
        let (to_robot, outputs) = channel();
        thread::spawn(move || {
            let mut runner = match FootRunner::new(options) {
                Ok(runner) => runner,
                // A send fails only if the robot is gone.
                Err(error) => return drop(to_robot.send(Err(error))),
            };
            if to_robot.send(Ok(SliceOutput::default())).is_err() {
                return;
            }
            for input in from_robot {
                if to_robot.send(runner.run(input)).is_err() {
                    return;
                }
            }
        });
        Self { inputs, outputs }
    }

    /// Starts a slice; [`finish`](Self::finish) waits for its end.
    pub fn begin(&self, input: SliceInput) {
        // A thread that has ended has reported why, or `finish` reports it.
        let _ = self.inputs.send(input);
    }

    /// Waits until the foot has started, or has run its slice.
    ///
    /// # Errors
    /// As [`Board::run_for`], and if the ELF does not fit or does not store its settings.
    pub fn finish(&self) -> Result<SliceOutput, ScenarioError> {
        let gone = "the thread of the board has ended";
        let output = self.outputs.recv();
        output.unwrap_or_else(|_| Err(ScenarioError::Elf(gone.to_owned())))
    }
}

/// Options of a foot.
#[derive(Clone)]
pub struct BoardFootOptions {
    /// Programs in its flash.
    pub programs: BoardPrograms,
    /// Options of the board.
    pub board: BoardOptions,
    /// Position of the foot.
    pub position: Position,
    /// Settings stored in flash that differ from the defaults.
    pub settings: Vec<(Address, Value)>,
    /// Gait.
    pub gait: GaitName,
    /// Seed of the steps.
    pub seed: u64,
    /// Delay of the foot's first step after the first step of the other feet, s.
    pub phase_s: f64,
}

/// Programs in the flash of a board.
#[derive(Clone)]
pub struct BoardPrograms {
    /// ELF of the foot's program.
    pub program: Arc<[u8]>,
    /// ELF of the bootloader; without one the program starts at once.
    pub bootloader: Option<Arc<[u8]>>,
}

impl From<Vec<u8>> for BoardPrograms {
    fn from(program: Vec<u8>) -> Self {
        Self { program: program.into(), bootloader: None }
    }
}

/// Input of a time slice.
pub struct SliceInput {
    /// End of the slice, in units of [`time`](crate::emulator::time).
    pub until: u64,
    /// Frames sent by the other nodes.
    pub frames: Vec<TimedFrame>,
    /// Bytes received over the serial line.
    pub bytes: Vec<u8>,
    /// Orders for the foot.
    pub orders: Vec<Order>,
}

/// Output of a time slice.
#[derive(Default)]
pub struct SliceOutput {
    /// Frames sent, with the times of their ends.
    pub frames: Vec<TimedFrame>,
    /// Bytes sent over the serial line.
    pub bytes: Vec<u8>,
    /// Number of bytes still being received.
    pub bytes_incoming: usize,
    /// Bit rate of the CAN controller, bit/s; `None` while it is off the bus.
    pub bit_rate: Option<u32>,
    /// Load on the foot, N.
    pub load: f64,
    /// Causes of resets.
    pub resets: Vec<ResetCause>,
}

/// An order to a foot.
#[derive(Clone, Copy)]
pub enum Order {
    /// Changes the gait.
    Gait(GaitName),
    /// Injects or clears a fault.
    Fault(SelectedFault),
    /// Turns the foot to a side.
    Hold(Side),
    /// Taps the sole.
    Tap,
    /// Removes the supply for a moment, and clears all faults.
    PowerCycle,
}

impl core::fmt::Display for Order {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Gait(gait) => write!(f, "gait {gait}"),
            Self::Fault(fault) => write!(f, "fault {}", fault.scenario.name),
            Self::Hold(side) => write!(f, "hold {}", side.name()),
            Self::Tap => f.write_str("tap"),
            Self::PowerCycle => f.write_str("power-cycle"),
        }
    }
}

/// Time for a board to apply its settings, and to store them, ms.
const SETTING_MS: u64 = 100;

/// Age at which a frame that could not reach the board counts as discarded by its sender, ms: the firmware drops
/// its own frames at this age.
const GIVEN_UP_MS: u64 = 20;

/// First word of the unique number of the first foot's chip; the other feet follow.
const FIRST_NUMBER: u32 = 0x0034_001F;

/// Sources of a foot's motion: its walk, and hands that hold it.
struct MotionSource {
    walk: EndlessGait,
    hands: Hands,
}

/// The board of a foot in its thread.
struct FootRunner {
    options: BoardFootOptions,
    motion: Rc<RefCell<MotionSource>>,
    board: Board,
    /// Time at which it was switched on.
    on_since: u64,
    /// Pending steps with their times.
    steps: VecDeque<(u64, ScenarioStep)>,
    /// Number of resets that are already in an output.
    resets: usize,
}

impl FootRunner {
    fn new(options: BoardFootOptions) -> Result<Self, ScenarioError> {
        let pages = store_settings(&options.programs.program, &options.settings)?;
        let walk = EndlessGait::new(options.gait, options.seed, options.phase_s);
        let hands = Hands::default();
        let motion = Rc::new(RefCell::new(MotionSource { walk, hands }));
        let board = switch_on(&options, options.board, &motion, 0, &pages)?;
        Ok(Self { options, motion, board, on_since: 0, steps: VecDeque::new(), resets: 0 })
    }

    fn now(&self) -> u64 {
        self.on_since + self.board.now()
    }

    /// Runs a time slice.
    fn run(&mut self, input: SliceInput) -> Result<SliceOutput, ScenarioError> {
        for order in input.orders {
            self.execute(order)?;
        }
        for TimedFrame { time, frame } in input.frames {
            self.board.push_can_at(frame, time.saturating_sub(self.on_since));
        }
        if !input.bytes.is_empty() {
            self.board.push_uart(&input.bytes);
        }
        while let Some(&(at, step)) = self.steps.front().filter(|(at, _)| *at <= input.until) {
            self.run_until(at)?;
            self.steps.pop_front();
            step.act(&mut self.board);
        }
        self.run_until(input.until)?;
        let now = self.board.now();
        self.board.withdraw_can(now.saturating_sub(GIVEN_UP_MS * MILLISECOND));
        // Takes the requests, which would accumulate otherwise.
        self.board.take_can_requests();
        let load = self.motion.borrow_mut().walk.at(seconds(self.now())).load;
        let resets = self.board.resets();
        let new = resets.iter().skip(self.resets).map(|(_, cause)| *cause);
        let mut frames = self.board.take_can();
        for sent in &mut frames {
            sent.time += self.on_since;
        }
        let bytes = self.board.take_uart();
        let output = SliceOutput {
            frames,
            bytes: bytes.iter().map(|timed| timed.byte).collect(),
            bytes_incoming: self.board.uart_incoming(),
            bit_rate: self.board.can_bit_rate(),
            load,
            resets: new.collect(),
        };
        self.resets = resets.len();
        Ok(output)
    }

    fn run_until(&mut self, until: u64) -> Result<(), ScenarioError> {
        self.board.run_until(until.saturating_sub(self.on_since))?;
        Ok(())
    }

    /// Executes an order. The steps of a fault follow at their times.
    fn execute(&mut self, order: Order) -> Result<(), ScenarioError> {
        match order {
            Order::Gait(gait) => self.motion.borrow_mut().walk.change(gait),
            Order::Hold(side) => {
                let now_s = seconds(self.now());
                self.motion.borrow_mut().hands.turn_to(side, now_s);
            }
            Order::Tap => self.motion.borrow_mut().hands.tap(seconds(self.now())),
            Order::PowerCycle => self.power_cycle(self.options.board)?,
            Order::Fault(fault) => {
                let mut at = self.now();
                if fault.needs_power_up() {
                    let mut options = self.options.board;
                    (fault.scenario.board)(&mut options, BEFORE_MS as u32 * 1000);
                    self.power_cycle(options)?;
                    if !fault.scenario.at_power_up {
                        at += BEFORE_MS * MILLISECOND;
                    }
                }
                for &step in fault.scenario.before {
                    step.act(&mut self.board);
                }
                if !fault.scenario.before.is_empty() {
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

    /// Switches the board off and on again, with these options. Its flash keeps its content.
    fn power_cycle(&mut self, board: BoardOptions) -> Result<(), ScenarioError> {
        let pages = self.board.settings();
        let now = self.now();
        self.board = switch_on(&self.options, board, &self.motion, now, &pages)?;
        self.on_since = now;
        self.steps.clear();
        self.resets = 0;
        Ok(())
    }
}

/// Converts a time to seconds.
fn seconds(time: u64) -> f64 {
    time as f64 / PER_SECOND as f64
}

/// Creates a board that is switched on at a time, with the given content of its settings pages.
fn switch_on(
    foot: &BoardFootOptions,
    board: BoardOptions,
    motion: &Rc<RefCell<MotionSource>>,
    now: u64,
    pages: &[u8],
) -> Result<Board, ScenarioError> {
    let (motion, on_since_s) = (Rc::clone(motion), seconds(now));
    let stimulus = move |time_s: f64| {
        let time_s = on_since_s + time_s;
        let mut motion = motion.borrow_mut();
        let state = motion.walk.at(time_s);
        let walked = gait::sensor::felt_by(&state, TEMPERATURE);
        motion.hands.stimulus(&walked, time_s)
    };
    let BoardPrograms { program, bootloader } = &foot.programs;
    let board = Board::with_bootloader(bootloader.as_deref(), program, board, stimulus);
    let mut board = board.map_err(|error| ScenarioError::Elf(error.to_string()))?;
    board.set_settings(pages);
    board.set_serial_number(FIRST_NUMBER + u32::from(foot.position.code()) - 1);
    Ok(board)
}

/// Lets a board's firmware store these settings; returns its settings pages, blank if there are none.
fn store_settings(elf: &[u8], settings: &[(Address, Value)]) -> Result<Vec<u8>, ScenarioError> {
    if settings.is_empty() {
        return Ok(Vec::new());
    }
    let mut board = Board::from_elf(elf).map_err(|error| ScenarioError::Elf(error.to_string()))?;
    board.run_until(BEFORE_MS * MILLISECOND)?;
    for &(address, value) in settings {
        ScenarioStep::Set(address, value).act(&mut board);
        board.run_for(SETTING_MS * MILLISECOND)?;
    }
    ScenarioStep::StoreStopped.act(&mut board);
    board.run_for(SETTING_MS * MILLISECOND)?;
    let pages = board.settings();
    if pages.iter().all(|byte| *byte == 0xFF) {
        return Err(ScenarioError::Elf("the program does not store its settings".into()));
    }
    Ok(pages)
}
