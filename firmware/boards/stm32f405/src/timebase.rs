//! TIM2: the time of samples, the 1 kHz tick and the timestamps of data-ready edges.
//!
//! The timer is free-running and counts microseconds. Its channels:
//!
//! - Channel 1 captures each rising edge of the sensor's data-ready line, behind a filter. Only the first edge after a
//!   tick raises an interrupt.
//! - Compare channel 2 is the tick.
//! - Channel 3 ends the wait for the edge.
//! - Channel 4 ends a sleep at its [`Deadline`].
//!
//! TIM4 counts all captures, clocked by TIM2's trigger output. So missing and extra edges are detected without
//! interrupts.
//!
//! A compare value that the counter has passed matches only after the counter has wrapped, in 71 minutes. So the
//! counter is read again after a value is written. If it is late, as after a stall by the flash, ticks that can no
//! longer be served are skipped and counted.

use core::sync::atomic::{AtomicU16, AtomicU32, Ordering};

use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::pac::timer::{regs, vals};
use embassy_stm32::pac::{TIM2, TIM4};
use embassy_stm32::{Peri, peripherals, rcc};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use estimator_core::Timestamp;
use firmware::sampling::{EDGE_LIMIT_US, Tick, Ticks};

use crate::URGENT_PRIORITY;
use crate::wiring::CAPTURE_INPUT;

/// Duration of a tick, µs.
const TICK_MICROS: u32 = 1_000;

/// Maximum time from the tick to the edge, µs.
const EDGE_MICROS: u32 = EDGE_LIMIT_US as u32;

/// Maximum delay of serving a tick, µs. It leaves time for an edge before the next tick.
const SERVED_MICROS: u32 = TICK_MICROS - EDGE_MICROS - 100;

/// Period of the edges, µs.
const EDGE_PERIOD_MICROS: u32 = 150;

/// Channels, counted from 0.
const EDGE: usize = 0;
const TICK: usize = 1;
const EDGE_DEADLINE: usize = 2;
const SLEEP_DEADLINE: usize = 3;

/// Number of wraps of the counter.
static WRAPS: AtomicU32 = AtomicU32::new(0);

/// Ticks since the start, modulo 2³².
static TICKS: AtomicU32 = AtomicU32::new(0);

/// Count of TIM4 at the last tick.
static EDGES: AtomicU16 = AtomicU16::new(0);

/// Edges counted by TIM4 between the last two ticks.
static EDGES_OF_TICK: AtomicU16 = AtomicU16::new(0);

/// Count of the timer at the newest edge after a tick, or at the end of the wait for it.
static SAMPLED: AtomicU32 = AtomicU32::new(0);

static ALARM: Signal<CriticalSectionRawMutex, Alarm> = Signal::new();

/// Tick and its edge.
#[derive(Clone, Copy)]
struct Alarm {
    /// Number of the tick, modulo 2³².
    tick: u32,
    /// Time of the tick.
    time: Timestamp,
    /// Time of the data-ready edge, if it came in time.
    edge: Option<Timestamp>,
    /// Edges since the previous tick.
    edges: u16,
}

/// Running timer.
pub struct Timebase {
    /// Last tick served, if any.
    served: Option<u32>,
}

impl Timebase {
    /// Starts the timer, and TIM4, which counts its edges.
    pub fn start(
        _timer: Peri<'static, peripherals::TIM2>,
        _counter: Peri<'static, peripherals::TIM4>,
    ) -> Self {
        rcc::enable_and_reset::<peripherals::TIM4>();
        // The internal trigger 1 of TIM4 is TIM2's output (RM0090, table 98).
        TIM4.smcr().modify(|w| {
            w.set_ts(vals::Ts::ITR1);
            w.set_sms(vals::Sms::EXT_CLOCK_MODE);
        });
        TIM4.cr1().modify(|w| w.set_cen(true));
        rcc::enable_and_reset::<peripherals::TIM2>();
        // One pulse per capture of channel 1, whether or not the previous one was read.
        TIM2.cr2().modify(|w| {
            w.set_mms(vals::Mms::COMPARE_PULSE);
            w.set_ti1s(CAPTURE_INPUT);
        });
        let cycles_per_micro = rcc::frequency::<peripherals::TIM2>().0 / 1_000_000;
        TIM2.psc().write_value((cycles_per_micro - 1) as u16);
        TIM2.arr().write_value(u32::MAX);
        TIM2.ccmr_input(0).modify(|w| {
            w.set_ccs(EDGE, vals::CcmrInputCcs::TI4);
            // Eight cycles of 80 MHz. The filter ignores a level of less than 88 ns.
            w.set_icf(EDGE, vals::FilterValue::FCK_INT_N8);
        });
        TIM2.ccer().modify(|w| w.set_cce(EDGE, true));
        TIM2.ccr(TICK).write_value(TICK_MICROS);
        // Loads the prescaler; the resulting update must not count as a wrap.
        TIM2.egr().write(|w| w.set_ug(true));
        TIM2.sr().write_value(regs::SrGp16(0));
        TIM2.dier().modify(|w| {
            w.set_uie(true);
            w.set_ccie(TICK, true);
            w.set_ccie(SLEEP_DEADLINE, true);
        });
        TIM2.cr1().modify(|w| w.set_cen(true));
        interrupt::TIM2.set_priority(URGENT_PRIORITY);
        // SAFETY: the handler below accesses nothing that a lock protects.
        unsafe { interrupt::TIM2.enable() };
        Self { served: None }
    }
}

impl Ticks for Timebase {
    async fn next(&mut self) -> Tick {
        let Alarm { tick, time, edge, edges } = ALARM.wait().await;
        let missed = match self.served.replace(tick) {
            Some(before) => tick.wrapping_sub(before).wrapping_sub(1),
            None => 0,
        };
        Tick { time, edge, edges: Some(edges), missed, is_without_line: false }
    }
}

/// Time since the start.
pub fn now() -> Timestamp {
    Timestamp::from_micros(now_micros())
}

fn now_micros() -> u64 {
    loop {
        let wraps = WRAPS.load(Ordering::Acquire);
        let count = TIM2.cnt().read();
        // A wrap that the interrupt has not counted yet, because this code delays it.
        let uncounted = TIM2.sr().read().uif() && count < 1 << 31;
        if WRAPS.load(Ordering::Acquire) == wraps {
            return (u64::from(wraps) + u64::from(uncounted)) << 32 | u64::from(count);
        }
    }
}

/// Timeout of a wait. It is an interrupt, and so an event that ends the processor's sleep.
pub struct Deadline {
    end: u32,
}

impl Deadline {
    /// Sets a deadline in `micros`. Only the sampling level has one, and never two at once.
    pub fn after(micros: u32) -> Self {
        let end = TIM2.cnt().read().wrapping_add(micros);
        TIM2.ccr(SLEEP_DEADLINE).write_value(end);
        Self { end }
    }

    /// Returns whether the deadline has passed. Call this before each sleep, because no interrupt follows if the
    /// deadline passed before it was written.
    pub fn has_passed(&self) -> bool {
        let left = self.end.wrapping_sub(TIM2.cnt().read());
        left == 0 || left > u32::MAX / 2
    }
}

impl Drop for Deadline {
    /// Moves the compare value half a wrap behind the counter. Its next match, in 36 minutes, only ends a sleep.
    fn drop(&mut self) {
        TIM2.ccr(SLEEP_DEADLINE).write_value(self.end.wrapping_sub(1 << 31));
    }
}

/// Count of the timer, µs.
pub fn count() -> u32 {
    TIM2.cnt().read()
}

/// Discards a tick that came before the sampling loop started, because its edge may be long over.
pub fn discard() {
    ALARM.reset();
}

/// Time since the data-ready edge of the tick, or since the end of the wait for it, µs.
pub fn since_edge() -> u32 {
    count().wrapping_sub(SAMPLED.load(Ordering::Relaxed))
}

/// Time at which the counter was at `count`, less than a wrap ago.
pub fn extend(count: u32) -> Timestamp {
    let now = now_micros();
    Timestamp::from_micros(now - u64::from((now as u32).wrapping_sub(count)))
}

/// Handles the timer's events; much shorter than a tick.
#[embassy_stm32::interrupt]
fn TIM2() {
    let pending = TIM2.sr().read();
    let enabled = TIM2.dier().read();
    if pending.uif() {
        acknowledge(|w| w.set_uif(false));
        WRAPS.store(WRAPS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Release);
    }
    if pending.ccif(TICK) {
        let tick = TIM2.ccr(TICK).read();
        TIM2.ccr(TICK).write_value(tick.wrapping_add(TICK_MICROS));
        // The deadline counts from now, not from the tick. If this handler is late, it also discards the first edge
        // after the tick.
        TIM2.ccr(EDGE_DEADLINE).write_value(TIM2.cnt().read().wrapping_add(EDGE_MICROS));
        // Edges before the tick are discarded, with the flag of several captures.
        acknowledge(|w| {
            w.set_ccif(TICK, false);
            w.set_ccif(EDGE, false);
            w.set_ccof(EDGE, false);
            w.set_ccif(EDGE_DEADLINE, false);
        });
        count_edges();
        count_ticks(1);
        wait_for_edge(true);
        // A compare value that the counter has passed will not match.
        if TIM2.cnt().read().wrapping_sub(tick) >= EDGE_MICROS {
            catch_up(tick);
        }
    } else if pending.ccif(EDGE) && enabled.ccie(EDGE) {
        wait_for_edge(false);
        let edge = TIM2.ccr(EDGE).read();
        SAMPLED.store(edge, Ordering::Relaxed);
        raise(Some(extend(edge)));
    } else if pending.ccif(EDGE_DEADLINE) && enabled.ccie(EDGE_DEADLINE) {
        wait_for_edge(false);
        SAMPLED.store(count(), Ordering::Relaxed);
        raise(None);
    } else if pending.ccif(SLEEP_DEADLINE) {
        // The only effect is to end the sleep.
        acknowledge(|w| w.set_ccif(SLEEP_DEADLINE, false));
    }
    // See `Barrier`.
    cortex_m::asm::dsb();
}

/// Continues after a tick that was served so late that its edge may be over. Takes the newest tick, or no tick if that
/// is too late as well.
fn catch_up(mut tick: u32) {
    loop {
        let late = TIM2.cnt().read().wrapping_sub(tick);
        let skipped = late / TICK_MICROS;
        tick = tick.wrapping_add(skipped * TICK_MICROS);
        count_ticks(skipped);
        TIM2.ccr(TICK).write_value(tick.wrapping_add(TICK_MICROS));
        acknowledge(|w| w.set_ccif(TICK, false));
        let late = TIM2.cnt().read().wrapping_sub(tick);
        if late >= TICK_MICROS {
            continue;
        }
        let served = late < SERVED_MICROS;
        wait_for_edge(served);
        if served {
            let end = tick.wrapping_add(late).wrapping_add(EDGE_MICROS);
            TIM2.ccr(EDGE_DEADLINE).write_value(end);
            acknowledge(|w| w.set_ccif(EDGE_DEADLINE, false));
            // Edges since the tick must not count as edges before it.
            let since = (late / EDGE_PERIOD_MICROS) as u16;
            for count in [&EDGES, &EDGES_OF_TICK] {
                count.store(count.load(Ordering::Relaxed).wrapping_sub(since), Ordering::Relaxed);
            }
        }
        return;
    }
}

fn count_ticks(count: u32) {
    TICKS.store(TICKS.load(Ordering::Relaxed).wrapping_add(count), Ordering::Relaxed);
}

fn count_edges() {
    let count = TIM4.cnt().read().cnt();
    let before = EDGES.load(Ordering::Relaxed);
    EDGES.store(count, Ordering::Relaxed);
    EDGES_OF_TICK.store(count.wrapping_sub(before), Ordering::Relaxed);
}

fn wait_for_edge(wait: bool) {
    TIM2.dier().modify(|w| {
        w.set_ccie(EDGE, wait);
        w.set_ccie(EDGE_DEADLINE, wait);
    });
}

fn raise(edge: Option<Timestamp>) {
    let tick = TIM2.ccr(TICK).read().wrapping_sub(TICK_MICROS);
    ALARM.signal(Alarm {
        tick: TICKS.load(Ordering::Relaxed),
        time: extend(tick),
        edge,
        edges: EDGES_OF_TICK.load(Ordering::Relaxed),
    });
}

/// Clears flags. Writing one leaves a flag unchanged, so that flags set meanwhile are kept.
fn acknowledge(clear: impl FnOnce(&mut regs::SrGp16)) {
    let mut flags = regs::SrGp16(u32::MAX);
    clear(&mut flags);
    TIM2.sr().write_value(flags);
}
