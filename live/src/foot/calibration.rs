//! What the foot has learnt while it walked: looked at, kept over power-off, and forgotten.

use wire::dictionary::index;
use wire::node::{Calibration, CalibrationState};
use wire::pdo::{BIAS_STEP, Quantity};
use wire::{Address, DataType, Value};

use super::Named;
use super::client::{Client, RequestError};
use super::settings;

/// The object's part that takes commands, and that of the state.
const COMMAND: u8 = 1;
const STATE: u8 = 2;

/// The first of the parts that are numbers.
const FIRST: u8 = 3;

/// How far the foot is.
///
/// # Errors
/// A request came to nothing.
pub fn state(client: &mut Client) -> Result<CalibrationState, RequestError> {
    let address = Address::new(index::CALIBRATION, STATE);
    let code = client.read(address, DataType::Unsigned8)?.to_raw();
    let state = u8::try_from(code)
        .ok()
        .and_then(CalibrationState::from_code);
    state.ok_or(RequestError::Unknown {
        what: "the state of the calibration",
        code,
    })
}

/// What the foot has learnt as it is now, each number with its name and unit.
///
/// # Errors
/// A request came to nothing.
pub fn numbers(client: &mut Client) -> Result<Vec<(Named, f32)>, RequestError> {
    read(client, |named| {
        named.address.index == index::CALIBRATION && named.address.subindex >= FIRST
    })
}

/// What the foot has kept of that, which it starts with, each number with its name and unit.
///
/// # Errors
/// A request came to nothing.
pub fn kept(client: &mut Client) -> Result<Vec<(Named, f32)>, RequestError> {
    read(client, |named| {
        named.address.index == index::LEARNT && named.address.subindex > 0
    })
}

/// The bias of the gyroscope along each axis, rad/s.
///
/// # Errors
/// A request came to nothing.
pub fn gyroscope_bias_rad_s(client: &mut Client) -> Result<[Option<f32>; 3], RequestError> {
    let mut bias = [None; 3];
    for (subindex, bias) in (1..).zip(&mut bias) {
        let part = Address::new(index::BIAS, subindex);
        if let Value::I16(code) = client.read(part, DataType::Integer16)? {
            let rate = Quantity(code).value(BIAS_STEP);
            *bias = rate.is_finite().then_some(rate);
        }
    }
    Ok(bias)
}

/// The correction of the accelerometer: bias along each axis, m/s², then scale.
///
/// # Errors
/// A request came to nothing.
pub fn correction(client: &mut Client) -> Result<Vec<(Named, f32)>, RequestError> {
    read(client, |named| {
        named.address.index == index::ACCELEROMETER && named.address.subindex > 0
    })
}

fn read(
    client: &mut Client,
    is_wanted: impl Fn(&Named) -> bool,
) -> Result<Vec<(Named, f32)>, RequestError> {
    let mut numbers = Vec::new();
    for named in Named::all().filter(is_wanted) {
        if let Value::F32(number) = client.read(named.address, named.entry.data_type())? {
            numbers.push((named, number));
        }
    }
    Ok(numbers)
}

/// Has the foot keep what it has learnt, or forget it, and store that. The foot does not stream meanwhile.
///
/// # Errors
/// The foot refuses it, as while it is settling, or does not answer.
pub fn store(client: &mut Client, command: Calibration) -> Result<(), RequestError> {
    let address = Address::new(index::CALIBRATION, COMMAND);
    settings::while_paused(client, |client| {
        client.write(address, Value::U8(command.code()))?;
        settings::store(client)
    })
}
