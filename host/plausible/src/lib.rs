//! Checks a recording for what cannot be right: wrong units, gravity included or removed, a sensor on its side,
//! mirrored or exchanged axes, dead or stuck sensors, clock jumps, too few samples. No finding is an error by itself,
//! and the findings about a foot that never rests may be wrong.
//!
//! | finding | file |
//! |---|---|
//! | names, conditions, texts and remedies of all | [`finding`] |
//! | samples whose axes are no numbers | `not_numbers` |
//! | unit of the accelerations, gravity, the axis that is up | `gravity`, by the reading at rest: [`rest`] |
//! | accelerometer and gyroscope exchanged | `exchanged_sensors` |
//! | mirrored axes, axes that differ between accelerometer and gyroscope | `sensor_axes` |
//! | readings of several feet that alternate | `mixed_feet` |
//! | unit of the rates | `rate_unit` |
//! | a dead gyroscope or axis, a frozen sensor, held readings | `dead_gyroscope`, `dead_axis`, `frozen_sensor`, `held_readings` |
//! | a clock that jumps, rows in batches | `clock` |
//! | loads and their thresholds | `loads` |
//! | too few samples in a window | `low_rate` |

mod clock;
mod dead_axis;
mod dead_gyroscope;
mod exchanged_sensors;
pub mod finding;
#[cfg(test)]
mod fixtures;
mod frozen_sensor;
mod gravity;
mod held_readings;
pub mod limits;
mod loads;
mod low_rate;
mod mixed_feet;
mod not_numbers;
mod rate_unit;
pub mod rest;
mod sensor_axes;

use estimator_core::Gravity;
use estimator_core::params::LoadParams;
use samples::{RecordedSample, Recording};

use clock::ClockCheck;
use dead_axis::DeadAxisCheck;
use dead_gyroscope::DeadCheck;
use exchanged_sensors::ExchangeCheck;
use frozen_sensor::FrozenCheck;
use gravity::{check_gravity, check_up};
use held_readings::HeldCheck;
use loads::LoadCheck;
use low_rate::low_rate;
use mixed_feet::MixedFeetCheck;
use not_numbers::NotNumbersCheck;
use rate_unit::RateCheck;
use rest::{Rest, RestSearch};
use sensor_axes::{Axes, AxesCheck};

pub use finding::{Finding, FindingKind};
pub use limits::{LARGEST_RATE, LARGEST_REST, LOWEST_RATE};
pub use rest::gravity_at_rest;

/// Returns the findings about a recording in SI units.
#[must_use]
pub fn check(recording: &Recording) -> Vec<Finding> {
    check_with(recording, Check::new(recording.sample_rate, recording.gravity))
}

/// Returns the findings about a recording in SI units, and about its loads with these thresholds.
#[must_use]
pub fn check_with_load(recording: &Recording, thresholds: LoadParams) -> Vec<Finding> {
    let check = Check::new(recording.sample_rate, recording.gravity);
    check_with(recording, check.with_thresholds(thresholds))
}

fn check_with(recording: &Recording, mut check: Check) -> Vec<Finding> {
    for sample in &recording.samples {
        check.add(sample);
    }
    check.findings()
}

/// Checks a recording sample by sample; memory grows by a thousandth of its length.
pub struct Check {
    sample_rate: f32,
    gravity: Gravity,
    not_numbers: NotNumbersCheck,
    rest: RestSearch,
    exchanged: ExchangeCheck,
    axes: AxesCheck,
    mixed: MixedFeetCheck,
    dead_axes: DeadAxisCheck,
    rates: RateCheck,
    dead: DeadCheck,
    frozen: FrozenCheck,
    clock: ClockCheck,
    held: HeldCheck,
    loads: LoadCheck,
    /// Thresholds of the load, if they are checked.
    thresholds: Option<LoadParams>,
}

impl Check {
    /// Checks a recording at `sample_rate` in Hz, with its gravity as declared.
    #[must_use]
    pub fn new(sample_rate: f32, gravity: Gravity) -> Self {
        Self {
            sample_rate,
            gravity,
            not_numbers: NotNumbersCheck::default(),
            rest: RestSearch::new(sample_rate),
            exchanged: ExchangeCheck::new(sample_rate),
            axes: AxesCheck::new(sample_rate),
            mixed: MixedFeetCheck::default(),
            dead_axes: DeadAxisCheck::default(),
            rates: RateCheck::new(sample_rate),
            dead: DeadCheck::default(),
            frozen: FrozenCheck::default(),
            clock: ClockCheck::default(),
            held: HeldCheck::default(),
            loads: LoadCheck::default(),
            thresholds: None,
        }
    }

    /// Checks the loads against these thresholds, too.
    #[must_use]
    pub fn with_thresholds(self, thresholds: LoadParams) -> Self {
        Self { thresholds: Some(thresholds), ..self }
    }

    /// Processes the next sample.
    pub fn add(&mut self, sample: &RecordedSample) {
        self.rest.add(sample);
        self.exchanged.add(sample);
        self.axes.add(sample);
        self.mixed.add(sample);
        self.dead_axes.add(sample);
        self.not_numbers.add(sample);
        self.rates.add(sample);
        self.dead.add(sample);
        self.frozen.add(sample);
        self.clock.add(sample.imu.timestamp);
        self.held.add(sample);
        self.loads.add(sample);
    }

    /// Returns the findings about all samples.
    #[must_use]
    pub fn findings(&self) -> Vec<Finding> {
        let rest = self.rest.rest();
        let mut findings = Vec::from_iter(rest.as_ref().and_then(|rest| self.check_axes(rest)));
        // If the feet have different axes, the mean at rest is less than gravity. In another unit it is more.
        let is_in_unit = rest.is_none_or(|rest| rest.size < LARGEST_REST);
        if self.gravity == Gravity::Included && is_in_unit {
            findings.extend(self.mixed.finding());
        }
        findings.extend(self.not_numbers.finding());
        findings.extend(self.rates.finding());
        findings.extend(self.dead.finding());
        findings.extend(self.dead_axes.findings());
        findings.extend(self.frozen.finding());
        findings.extend(self.clock.findings());
        findings.extend(self.held.finding(self.sample_rate));
        findings.extend(self.thresholds.and_then(|thresholds| self.loads.finding(&thresholds)));
        findings.extend(low_rate(self.sample_rate));
        findings
    }

    /// Finding about gravity and the axes.
    fn check_axes(&self, rest: &Rest) -> Option<Finding> {
        let exchanged = self.exchanged.finding(rest, self.gravity);
        if exchanged.is_some() {
            return exchanged;
        }
        let found = check_gravity(rest, self.gravity);
        let is_of_axes = matches!(found, None | Some(Finding::GravityNotAlongZ { .. }));
        // Axes are not judged if the rates are in another unit or an axis is dead, because the judgement integrates the rates.
        let is_judged =
            self.rates.finding().is_none() && self.dead_axes.findings().next().is_none();
        if !is_of_axes || self.gravity != Gravity::Included || !is_judged {
            return found;
        }
        match self.axes.axes() {
            Some(Axes::Mirrored) => {
                Some(Finding::LeftHanded { up: check_up(rest.mean).unwrap_or("z") })
            }
            // This replaces a finding about the mounting, which can be judged only once the axes agree.
            Some(Axes::Different(gyroscope)) => Some(Finding::DifferentAxes { gyroscope }),
            None => found,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use estimator_core::Vec3;

    use fixtures::{found, pitching, walk, with_both, with_force};

    #[test]
    fn walk_has_no_finding() {
        assert_eq!(found(&walk()), [""; 0]);
    }

    #[test]
    fn axes_are_not_judged_if_one_is_dead() {
        let mut mirrored = with_both(pitching(), |v| Vec3::new(-v.x, v.y, v.z));
        assert_eq!(found(&mirrored), ["left_handed"]);
        for sample in &mut mirrored.samples {
            sample.imu.angular_rate.0.x = 0.0;
        }
        assert_eq!(found(&mirrored), ["dead_axis"]);
    }

    #[test]
    fn recording_without_valid_samples_has_no_other_finding() {
        let mut recording = with_force(|_| Vec3::new(f32::NAN, 0.0, 0.0));
        assert_eq!(found(&recording), ["not_numbers"]);
        recording.samples.clear();
        assert_eq!(found(&recording), [""; 0]);
    }
}
