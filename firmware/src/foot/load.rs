//! Load on the foot: from the analog input, over CAN, or unknown.

use core::ops::RangeInclusive;

use estimator_core::Load;
use wire::Fault;
use wire::settings::LoadSource;

use super::Foot;
use crate::ports::Ports;
use crate::supervision::Hysteresis;

/// Readings of the load input in which it is connected; at the ends of the 12-bit range it is
/// open or shorted.
pub const LOAD_READINGS: RangeInclusive<u16> = 16..=4079;

/// Ticks after which the input counts as open, and as connected again.
pub(super) const OPEN: Hysteresis = Hysteresis::new(10, 100);

impl Foot {
    /// Current load on the foot, if it is known.
    pub(super) fn load(&mut self, reading: Option<u16>, ports: &Ports) -> Option<Load> {
        let input = self.settings().load_input();
        let analog = (input.source == LoadSource::Analog).then_some(reading);
        let open = analog.is_some_and(|reading| {
            !reading.is_some_and(|reading| LOAD_READINGS.contains(&reading))
        });
        if self.load_open.update(open) {
            let detail = reading.map_or(u32::MAX, u32::from);
            self.raise(Fault::LoadSensorOpen, detail, ports);
            return None;
        }
        self.clear(Fault::LoadSensorOpen, ports);
        match input.source {
            LoadSource::None => None,
            LoadSource::Analog => {
                let reading = reading.filter(|_| !open)?;
                Some(Load(input.scale * (f32::from(reading) - input.offset)))
            }
            LoadSource::Can => self.node.load().map(Into::into),
        }
    }
}
