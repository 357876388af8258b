//! The sensor's self-test: it runs at a start of the foot, where the settings say so.

use std::time::{Duration, Instant};

use estimator_core::Axis;
use thiserror::Error;
use wire::dictionary::index;
use wire::node::Command;
use wire::{Address, DataType, Emergency, Fault, Faults, Stage, Value};

use super::client::{Client, RequestError};
use super::settings;

/// How long the start of a foot may take, self-test and all.
const START: Duration = Duration::from_secs(10);

/// From one look at the stage to the next: a self-test takes longer.
const LOOK: Duration = Duration::from_millis(10);

/// How long the report of a fault may take after its tick.
const REPORT: Duration = Duration::from_millis(100);

/// What came of a self-test.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// All axes react as the data sheet says.
    Passed,
    /// Some do not; `None` where the foot does not say which, as on a serial line.
    Failed(Option<Vec<Axis>>),
}

/// Why there is no verdict.
#[derive(Debug, Error)]
pub enum SelfTestError {
    /// The foot started without it.
    #[error("the foot has started without a self-test: does its program have one?")]
    NotRun,
    /// The sensor did not start.
    #[error("the sensor has not started within {} s: {faults}", START.as_secs())]
    NotStarted {
        /// The faults that it has.
        faults: String,
    },
    /// A request came to nothing.
    #[error(transparent)]
    Request(#[from] RequestError),
    /// The setting could not be put back.
    #[error(
        "{0}; the self-test stays on at each start until footfall foot … set self_test_at_start=0 --save"
    )]
    StaysOn(RequestError),
}

/// Runs the self-test, for which the foot is reset and must not move; settings that are not stored are
/// lost. Where the settings do not have one at each start, they are stored with it and then without it.
///
/// # Errors
/// There is no verdict.
pub fn run(client: &mut Client) -> Result<Verdict, SelfTestError> {
    client.is_alone()?;
    let before = client.state()?;
    let setting = Address::new(index::SELF_TEST, 0);
    client.reset(None)?;
    let was_on = client.read(setting, DataType::Unsigned8)? != OFF;
    if !was_on {
        client.write(setting, ON)?;
        settings::store(client)?;
    }
    let verdict = watched(client);
    if !was_on {
        switch_off(client).map_err(SelfTestError::StaysOn)?;
    }
    client.bring_to(before)?;
    verdict
}

/// Stores that no self-test runs at a start. A foot that has started by itself meanwhile may stream, and takes no
/// settings then.
fn switch_off(client: &mut Client) -> Result<(), RequestError> {
    client.first_answer()?;
    client.command(Command::EnterPreOperational)?;
    client.write(Address::new(index::SELF_TEST, 0), OFF)?;
    settings::store(client)
}

const ON: Value = Value::U8(1);
const OFF: Value = Value::U8(0);

/// Resets the foot and watches it start.
fn watched(client: &mut Client) -> Result<Verdict, SelfTestError> {
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
        return Ok(Verdict::Failed(Some(
            failed.map(|(axis, _)| axis).collect(),
        )));
    }
    if faults.contains(Fault::SensorSelfTest) {
        return Ok(Verdict::Failed(None));
    }
    if !has_run {
        return Err(SelfTestError::NotRun);
    }
    Ok(Verdict::Passed)
}
