//! State of the board in health messages: its stage, counters that include every loss, and the budget of its latency.

/// Limit of the time from the sensor's data-ready edge to the contact in its CAN mailbox, µs. It applies to an hour
/// under full load, and to each accepted board. It is about twice the longest time measured on the virtual board, whose
/// times have an error of up to 25 %.
pub const EDGE_TO_MAILBOX_US: u32 = 300;

/// Stage of the board, as reported in health messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Stage {
    /// Finding and configuring the sensor.
    #[default]
    Starting,
    /// Running the sensor's self-test.
    SelfTest,
    /// Finding up. The foot must be held still.
    HoldStill,
    /// Estimating.
    Running,
    /// Initialising the sensor again after it has failed.
    Recovering,
}

impl Stage {
    /// All stages, in the order of their codes, from 0.
    pub const ALL: [Self; 5] =
        [Self::Starting, Self::SelfTest, Self::HoldStill, Self::Running, Self::Recovering];

    /// The stage's name as written in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Starting => "starting",
            Self::SelfTest => "self_test",
            Self::HoldStill => "hold_still",
            Self::Running => "running",
            Self::Recovering => "recovering",
        }
    }

    /// The stage's code on the wire.
    #[must_use]
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// The stage with this code.
    #[must_use]
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|stage| stage.code() == code)
    }
}

/// Counter since power-up. Counters wrap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Counter {
    /// Ticks of the sampling loop.
    Ticks,
    /// Valid samples.
    ValidSamples,
    /// Samples with an axis at the end of its range.
    SaturatedSamples,
    /// Ticks without a fresh sample.
    MissedSamples,
    /// Restarts of the sensor.
    SensorRestarts,
    /// CAN frames replaced by newer ones before they could be sent, and process data withdrawn because the bus did not
    /// take them within 20 ms.
    CanDropped,
    /// Bus-off events of the CAN controller.
    CanBusOff,
    /// UART frames replaced by newer ones before they could be sent, or not taken by the line.
    UartDropped,
    /// Received UART frames that were rejected: CRC, coding, version, type or length.
    UartRefused,
    /// Bytes lost by the UART receiver.
    UartOverruns,
    /// Ticks missed because the work before them took too long.
    LateTicks,
}

impl Counter {
    /// All counters, in the order in which they are written.
    pub const ALL: [Self; 11] = [
        Self::Ticks,
        Self::ValidSamples,
        Self::SaturatedSamples,
        Self::MissedSamples,
        Self::SensorRestarts,
        Self::CanDropped,
        Self::CanBusOff,
        Self::UartDropped,
        Self::UartRefused,
        Self::UartOverruns,
        Self::LateTicks,
    ];

    /// The counter's name as written in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ticks => "ticks",
            Self::ValidSamples => "valid_samples",
            Self::SaturatedSamples => "saturated_samples",
            Self::MissedSamples => "missed_samples",
            Self::SensorRestarts => "sensor_restarts",
            Self::CanDropped => "can_dropped",
            Self::CanBusOff => "can_bus_off",
            Self::UartDropped => "uart_dropped",
            Self::UartRefused => "uart_refused",
            Self::UartOverruns => "uart_overruns",
            Self::LateTicks => "late_ticks",
        }
    }
}

/// Number of counters.
pub const COUNTERS: usize = Counter::ALL.len();

/// Values of every [`Counter`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters([u32; COUNTERS]);

impl Counters {
    /// Counters from their values, in the order of [`Counter::ALL`].
    #[must_use]
    pub const fn from_array(values: [u32; COUNTERS]) -> Self {
        Self(values)
    }

    /// The values in the order of [`Counter::ALL`].
    #[must_use]
    pub const fn to_array(self) -> [u32; COUNTERS] {
        self.0
    }

    /// Value of a counter.
    #[must_use]
    pub fn get(&self, counter: Counter) -> u32 {
        self.0.get(counter as usize).copied().unwrap_or(0)
    }

    /// Adds to a counter.
    pub fn add(&mut self, counter: Counter, count: u32) {
        if let Some(value) = self.0.get_mut(counter as usize) {
            *value = value.wrapping_add(count);
        }
    }

    /// Number of the board's own frames that were dropped on CAN and UART.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.get(Counter::CanDropped).wrapping_add(self.get(Counter::UartDropped))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_have_unique_codes_and_names() {
        for (code, stage) in (0..).zip(Stage::ALL) {
            assert_eq!(stage.code(), code);
            assert_eq!(Stage::from_code(code), Some(stage));
            let same = Stage::ALL.into_iter().filter(|s| s.name() == stage.name());
            assert_eq!(same.count(), 1, "{stage:?}");
        }
        assert_eq!(Stage::from_code(Stage::ALL.len() as u8), None);
    }

    #[test]
    fn counters_are_independent() {
        let mut counters = Counters::default();
        for (i, counter) in Counter::ALL.into_iter().enumerate() {
            counters.add(counter, i as u32);
        }
        assert!(counters.to_array().into_iter().eq(0..COUNTERS as u32));
    }
}
