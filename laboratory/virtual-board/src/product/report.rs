//! Statistics of a run. Memory use does not grow with its length.

use std::collections::VecDeque;

use serde_json::{Value, json};
use wire::Counter;
use wire::uart::{ContactMessage, Decoder, HealthMessage, Message};

use crate::emulator::board::Board;
use crate::emulator::chip::Transaction;
use crate::emulator::part::can::TimedFrame;
use crate::emulator::part::usart::TimedByte;
use crate::emulator::time::{PER_SECOND, to_ns, to_us};
use crate::product::parity::{self, Parity, ParityCheck};
use crate::product::spread::Spread;
use crate::product::traffic::Traffic;

const MILLISECOND: u64 = PER_SECOND / 1000;

/// Milliseconds at the start without statistics, while clocks, sensor and estimator settle.
const SETTLING: u64 = 500;

/// Phases of a millisecond at which others send requests, one after the other. The phase determines which requests fall
/// into one tick, and the phase of the ticks depends on the start of the board.
const PHASES: u64 = 10;

/// Time at one phase, ms: a whole round of requests.
const ROUND_MS: u64 = 300;

/// Function codes of `CANopen`; the node's number is added.
const EMERGENCY: u32 = 0x080;
const ESTIMATE: u32 = 0x180;

/// `ContactEstimator::update`, as the compiler names it.
const ESTIMATOR: &str = "ContactEstimator6update";

/// Options of a run.
#[derive(Clone, Debug, Default)]
pub struct RunOptions {
    /// Duration, ms.
    pub milliseconds: u64,
    /// Additional traffic on the lines.
    pub traffic: Traffic,
}

/// Number of the longest ticks that a report has, and of the functions of each.
const LONGEST: usize = 5;
const FUNCTIONS: usize = 25;

/// Number of transactions in which a sample's edge is searched.
const RECENT: usize = 16;

/// Record of a run.
#[derive(Default)]
struct Log {
    /// Time from which statistics count.
    settled: u64,
    /// Time at which the last estimate went to its mailbox.
    last_estimate: u64,
    instructions: Spread,
    estimator: Spread,
    cycles: Spread,
    flash_waits: Spread,
    to_can: Spread,
    to_uart: Spread,
    /// Offset of the board's clock behind virtual time, µs.
    clock_offset: Option<f64>,
    decoder: Decoder,
    frame_began: Option<u64>,
    health: Option<HealthMessage>,
    recent: VecDeque<Transaction>,
    /// The ticks of most instructions, the longest first.
    longest: Vec<LongTick>,
    /// The longest time to a mailbox, ns, and when that was.
    slowest: (u64, u64),
    comparison: Option<ParityCheck>,
    uart_frames: u64,
    can_frames: u64,
    emergencies: Vec<Value>,
}

/// A tick, and the functions that it executed.
struct LongTick {
    /// Time of its end since power-up.
    end: u64,
    instructions: u64,
    /// Instructions of each function without its callees, the largest first.
    functions: Vec<(String, u64)>,
}

impl LongTick {
    fn report(&self) -> Value {
        let functions = self.functions.iter().take(FUNCTIONS);
        let functions: Vec<_> = functions.map(|(name, count)| json!([count, name])).collect();
        json!({
            "ms": to_us(self.end) / 1.0e3,
            "instructions": self.instructions,
            "functions": functions,
        })
    }
}

impl Log {
    /// Keeps a tick's functions if it is one of the longest.
    fn keep_longest(&mut self, board: &mut Board, instructions: u64) {
        let shortest = self.longest.last().map_or(0, |tick| tick.instructions);
        if self.longest.len() == LONGEST && instructions <= shortest {
            board.discard_profile();
            return;
        }
        let functions = board.take_profile();
        self.longest.push(LongTick { end: board.now(), instructions, functions });
        self.longest.sort_by_key(|tick| core::cmp::Reverse(tick.instructions));
        self.longest.truncate(LONGEST);
    }

    fn uart(&mut self, bytes: &[TimedByte]) {
        for &TimedByte { time, byte } in bytes {
            let began = *self.frame_began.get_or_insert(time);
            if byte == 0 {
                self.frame_began = None;
            }
            let Some(Ok(frame)) = self.decoder.push(byte) else {
                continue;
            };
            self.uart_frames += 1;
            match frame.message {
                Message::Contact(message) => self.contact(began, message),
                Message::Health(message) => self.health = Some(message),
                _ => {}
            }
        }
    }

    fn contact(&mut self, began: u64, message: ContactMessage) {
        if let Some(edge) = self.edge_before(began) {
            let delay = to_us(began - edge) + self.edges_after(edge, &message);
            if began > self.settled {
                self.to_uart.push((delay * 1.0e3) as u64);
            }
        }
        if let Some(comparison) = &mut self.comparison {
            comparison.contact(began, message);
        }
    }

    fn bus(&mut self, transactions: Vec<Transaction>) {
        if let Some(comparison) = &mut self.comparison {
            comparison.bus(&transactions);
        }
        self.recent.extend(transactions);
        let old = self.recent.len().saturating_sub(RECENT);
        self.recent.drain(..old);
    }

    /// Time from the data-ready edge of a contact's own sample to the newest edge when it was sent, µs: 0 unless the contact
    /// waited for longer than a tick.
    fn edges_after(&mut self, newest: u64, message: &ContactMessage) -> f64 {
        const PERIOD_US: f64 = 1.0e3;
        let offset = to_us(newest) - message.timestamp.as_micros() as f64;
        // The first contact finds the line idle.
        let own = *self.clock_offset.get_or_insert(offset);
        let later = ((offset - own) / PERIOD_US).round() * PERIOD_US;
        // The board's clock may drift.
        self.clock_offset = Some(offset - later);
        later
    }

    /// Data-ready edge of the last sample read before a time.
    fn edge_before(&self, time: u64) -> Option<u64> {
        self.recent
            .iter()
            .rev()
            .find(|transaction| transaction.start < time && parity::is_sample(transaction))?
            .edge
    }

    fn requests(&mut self, requests: &[(u64, u32)]) {
        for &(time, id) in requests {
            if id & !0x7F != ESTIMATE {
                continue;
            }
            self.last_estimate = time;
            if time > self.settled
                && let Some(edge) = self.edge_before(time)
            {
                let taken = to_ns(time - edge);
                if taken > self.slowest.0 {
                    self.slowest = (taken, time);
                }
                self.to_can.push(taken);
            }
        }
    }

    fn can(&mut self, frames: Vec<TimedFrame>) {
        for sent in frames {
            let TimedFrame { time, frame } = &sent;
            self.can_frames += 1;
            if frame.id & !0x7F == EMERGENCY
                && frame.id & 0x7F != 0
                && self.emergencies.len() < 1000
            {
                let digits = frame.data.iter().map(|byte| format!("{byte:02X}"));
                self.emergencies.push(
                    json!({ "ms": to_us(*time) / 1.0e3, "data": digits.collect::<String>() }),
                );
            }
            if frame.id & !0x7F == ESTIMATE
                && let Some(comparison) = &mut self.comparison
            {
                comparison.frame(sent);
            }
        }
    }
}

/// Runs a board from its current state, and returns the report.
///
/// # Errors
/// If the firmware misuses the board.
pub fn run(board: &mut Board, run: &RunOptions) -> Result<Value, Box<dyn core::error::Error>> {
    let first = board.now().div_ceil(MILLISECOND);
    let mut log = Log {
        settled: (first + SETTLING) * MILLISECOND,
        comparison: Some(ParityCheck::new()?),
        ..Log::default()
    };
    board.record_sensor_bus();
    let watched = board.watch_function(ESTIMATOR);
    let (mut last, mut last_watched) = (board.counters(), 0);
    // Offset within a millisecond at which the counts of a tick end.
    let mut idle = 0;
    for ms in 0..run.milliseconds {
        let start = (first + ms) * MILLISECOND;
        if ms == SETTLING {
            // Half a tick after an estimate the work of its tick is done, whenever the board started.
            idle = (log.last_estimate + MILLISECOND / 2) % MILLISECOND;
            board.profile_functions();
        }
        // If two events are due in a millisecond, the earlier one comes first.
        let asked = start + ms / ROUND_MS % PHASES * MILLISECOND / PHASES;
        if asked < start + idle {
            board.run_until(asked)?;
            run.traffic.act(board, first + ms);
        }
        board.run_until(start + idle)?;
        let (now, now_watched) = (board.counters(), board.watched_instructions());
        if ms > SETTLING {
            log.keep_longest(board, now.instructions - last.instructions);
            log.instructions.push(now.instructions - last.instructions);
            log.cycles.push(now.cycles - last.cycles);
            log.flash_waits.push(now.flash_waits - last.flash_waits);
            log.estimator.push(now_watched - last_watched);
        }
        (last, last_watched) = (now, now_watched);
        if asked >= start + idle {
            board.run_until(asked)?;
            run.traffic.act(board, first + ms);
        }
        board.run_until(start + MILLISECOND)?;
        log.bus(board.take_transactions());
        log.uart(&board.take_uart());
        log.requests(&board.take_can_requests());
        log.can(board.take_can());
    }
    let parity = log.comparison.take().map(ParityCheck::finish).unwrap_or_default();
    Ok(report(board, run, &log, parity, watched))
}

fn report(board: &mut Board, run: &RunOptions, log: &Log, parity: Parity, watched: bool) -> Value {
    let count = |counter: Counter| log.health.map(|health| health.counters.get(counter));
    let stack = match ["_stack_end", "_stack_start"].map(|name| board.image.symbol(name)) {
        [Some(low), Some(high)] => Some(board.stack_high_water(low, high)),
        _ => None,
    };
    let cycles = log.cycles.sum as f64;
    let hclk = f64::from(board.cpu().machine().chip.rcc.clocks.hclk);
    let load = 100.0 * cycles / (hclk / 1.0e3 * log.cycles.length.max(1) as f64);
    let resets: Vec<Value> = board
        .resets()
        .iter()
        .map(|(time, cause)| json!({ "ms": to_us(*time) / 1.0e3, "cause": format!("{cause:?}") }))
        .collect();
    let core_faults: Vec<String> =
        board.faults().iter().map(|fault| format!("{fault:x?}")).collect();
    json!({
        "seconds": run.milliseconds as f64 / 1.0e3,
        "ticks": count(Counter::Ticks),
        "late_ticks": count(Counter::LateTicks),
        "missed_ticks": count(Counter::MissedSamples),
        "instructions_per_tick": log.instructions.min_median_max(),
        "estimator_instructions": watched.then(|| log.estimator.min_median_max()),
        "estimated_cycles_per_tick": log.cycles.min_median_max(),
        "estimated_flash_waits_per_tick": log.flash_waits.min_median_max(),
        "cpu_load_percent": load,
        "drdy_to_can_us": log.to_can.times_us(),
        "longest_ticks": log.longest.iter().map(LongTick::report).collect::<Vec<_>>(),
        "drdy_to_can_longest_at_ms": to_us(log.slowest.1) / 1.0e3,
        "drdy_to_uart_us": log.to_uart.times_us(),
        "stack_high_water_bytes": stack,
        "uart_frames": log.uart_frames,
        "can_frames": log.can_frames,
        "drops": {
            "can": count(Counter::CanDropped),
            "uart": count(Counter::UartDropped),
        },
        "parity_compared": { "uart": parity.compared, "can": parity.can_compared },
        "parity_measured": parity.measured,
        "parity_mismatches": parity.mismatches + parity.can_mismatches,
        "emergencies": log.emergencies,
        "resets": resets,
        "core_faults": core_faults,
    })
}
