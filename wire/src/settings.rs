//! Values of all settings: the configuration, in the form in which it is stored.

use estimator_core::any::{AnyParams, Method};
use estimator_core::correction::AccelerometerCorrection;
use estimator_core::half_widths::{HalfWidthParams, WindowLength};
use estimator_core::mounting::{Mounting, MountingParams, SensorAxis};
use estimator_core::parameter::Parameter;
use estimator_core::{Learning, Learnt, Params, Quaternion, Stream, Vec3};

use crate::abort::AbortCode;
use crate::dictionary::{self, Address, Concern, Entry, OBJECTS, PDO_OFF, Place, SETTINGS, index};
use crate::foot::{Foot, NodeId};
use crate::pdo::{PDOS, Pdo};
use crate::value::{DataType, Value};

pub use crate::dictionary::WINDOW_CAPACITY;

/// Source of the load.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LoadSource {
    /// No load.
    #[default]
    None,
    /// The board's analog input.
    Analog,
    /// RPDO1.
    Can,
}

/// Load input: load = scale × (reading − offset).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoadInput {
    /// Source of the load.
    pub source: LoadSource,
    /// Scale, N per step of the analog reading.
    pub scale: f32,
    /// Offset: the analog reading without load.
    pub offset: f32,
}

/// Periods of the UART messages, ms, to the nearest tick; 0: never.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UartStreams {
    /// The contact.
    pub contact: u16,
    /// The raw sample.
    pub raw: u16,
    /// Health.
    pub health: u16,
}

/// Transmission trigger of a PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trigger {
    /// Never.
    Off,
    /// Every N ticks. A tick is 1 ms on each board with CAN.
    Ticks(u16),
    /// With every N-th SYNC.
    Sync(u8),
}

/// Slot of a setting. The compiler rejects an address without one.
macro_rules! slot {
    ($index:ident, $subindex:expr) => {
        const { dictionary::slot_of(index::$index, $subindex) }
    };
}

/// Storage format of a number of the estimator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum KeptAs {
    Real,
    Micros,
}

/// Numbers of the estimator that are settings, and the slots in which they are stored. The compiler builds the list,
/// and would report an index out of range.
#[allow(clippy::indexing_slicing)]
static PARAMETERS: [(Parameter, u8, KeptAs); Parameter::ALL.len()] = {
    let mut parameters = [(Parameter::DecisionThreshold, 0, KeptAs::Real); Parameter::ALL.len()];
    let (mut count, mut slot, mut i) = (0, 0, 0);
    while i < OBJECTS.len() {
        let entries = OBJECTS[i].entries;
        let mut j = 0;
        while j < entries.len() {
            let entry = &entries[j];
            if let Some(Concern::Parameter(parameter)) = entry.concern() {
                let kept_as = match entry.data_type() {
                    DataType::Unsigned32 => KeptAs::Micros,
                    _ => KeptAs::Real,
                };
                parameters[count] = (parameter, slot as u8, kept_as);
                count += 1;
            }
            slot += entry.is_setting() as usize;
            j += 1;
        }
        i += 1;
    }
    assert!(count == parameters.len() && slot <= 1 + u8::MAX as usize);
    parameters
};

/// Slots of the settings that trigger each PDO: identifier, transmission type, event timer.
#[allow(clippy::indexing_slicing)] // Evaluated by the compiler only.
const TRIGGERS: [[usize; 3]; PDOS] = {
    let mut slots = [[0; 3]; PDOS];
    let mut i = 0;
    while i < PDOS {
        let object = index::TPDO + i as u16;
        slots[i] = [
            dictionary::slot_of(object, 1),
            dictionary::slot_of(object, 2),
            dictionary::slot_of(object, 5),
        ];
        i += 1;
    }
    slots
};

/// Sub-indices of the version and of the CRC of the learnt values.
const LEARNT_VERSION: u8 = 6;
const LEARNT_CRC: u8 = 7;

/// Slots of the learnt values in the order of their stored form: version, numbers, CRC.
const LEARNT_SLOTS: [usize; Learnt::WORDS] = {
    let numbers = dictionary::slot_of(index::LEARNT, 1);
    [
        dictionary::slot_of(index::LEARNT, LEARNT_VERSION),
        numbers,
        numbers + 1,
        numbers + 2,
        numbers + 3,
        numbers + 4,
        dictionary::slot_of(index::LEARNT, LEARNT_CRC),
    ]
};

/// Values of all settings of the [dictionary]. They are always within limits and compatible with each other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settings {
    raw: [u32; SETTINGS],
}

impl Default for Settings {
    fn default() -> Self {
        let mut raw = [0; SETTINGS];
        for (raw, (_, entry)) in raw.iter_mut().zip(dictionary::settings()) {
            *raw = entry.default.to_raw();
        }
        Self { raw }
    }
}

impl Settings {
    /// Value of a setting; `None` if there is no setting at `address`. The identifier of a PDO is returned without the
    /// node id.
    #[must_use]
    pub fn get(&self, address: Address) -> Option<Value> {
        let (entry, slot) = find(address).ok()?;
        Value::from_raw(entry.data_type(), *self.raw.get(slot)?)
    }

    /// Changes a setting. On an error nothing changes.
    ///
    /// # Errors
    /// There is no setting at `address`, `value` has the wrong type, is outside the limits, or
    /// is incompatible with the other settings.
    pub fn set(&mut self, address: Address, value: Value) -> Result<(), AbortCode> {
        let mut candidate = self.clone();
        candidate.put(address, value)?;
        candidate.check()?;
        *self = candidate;
        Ok(())
    }

    /// Changes a setting within its own limits, without checking its compatibility with other settings.
    fn put(&mut self, address: Address, value: Value) -> Result<(), AbortCode> {
        let (entry, slot) = find(address)?;
        if value.data_type() != entry.data_type() {
            return Err(AbortCode::Length);
        }
        entry.limits().check(value)?;
        if entry.role == dictionary::Role::PdoCobId
            && value.to_raw() & !PDO_OFF != entry.default.to_raw()
        {
            return Err(AbortCode::InvalidValue);
        }
        *self.raw.get_mut(slot).ok_or(AbortCode::NoObject)? = value.to_raw();
        Ok(())
    }

    /// All settings and their values, to be stored. Restore them with [`Settings::set_all`]. [`Settings::set`] restores
    /// them one by one, in an order in which each is compatible with those before it.
    pub fn iter(&self) -> impl Iterator<Item = (Address, Value)> + '_ {
        dictionary::settings().zip(self.raw).filter_map(|((address, entry), raw)| {
            Some((address, Value::from_raw(entry.data_type(), raw)?))
        })
    }

    /// Hash of all values, each a word in the order of the dictionary: h ← (h rotated left by 5 ⊕ word) · 0x9E37 79B9
    /// modulo 2³², starting from 0. It does not protect against forgery.
    #[must_use]
    pub fn hash(&self) -> u32 {
        self.raw
            .iter()
            .fold(0, |hash: u32, raw| (hash.rotate_left(5) ^ raw).wrapping_mul(0x9E37_79B9))
    }

    /// Restores stored settings, in any order. Applies values that are still allowed, and defaults for the others. The
    /// second result is the number of values refused.
    pub fn set_all(stored: impl Iterator<Item = (Address, Value)>) -> (Self, usize) {
        let mut all = Self::default();
        let mut refused = 0;
        for (address, value) in stored {
            refused += usize::from(all.put(address, value).is_err());
        }
        if all.check().is_ok() {
            return (all, refused);
        }
        // Some are incompatible. So they are set one by one, and then again, because a later one may make an earlier one
        // compatible.
        let mut settings = Self::default();
        for _ in 0..2 {
            for (address, value) in all.iter() {
                // Refused values are counted below.
                let _ = settings.set(address, value);
            }
        }
        let values = settings.raw.iter().zip(&all.raw);
        refused += values.filter(|(taken, stored)| taken != stored).count();
        (settings, refused)
    }

    /// Position of the foot.
    #[must_use]
    pub fn foot(&self) -> Foot {
        Foot::from_code(self.u8(slot!(FOOT, 0))).unwrap_or_default()
    }

    /// Node id from the next reset on, by default that of the foot; `None`: wait for LSS.
    #[must_use]
    pub fn node_id(&self) -> Option<NodeId> {
        match self.u8(slot!(NODE_ID, 0)) {
            0 => Some(self.foot().default_node_id()),
            id => NodeId::new(id),
        }
    }

    /// CAN bit rate, bit/s.
    #[must_use]
    pub fn can_bit_rate(&self) -> u32 {
        u32::from(self.u16(slot!(CAN_BIT_RATE, 0))) * 1000
    }

    /// UART rate, baud.
    #[must_use]
    pub fn uart_rate(&self) -> u32 {
        self.value(slot!(UART_RATE, 0))
    }

    /// Timeout of a load over RPDO1, ms. It is a second at most, so that a robot that has stopped sending is noticed
    /// within a stance.
    #[must_use]
    pub fn load_timeout_ms(&self) -> u16 {
        self.u16(slot!(RPDO, 5))
    }

    /// Returns whether the node becomes operational without a command.
    #[must_use]
    pub fn autostart(&self) -> bool {
        self.u8(slot!(AUTOSTART, 0)) != 0
    }

    /// Returns whether the configuration is locked.
    #[must_use]
    pub fn is_locked(&self) -> bool {
        self.u8(slot!(LOCK, 0)) != 0
    }

    /// Log level: 0 nothing to 3 information.
    #[must_use]
    pub fn log_level(&self) -> u8 {
        self.u8(slot!(LOG_LEVEL, 0))
    }

    /// Returns whether the sensor's self-test runs at each start.
    #[must_use]
    pub fn self_test(&self) -> bool {
        self.u8(slot!(SELF_TEST, 0)) != 0
    }

    /// Heartbeat period, ms; 0: no heartbeat.
    #[must_use]
    pub fn heartbeat_ms(&self) -> u16 {
        self.u16(slot!(HEARTBEAT, 0))
    }

    /// Transmission trigger of a PDO.
    #[must_use]
    pub fn trigger(&self, pdo: Pdo) -> Trigger {
        let [id, transmission, period] = TRIGGERS.get(pdo as usize).copied().unwrap_or_default();
        if self.value(id) & PDO_OFF != 0 {
            return Trigger::Off;
        }
        match self.u8(transmission) {
            every @ 1..=240 => Trigger::Sync(every),
            _ => match self.u16(period) {
                0 => Trigger::Off,
                period => Trigger::Ticks(period),
            },
        }
    }

    /// Maximum bus load of the foot's own streams and heartbeat, bit/s. PDOs tied to SYNC are counted for 100 SYNCs a
    /// second.
    #[must_use]
    pub fn worst_load(&self) -> u32 {
        let pdos = Pdo::ALL.into_iter().map(|pdo| match self.trigger(pdo) {
            Trigger::Off => 0,
            Trigger::Ticks(period) => longest_frame(8) * 1000 / u32::from(period).max(1),
            Trigger::Sync(every) => longest_frame(8) * 100 / u32::from(every).max(1),
        });
        let heartbeat = longest_frame(1) * 1000;
        let heartbeat = heartbeat.checked_div(u32::from(self.heartbeat_ms()));
        pdos.sum::<u32>() + heartbeat.unwrap_or(0)
    }

    /// Periods of the UART messages.
    #[must_use]
    pub fn uart_streams(&self) -> UartStreams {
        UartStreams {
            contact: self.u16(slot!(UART_STREAMS, 1)),
            raw: self.u16(slot!(UART_STREAMS, 2)),
            health: self.u16(slot!(UART_STREAMS, 3)),
        }
    }

    /// Checks the conditions between settings: the parameters are consistent, the parts of the mounting are consistent,
    /// and the streams fit the bit rate.
    fn check(&self) -> Result<(), AbortCode> {
        let fits = self.worst_load() <= self.can_bit_rate() / 4 * 3;
        let valid = self.params().validate::<WINDOW_CAPACITY>(Stream::KILOHERTZ).is_ok()
            && self.mounting_params().validate().is_ok();
        (fits && valid).then_some(()).ok_or(AbortCode::Incompatible)
    }

    /// Source and scaling of the load.
    #[must_use]
    pub fn load_input(&self) -> LoadInput {
        LoadInput {
            source: match self.u8(slot!(LOAD_INPUT, 1)) {
                1 => LoadSource::Analog,
                2 => LoadSource::Can,
                _ => LoadSource::None,
            },
            scale: self.f32(slot!(LOAD_INPUT, 2)),
            offset: self.f32(slot!(LOAD_INPUT, 3)),
        }
    }

    /// Ratio of the accelerometer's full scales and sensitivities to those of an LSM6DSOX: 1, or 2 for an LSM6DSO32,
    /// which has the same registers and identity (LSM6DSO32 data sheet).
    #[must_use]
    pub fn accelerometer_range(&self) -> f32 {
        match self.u8(slot!(ACCELEROMETER, 7)) {
            0 => 1.0,
            _ => 2.0,
        }
    }

    /// Correction of the accelerometer, to be applied to the reading of an LSM6DSOX with the same codes. The
    /// [range](Self::accelerometer_range) is a power of two, so that this loses no bit.
    #[must_use]
    pub fn accelerometer(&self) -> AccelerometerCorrection {
        let range = self.accelerometer_range();
        AccelerometerCorrection {
            bias: self.vector(slot!(ACCELEROMETER, 1)) * (1.0 / range),
            scale: self.vector(slot!(ACCELEROMETER, 4)) * range,
        }
    }

    /// Orientation of the sensor's axes in the foot.
    #[must_use]
    pub fn mounting(&self) -> Mounting {
        self.mounting_params().validate().unwrap_or_default()
    }

    fn mounting_params(&self) -> MountingParams {
        let code = self.u16(slot!(MOUNTING, 1));
        if code == dictionary::AS_QUATERNION {
            let [w, x, y, z] = self.array(slot!(MOUNTING, 2));
            return MountingParams::Rotation(Quaternion { w, x, y, z });
        }
        let axis = |digit: u16| {
            let place = usize::from(digit % 10).wrapping_sub(1);
            SensorAxis::ALL.get(place).copied().unwrap_or_default()
        };
        MountingParams::Axes([axis(code / 100), axis(code / 10), axis(code)])
    }

    /// Source of the limits of stillness.
    #[must_use]
    pub fn method(&self) -> Method {
        match self.u8(slot!(ESTIMATION, 1)) {
            0 => Method::SelfCalibrating,
            _ => Method::HalfWidths,
        }
    }

    /// Returns whether learning continues.
    #[must_use]
    pub fn learning(&self) -> Learning {
        match self.u8(slot!(ESTIMATION, 2)) {
            0 => Learning::Frozen,
            _ => Learning::On,
        }
    }

    /// Learnt values with which the foot starts; `None` if there are none, if they have another version, or if they are
    /// damaged.
    #[must_use]
    pub fn learnt(&self) -> Option<Learnt> {
        Learnt::from_words(&LEARNT_SLOTS.map(|slot| self.value(slot))).ok()
    }

    /// Changes the learnt values with which the foot starts. On an error nothing changes.
    ///
    /// # Errors
    /// A number is outside its limits, or the numbers are incompatible.
    pub fn set_learnt(&mut self, learnt: Option<Learnt>) -> Result<(), AbortCode> {
        let mut candidate = self.clone();
        for (subindex, number) in (1..).zip(learnt.unwrap_or_default().to_array()) {
            candidate.put(Address::new(index::LEARNT, subindex), Value::F32(number))?;
        }
        let [version, crc] = learnt.map_or([0; 2], |learnt| [Learnt::VERSION, learnt.crc()]);
        candidate.put(Address::new(index::LEARNT, LEARNT_VERSION), Value::U32(version))?;
        candidate.put(Address::new(index::LEARNT, LEARNT_CRC), Value::U32(crc))?;
        candidate.check()?;
        *self = candidate;
        Ok(())
    }

    /// Parameters of the estimator.
    #[must_use]
    pub fn params(&self) -> AnyParams {
        let mut params = AnyParams {
            method: self.method(),
            params: Params { learning: self.learning(), learnt: self.learnt(), ..Params::DEFAULT },
            half_widths: HalfWidthParams {
                window: WindowLength::Duration(self.seconds(slot!(WINDOW, 0))),
                ..HalfWidthParams::DEFAULT
            },
        };
        for (parameter, slot, kept_as) in PARAMETERS {
            let value = match kept_as {
                KeptAs::Real => self.f32(usize::from(slot)),
                KeptAs::Micros => self.seconds(usize::from(slot)),
            };
            parameter.set(&mut params, value);
        }
        params
    }

    /// Vector with the first component in slot `first`.
    fn vector(&self, first: usize) -> Vec3 {
        let [x, y, z] = self.array(first);
        Vec3::new(x, y, z)
    }

    /// Numbers from slot `first` on.
    fn array<const N: usize>(&self, first: usize) -> [f32; N] {
        core::array::from_fn(|i| self.f32(first + i))
    }

    fn seconds(&self, slot: usize) -> f32 {
        self.value(slot) as f32 / 1.0e6
    }

    fn f32(&self, slot: usize) -> f32 {
        f32::from_bits(self.value(slot))
    }

    fn u16(&self, slot: usize) -> u16 {
        self.value(slot) as u16
    }

    fn u8(&self, slot: usize) -> u8 {
        self.value(slot) as u8
    }

    fn value(&self, slot: usize) -> u32 {
        self.raw.get(slot).copied().unwrap_or(0)
    }
}

/// Setting at an address, and its slot.
fn find(address: Address) -> Result<(&'static Entry, usize), AbortCode> {
    match dictionary::find(address)? {
        Place::Entry(entry, Some(slot)) => Ok((entry, slot)),
        Place::Entry(..) | Place::Highest(_) => Err(AbortCode::ReadOnly),
    }
}

/// Maximum length of a data frame of N bytes on the bus, bits.
///
/// The data and 34 other bits are subject to stuffing, which adds one bit for every four after the first. The 13 bits
/// of delimiters, acknowledgement, end of frame and the space between frames are not. (Davis, Burns, Bril, Lukkien:
/// *Controller Area Network (CAN) schedulability analysis*, 2007, equation 1.)
#[must_use]
pub const fn longest_frame(bytes: u32) -> u32 {
    8 * bytes + 13 + 34 + (34 + 8 * bytes - 1) / 4
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dictionary::Limits;

    /// Asserts that settings are restored from storage in both orders.
    #[track_caller]
    fn assert_restored(settings: &Settings) {
        let stored: std::vec::Vec<_> = settings.iter().collect();
        assert_eq!(Settings::set_all(stored.iter().copied()), (settings.clone(), 0));
        assert_eq!(Settings::set_all(stored.into_iter().rev()), (settings.clone(), 0));
    }

    #[test]
    fn defaults_are_those_of_the_estimator() {
        let settings = Settings::default();
        assert_eq!(settings.params(), AnyParams::DEFAULT);
        assert_eq!(settings.accelerometer(), AccelerometerCorrection::NONE);
        assert_eq!(settings.mounting(), Mounting::IDENTITY);
    }

    /// Settings with learnt classes as far apart as allowed, and load thresholds for on and off as high and
    /// as low as allowed: each number can then take any value.
    fn wide_settings() -> Settings {
        let mut settings = Settings::default();
        let learnt = Learnt {
            still: -4.6,
            moving: 6.0,
            speed: -5.0,
            still_seconds: 1.0,
            moving_seconds: 1.0,
        };
        assert_eq!(settings.set_learnt(Some(learnt)), Ok(()));
        for (subindex, value) in [(4, 1.0e9), (5, -1.0e9)] {
            let address = Address::new(index::LOAD_INPUT, subindex);
            assert_eq!(settings.set(address, Value::F32(value)), Ok(()));
        }
        settings
    }

    /// Changes a setting without a check, and gives learnt values the CRC that fits them.
    fn with_raw(base: &Settings, address: Address, value: Value) -> Settings {
        let (_, slot) = find(address).expect("a setting");
        let mut settings = base.clone();
        settings.raw[slot] = value.to_raw();
        let learnt = Learnt::from_array(settings.array(slot!(LEARNT, 1)));
        settings.raw[slot!(LEARNT, 7)] = learnt.crc();
        settings
    }

    #[test]
    fn parameter_limits_are_those_of_the_estimator() {
        let mut base = wide_settings();
        // The other method has no window.
        let method = Address::new(index::ESTIMATION, 1);
        assert_eq!(base.set(method, Value::U8(1)), Ok(()));
        let mut tried = 0;
        for (address, entry) in dictionary::settings() {
            let of_the_estimator = match entry.concern() {
                Some(Concern::Parameter(_)) => true,
                Some(Concern::Learnt) => address.subindex < LEARNT_VERSION,
                Some(Concern::Estimator) => address.index == index::WINDOW,
                _ => false,
            };
            if !of_the_estimator {
                continue;
            }
            tried += 1;
            let Limits::Range(low, high) = entry.limits() else {
                panic!("{address:?} has no range");
            };
            for value in [low, high] {
                assert_eq!(base.clone().set(address, value), Ok(()), "{address:?}");
                assert_eq!(with_raw(&base, address, value).check(), Ok(()), "{address:?}");
            }
            // The estimator rejects the next step as well, so no looser limit is possible.
            let outside = match (low, high) {
                (Value::F32(low), Value::F32(high)) => {
                    [Value::F32(low.next_down()), Value::F32(high.next_up())]
                }
                (Value::U32(low), Value::U32(high)) => {
                    [Value::U32(low.wrapping_sub(600)), Value::U32(high + 600)]
                }
                _ => panic!("{address:?} is not a number"),
            };
            for value in outside {
                let params = with_raw(&base, address, value).params();
                let refused = params.validate::<WINDOW_CAPACITY>(Stream::KILOHERTZ);
                assert!(refused.is_err(), "{address:?} may be {value:?}");
            }
        }
        assert_eq!(tried, Parameter::ALL.len() + Learnt::NUMBERS + 1);
    }

    #[test]
    fn every_parameter_is_a_setting() {
        let base = wide_settings();
        for parameter in Parameter::ALL {
            let is_its = |entry: &Entry| entry.concern() == Some(Concern::Parameter(parameter));
            let mut settings = dictionary::settings().filter(|(_, entry)| is_its(entry));
            let Some((address, entry)) = settings.next() else {
                panic!("{parameter:?} is no setting");
            };
            assert_eq!(settings.next(), None, "{parameter:?} is twice there");
            let Limits::Range(low, high) = entry.limits() else {
                panic!("{address:?} has no range");
            };
            for (value, expected) in [(low, parameter.row().least), (high, parameter.row().most)] {
                let mut settings = base.clone();
                assert_eq!(settings.set(address, value), Ok(()));
                let mut params = base.params();
                parameter.set(&mut params, expected);
                assert_eq!(settings.params(), params, "{parameter:?}");
            }
        }
    }

    #[test]
    fn objects_of_the_estimate_are_window_to_velocity() {
        for (address, entry) in dictionary::settings() {
            let concerns_the_estimate =
                !matches!(entry.concern(), Some(Concern::Node | Concern::Stream | Concern::Sensor));
            let is_there = (index::WINDOW..=index::VELOCITY).contains(&address.index);
            assert_eq!(concerns_the_estimate, is_there, "{address:?}");
        }
    }

    #[test]
    fn the_method_and_learning_are_switches() {
        let mut settings = Settings::default();
        for (subindex, value) in [(1, 1), (2, 0)] {
            let address = Address::new(index::ESTIMATION, subindex);
            assert_eq!(settings.set(address, Value::U8(value)), Ok(()));
        }
        let expected = AnyParams {
            method: Method::HalfWidths,
            params: Params { learning: Learning::Frozen, ..Params::DEFAULT },
            ..AnyParams::DEFAULT
        };
        assert_eq!(settings.params(), expected);
    }

    fn learnt() -> Learnt {
        Learnt::from_array([-1.0, 2.0, -4.5, 4.0, 3.0])
    }

    #[test]
    fn learnt_values_are_written_one_by_one_and_restored() {
        let mut settings = Settings::default();
        let numbers = learnt().to_array().map(Value::F32).into_iter();
        let seal = [Learnt::VERSION, learnt().crc()].map(Value::U32);
        for (subindex, value) in (1..).zip(numbers.chain(seal)) {
            assert_eq!(settings.learnt(), None, "{subindex}");
            let address = Address::new(index::LEARNT, subindex);
            assert_eq!(settings.set(address, value), Ok(()));
        }
        assert_eq!(settings.params().params.learnt, Some(learnt()));
        let mut at_once = Settings::default();
        assert_eq!(at_once.set_learnt(Some(learnt())), Ok(()));
        assert_eq!(at_once, settings);
        assert_restored(&settings);
        assert_eq!(settings.set_learnt(None), Ok(()));
        assert_eq!(settings, Settings::default());
    }

    #[test]
    fn hash_changes_with_each_setting_and_two_signs() {
        let default = Settings::default();
        let words = default.iter().map(|(_, value)| u64::from(value.to_raw()));
        let expected = words.fold(0, |hash: u64, word| {
            let rotated = (hash << 5) % (1 << 32) + (hash >> 27);
            (rotated ^ word) * 0x9E37_79B9 % (1 << 32)
        });
        assert_eq!(u64::from(default.hash()), expected);
        for pair in 1..SETTINGS {
            let mut settings = default.clone();
            settings.raw[pair - 1] ^= 1 << 31;
            settings.raw[pair] ^= 1 << 31;
            assert_ne!(settings.hash(), default.hash(), "{pair}");
        }
        for (slot, (address, _)) in dictionary::settings().enumerate() {
            for bit in [0, 1, 12, 31] {
                let mut settings = default.clone();
                settings.raw[slot] ^= 1 << bit;
                assert_ne!(settings.hash(), default.hash(), "{address:?}");
            }
        }
    }

    #[test]
    fn incompatible_learnt_values_are_refused() {
        let mut settings = Settings::default();
        assert_eq!(settings.set_learnt(Some(learnt())), Ok(()));
        let before = settings.clone();
        // Motion below stillness.
        let mut numbers = learnt().to_array();
        numbers[1] = -4.0;
        let swapped = settings.set_learnt(Some(Learnt::from_array(numbers)));
        assert_eq!(swapped, Err(AbortCode::Incompatible));
        numbers[1] = f32::NAN;
        let no_number = settings.set_learnt(Some(Learnt::from_array(numbers)));
        assert_eq!(no_number, Err(AbortCode::InvalidValue));
        assert_eq!(settings, before);
    }

    #[test]
    fn each_flipped_bit_of_learnt_values_makes_the_foot_learn_again() {
        let mut settings = Settings::default();
        assert_eq!(settings.set_learnt(Some(learnt())), Ok(()));
        for slot in LEARNT_SLOTS {
            for bit in 0..u32::BITS {
                let mut flipped = settings.clone();
                flipped.raw[slot] ^= 1 << bit;
                assert_eq!(flipped.learnt(), None, "bit {bit} of slot {slot}");
            }
        }
    }

    #[test]
    fn older_stored_settings_get_defaults_for_new_objects() {
        let mut settings = Settings::default();
        let window = Address::new(index::WINDOW, 0);
        assert_eq!(settings.set(window, Value::U32(40_000)), Ok(()));
        for newer in [
            index::ESTIMATION,
            index::ACCELEROMETER,
            index::LEARNT,
            index::MOUNTING,
            index::VELOCITY,
        ] {
            let older = settings.iter().filter(|(address, _)| address.index < newer);
            assert_eq!(Settings::set_all(older), (settings.clone(), 0));
        }
    }

    #[test]
    fn accelerometer_correction_maps_to_its_sub_indices() {
        let mut settings = Settings::default();
        for (subindex, value) in (1..).zip([0.1, -0.2, 0.3, 1.01, 0.98, 1.03]) {
            let address = Address::new(index::ACCELEROMETER, subindex);
            assert_eq!(settings.set(address, Value::F32(value)), Ok(()));
        }
        let expected = AccelerometerCorrection {
            bias: Vec3::new(0.1, -0.2, 0.3),
            scale: Vec3::new(1.01, 0.98, 1.03),
        };
        assert_eq!(settings.accelerometer(), expected);
        assert_eq!(settings.params(), AnyParams::DEFAULT);
    }

    #[test]
    fn other_part_has_twice_the_reading_before_its_correction() {
        let mut settings = Settings::default();
        let mut set = |subindex: u8, value: Value| {
            let address = Address::new(index::ACCELEROMETER, subindex);
            assert_eq!(settings.set(address, value), Ok(()));
        };
        (1..)
            .zip([0.1, -0.2, 0.3, 1.01, 0.98, 1.03])
            .for_each(|(subindex, value)| set(subindex, Value::F32(value)));
        let mut other = settings.clone();
        let part = Address::new(index::ACCELEROMETER, 7);
        assert_eq!(other.set(part, Value::U8(2)), Err(AbortCode::TooHigh));
        assert_eq!(other.set(part, Value::U8(1)), Ok(()));
        let reading = Vec3::new(1.7, -4.9, 78.1);
        assert_eq!(
            other.accelerometer().apply(estimator_core::SpecificForce(reading)),
            settings.accelerometer().apply(estimator_core::SpecificForce(reading * 2.0))
        );
        assert_eq!([&settings, &other].map(Settings::accelerometer_range), [1.0, 2.0]);
    }

    fn set_mounting(settings: &mut Settings, subindex: u8, value: Value) -> Result<(), AbortCode> {
        settings.set(Address::new(index::MOUNTING, subindex), value)
    }

    #[test]
    fn each_allowed_axes_code_is_a_distinct_mounting() {
        let mut mountings = std::vec::Vec::new();
        for code in 0..1000 {
            let mut settings = Settings::default();
            let Ok(()) = set_mounting(&mut settings, 1, Value::U16(code)) else {
                assert_eq!(settings, Settings::default());
                continue;
            };
            let mounting = settings.mounting();
            if let (MountingParams::Axes(axes), 1..) = (mounting.params(), code) {
                assert_eq!(dictionary::code_of_axes(axes), code);
                assert!(!mountings.contains(&mounting));
                mountings.push(mounting);
            }
        }
        assert_eq!(mountings.len(), 24);
        let mut settings = Settings::default();
        assert_eq!(set_mounting(&mut settings, 1, Value::U16(162)), Ok(()));
        let turned = MountingParams::Axes([SensorAxis::X, SensorAxis::MinusZ, SensorAxis::Y]);
        assert_eq!(settings.mounting().params(), turned);
        // Left-handed, and with an axis twice.
        for wrong in [132, 113, 999] {
            let refused = set_mounting(&mut settings, 1, Value::U16(wrong));
            assert_eq!(refused, Err(AbortCode::InvalidValue), "{wrong}");
        }
    }

    #[test]
    fn a_quaternion_is_written_by_component_and_then_selected() {
        let mut settings = Settings::default();
        for (subindex, part) in (2..).zip([0.8, 0.0, -0.6, 0.0]) {
            assert_eq!(set_mounting(&mut settings, subindex, Value::F32(part)), Ok(()));
            assert_eq!(settings.mounting(), Mounting::IDENTITY);
        }
        assert_eq!(set_mounting(&mut settings, 1, Value::U16(0)), Ok(()));
        let turned = MountingParams::Rotation(Quaternion { w: 0.8, x: 0.0, y: -0.6, z: 0.0 });
        assert_eq!(settings.mounting().params(), turned);
        // From now on the components of the quaternion must be compatible.
        let before = settings.clone();
        for (wrong, code) in [
            (0.7, AbortCode::Incompatible),
            (1.1, AbortCode::TooHigh),
            (-1.1, AbortCode::TooLow),
            (f32::NAN, AbortCode::InvalidValue),
        ] {
            assert_eq!(set_mounting(&mut settings, 2, Value::F32(wrong)), Err(code), "{wrong}");
        }
        assert_eq!(settings, before);
        assert_eq!(set_mounting(&mut settings, 1, Value::U16(123)), Ok(()));
        assert_eq!(set_mounting(&mut settings, 2, Value::F32(0.7)), Ok(()));
        let chosen = set_mounting(&mut settings, 1, Value::U16(0));
        assert_eq!(chosen, Err(AbortCode::Incompatible));
        assert_restored(&before);
    }

    #[test]
    fn a_refused_value_changes_nothing() {
        let mut settings = Settings::default();
        let threshold = Address::new(index::DECISION, 1);
        assert_eq!(settings.set(threshold, Value::F32(1.5)), Err(AbortCode::TooHigh));
        assert_eq!(settings.set(threshold, Value::U8(0)), Err(AbortCode::Length));
        let off = Address::new(index::LOAD_INPUT, 5);
        assert_eq!(settings.set(off, Value::F32(12.5)), Err(AbortCode::Incompatible));
        let device = Address::new(index::DEVICE_TYPE, 0);
        assert_eq!(settings.set(device, Value::U32(1)), Err(AbortCode::ReadOnly));
        assert_eq!(settings, Settings::default());
    }

    #[test]
    fn stored_settings_are_restored_in_any_order() {
        let mut settings = Settings::default();
        for (address, value) in [
            (Address::new(index::LOAD_INPUT, 4), Value::F32(2.0e3)),
            (Address::new(index::LOAD_INPUT, 5), Value::F32(1.0e3)),
            (Address::new(index::FOOT, 0), Value::U8(4)),
        ] {
            assert_eq!(settings.set(address, value), Ok(()));
        }
        // In the opposite order, the thresholds cross in between.
        assert_restored(&settings);
    }

    #[test]
    fn stored_values_no_longer_allowed_are_refused() {
        let stored = [
            (Address::new(index::FOOT, 0), Value::U8(99)),
            (Address::new(0x2FFF, 0), Value::U8(1)),
            (Address::new(index::LOG_LEVEL, 0), Value::U8(1)),
        ];
        let (settings, refused) = Settings::set_all(stored.into_iter());
        assert_eq!(refused, 2);
        assert_eq!((settings.foot(), settings.log_level()), (Foot::FrontLeft, 1));
    }

    #[test]
    fn each_foot_has_its_own_default_node_id() {
        let mut settings = Settings::default();
        for foot in Foot::ALL {
            let address = Address::new(index::FOOT, 0);
            assert_eq!(settings.set(address, Value::U8(foot.code())), Ok(()));
            assert_eq!(settings.node_id(), Some(foot.default_node_id()));
        }
        let id = Address::new(index::NODE_ID, 0);
        for (set, expected) in [(0x33, NodeId::new(0x33)), (255, None)] {
            assert_eq!(settings.set(id, Value::U8(set)), Ok(()));
            assert_eq!(settings.node_id(), expected);
        }
    }

    #[test]
    fn streams_that_exceed_the_bit_rate_are_refused() {
        let rate = Address::new(index::CAN_BIT_RATE, 0);
        let timer = |pdo: Pdo| Address::new(index::TPDO + pdo as u16, 5);
        let mut settings = Settings::default();
        assert_eq!(longest_frame(8), 135);
        // 1211 frames and two heartbeats a second.
        assert_eq!(settings.worst_load(), 135 * 1211 + 2 * longest_frame(1));
        // Fifty frames a second become 25, with every fourth of 100 SYNCs.
        let mut tied = settings.clone();
        let kind = Address::new(index::TPDO + Pdo::Axes as u16, 2);
        let before = tied.worst_load();
        assert_eq!(tied.set(kind, Value::U8(4)), Ok(()));
        assert_eq!(tied.worst_load() + 135 * 50, before + 135 * 25);
        for (bit_rate, result) in
            [(500, Ok(())), (250, Ok(())), (125, Err(AbortCode::Incompatible))]
        {
            assert_eq!(settings.set(rate, Value::U16(bit_rate)), result);
        }
        assert_eq!(settings.can_bit_rate(), 250_000);
        let faster = settings.set(timer(Pdo::Axes), Value::U16(2));
        assert_eq!(faster, Err(AbortCode::Incompatible));
        assert_eq!(settings.set(timer(Pdo::Contact), Value::U16(5)), Ok(()));
        assert_eq!(settings.set(rate, Value::U16(125)), Ok(()));
        assert_restored(&settings);
        // Only incompatible values are refused.
        let stored = [(rate, Value::U16(125)), (Address::new(index::LOG_LEVEL, 0), Value::U8(1))];
        let (settings, refused) = Settings::set_all(stored.into_iter());
        assert_eq!((settings.can_bit_rate(), refused), (1_000_000, 1));
        assert_eq!(settings.log_level(), 1);
    }

    #[test]
    fn an_event_timer_of_0_sends_nothing() {
        let mut settings = Settings::default();
        let timer = Address::new(index::TPDO, 5);
        assert_eq!(settings.set(timer, Value::U16(0)), Ok(()));
        assert_eq!(settings.trigger(Pdo::Contact), Trigger::Off);
    }

    #[test]
    fn a_pdo_can_be_switched_off_but_not_moved() {
        let mut settings = Settings::default();
        let address = Address::new(index::TPDO, 1);
        assert_eq!(settings.trigger(Pdo::Contact), Trigger::Ticks(1));
        assert_eq!(settings.set(address, Value::U32(0x4000_0181)), Err(AbortCode::InvalidValue));
        assert_eq!(settings.set(address, Value::U32(0xC000_0180)), Ok(()));
        assert_eq!(settings.trigger(Pdo::Contact), Trigger::Off);
    }
}
