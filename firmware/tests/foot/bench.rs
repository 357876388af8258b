//! A foot on a bench: the simulated sensor, virtual time, and all of its output.
//!
//! Time is that of the sensor. The executor polls the sampling loop until it waits, advances time to the next
//! moment that a task waits for, and polls again. So the same run always gives the same bits.

use std::cell::{Cell, RefCell};
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use embedded_hal_async::delay::DelayNs;
use estimator_core::{ImuSample, Timestamp};
use firmware::exchange::{Exchange, Input};
use firmware::sampling::{
    self, Activity, BusHealth, EDGE_LIMIT_US, Measurement, ReadAt, Sensor, Tick, Ticks,
};
use firmware::uart_requests::UartReceiver;
use firmware::{Foot, Ports, Start, tasks};
use lsm6dsox::BusSpeed;
use lsm6dsox::imu::Conversion;
use lsm6dsox::sim::{Motion, Part, PartOptions, SharedPart, Stimulus};
use lsm6dsox::{Config, Pin as InterruptPin, RawSample};
use wire::node::NmtCommand;
use wire::pdo::{Contact, Pdo};
use wire::uart::{Answer, ConfigSet, Decoder, Message, NmtRequest, encode};
use wire::{Address, CanFrame, Emergency, Settings, Stage, Value};

pub const MS: u64 = 1_000_000;
pub const SECOND: u64 = 1000 * MS;

/// Options of an ordinary part.
pub const ORDINARY: PartOptions = PartOptions { byte_time_ns: 800, ..PLAIN };

const PLAIN: PartOptions =
    PartOptions { accel_test_signal: [4.9; 3], gyro_test_signal: [7.0; 3], ..PartOptions::DEFAULT };

/// Measurement of a sensor without faults.
pub const fn measurement(sample: ImuSample, raw: Option<RawSample>) -> Measurement {
    Measurement {
        sample,
        raw,
        activity: Activity::Measuring,
        fault: None,
        read_at: ReadAt::Edge,
        saturated_for_long: false,
        restarts: 0,
        misreads: 0,
        bus: BusHealth { identity: 0x6C, speed: BusSpeed::Full, errors: [0; 3] },
    }
}

pub fn standing() -> SharedPart {
    part(|_: f64| Stimulus::REST, ORDINARY)
}

pub fn part(motion: impl Motion + 'static, options: PartOptions) -> SharedPart {
    Part::with_options(motion, options).shared()
}

/// The next moment that a task waits for.
struct Alarm<'a> {
    part: &'a SharedPart,
    next_ns: &'a Cell<u64>,
}

impl Alarm<'_> {
    async fn wait_until(&self, ns: u64) {
        std::future::poll_fn(|_| {
            if self.part.now_ns() >= ns {
                Poll::Ready(())
            } else {
                self.next_ns.set(self.next_ns.get().min(ns));
                Poll::Pending
            }
        })
        .await;
    }
}

struct BenchDelay<'a>(Alarm<'a>);

impl DelayNs for BenchDelay<'_> {
    async fn delay_ns(&mut self, ns: u32) {
        let until = self.0.part.now_ns() + u64::from(ns);
        self.0.wait_until(until).await;
    }
}

/// A timer of 1 kHz, and a capture of the data-ready pin.
struct BenchTicks<'a> {
    alarm: Alarm<'a>,
    next: u64,
    count_edges: bool,
    is_without_line: bool,
}

impl BenchTicks<'_> {
    fn edge_after(&self) -> Option<u64> {
        self.alarm.part.next_rising_edge_ns(InterruptPin::Int1)
    }
}

impl Ticks for BenchTicks<'_> {
    async fn next(&mut self) -> Tick {
        let mut edges = 0;
        let mut missed = 0;
        while self.alarm.part.now_ns() >= (self.next + 1) * MS {
            self.next += 1;
            missed += 1;
        }
        let tick_ns = self.next * MS;
        self.next += 1;
        while self.count_edges
            && let Some(edge) = self.edge_after()
            && edge <= tick_ns
        {
            self.alarm.wait_until(edge).await;
            edges += 1;
        }
        self.alarm.wait_until(tick_ns).await;
        if self.is_without_line {
            let time = Timestamp::from_micros(tick_ns / 1000);
            return Tick { time, missed, is_without_line: true, ..Tick::default() };
        }
        let limit_ns = tick_ns + EDGE_LIMIT_US * 1000;
        let edge = self.edge_after().filter(|edge| *edge <= limit_ns);
        self.alarm.wait_until(edge.unwrap_or(limit_ns)).await;
        // The edge that has just arrived belongs to this tick's count.
        let edges = edges + u16::from(edge.is_some());
        Tick {
            time: Timestamp::from_micros(tick_ns / 1000),
            edge: edge.map(|ns| Timestamp::from_micros(ns / 1000)),
            edges: self.count_edges.then_some(edges),
            missed,
            is_without_line: false,
        }
    }
}

/// An action on the part, with its time.
pub type Action<'a> = (u64, &'a dyn Fn(&SharedPart));

/// Options of a run.
#[derive(Clone, Copy, Default)]
pub struct Run<'a> {
    pub self_test: bool,
    pub count_edges: bool,
    /// Whether the board has no line for data-ready edges.
    pub is_without_line: bool,
    /// In order of time.
    pub actions: &'a [Action<'a>],
}

impl Run<'_> {
    /// Runs the sampling loop on `part` for `ns`; each tick is handed to `each`.
    pub fn on(self, part: &SharedPart, ns: u64, each: impl FnMut(&Tick, &Measurement)) {
        let next_ns = Cell::new(u64::MAX);
        let alarm = || Alarm { part, next_ns: &next_ns };
        let ticks = BenchTicks {
            alarm: alarm(),
            next: 1 + part.now_ns() / MS,
            count_edges: self.count_edges,
            is_without_line: self.is_without_line,
        };
        let end = part.now_ns() + ns;
        let sensor = Sensor::new(part.spi(), Config::FRESH_KILOHERTZ);
        let delay = BenchDelay(alarm());
        let mut future = pin!(sampling::run(sensor, delay, ticks, self.self_test, each));
        let mut context = Context::from_waker(Waker::noop());
        let mut actions = self.actions.iter();
        let mut due = actions.next();
        while part.now_ns() < end {
            next_ns.set(u64::MAX);
            assert!(future.as_mut().poll(&mut context).is_pending());
            let mut next = next_ns.get();
            assert!(next < u64::MAX, "the loop waits for nothing");
            if let Some((at, action)) = due
                && *at <= next
            {
                part.advance_to(*at);
                action(part);
                due = actions.next();
                // The awaited event may now come at another time.
                next = part.now_ns();
            }
            part.advance_to(next);
        }
    }
}

/// The foot with its ports, and consumers that take all output at once.
pub struct Bench {
    pub foot: Foot,
    pub ports: Ports,
    pub can: Vec<CanFrame>,
    pub uart: Vec<Message>,
    pub can_listens: bool,
    pub uart_listens: bool,
    decoder: Decoder,
    receiver: UartReceiver,
    still_ticks: u64,
}

impl Bench {
    pub fn new(settings: Settings) -> Self {
        Self::with_start(settings, Start::default())
    }

    pub fn with_start(settings: Settings, start: Start) -> Self {
        Self {
            foot: Foot::new(settings, start).expect("checked settings"),
            ports: Ports::new(),
            can: Vec::new(),
            uart: Vec::new(),
            can_listens: true,
            uart_listens: true,
            decoder: Decoder::new(),
            receiver: UartReceiver::new(),
            still_ticks: 0,
        }
    }

    /// Runs one tick and records its output. Earlier output is discarded.
    pub fn tick(&mut self, tick: &Tick, measurement: &Measurement, reading: Option<u16>) {
        let exchange = &mut Exchange::new();
        tasks::run_tick(&mut self.foot, &self.ports, exchange, tick, measurement, reading);
        self.can.clear();
        self.uart.clear();
        if self.can_listens {
            self.can.extend(std::iter::from_fn(|| self.ports.try_next_can()));
        }
        if self.uart_listens {
            while let Some(frame) = self.ports.try_next_uart() {
                for byte in &frame {
                    if let Some(frame) = self.decoder.push(*byte) {
                        self.uart.push(frame.expect("a sound frame").message);
                    }
                }
            }
        }
    }

    /// Contact frame of the last tick.
    pub fn contact(&self) -> Option<Contact> {
        let id = Pdo::Contact.cob_id(self.foot.settings().node_id()?);
        let mut frames = self.can.iter().filter(|frame| frame.id() == id);
        let frame = frames.next()?;
        assert!(frames.next().is_none(), "two contact frames on one tick");
        Some(Contact::decode(frame.data8().expect("eight bytes")))
    }

    /// Writes bytes to the UART; bytes for which the foot has no room are returned.
    pub fn type_in(&mut self, bytes: &[u8]) {
        for byte in bytes {
            if let Some(request) = self.receiver.push(*byte) {
                assert!(self.ports.try_put(Input::Uart(request)), "too much at once");
            }
        }
        if let Some(refused) = self.receiver.refused() {
            assert!(self.ports.try_put(Input::UartRefused(refused)), "too much at once");
        }
    }

    /// Sends a request over UART.
    pub fn ask(&mut self, message: &Message) {
        let frame = encode(0, message);
        self.type_in(frame.as_bytes());
    }

    pub fn set(&mut self, address: Address, value: Value) {
        self.ask(&Message::ConfigSet(ConfigSet { address, value: value.into() }));
    }

    pub fn command(&mut self, command: NmtCommand) {
        self.ask(&Message::Nmt(NmtRequest(command)));
    }

    /// Answers on the UART in the last tick.
    pub fn answers(&self) -> Vec<Answer> {
        let answers = self.uart.iter().filter_map(|message| match message {
            Message::ConfigResponse(response) => Some(response.answer),
            _ => None,
        });
        answers.collect()
    }

    /// Emergency messages on CAN in the last tick.
    pub fn emergencies(&self) -> Vec<Emergency> {
        let frames = self.can.iter().filter(|frame| frame.id() == 0x91);
        let bytes = frames.map(|frame| frame.data8().expect("eight bytes"));
        bytes.map(Emergency::decode).collect()
    }

    /// Runs one tick of a resting sensor, without a simulated part.
    pub fn still(&mut self) {
        self.still_with(None);
    }

    /// Runs a resting tick with a reading of the load input.
    pub fn still_with(&mut self, reading: Option<u16>) {
        self.still_tick(0, reading);
    }

    /// Runs a resting tick after missed ticks.
    pub fn still_after(&mut self, missed: u32) {
        self.still_tick(missed, None);
    }

    fn still_tick(&mut self, missed: u32, reading: Option<u16>) {
        self.still_ticks += 1 + u64::from(missed);
        let time = Timestamp::from_micros(self.still_ticks * 1000);
        let tick = Tick { time, edge: Some(time), missed, ..Tick::default() };
        // Codes of 1 g upwards, with scatter on all values.
        let scatter = (self.still_ticks % 7) as i16 - 3;
        let mut bytes = [3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        bytes[4] = u8::from(scatter > 0);
        bytes[14..].copy_from_slice(&(2049 + scatter).to_le_bytes());
        let raw = RawSample::decode(&bytes, &Config::FRESH_KILOHERTZ).expect("a status");
        let sample = Conversion::new(&Config::FRESH_KILOHERTZ).imu_sample(&raw, time);
        let measurement = Measurement { raw: Some(raw), ..measurement(sample, None) };
        self.tick(&tick, &measurement, reading);
    }

    /// Runs ticks until the foot has started.
    pub fn running(mut self) -> Self {
        for _ in 0..1000 {
            self.still();
        }
        assert_eq!(self.foot.stage(), Stage::Running);
        self
    }
}

/// Runs a foot on `part`, and passes all ticks with their output to `each`.
pub fn run(
    run: Run<'_>,
    part: &SharedPart,
    bench: &mut Bench,
    ns: u64,
    mut each: impl FnMut(&mut Bench, &Tick, &Measurement),
) {
    let bench = RefCell::new(bench);
    run.on(part, ns, |tick, measurement| {
        let bench = &mut **bench.borrow_mut();
        bench.tick(tick, measurement, None);
        each(bench, tick, measurement);
    });
}
