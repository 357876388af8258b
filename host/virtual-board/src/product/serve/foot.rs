//! A foot: a board in its own thread, which runs one time slice at a time, and a person's hands, which turn the foot to
//! one of its sides and tap its sole.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use gait::{EndlessGait, GaitName};
use lsm6dsox::sim::Stimulus;
use recordings::space::{Rotation, Vector};
use wire::{Address, Foot as Position, Value};

use super::MILLISECOND;
use crate::emulator::board::{Board, BoardOptions};
use crate::emulator::part::can::TimedFrame;
use crate::emulator::part::rcc::ResetCause;
use crate::emulator::time::{PER_SECOND, from_us};
use crate::product::fault::SelectedFault;
use crate::product::scenario::{BEFORE_MS, ScenarioError, ScenarioStep};

/// Time for a board to apply its settings, and to store them, ms.
const SETTING_MS: u64 = 100;

/// Age at which a frame that could not reach the board counts as discarded by its sender, ms: the firmware drops
/// its own frames at this age.
const GIVEN_UP_MS: u64 = 20;

/// First word of the unique number of the first foot's chip; the other feet follow.
const FIRST_NUMBER: u32 = 0x0034_001F;

/// Options of a foot.
#[derive(Clone)]
pub struct BoardFootOptions {
    /// ELF of the firmware.
    pub programs: BoardPrograms,
    /// Options of the board.
    pub options: BoardOptions,
    /// Position of the foot.
    pub position: Position,
    /// Settings stored in flash that differ from the defaults.
    pub settings: Vec<(Address, Value)>,
    /// Gait.
    pub gait: GaitName,
    /// Seed of the steps.
    pub seed: u64,
    /// Delay of its first step after that of the other feet, s.
    pub phase_s: f64,
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
pub struct Slice {
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

/// Handle of a running foot.
pub struct Foot {
    slices: Sender<Slice>,
    ran: Receiver<Result<SliceOutput, ScenarioError>>,
}

impl Foot {
    /// Starts a foot: its firmware stores its settings, then it is switched on.
    #[must_use]
    pub fn start(make: BoardFootOptions) -> Self {
        let (slices, of_foot) = channel();
        let (to_robot, ran) = channel();
        thread::spawn(move || {
            let mut runner = match Runner::new(make) {
                Ok(runner) => runner,
                // A send fails only if the robot is gone.
                Err(error) => return drop(to_robot.send(Err(error))),
            };
            if to_robot.send(Ok(SliceOutput::default())).is_err() {
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

    /// Starts a slice; [`finish`](Self::finish) waits for its end.
    pub fn begin(&self, slice: Slice) {
        // A thread that has ended has reported why, or `finish` reports it.
        let _ = self.slices.send(slice);
    }

    /// Waits until the foot has started, or has run its slice.
    ///
    /// # Errors
    /// As [`Board::run_for`], and if the ELF does not fit or does not store its settings.
    pub fn finish(&self) -> Result<SliceOutput, ScenarioError> {
        let gone = "the thread of the board has ended";
        let ran = self.ran.recv();
        ran.unwrap_or_else(|_| Err(ScenarioError::Elf(gone.to_owned())))
    }
}

/// Cause of a foot's motion.
struct MotionSource {
    walk: EndlessGait,
    hands: Hands,
}

/// The board and its input.
struct Runner {
    make: BoardFootOptions,
    moved: Rc<RefCell<MotionSource>>,
    board: Board,
    /// Time at which it was switched on.
    on_since: u64,
    /// Pending steps with their times.
    steps: VecDeque<(u64, ScenarioStep)>,
    resets: usize,
}

impl Runner {
    fn new(make: BoardFootOptions) -> Result<Self, ScenarioError> {
        let pages = stored(&make.programs.program, &make.settings)?;
        let walk = EndlessGait::new(make.gait, make.seed, make.phase_s);
        let hands = Hands::default();
        let moved = Rc::new(RefCell::new(MotionSource { walk, hands }));
        let board = switched_on(&make, make.options, &moved, 0, &pages)?;
        Ok(Self { make, moved, board, on_since: 0, steps: VecDeque::new(), resets: 0 })
    }

    fn now(&self) -> u64 {
        self.on_since + self.board.now()
    }

    fn run(&mut self, slice: Slice) -> Result<SliceOutput, ScenarioError> {
        for order in slice.orders {
            self.execute(order)?;
        }
        for TimedFrame { time, frame } in slice.frames {
            self.board.push_can_at(frame, time.saturating_sub(self.on_since));
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
        self.board.withdraw_can(now.saturating_sub(GIVEN_UP_MS * MILLISECOND));
        // Takes the requests, which would accumulate otherwise.
        self.board.take_can_requests();
        let load = self.moved.borrow_mut().walk.at(seconds(self.now())).load;
        let resets = self.board.resets();
        let new = resets.iter().skip(self.resets).map(|(_, cause)| *cause);
        let mut frames = self.board.take_can();
        for sent in &mut frames {
            sent.time += self.on_since;
        }
        let bytes = self.board.take_uart();
        let ran = SliceOutput {
            frames,
            bytes: bytes.iter().map(|timed| timed.byte).collect(),
            bytes_incoming: self.board.uart_incoming(),
            bit_rate: self.board.can_bit_rate(),
            load,
            resets: new.collect(),
        };
        self.resets = resets.len();
        Ok(ran)
    }

    fn run_until(&mut self, until: u64) -> Result<(), ScenarioError> {
        self.board.run_until(until.saturating_sub(self.on_since))?;
        Ok(())
    }

    fn execute(&mut self, order: Order) -> Result<(), ScenarioError> {
        match order {
            Order::Gait(gait) => self.moved.borrow_mut().walk.change(gait),
            Order::Hold(side) => {
                let now_s = seconds(self.now());
                self.moved.borrow_mut().hands.turn_to(side, now_s);
            }
            Order::Tap => self.moved.borrow_mut().hands.tap(seconds(self.now())),
            Order::PowerCycle => self.switch_on(self.make.options)?,
            Order::Fault(fault) => {
                let mut at = self.now();
                if fault.needs_power_up() {
                    let mut options = self.make.options;
                    (fault.scenario.board)(&mut options, BEFORE_MS as u32 * 1000);
                    self.switch_on(options)?;
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

    /// Switches the board off and on again, with `options`. Its flash keeps its content.
    fn switch_on(&mut self, options: BoardOptions) -> Result<(), ScenarioError> {
        let pages = self.board.settings();
        let now = self.now();
        self.board = switched_on(&self.make, options, &self.moved, now, &pages)?;
        self.on_since = now;
        self.steps.clear();
        self.resets = 0;
        Ok(())
    }
}

fn seconds(time: u64) -> f64 {
    time as f64 / PER_SECOND as f64
}

/// Creates a board that is switched on at a time, with the given content of its settings pages.
fn switched_on(
    make: &BoardFootOptions,
    options: BoardOptions,
    moved: &Rc<RefCell<MotionSource>>,
    now: u64,
    pages: &[u8],
) -> Result<Board, ScenarioError> {
    let (moved, on_since_s) = (Rc::clone(moved), seconds(now));
    let motion = move |time_s: f64| {
        let time_s = on_since_s + time_s;
        let mut moved = moved.borrow_mut();
        let state = moved.walk.at(time_s);
        let felt = gait::sensor::felt_by(&state, crate::product::motion::TEMPERATURE);
        moved.hands.stimulus(&felt, time_s)
    };
    let bootloader = make.programs.bootloader.as_deref();
    let board = Board::with_bootloader(bootloader, &make.programs.program, options, motion);
    let mut board = board.map_err(|error| ScenarioError::Elf(error.to_string()))?;
    board.set_settings(pages);
    board.set_serial_number(FIRST_NUMBER + u32::from(make.position.code()) - 1);
    Ok(board)
}

/// Settings pages of a board whose firmware has stored these settings; blank if there are none.
fn stored(elf: &[u8], settings: &[(Address, Value)]) -> Result<Vec<u8>, ScenarioError> {
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

/// Duration of a turn, s.
const TURN_S: f64 = 1.0;

/// Duration of a tap, s, and its greatest acceleration, m/s².
const TAP_S: f64 = 0.006;
const TAP: f64 = 60.0;

/// A side of the foot, by its index in [`Side::NAMES`]: the direction that is up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Side(usize);

impl Side {
    /// Names of all sides, in the order x, y, z, each up and then down.
    pub const NAMES: [&'static str; 6] = ["x", "-x", "y", "-y", "z", "-z"];

    /// Parses a name.
    #[must_use]
    pub fn find(name: &str) -> Option<Self> {
        let mut names = Self::NAMES.iter();
        names.position(|known| *known == name).map(Self)
    }

    /// Name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        Self::NAMES[self.0]
    }

    fn up(self) -> Vector {
        let mut axes = [0.0; 3];
        axes[self.0 / 2] = if self.0 % 2 == 1 { -1.0 } else { 1.0 };
        Vector::from_array(axes)
    }
}

/// A rotation about a fixed axis of the foot.
#[derive(Clone, Copy, Debug)]
struct Turn {
    /// Axis of the foot.
    axis: Vector,
    angle_rad: f64,
    began_s: f64,
}

impl Turn {
    /// Share of the angle that is done at a time, and its derivative, 1/s: without jumps of rate or acceleration.
    fn share(&self, time_s: f64) -> (f64, f64) {
        let x = ((time_s - self.began_s) / TURN_S).clamp(0.0, 1.0);
        let share = x * x * x * (10.0 + x * (-15.0 + 6.0 * x));
        let slope = 30.0 * x * x * (1.0 - x) * (1.0 - x) / TURN_S;
        (share, slope)
    }
}

/// Hands around a foot. Without a command they leave it as it is.
#[derive(Clone, Debug)]
pub struct Hands {
    /// Orientation before the newest turn.
    before: Rotation,
    turn: Option<Turn>,
    tapped_s: Option<f64>,
}

impl Default for Hands {
    fn default() -> Self {
        let v = Vector::default();
        Self { before: Rotation { w: 1.0, v }, turn: None, tapped_s: None }
    }
}

impl Hands {
    /// Begins to turn the foot to a side.
    pub fn turn_to(&mut self, side: Side, time_s: f64) {
        let now = self.orientation(time_s);
        let (from, to) = (now.to_sensor(Vector::new(0.0, 0.0, 1.0)), side.up());
        // The direction of up turns against the foot.
        let axis = to.cross(from);
        let axis = match axis.length() {
            // Half a turn about any axis across.
            near if near < 1e-6 && from.dot(to) < 0.0 => {
                let [x, y, z] = to.to_array();
                Vector::new(y, z, x)
            }
            near if near < 1e-6 => Vector::default(),
            length => axis * (1.0 / length),
        };
        self.before = now;
        self.turn = Some(Turn { axis, angle_rad: from.angle_to(to), began_s: time_s });
    }

    /// Taps the sole.
    pub fn tap(&mut self, time_s: f64) {
        self.tapped_s = Some(time_s);
    }

    fn orientation(&self, time_s: f64) -> Rotation {
        let Some(turn) = self.turn else {
            return self.before;
        };
        let half = turn.share(time_s).0 * turn.angle_rad / 2.0;
        self.before.after(Rotation { w: half.cos(), v: turn.axis * half.sin() })
    }

    /// Stimulus of the sensor in these hands, of a foot whose sensor has the stimulus `without` them.
    #[must_use]
    pub fn stimulus(&self, without: &Stimulus, time_s: f64) -> Stimulus {
        let orientation = self.orientation(time_s);
        let mut force = Vector::from_array(without.specific_force);
        if let Some(tapped_s) = self.tapped_s
            && (0.0..TAP_S).contains(&(time_s - tapped_s))
        {
            let phase = core::f64::consts::PI * (time_s - tapped_s) / TAP_S;
            force = force + Vector::new(0.0, 0.0, TAP * phase.sin());
        }
        let turning = self
            .turn
            .map_or(Vector::default(), |turn| turn.axis * (turn.angle_rad * turn.share(time_s).1));
        let rate = orientation.to_sensor(Vector::from_array(without.angular_rate)) + turning;
        Stimulus {
            specific_force: orientation.to_sensor(force).to_array(),
            angular_rate: rate.to_array(),
            temperature: without.temperature,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gait::sensor::GRAVITY;

    #[test]
    fn foot_is_turned_to_each_side_from_each_other() {
        for from in Side::NAMES {
            for to in Side::NAMES {
                let mut hands = Hands::default();
                for (name, time_s) in [(from, 0.0), (to, 2.0)] {
                    hands.turn_to(Side::find(name).expect("a side"), time_s);
                }
                let force = Vector::from_array(hands.stimulus(&Stimulus::REST, 4.0).specific_force);
                let up = Side::find(to).expect("a side").up();
                let error = (force + up * -GRAVITY).length();
                assert!(error < 1e-6, "{from} to {to}: {force:?}");
            }
        }
    }

    #[test]
    fn rate_of_a_turn_is_that_of_gravity_in_the_foot() {
        let mut hands = Hands::default();
        hands.turn_to(Side::find("x").expect("a side"), 0.0);
        for step in 1..999 {
            let time_s = f64::from(step) * 1e-3;
            let at = |time_s| hands.stimulus(&Stimulus::REST, time_s);
            let [before, after] =
                [-1e-5, 1e-5].map(|s| Vector::from_array(at(time_s + s).specific_force));
            let force = Vector::from_array(at(time_s).specific_force);
            let change = (after + before * -1.0) * (1.0 / 2e-5);
            let expected = force.cross(Vector::from_array(at(time_s).angular_rate));
            assert!((change + expected * -1.0).length() < 1e-3, "{time_s}");
        }
    }

    #[test]
    fn tap_lasts_six_milliseconds() {
        let mut hands = Hands::default();
        hands.tap(1.0);
        let up = |time_s| hands.stimulus(&Stimulus::REST, time_s).specific_force[2];
        assert!((up(1.003) - GRAVITY - TAP).abs() < 1e-6);
        assert_eq!((up(0.999), up(1.007)), (GRAVITY, GRAVITY));
    }
}
