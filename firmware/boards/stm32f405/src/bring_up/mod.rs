//! Measurements of a new board, reported one per line over the serial line and RTT.
//!
//! Every wait ends. The driver limits the waits for the sensor, and the tick limits the waits for an edge. The watchdog
//! ends all other waits, because it is fed only for as long as a report can take, and again after the end of the report.

mod bus;
mod can;
mod supply;

use core::fmt;
use core::sync::atomic::{AtomicBool, Ordering};

use embassy_executor::Executor;
use embassy_stm32::pac::{DBGMCU, FLASH};
use embassy_time::{Duration, Instant, Timer};
use firmware::bring_up::{
    BoardReport, Edges, Jitter, Report, SUPPLY_MV, Scatter, Verdict, supply_mv,
};
use firmware::diagnosis::CodeMeter;
use firmware::sampling::Ticks;
use firmware::supervision::StackDepth;
use lsm6dsox::asynch::Lsm6dsox;
use lsm6dsox::register::WHO_AM_I;
use lsm6dsox::{Config, Error, Status};
use static_cell::StaticCell;
use stm32f405_chip::crystal::Frequency;
use wire::Diagnosis;

use crate::clocks::Source;
use crate::sensor::{Delay, SensorBus};
use crate::timebase::{Timebase, since_edge};
use crate::uart::{Receiver, Sender};
use crate::wiring::{BOARD, CRYSTAL_MHZ, CanParts};
use crate::{Peripherals, flash, stack, update, watchdog};

/// Rate of the serial line: that of a foot without stored settings.
const UART_RATE: u32 = 1_000_000;

/// Number of the chip in `DBGMCU_IDCODE` (RM0090, 38.6.1: STM32F405).
const DEVICE: u16 = 0x413;

/// Samples of the force at rest, and ticks of the data-ready line: a second each.
const SAMPLES: u16 = 1_000;
const TICKS: u16 = 1_000;

/// Largest deviation of an edge from its place, µs. The sensor's data sheet states none. The timer resolves 1 µs.
const JITTER_US: f32 = 10.0;

/// Time from an edge at which its sample has been read and the next is not yet due, µs. Pulse and gap are 75 µs each,
/// so that an inverted edge comes 75 µs before the next sample.
const BETWEEN_US: u32 = 110;

/// Largest ratio of the noise at rest with a busy CAN to the noise without. One second of samples gives the noise to 3 %.
const NOISE_RATIO: f32 = 1.25;

/// Unused stack that a program must leave, bytes.
const SPARE_STACK: usize = 8 * 1024;

/// Longest time of a report, s. All waits for the sensor together take some 10 s.
const LONGEST_S: u64 = 60;

/// Whether the report has ended.
static IS_DONE: AtomicBool = AtomicBool::new(false);

/// Destinations of the lines.
pub(super) struct Out {
    uart: Sender,
    report: Report,
}

impl Out {
    async fn write(&mut self, line: &str) {
        defmt::println!("{=str}", line.trim_end());
        // The serial line may be absent. RTT has the line.
        let _ = self.uart.start(line.as_bytes()).end().await;
    }

    /// Writes the lines that `footfall foot … report` also has.
    async fn write_board(&mut self, board: &BoardReport) {
        for line in board.text().split_inclusive('\n') {
            self.write(line).await;
        }
    }

    pub(super) async fn line(
        &mut self,
        name: &str,
        value: fmt::Arguments<'_>,
        limit: &str,
        verdict: Verdict,
    ) {
        let line = self.report.line(name, value, limit, verdict);
        self.write(&line).await;
    }
}

/// Starts the board and measures it.
pub fn run() -> ! {
    static THREAD: StaticCell<Executor> = StaticCell::new();
    let peripherals = crate::start();
    THREAD.init(Executor::new()).run(|thread| {
        if let (Ok(feed), Ok(measure)) = (feed(), measure(peripherals)) {
            thread.spawn(feed);
            thread.spawn(measure);
        }
    })
}

/// Measures everything, then waits for a request to repeat it.
#[embassy_executor::task]
async fn measure(peripherals: Peripherals) {
    let Ok((uart, receiver)) = peripherals.uart.start(UART_RATE) else {
        defmt::error!("the serial line cannot have its rate");
        return;
    };
    let mut out = Out { uart, report: Report::default() };
    let mut diagnosis = crate::diagnosis(peripherals.clock, peripherals.reset);
    measure_chip(&mut out, peripherals.clock, peripherals.serial).await;
    let sensor =
        measure_sensor(&mut out, peripherals.sensor, peripherals.timebase, &mut diagnosis).await;
    match peripherals.clock {
        Source::Crystal(_) => measure_can(&mut out, peripherals.can, sensor).await,
        Source::Internal(_) => {
            let no_crystal = Verdict::NotTested("it needs the crystal");
            out.line("CAN", format_args!("-"), "", no_crystal).await;
        }
    }
    let stack_bytes = measure_stack(&mut out).await;
    let board = BoardReport {
        board: BOARD.name(),
        serial: peripherals.serial,
        program: update::program().identification,
        crash: peripherals.crash.map(|crash| crash.record.into()),
        diagnosis,
        brown_out_level: flash::brown_out_level(),
        stack_bytes,
    };
    out.write_board(&board).await;
    let summary = out.report.summary();
    out.write(&summary).await;
    IS_DONE.store(true, Ordering::Relaxed);
    again(receiver).await;
}

/// Feeds the watchdog until a report should have ended, and again after its end.
#[embassy_executor::task]
async fn feed() {
    while IS_DONE.load(Ordering::Relaxed) || Instant::now().as_secs() < LONGEST_S {
        watchdog::feed();
        Timer::after(Duration::from_millis(watchdog::FEEDING_MILLIS.into())).await;
    }
}

/// Restarts at the first byte received.
async fn again(mut receiver: Receiver) {
    let mut byte = [0; 1];
    loop {
        if receiver.receive(&mut byte).await.is_some() {
            cortex_m::peripheral::SCB::sys_reset();
        }
        Timer::after(Duration::from_millis(10)).await;
    }
}

async fn measure_chip(out: &mut Out, clock: Source, serial: u32) {
    let chip = DBGMCU.idcode().read();
    out.line(
        "chip",
        format_args!("{:#05x}, revision {:#06x}", chip.dev_id(), chip.rev_id()),
        "0x413",
        Verdict::when(chip.dev_id() == DEVICE, "not an STM32F405: another program is needed"),
    )
    .await;
    out.line("serial number", format_args!("{serial:#010x}"), "", Verdict::Pass).await;
    match clock {
        Source::Crystal(Frequency::Measured(_)) => {
            let value = format_args!("{CRYSTAL_MHZ} MHz");
            out.line("crystal", value, "within 6 %", Verdict::Pass).await;
        }
        Source::Crystal(Frequency::NotMeasured) => {
            let verdict = Verdict::NotTested("it starts, but its frequency cannot be measured");
            out.line("crystal", format_args!("starts"), "within 6 %", verdict).await;
        }
        Source::Internal(0) => {
            let verdict = Verdict::Fail("it does not start: solder joints, load capacitors");
            out.line("crystal", format_args!("none"), "", verdict).await;
        }
        Source::Internal(khz) => {
            let verdict = Verdict::Fail("another crystal, or the program of another board");
            let value = format_args!("{khz} kHz, {CRYSTAL_MHZ} MHz wanted");
            out.line("crystal", value, "within 6 %", verdict).await;
        }
    }
    measure_supply(out).await;
    let level = flash::brown_out_level();
    let verdict = if level == 3 {
        Verdict::Pass
    } else {
        Verdict::NotTested("the foot's program sets 3 at its first start")
    };
    out.line("brown-out level", format_args!("{level}"), "3", verdict).await;
    let options = FLASH.optcr().read();
    let is_open = options.rdp() == 0xAA;
    out.line(
        "option bytes",
        format_args!("{:#010x}", options.0),
        "not read-protected",
        if is_open {
            Verdict::Pass
        } else {
            Verdict::NotTested("protected: no probe reads this chip")
        },
    )
    .await;
}

async fn measure_supply(out: &mut Out) {
    let code = supply::reference().await;
    let mv = code.and_then(|code| supply_mv(code, supply::calibration()));
    let verdict = match mv {
        Some(mv) => Verdict::when(
            SUPPLY_MV.contains(&mv),
            "measure 3.3 V at the chip under load; its regulator",
        ),
        None => Verdict::NotTested("the chip's reference cannot be read"),
    };
    let volts = mv.unwrap_or(0) as f32 / 1000.0;
    out.line("supply", format_args!("{volts:.2} V"), "3.0 to 3.6 V", verdict).await;
}

/// The sensor's driver, and its noise.
type Sensor = (Lsm6dsox<SensorBus>, Rest);

async fn measure_sensor(
    out: &mut Out,
    bus: SensorBus,
    mut timebase: Timebase,
    diagnosis: &mut Diagnosis,
) -> Option<Sensor> {
    let mut driver = Lsm6dsox::new(bus, Config::FRESH_KILOHERTZ);
    // Ends I3C mode. A failure shows up below.
    let _ = driver.init(&mut Delay).await;
    bus::measure(out, driver.bus(), diagnosis).await;
    diagnosis.identity = match driver.check_identity().await {
        Ok(()) => WHO_AM_I.reset,
        Err(Error::Identity { read }) => read,
        Err(_) => 0,
    };
    if driver.init(&mut Delay).await.is_err() {
        let verdict = Verdict::Fail("see the lines of the bus");
        out.line("sensor", format_args!("does not start"), "", verdict).await;
        return None;
    }
    let test = driver.self_test(&mut Delay).await;
    let (value, passed) = match &test {
        Ok(test) => (if test.passed() { "all axes" } else { "beyond its limits" }, test.passed()),
        Err(_) => ("no answer", false),
    };
    let remedy = "keep it still and repeat; replace the sensor";
    let verdict = Verdict::when(passed, remedy);
    out.line("sensor's self-test", format_args!("{value}"), "DS12814", verdict).await;
    let trim = driver.frequency_fine().await;
    if driver.init(&mut Delay).await.is_err() {
        let verdict = Verdict::Fail("it does not start again after its self-test");
        out.line("sensor", format_args!("silent"), "", verdict).await;
        return None;
    }
    let trim = trim.map_or(1.0, |trim| trim.ratio() as f32);
    diagnosis.edges = measure_edges(out, &mut timebase, trim).await;
    measure_polarity(out, &mut timebase, &mut driver).await;
    let rest = rest(&mut driver, || ()).await;
    rest.codes.write(diagnosis);
    let failed = SAMPLES - rest.force.count();
    out.line(
        "samples",
        format_args!("{failed} of {SAMPLES} failed"),
        "0",
        Verdict::when(failed == 0, "wires of SPI; supply of the sensor"),
    )
    .await;
    if rest.force.count() == 0 {
        return None;
    }
    let [x, y, z] = rest.force.mean();
    let force = libm::sqrtf(x * x + y * y + z * z);
    out.line(
        "force at rest",
        format_args!("{force:.2} m/s2"),
        "7.84 to 11.77",
        Verdict::of(force, &(7.84..=11.77), "half or twice is another part, such as an LSM6DSO32"),
    )
    .await;
    out.line(
        "sensor's temperature",
        format_args!("{:.1} C", rest.celsius),
        "0 to 60",
        Verdict::of(rest.celsius, &(0.0..=60.0), "let it come to the temperature of the room"),
    )
    .await;
    Some((driver, rest))
}

/// Samples of a second at rest.
#[derive(Default)]
struct Rest {
    force: Scatter,
    rate: Scatter,
    codes: CodeMeter,
    celsius: f32,
}

/// Takes the samples of a second, and calls `act` between them.
async fn rest(driver: &mut Lsm6dsox<SensorBus>, act: impl Fn()) -> Rest {
    let mut rest = Rest::default();
    for _ in 0..SAMPLES {
        if let Ok(sample) = driver.sample().await {
            rest.codes.take(&sample);
            let sample = sample.to_si();
            rest.force.take(sample.specific_force);
            rest.rate.take(sample.angular_rate);
            rest.celsius = sample.temperature;
        }
        for _ in 0..5 {
            act();
            Timer::after(Duration::from_micros(200)).await;
        }
    }
    rest
}

/// Measures whether a sample is new at the edge of INT1, and not half a period before it.
async fn measure_polarity(
    out: &mut Out,
    timebase: &mut Timebase,
    driver: &mut Lsm6dsox<SensorBus>,
) {
    let (mut ticks, mut inverted) = (0, 0);
    for _ in 0..TICKS {
        if timebase.next().await.edge.is_none() {
            continue;
        }
        ticks += 1;
        let _ = driver.sample().await;
        while since_edge() < BETWEEN_US {}
        let status = driver.status().await;
        inverted += u16::from(status.is_ok_and(Status::gyro_fresh));
    }
    let verdict = if ticks == 0 {
        Verdict::NotTested("no edge came")
    } else {
        Verdict::when(inverted < ticks / 2, "INT1 is inverted: no inverter in its wire")
    };
    let value = format_args!("{inverted} of {ticks} inverted");
    out.line("polarity of INT1", value, "less than half", verdict).await;
}

/// Measures the data-ready line: 6.67 kHz, within 5 % of the trim that the part reports for its own clock. Returns the
/// number of edges in [`TICKS`].
async fn measure_edges(out: &mut Out, timebase: &mut Timebase, trim: f32) -> u16 {
    let mut edges = Edges::default();
    // The first tick also counts earlier edges.
    timebase.next().await;
    for _ in 0..TICKS {
        edges.take(timebase.next().await.edges.unwrap_or(0));
    }
    let (interval, nominal) = (edges.interval_us(), 150.0 / trim);
    out.line(
        "interval of INT1",
        format_args!("{interval:.2} us, {nominal:.2} by trim"),
        "within 5 %",
        Verdict::of(interval / nominal, &(0.95..=1.05), "the wire from INT1; its resistor"),
    )
    .await;
    let mut jitter = Jitter::new(interval);
    for _ in 0..TICKS {
        if let Some(edge) = timebase.next().await.edge {
            jitter.take(edge.as_micros());
        }
    }
    let largest = jitter.largest_us();
    out.line(
        "jitter of INT1",
        format_args!("{largest:.1} us at most"),
        "10 us",
        Verdict::of(largest, &(0.0..=JITTER_US), "noise on the wire from INT1"),
    )
    .await;
    let without = edges.without();
    out.line(
        "ticks without INT1",
        format_args!("{without} of {TICKS}"),
        "0",
        Verdict::when(without == 0, "the wire from INT1; noise beside it"),
    )
    .await;
    edges.count().min(u32::from(u16::MAX)) as u16
}

async fn measure_can(out: &mut Out, parts: CanParts, sensor: Option<Sensor>) {
    let (control, _sender, _receiver) = parts.start(can::BIT_RATE);
    let loops = can::loops_back(&control).await;
    out.line(
        "CAN inside the chip",
        format_args!("{}", if loops { "loops back" } else { "silent" }),
        "",
        Verdict::when(loops, "the chip: replace it"),
    )
    .await;
    let (is_acknowledged, errors) = can::is_acknowledged(&control).await;
    out.line(
        "CAN with another node",
        format_args!("{errors} errors"),
        "acknowledged",
        Verdict::when(
            is_acknowledged,
            "one node at 1 Mbit/s; 60 ohm between H and L; transceiver's mode pin; TX and RX",
        ),
    )
    .await;
    if let Some((mut driver, quiet)) = sensor {
        let busy = rest(&mut driver, can::fill).await;
        let force = libm::sqrtf(busy.force.variance() / quiet.force.variance());
        let rate = libm::sqrtf(busy.rate.variance() / quiet.rate.variance());
        out.line(
            "noise with a busy CAN",
            format_args!("force {force:.2}, rate {rate:.2} times"),
            "1.25",
            Verdict::when(
                force <= NOISE_RATIO && rate <= NOISE_RATIO,
                "keep it still; capacitors at the supply of sensor and transceiver",
            ),
        )
        .await;
    }
    can::leave();
}

/// Measures the stack; returns its deepest use, bytes.
async fn measure_stack(out: &mut Out) -> usize {
    let mut depth = StackDepth::default();
    let mut deepest = 0;
    // Each call checks one piece of 128 words. This many calls check the whole stack eight times.
    for _ in 0..stack::size() / 64 {
        if let Some(found) = stack::look(&mut depth) {
            deepest = found;
        }
    }
    let limit = stack::size() - SPARE_STACK;
    out.line(
        "stack",
        format_args!("{deepest} of {} B", stack::size()),
        "8 KiB spare",
        Verdict::when(deepest > 0 && deepest < limit, "report it"),
    )
    .await;
    deepest
}
