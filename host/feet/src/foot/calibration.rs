//! Calibration that the foot has learnt while walking: read, stored and erased.

use estimator_core::mounting::{Mounting, MountingParams, SensorAxis};
use estimator_core::{Learnt, Quaternion};
use wire::dictionary::index;
use wire::node::{Calibration, CalibrationState};
use wire::pdo::{BIAS_STEP, Quantity};
use wire::{Address, DataType, Value};

use super::Named;
use super::settings;
use super::{Client, RequestError};

/// Subindices of the command and the state.
const COMMAND: u8 = 1;
const STATE: u8 = 2;

/// Reads the state of the calibration.
///
/// # Errors
/// A request has failed.
pub fn state(client: &mut Client) -> Result<CalibrationState, RequestError> {
    let code = client.read_number(index::CALIBRATION, STATE)?;
    let state = u8::try_from(code).ok();
    let state = state.and_then(CalibrationState::from_code);
    state.ok_or(RequestError::Unknown { what: "the state of the calibration", code })
}

/// Reads the values that the foot has learnt so far.
///
/// # Errors
/// A request has failed.
pub fn learnt(client: &mut Client) -> Result<Learnt, RequestError> {
    let mut learnt = [0.0; Learnt::NUMBERS];
    for (number, (_, read)) in learnt.iter_mut().zip(numbers(client, index::CALIBRATION)?) {
        *number = read;
    }
    Ok(Learnt::from_array(learnt))
}

/// Reads the mounting of the foot's sensor.
///
/// # Errors
/// A request has failed, or the values are not a valid mounting.
pub fn mounting(client: &mut Client) -> Result<Mounting, RequestError> {
    let code = client.read_number(index::MOUNTING, 1)?;
    let axis = |digit: u32| SensorAxis::ALL.get((digit as usize).wrapping_sub(1)).copied();
    let params = match [axis(code / 100), axis(code / 10 % 10), axis(code % 10)] {
        [Some(x), Some(y), Some(z)] => MountingParams::Axes([x, y, z]),
        _ => {
            let mut parts = [0.0; 4];
            for (part, (_, read)) in parts.iter_mut().zip(numbers(client, index::MOUNTING)?) {
                *part = read;
            }
            let [w, x, y, z] = parts;
            MountingParams::Rotation(Quaternion { w, x, y, z })
        }
    };
    params.validate().map_err(|_| RequestError::Unknown { what: "the mounting", code })
}

/// Reads the bias of the gyroscope along each axis, rad/s; `None` if it is not finite.
///
/// # Errors
/// A request has failed.
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

/// Reads the parts of an object that are REAL32, such as the numbers of a calibration.
///
/// # Errors
/// A request has failed.
pub fn numbers(client: &mut Client, index: u16) -> Result<Vec<(Named, f32)>, RequestError> {
    let mut numbers = Vec::new();
    let is_wanted =
        |named: &Named| named.address.index == index && named.entry.data_type() == DataType::Real32;
    for named in Named::all().filter(is_wanted) {
        if let Value::F32(number) = client.read(named.address, DataType::Real32)? {
            numbers.push((named, number));
        }
    }
    Ok(numbers)
}

/// Makes the foot keep or forget its calibration, and stores the result. The foot does not stream meanwhile.
///
/// # Errors
/// The foot refuses the command, for example while it is settling, or does not respond.
pub fn store(client: &mut Client, command: Calibration) -> Result<(), RequestError> {
    let address = Address::new(index::CALIBRATION, COMMAND);
    settings::while_paused(client, |client| {
        client.write(address, Value::U8(command.code()))?;
        settings::store(client)
    })
}
