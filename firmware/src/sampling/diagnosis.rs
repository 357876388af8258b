//! Diagnosis of sensor faults: one register is read back each tick, and all of them after bad ticks.

use estimator_core::Timestamp;
use lsm6dsox::{AsyncBus, Config, Error, SetSpiClock};
use wire::Fault;

use super::fault::SensorFault;
use super::sensor::Sensor;
use super::watch::SampleIssue;

/// Index of the last register of the configuration: a data rate.
const LAST_WRITE: usize = Config::WRITES - 1;

/// Ticks for reading back every register of the configuration once.
pub const READ_BACK_TICKS: usize = 2 * LAST_WRITE;

const _: () = assert!(READ_BACK_TICKS == 44);

impl<BUS: AsyncBus + SetSpiClock> Sensor<BUS> {
    /// Reads back in turns: the identity with a data rate, which a failed sensor loses first, and one other
    /// register of the configuration. A difference counts once it has been read twice; one that is not read again is a misread. If the identity reads
    /// as that of a line at rest it does not count: such a sensor gives no samples either, and the
    /// bad ticks raise the fault.
    pub(super) async fn read_back_one_register(&mut self, now: Timestamp) -> Option<SensorFault> {
        let turn = self.watch.turn;
        let write = match turn % 2 {
            0 => None,
            _ => self.driver.config().write(turn / 2 % LAST_WRITE),
        };
        for misreads in 0..2 {
            let result = match write {
                None => self.driver.check_identity_and_rate().await,
                Some(write) => self.driver.check(write).await,
            };
            if result.is_ok() {
                if misreads > 0 {
                    self.misreads = self.misreads.wrapping_add(misreads);
                    self.count_bus_error();
                }
                return None;
            }
        }
        match self.driver.check_identity().await {
            Err(Error::Identity { read: 0x00 | 0xFF }) => None,
            _ => Some(self.diagnose(SampleIssue::Stale, now).await),
        }
    }

    /// Finds the cause of bad ticks: the identity first, then every register, then the issue itself.
    pub(super) async fn diagnose(&mut self, issue: SampleIssue, now: Timestamp) -> SensorFault {
        let silent_us = self.watch.last_good.and_then(|good| now.micros_since(good));
        let silent_us = silent_us.map_or(u32::MAX, |us| us.min(u64::from(u32::MAX)) as u32);
        let silence = SensorFault::new(Fault::SensorSilent, silent_us);
        let timing = SensorFault::new(Fault::SensorTiming, self.watch.bad_ticks);
        let without_edge = self.watch.without_edge;
        match self.driver.check_identity().await {
            // A line at rest and no edges: no part, or one that is still booting.
            Err(Error::Identity { read: 0x00 | 0xFF }) if without_edge >= 2 => return silence,
            Err(error) => return self.fault_of(&error),
            Ok(()) => {}
        }
        if let Err(error) = self.driver.verify().await {
            return self.fault_of(&error);
        }
        match issue {
            SampleIssue::Repeat => SensorFault::new(Fault::SensorFrozen, self.watch.frozen_axes()),
            SampleIssue::Unannounced if without_edge >= 2 => {
                self.watch.read_by_timer();
                silence
            }
            SampleIssue::Unannounced if self.watch.has_lost_edges() => {
                self.watch.read_by_timer();
                timing
            }
            SampleIssue::Edge if without_edge >= 3 => silence,
            SampleIssue::Edge
            | SampleIssue::Unannounced
            | SampleIssue::Rate
            | SampleIssue::Stale
            | SampleIssue::Unproven => timing,
            SampleIssue::Status(read) => {
                self.fault_of(&Error::Status { register: lsm6dsox::register::STATUS_REG, read })
            }
            SampleIssue::Bus => silence,
        }
    }

    pub(super) fn fault_of(&self, error: &Error<BUS::Error>) -> SensorFault {
        let registers =
            |address: u8, written: u8, read: u8| u32::from_le_bytes([address, written, read, 0]);
        match *error {
            Error::Identity { read } => SensorFault::new(Fault::SensorWrongId, u32::from(read)),
            Error::ReadBack { register, read, .. } if register.agree(read, register.reset) => {
                SensorFault::new(Fault::SensorReset, self.watch.bad_ticks)
            }
            Error::ReadBack { register, written, read } => SensorFault::new(
                Fault::SensorConfigMismatch,
                registers(register.address, written, read),
            ),
            Error::Status { register, read } => {
                SensorFault::new(Fault::SensorConfigMismatch, registers(register.address, 0, read))
            }
            Error::ResetTimeout { written, read } => SensorFault::new(
                Fault::SensorConfigMismatch,
                registers(lsm6dsox::register::CTRL3_C.address, written, read),
            ),
            Error::Bus(_) | Error::DataReadyTimeout { .. } | Error::Unconfigured => {
                SensorFault::new(Fault::SensorSilent, u32::MAX)
            }
        }
    }
}
