//! Self-test of the sensor, which runs at a start of the foot if the settings enable it.

use std::time::Duration;

use estimator_core::Axis;
use thiserror::Error;
use wire::dictionary::index;
use wire::node::NmtCommand;
use wire::{Address, Emergency, Fault, Faults, Stage, Value};

use super::settings;
use super::{Client, RequestError};
use crate::remedy::FootHint;

/// Timeout of a start with self-test.
const START: Duration = Duration::from_secs(10);

/// Polling interval of the stage, shorter than a self-test.
const POLL_INTERVAL: Duration = Duration::from_millis(10);

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
    /// The sensor has not started, with these faults.
    #[error("the sensor has not started within {} s: {}", START.as_secs(), .0)]
    NotStarted(String),
    /// A request has failed.
    #[error(transparent)]
    Request(#[from] RequestError),
    /// The setting could not be restored.
    #[error("{0}; the self-test stays on at each start")]
    StaysOn(RequestError),
}

impl SelfTestError {
    /// Returns the remedy, if it depends on the program.
    #[must_use]
    pub const fn hint(&self) -> Option<FootHint> {
        match self {
            Self::StaysOn(_) => Some(FootHint::SwitchSelfTestOff),
            Self::Request(error) => error.hint(),
            Self::NotRun | Self::NotStarted(_) => None,
        }
    }
}

/// Runs the self-test. The foot is reset, must not move, and loses settings that are not stored. If the
/// self-test is disabled, it is enabled in the stored settings meanwhile.
///
/// # Errors
/// The self-test has no result.
pub fn run(client: &mut Client) -> Result<SelfTestResult, SelfTestError> {
    client.check_alone()?;
    let before = client.state()?;
    client.reset(None)?;
    let was_on = client.read_number(index::SELF_TEST, 0)? != 0;
    let mut stored = Ok(());
    if !was_on {
        client.write(SETTING, Value::U8(1))?;
        // An error is not returned yet, because the settings may be stored even if the response is missing.
        stored = settings::store(client);
    }
    let stored = stored.map_err(SelfTestError::from);
    let verdict = stored.and_then(|()| watched(client));
    if !was_on {
        switch_off(client).map_err(SelfTestError::StaysOn)?;
    }
    let resumed = client.bring_to(before);
    // A failed test is returned even if the foot does not resume.
    if !matches!(verdict, Ok(SelfTestResult::Failed(_)) | Err(_)) {
        resumed?;
    }
    verdict
}

/// Disables the self-test in the stored settings. Pauses the foot first: after a reset of its own it may stream, and
/// then refuses settings.
fn switch_off(client: &mut Client) -> Result<(), RequestError> {
    client.first_answer()?;
    client.command(NmtCommand::EnterPreOperational)?;
    client.write(SETTING, Value::U8(0))?;
    settings::store(client)
}

/// Object of the setting.
const SETTING: Address = Address::new(index::SELF_TEST, 0);

/// Resets the foot and watches it start.
fn watched(client: &mut Client) -> Result<SelfTestResult, SelfTestError> {
    client.take_emergencies();
    client.reset(None)?;
    let clock = client.clock();
    let end = clock.now() + START;
    let mut has_run = false;
    let mut faults = Faults::NONE;
    loop {
        let code = client.read_number(index::STAGE, 0)?;
        let now = Faults::from_bits(client.read_number(index::FAULTS, 0)?);
        now.iter().for_each(|fault| faults = faults.with(fault));
        match u8::try_from(code).ok().and_then(Stage::from_code) {
            Some(Stage::SelfTest) => has_run = true,
            Some(Stage::HoldStill | Stage::Running) => break,
            _ if clock.now() < end => {}
            _ => {
                let names: Vec<_> = now.iter().map(Fault::name).collect();
                return Err(SelfTestError::NotStarted(names.join(", ")));
            }
        }
        client.wait(POLL_INTERVAL)?;
    }
    client.wait(REPORT)?;
    let emergencies = client.take_emergencies();
    let is_of_test = |emergency: &&Emergency| emergency.code == Fault::SensorSelfTest.code();
    if let Some(emergency) = emergencies.iter().find(is_of_test) {
        let axes = Axis::ALL.into_iter().zip(0..);
        let failed = axes.filter(|(_, bit)| emergency.detail >> bit & 1 != 0);
        let failed = failed.map(|(axis, _)| axis).collect();
        return Ok(SelfTestResult::Failed(Some(failed)));
    }
    if faults.contains(Fault::SensorSelfTest) {
        Ok(SelfTestResult::Failed(None))
    } else if has_run {
        Ok(SelfTestResult::Passed)
    } else {
        Err(SelfTestError::NotRun)
    }
}
