//! A run with everything written down: bytes, frames, samples, a picture and numbers.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use serde_json::{Value, json};
use wire::Counter;
use wire::uart::{ContactMessage, Decoder, HealthMessage, Message};

use crate::board::{Board, Fault};
use crate::chip::Transaction;
use crate::parity::{self, SentContact};
use crate::part::can::TimedFrame;
use crate::part::usart::TimedByte;
use crate::time::{PER_SECOND, to_us};

const MILLISECOND: u64 = PER_SECOND / 1000;

/// Milliseconds at the start that no statistics cover: clocks, sensor and estimator settle.
const SETTLING: u64 = 500;

/// Function codes of `CANopen`; the node's number is added.
const EMERGENCY: u32 = 0x080;
const ESTIMATE: u32 = 0x180;

/// The estimator's entry, as the compiler names it.
const ESTIMATOR: &str = "ContactEstimator$LT$_$GT$6update";

/// What a run is made of.
#[derive(Clone, Debug)]
pub struct Run {
    /// How long it is, ms.
    pub milliseconds: u64,
    /// What goes wrong, and when, ms.
    pub faults: Vec<(String, Fault, u64)>,
}

/// Smallest, median and largest.
#[derive(Clone, Debug, Default)]
struct Spread(Vec<f64>);

impl Spread {
    fn push(&mut self, value: f64) {
        self.0.push(value);
    }

    fn sorted(&self) -> Vec<f64> {
        let mut values = self.0.clone();
        values.sort_by(f64::total_cmp);
        values
    }

    fn three(&self) -> Value {
        let values = self.sorted();
        match (values.first(), values.get(values.len() / 2), values.last()) {
            (Some(min), Some(median), Some(max)) => {
                json!({ "min": min, "median": median, "max": max })
            }
            _ => Value::Null,
        }
    }

    fn two(&self) -> Value {
        let values = self.sorted();
        match (values.get(values.len() / 2), values.last()) {
            (Some(median), Some(max)) => json!({ "median": median, "max": max }),
            _ => Value::Null,
        }
    }
}

/// What is kept of a run.
#[derive(Default)]
struct Log {
    /// From when on it counts.
    settled: u64,
    instructions: Spread,
    estimator: Spread,
    cycles: Spread,
    to_can: Spread,
    to_uart: Spread,
    decoder: Decoder,
    frame_began: Option<u64>,
    contacts: Vec<SentContact>,
    estimates: Vec<TimedFrame>,
    health: Option<HealthMessage>,
    transactions: Vec<Transaction>,
    uart_frames: u64,
    can_frames: u64,
    emergencies: Vec<Value>,
}

impl Log {
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
        if began > self.settled
            && let Some(edge) = self.edge_before(began)
        {
            self.to_uart.push(to_us(began - edge));
        }
        self.contacts.push(SentContact { began, message });
    }

    /// The data-ready edge of the last sample read before a time.
    fn edge_before(&self, time: u64) -> Option<u64> {
        self.transactions
            .iter()
            .rev()
            .take(8)
            .find(|transaction| transaction.start < time && parity::is_sample(transaction))?
            .edge
    }

    fn requests(&mut self, requests: &[(u64, u32)]) {
        for &(time, id) in requests {
            if id & !0x7F == ESTIMATE
                && time > self.settled
                && let Some(edge) = self.edge_before(time)
            {
                self.to_can.push(to_us(time - edge));
            }
        }
    }

    fn can(&mut self, frames: &[TimedFrame], out: &mut impl Write) -> std::io::Result<()> {
        for TimedFrame { time, frame } in frames {
            self.can_frames += 1;
            if frame.id & !0x7F == ESTIMATE {
                self.estimates.push(TimedFrame {
                    time: *time,
                    frame: frame.clone(),
                });
            }
            let data: String = frame.data.iter().fold(String::new(), |mut text, byte| {
                // Writing to a string does not fail.
                let _ = write!(text, "{byte:02X}");
                text
            });
            let micros = to_us(*time);
            writeln!(out, "({:.6}) can0 {:03X}#{data}", micros / 1.0e6, frame.id)?;
            if frame.id & !0x7F == EMERGENCY
                && frame.id & 0x7F != 0
                && self.emergencies.len() < 1000
            {
                self.emergencies
                    .push(json!({ "ms": micros / 1.0e3, "data": data }));
            }
        }
        Ok(())
    }
}

/// Runs a board from where it is and writes `uart.bin`, `can.log`, `samples.csv`, `plot.svg` and `report.json`
/// into a directory: the report.
///
/// # Errors
/// Where the directory cannot be written to, or the firmware misuses the board.
pub fn run(board: &mut Board, run: &Run, out: &Path) -> Result<Value, Box<dyn core::error::Error>> {
    std::fs::create_dir_all(out)?;
    let create = |name: &str| File::create(out.join(name)).map(BufWriter::new);
    let (mut uart, mut can) = (create("uart.bin")?, create("can.log")?);
    let first = board.now().div_ceil(MILLISECOND);
    let mut log = Log {
        settled: (first + SETTLING) * MILLISECOND,
        ..Log::default()
    };
    let mut faults = run.faults.clone();
    faults.sort_by_key(|(_, _, ms)| *ms);
    let mut faults = faults.into_iter().peekable();
    board.record_sensor_bus();
    let watched = board.watch_function(ESTIMATOR);
    let (mut last, mut last_watched) = (board.counters(), 0);
    for ms in 0..run.milliseconds {
        while let Some((_, fault, _)) = faults.next_if(|(_, _, at)| *at <= ms) {
            board.inject(fault);
        }
        if ms == SETTLING {
            board.start_profile();
        }
        board.run_until((first + ms + 1) * MILLISECOND)?;
        let (now, now_watched) = (board.counters(), board.watched_instructions());
        if ms >= SETTLING {
            log.instructions
                .push((now.instructions - last.instructions) as f64);
            log.cycles.push((now.cycles - last.cycles) as f64);
            log.estimator.push((now_watched - last_watched) as f64);
        }
        (last, last_watched) = (now, now_watched);
        log.transactions.extend(board.take_transactions());
        let bytes = board.take_uart();
        uart.write_all(&bytes.iter().map(|sent| sent.byte).collect::<Vec<u8>>())?;
        log.uart(&bytes);
        log.requests(&board.take_can_requests());
        log.can(&board.take_can(), &mut can)?;
    }
    uart.flush()?;
    can.flush()?;
    samples(&log.contacts, create("samples.csv")?)?;
    create("plot.svg")?.write_all(plot(&log.contacts).as_bytes())?;
    let report = report(board, run, &log, watched);
    create("report.json")?.write_all(format!("{report:#}\n").as_bytes())?;
    Ok(report)
}

/// Instructions a millisecond by function, most first, after a [`run`] of this many milliseconds;
/// what happened before statistics begin is left out.
#[must_use]
pub fn profile(board: &Board, milliseconds: u64) -> String {
    let counted = milliseconds.saturating_sub(SETTLING).max(1) as f64;
    let mut text = String::new();
    for (function, instructions) in board.profile() {
        // Writing to a string does not fail.
        let _ = writeln!(text, "{:10.1} {function}", instructions as f64 / counted);
    }
    text
}

fn report(board: &mut Board, run: &Run, log: &Log, watched: bool) -> Value {
    let count = |counter: Counter| log.health.map(|health| health.counters.get(counter));
    let parity = if run.faults.is_empty() {
        Some(parity::compare(
            &log.transactions,
            &log.contacts,
            &log.estimates,
        ))
    } else {
        None
    };
    let stack = match ["_stack_end", "_stack_start"].map(|name| board.image().symbol(name)) {
        [Some(low), Some(high)] => Some(board.stack_high_water(low, high)),
        _ => None,
    };
    let cycles: f64 = log.cycles.0.iter().sum();
    let hclk = f64::from(board.cpu().machine().chip.rcc.clocks().hclk);
    let load = 100.0 * cycles / (hclk / 1.0e3 * log.cycles.0.len().max(1) as f64);
    let resets: Vec<Value> = board
        .resets()
        .iter()
        .map(|(time, cause)| json!({ "ms": to_us(*time) / 1.0e3, "cause": format!("{cause:?}") }))
        .collect();
    let core_faults: Vec<String> = board
        .faults()
        .iter()
        .map(|fault| format!("{fault:x?}"))
        .collect();
    json!({
        "seconds": run.milliseconds as f64 / 1.0e3,
        "ticks": count(Counter::Ticks),
        "late_ticks": count(Counter::LateTicks),
        "missed_ticks": count(Counter::MissedSamples),
        "instructions_per_tick": log.instructions.three(),
        "estimator_instructions": watched.then(|| log.estimator.three()),
        "estimated_cycles_per_tick": log.cycles.three(),
        "cpu_load_percent": load,
        "drdy_to_can_us": log.to_can.two(),
        "drdy_to_uart_us": log.to_uart.two(),
        "stack_high_water_bytes": stack,
        "uart_frames": log.uart_frames,
        "can_frames": log.can_frames,
        "drops": {
            "can": count(Counter::CanDropped),
            "uart": count(Counter::UartDropped),
        },
        "parity_compared": parity.map(|parity| json!({
            "uart": parity.compared,
            "can": parity.can_compared,
        })),
        "parity_mismatches": parity.map(|parity| parity.mismatches + parity.can_mismatches),
        "faults": run.faults.iter().map(|(name, _, ms)| json!({ "name": name, "ms": ms })).collect::<Vec<_>>(),
        "emergencies": log.emergencies,
        "resets": resets,
        "core_faults": core_faults,
    })
}

fn samples(contacts: &[SentContact], mut out: impl Write) -> std::io::Result<()> {
    writeln!(out, "t,p_stable,p_tangential,p_vertical,flags")?;
    let part = |code: u16| f64::from(code) / 65535.0;
    for SentContact { message, .. } in contacts {
        writeln!(
            out,
            "{:.6},{:.6},{:.6},{:.6},{}",
            message.timestamp.as_micros() as f64 / 1.0e6,
            part(message.stable.0),
            part(message.tangential.0),
            part(message.vertical.0),
            message.flags,
        )?;
    }
    out.flush()
}

/// The probability of stable contact over time.
fn plot(contacts: &[SentContact]) -> String {
    let (width, height, left, top) = (900.0, 220.0, 50.0, 20.0);
    let seconds = |sent: &SentContact| sent.message.timestamp.as_micros() as f64 / 1.0e6;
    let end = contacts.last().map_or(1.0, seconds).max(1.0e-3);
    let step = contacts.len().div_ceil(3000).max(1);
    let mut points = String::new();
    for sent in contacts.iter().step_by(step) {
        let x = left + width * seconds(sent) / end;
        let y = top + height * (1.0 - f64::from(sent.message.stable.0) / 65535.0);
        // Writing to a string does not fail.
        let _ = write!(points, "{x:.1},{y:.1} ");
    }
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n\
         <rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" fill=\"none\" stroke=\"#888\"/>\n\
         <text x=\"{left}\" y=\"14\">probability of stable contact, as the board sent it</text>\n\
         <text x=\"30\" y=\"{}\">1</text><text x=\"30\" y=\"{}\">0</text>\n\
         <text x=\"{}\" y=\"{}\" text-anchor=\"end\">{end:.1} s</text>\n\
         <polyline fill=\"none\" stroke=\"#1f5fa8\" points=\"{points}\"/>\n</svg>\n",
        width + left + 30.0,
        height + top + 40.0,
        top + 6.0,
        top + height,
        left + width,
        top + height + 18.0,
    )
}
