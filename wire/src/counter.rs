//! Counters of the board: every loss is counted.

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
    /// Times the sensor was initialised again.
    SensorRestarts,
    /// CAN frames replaced by newer ones before they could be sent.
    CanDropped,
    /// Bus-off events of the CAN controller.
    CanBusOff,
    /// UART frames replaced by newer ones before they could be sent.
    UartDropped,
    /// Received UART frames that were rejected: CRC, coding, version, type or length.
    UartRefused,
    /// Bytes lost by the UART receiver.
    UartOverruns,
    /// Ticks whose work took longer than a tick.
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
    fn counters_are_independent() {
        let mut counters = Counters::default();
        for (i, counter) in Counter::ALL.into_iter().enumerate() {
            counters.add(counter, i as u32);
        }
        assert!(counters.to_array().into_iter().eq(0..COUNTERS as u32));
    }

    #[test]
    fn dropped_is_the_sum_of_can_and_uart() {
        let mut counters = Counters::default();
        for counter in Counter::ALL {
            counters.add(counter, 100);
        }
        assert_eq!(counters.dropped(), 200);
        counters.add(Counter::CanDropped, 3);
        counters.add(Counter::UartDropped, 4);
        assert_eq!(counters.dropped(), 207);
    }
}
