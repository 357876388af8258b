//! Self-test of the sensor, which runs at a start of the foot if the settings enable it.

use std::time::{Duration, Instant};

use estimator_core::Axis;
use thiserror::Error;
use wire::dictionary::index;
use wire::node::Command;
use wire::{Address, DataType, Emergency, Fault, Faults, Stage, Value};

use super::client::{Client, RequestError};
use super::settings;

/// Timeout of a start with self-test.
const START: Duration = Duration::from_secs(10);

/// Polling interval of the stage, shorter than a self-test.
const LOOK: Duration = Duration::from_millis(10);

/// Maximum delay of a fault's report after its tick.
const REPORT: Duration = Duration::from_millis(100);

/// Result of a self-test.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SelfTestResult {
    /// All axes react within the limits of the data sheet.
    Passed,
    /// Some axes have failed; `None` if the foot does not report which, as on a serial line.
    Failed(Option<Vec<Axis>>),
}

/// Error of a self-test.
#[derive(Debug, Error)]
pub enum SelfTestError {
    /// The foot has started without a self-test.
    #[error("the foot has started without a self-test: does its program have one?")]
    NotRun,
    /// The sensor has not started.
    #[error("the sensor has not started within {} s: {faults}", START.as_secs())]
    NotStarted {
        /// Active faults.
        faults: String,
    },
    /// A request has failed.
    #[error(transparent)]
    Request(#[from] RequestError),
    /// The setting could not be restored.
    #[error(
        "{0}; the self-test stays on at each start until footfall foot … set self_test_at_start=0 --save"
    )]
    StaysOn(RequestError),
}

/// Runs the self-test. The foot is reset, must not move, and loses settings that are not stored. If the
/// self-test is disabled, it is enabled in the stored settings meanwhile.
///
/// # Errors
/// The self-test has no result.
pub fn run(client: &mut Client) -> Result<SelfTestResult, SelfTestError> {
    client.is_alone()?;
    let before = client.state()?;
    let setting = Address::new(index::SELF_TEST, 0);
    client.reset(None)?;
    let was_on = client.read(setting, DataType::Unsigned8)? != OFF;
    if !was_on {
        client.write(setting, ON)?;
    }
    // Without an answer, settings may be stored nevertheless.
    let stored = match was_on {
        true => Ok(()),
        false => settings::store(client),
    };
    let verdict = match stored {
        Ok(()) => watched(client),
        Err(error) => Err(error.into()),
    };
    if !was_on {
        switch_off(client).map_err(SelfTestError::StaysOn)?;
    }
    let resumed = client.bring_to(before);
    // A failed test counts, also of a foot that does not resume.
    if !matches!(verdict, Ok(SelfTestResult::Failed(_)) | Err(_)) {
        resumed?;
    }
    verdict
}

/// Disables the self-test in the stored settings. The foot is paused first: after a reset of its own it may
/// stream, and then refuses settings.
fn switch_off(client: &mut Client) -> Result<(), RequestError> {
    client.first_answer()?;
    client.command(Command::EnterPreOperational)?;
    client.write(Address::new(index::SELF_TEST, 0), OFF)?;
    settings::store(client)
}

const ON: Value = Value::U8(1);
const OFF: Value = Value::U8(0);

/// Resets the foot and watches it start.
fn watched(client: &mut Client) -> Result<SelfTestResult, SelfTestError> {
    client.take_emergencies();
    client.reset(None)?;
    let end = Instant::now() + START;
    let mut has_run = false;
    let mut faults = Faults::NONE;
    loop {
        let code = client.read(Address::new(index::STAGE, 0), DataType::Unsigned8)?;
        let bits = client.read(Address::new(index::FAULTS, 0), DataType::Unsigned32)?;
        let now = Faults::from_bits(bits.to_raw());
        now.iter().for_each(|fault| faults = faults.with(fault));
        match u8::try_from(code.to_raw()).ok().and_then(Stage::from_code) {
            Some(Stage::SelfTest) => has_run = true,
            Some(Stage::HoldStill | Stage::Running) => break,
            _ if Instant::now() < end => {}
            _ => {
                let names: Vec<_> = now.iter().map(Fault::name).collect();
                let faults = names.join(", ");
                return Err(SelfTestError::NotStarted { faults });
            }
        }
        client.wait(LOOK)?;
    }
    client.wait(REPORT)?;
    let emergencies = client.take_emergencies();
    let is_of_test = |emergency: &&Emergency| emergency.code == Fault::SensorSelfTest.code();
    let detail = emergencies
        .iter()
        .find(is_of_test)
        .map(|emergency| emergency.detail);
    if let Some(bits) = detail {
        let failed = Axis::ALL
            .into_iter()
            .zip(0..)
            .filter(|(_, bit)| bits >> bit & 1 != 0);
        return Ok(SelfTestResult::Failed(Some(
            failed.map(|(axis, _)| axis).collect(),
        )));
    }
    if faults.contains(Fault::SensorSelfTest) {
        return Ok(SelfTestResult::Failed(None));
    }
    if !has_run {
        return Err(SelfTestError::NotRun);
    }
    Ok(SelfTestResult::Passed)
}
