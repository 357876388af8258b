//! Faults of the external lines.

use lsm6dsox::sim::PartFault as SensorFault;
use wire::dictionary::index;
use wire::node::NmtCommand;
use wire::{Address, Counter, Fault, Value};

use super::{LASTING, LOAD_SCALE, OLD_AND_NEW, ONE_TICK_US, PLAIN, RECEIVE_STREAM, SERIAL_STREAM};
use crate::emulator::board::Injection::{self, Bus, DmaError, Line};
use crate::emulator::part::can::BusFault;
use crate::emulator::part::usart::LineFault;
use crate::product::scenario::ScenarioStep::{Flood, Garbage, Inject, Nmt, Set, Wait};
use crate::product::scenario::{Invalid, Reports, Scenario};

/// A fault of a line that is cleared after a while.
const LINE: Scenario = Scenario { lasts_ms: LASTING, ..PLAIN };

/// Rows in the order of the table.
#[rustfmt::skip]
pub(super) const ROWS: &[Scenario] = &[
    Scenario { name: "bus-shorted", what: "CAN lines shorted: bus-off",
        steps: |_| vec![Inject(Bus(BusFault::Shorted))], reports: Reports::Fault(Fault::CanBusOff), keeps_time: true,
        ..LINE },
    Scenario { name: "no-acknowledge", what: "no node acknowledges on CAN",
        steps: |_| vec![Inject(Bus(BusFault::NoAcknowledge))], reports: Reports::Fault(Fault::CanErrorPassive),
        keeps_time: true, ..LINE },
    Scenario { name: "bus-saturated", what: "CAN full of frames of higher priority",
        steps: |_| vec![Inject(Bus(BusFault::Saturated))], reports: Reports::Counter(Counter::CanDropped),
        keeps_time: true, ..LINE },
    Scenario { name: "uart-open", what: "serial line open: no reader",
        steps: |_| vec![Inject(Line(LineFault::Open))],
        note: "undetectable without flow control; the next whole frame is read", ..LINE },
    Scenario { name: "uart-break", what: "serial consumer without power: line held low",
        steps: |_| vec![Inject(Line(LineFault::Break))], reports: Reports::Fault(Fault::UartOverrun), ..LINE },
    Scenario { name: "uart-dma-error", what: "serial line: DMA error in the middle of each transfer",
        steps: |_| vec![Inject(DmaError(SERIAL_STREAM))], reports: Reports::Counter(Counter::UartDropped), ..LINE },
    Scenario { name: "uart-receive-dma-error",
        what: "serial line: receive DMA error in the second half of its buffer, during garbage",
        // The first error comes with byte 257, which is the last byte of variant 0.
        steps: |variant| vec![Inject(DmaError(RECEIVE_STREAM)), Garbage(257 + 450 * variant as u32)],
        variants: (0, 4, 1), kept: Some((LOAD_SCALE, [Value::F32(1.0), OLD_AND_NEW[0]])),
        reports: Reports::Counter(Counter::UartOverruns), note: "settings are answered again afterwards", ..LINE },
    Scenario { name: "uart-garbage", what: "20 000 bytes of garbage on the serial line",
        steps: |_| vec![Garbage(20_000)], reports: Reports::Counter(Counter::UartRefused), keeps_time: true, ..PLAIN },
    Scenario { name: "command-flood", what: "1000 requests over CAN and 500 over the serial line at once",
        steps: |_| vec![Flood(500)], reports: Reports::Counter(Counter::UartDropped), ..PLAIN },
    Scenario { name: "bus-dominant-at-set", what: "CAN lines shorted while the controller is reconfigured",
        steps: |_| vec![Inject(Bus(BusFault::Shorted)), Set(Address::new(index::CAN_BIT_RATE, 0), Value::U16(500)),
            Nmt(NmtCommand::ResetCommunication), Wait(250_000), Nmt(NmtCommand::StartRemoteNode)],
        reports: Reports::Any, ..LINE },
    Scenario { name: "flood-then-sensor", what: "a flood of requests, and 12 ms later the SPI data line stuck low",
        steps: |_| vec![Flood(500), Wait(12_000), Inject(Injection::Sensor(SensorFault::MisoStuckLow))],
        invalid: Invalid::UntilCleared, blind_us: 12_000 + ONE_TICK_US,
        reports: Reports::Fault(Fault::SensorWrongId), ..LINE },
    Scenario { name: "uart-flood-of-breaks", what: "serial line held low for 2 ms, every 10 ms",
        steps: |_| [Inject(Line(LineFault::Break)), Wait(2_000), Inject(Line(LineFault::None)), Wait(8_000)].repeat(20),
        reports: Reports::Fault(Fault::UartOverrun), ..LINE },
];
