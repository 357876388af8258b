//! Measurements of board and sensor that need no person.

use std::time::Duration;

use wire::dictionary::index;
use wire::pdo::{Quantity, TEMPERATURE_STEP};
use wire::{Address, DataType, Fault, Faults, Value};

use super::{AcceptStep, Figure, Person, StepFigures, figure};
use crate::foot::self_test::{self, SelfTestError, SelfTestResult};
use crate::foot::{Client, RequestError};

/// Part of the hardware name of boards on USB that carry the sensor.
pub(super) const NANO: &str = "Nano RP2040";

/// Parts of the hardware names of all boards on USB.
const ON_USB: [&str; 2] = [NANO, "Feather RP2350"];

/// Polling interval of a value that the foot may not have yet.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

/// Number of attempts for a temperature, and for the depth of the stack.
const TEMPERATURE_POLLS: u32 = 30;
const STACK_POLLS: u32 = 300;

/// Reads faults, the last crash, the brown-out level, the temperature, and the costs that the board measures.
pub(super) fn measure(client: &mut Client) -> StepFigures {
    let faults = of_faults(faults(client)?);
    let crash = client.read_number(index::LAST_CRASH, 1)?;
    let level = if hardware(client)?.contains("STM32F405") {
        figure::BROWN_OUT.measured(f64::from(client.read_number(index::SUPPLY, 1)?))
    } else {
        figure::BROWN_OUT.not_tested("the foot's chip has none to set")
    };
    let period_us = tick_us(client)? as f64;
    let temperature = temperature_celsius(client)?;
    let limits =
        [(&figure::TO_MAILBOX, 1.0), (&figure::TO_END, 100.0 / period_us), (&figure::STACK, 1.0)];
    let (mut costs, mut looks) = (Vec::new(), 1);
    for (subindex, (limit, unit)) in (1..).zip(limits) {
        let cost = poll(client, looks, |client| {
            let cost = client.read_number(index::COSTS, subindex)?;
            Ok((cost != 0).then_some(cost))
        });
        costs.push(match cost {
            Ok(None) => limit.not_tested("the foot is simulated, lacks CAN, or has just started"),
            Ok(Some(cost)) => {
                // A foot that measures times also measures the stack, from ten seconds after its start.
                looks = STACK_POLLS;
                limit.measured(f64::from(cost) * unit)
            }
            Err(error) => return Err(error),
        });
    }
    let crash_name = match crash {
        0 => String::new(),
        code => format!("0x{code:04X}"),
    };
    let mut figures = vec![
        faults,
        figure::CRASH.measured(f64::from(crash)).with(crash_name),
        level,
        match temperature {
            Some(celsius) => figure::TEMPERATURE.measured(celsius),
            None => figure::TEMPERATURE.failed("the foot has none: its sensor is faulty"),
        },
    ];
    figures.extend(costs);
    Ok(figures)
}

/// Reads the active faults as bits. On a serial line it leaves out the faults of CAN, because a CAN bus may be absent.
pub(super) fn faults(client: &mut Client) -> Result<u32, RequestError> {
    let bits: u32 = client.read_number(index::FAULTS, 0)?;
    let of_can = Faults::NONE.with(Fault::CanErrorPassive).with(Fault::CanBusOff);
    Ok(if client.node().is_some() { bits } else { bits & !of_can.bits() })
}

/// Returns the figure of active faults: their number and names, including faults that this version does not know.
pub(super) fn of_faults(bits: u32) -> Figure {
    let faults = Faults::from_bits(bits);
    let mut names: Vec<_> = faults.iter().map(|fault| fault.name().to_owned()).collect();
    let unknown = bits & !faults.bits();
    if unknown != 0 {
        names.push(format!("0x{unknown:08X}, which this version does not know"));
    }
    figure::FAULTS.measured(f64::from(bits.count_ones())).with(names.join(", "))
}

/// Reads the name of the hardware.
pub(super) fn hardware(client: &mut Client) -> Result<String, RequestError> {
    client.read_text(Address::new(index::HARDWARE_VERSION, 0))
}

/// Reads the period of the foot's ticks, µs.
pub(super) fn tick_us(client: &mut Client) -> Result<u64, RequestError> {
    let period_us: u32 = client.read_number(index::COSTS, 4)?;
    Ok(u64::from(period_us.max(1)))
}

/// Reads a value up to `looks` times until the foot has one; `None` if it never has.
fn poll<T>(
    client: &mut Client,
    looks: u32,
    mut read: impl FnMut(&mut Client) -> Result<Option<T>, RequestError>,
) -> Result<Option<T>, RequestError> {
    for look in 0..looks {
        if look > 0 {
            client.wait(POLL_INTERVAL)?;
        }
        if let Some(value) = read(client)? {
            return Ok(Some(value));
        }
    }
    Ok(None)
}

/// Reads the temperature of the sensor, °C. It is unknown until the attitude is initialised; `None` if it stays unknown.
fn temperature_celsius(client: &mut Client) -> Result<Option<f64>, RequestError> {
    poll(client, TEMPERATURE_POLLS, |client| {
        let read = client.read(Address::new(index::TEMPERATURE, 0), DataType::Integer16)?;
        let Value::I16(code) = read else {
            return Ok(None);
        };
        let celsius = f64::from(Quantity(code).value(TEMPERATURE_STEP));
        Ok(celsius.is_finite().then_some(celsius))
    })
}

/// Runs the sensor's self-test.
pub(super) fn test_sensor(client: &mut Client, person: &mut Person) -> StepFigures<SelfTestError> {
    let hardware = hardware(client)?;
    if ON_USB.iter().any(|board| hardware.contains(board)) {
        let reason =
            "its reset takes the USB port away: set self_test_at_start=1, and plug it in again";
        return Ok(AcceptStep::SelfTest.not_tested(reason));
    }
    (person.tell)(
        "put the foot down, and do not touch it: the sensor tests itself, and the board starts again",
    );
    let figure = match self_test::run(client)? {
        SelfTestResult::Passed => figure::SELF_TEST.measured(0.0),
        SelfTestResult::Failed(Some(axes)) => {
            let names: Vec<_> = axes.iter().map(|axis| axis.name()).collect();
            figure::SELF_TEST.counted(axes.len()).with(names.join(", "))
        }
        SelfTestResult::Failed(None) => {
            let detail = "the failed axes are reported only over CAN".to_owned();
            figure::SELF_TEST.measured(f64::NAN).with(detail)
        }
    };
    debug_assert_eq!(figure.limit.step, AcceptStep::SelfTest);
    Ok(vec![figure])
}
