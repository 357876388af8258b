//! What the board counts: nothing is dropped in silence.

/// Something that is counted since power-up. Counters wrap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Counter {
    /// Ticks of the sampling loop.
    Ticks,
    /// Samples that were valid.
    ValidSamples,
    /// Samples with an axis at the end of its range.
    SaturatedSamples,
    /// Ticks without a fresh sample.
    MissedSamples,
    /// Times the sensor was initialised again.
    SensorRestarts,
    /// CAN frames that were replaced by newer ones before they could be sent.
    CanDropped,
    /// How often the CAN controller went bus-off.
    CanBusOff,
    /// UART frames that were replaced by newer ones before they could be sent.
    UartDropped,
    /// Received UART frames that were refused: CRC, coding, version, type or length.
    UartRefused,
    /// Bytes the UART receiver lost.
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

/// How many counters there are.
pub const COUNTERS: usize = Counter::ALL.len();

/// The state of every [`Counter`].
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

    /// One counter's value.
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

    /// Everything of the board's own that did not get onto the CAN or the UART.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.get(Counter::CanDropped)
            .wrapping_add(self.get(Counter::UartDropped))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_counter_counts_for_itself() {
        let mut counters = Counters::default();
        for (i, counter) in Counter::ALL.into_iter().enumerate() {
            counters.add(counter, i as u32);
        }
        assert!(counters.to_array().into_iter().eq(0..COUNTERS as u32));
    }

    #[test]
    fn what_was_dropped_is_dropped_on_either_way_and_nothing_else() {
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
