//! An IMU whose samples arrive one by one, such as on a topic of ROS 2. The estimates are computed here.
//!
//! The rate follows from the stamps in the first half second, unless it is given. Samples are held back until the rate is
//! known. From then on each sample becomes a row at once, like a contact that a foot sends. The samples are checked as a
//! recording is, after 5 s, 15 s and 45 s, and then once a minute.

use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;

use config::ParameterRefusal;
use estimator_core::any::AnyParams;
use estimator_core::{Gravity, Load, Timestamp, Validity};
use options::{Correction, Format, TableOptions};
use plausible::{Check, FindingKind};
use samples::estimate::Estimator;
use samples::{RecordedSample, imu_sample};

use crate::decode::ContactRow;
use crate::decode::row::CommonClock;
use crate::link::{Arrival, Arrived, Remark};
use crate::sample_times::{FoundTiming, Placed, SampleTimes, first_rate};
use crate::source::Playback;

/// Format by which the parameters are chosen, because the unit of a load is that of a message.
const FORMAT: Format = Format::Mcap;

/// Rate at which the parameters are checked before the first sample, Hz.
const USUAL_RATE: f32 = 1000.0;

/// Largest number of samples that are held back until the rate is known.
const MOST_HELD: usize = 1 << 14;

/// Times after the first sample at which the samples are checked, s, and the period after the last of them.
const CHECKS_S: [u64; 3] = [5, 15, 45];
const CHECKED_EACH_S: u64 = 60;

/// Duration of a check, s. Then a new one begins, because the memory of a check grows.
const CHECK_LASTS_S: u64 = 600;

/// Sample as it arrives.
#[derive(Clone, Copy, Debug)]
pub struct LiveSample {
    /// Time of the sample on the clock of its source, µs; `None` if the source gives none.
    pub stamp_us: Option<i64>,
    /// Part of the time that is lost by rounding to µs, ns.
    pub stamp_rest_ns: i16,
    /// Time of reception.
    pub received: Timestamp,
    /// Readings in the order of [`Axis::ALL`](estimator_core::Axis::ALL), in the units of the source; NaN if missing.
    pub readings: [f64; 6],
    /// Newest load on the foot, if known.
    pub load: Option<Load>,
}

/// An IMU whose samples arrive, with the estimator of its foot.
pub struct LiveImu {
    name: Arc<str>,
    line: Arc<str>,
    /// Units and scale of the readings.
    table: TableOptions,
    correction: Correction,
    params: AnyParams,
    gravity: Gravity,
    /// Rate that is given, Hz.
    given_rate: Option<f32>,
    state: State,
    /// Whether the newest row had a load.
    has_load: bool,
    /// Number of the next row, and number of restarts so far.
    sequence: u16,
    segment: u32,
    /// Samples that came out of order, and whether that was reported.
    out_of_order: u64,
    reported_order: bool,
    /// Kinds of findings that were reported.
    reported: BTreeSet<&'static str>,
    /// Whether the source has given a stamp.
    has_stamps: bool,
}

enum State {
    /// The rate is not known yet.
    Held(Vec<LiveSample>),
    Running(Box<Running>),
}

struct Running {
    estimator: Estimator,
    times: SampleTimes,
    check: Check,
    rate: f32,
    /// Time at which the check has begun, and number of checks so far.
    since_us: i64,
    checks: usize,
}

impl LiveImu {
    /// Creates the estimator of the foot `name`, received on `line`, with the settings of a recording that is played.
    ///
    /// # Errors
    /// A parameter is out of its range.
    pub fn new(
        name: Arc<str>,
        line: Arc<str>,
        playback: &Playback,
    ) -> Result<Self, ParameterRefusal> {
        let (options, settings) = (&playback.input_options, &playback.settings);
        let origins = settings.origins(&line);
        let params = settings.params_of(&[&*name], FORMAT);
        origins.check_effects(&params)?;
        let gravity = options.gravity.unwrap_or(Gravity::Included);
        // The rate of the samples is not known yet.
        let rate = options.sample_rate.unwrap_or(USUAL_RATE);
        Estimator::new(rate, gravity, &params).map_err(|error| origins.explain(&error))?;
        Ok(Self {
            correction: *options.correction_of(&[&*name]),
            table: options.table.clone(),
            params,
            gravity,
            given_rate: options.sample_rate,
            state: State::Held(Vec::new()),
            has_load: false,
            sequence: 0,
            segment: 0,
            out_of_order: 0,
            reported_order: false,
            reported: BTreeSet::new(),
            has_stamps: false,
            name,
            line,
        })
    }

    /// Returns the same IMU for another foot. Call it before a row of this IMU was made.
    ///
    /// # Errors
    /// A parameter of that foot is out of its range.
    pub fn renamed(self, name: Arc<str>, playback: &Playback) -> Result<Self, ParameterRefusal> {
        let new = Self::new(name, Arc::clone(&self.line), playback)?;
        Ok(Self { state: self.state, has_stamps: self.has_stamps, ..new })
    }

    /// Name of the foot.
    #[must_use]
    pub const fn name(&self) -> &Arc<str> {
        &self.name
    }

    /// Processes a sample; adds rows and remarks.
    pub fn take(&mut self, sample: LiveSample, arrivals: &mut VecDeque<Arrived>) {
        self.has_stamps |= sample.stamp_us.is_some();
        if self.has_stamps && sample.stamp_us.is_none() {
            // A sample without a stamp is left out, because its time of reception is on another clock than the stamps.
            return self.count_out_of_order(sample.received, arrivals);
        }
        match &mut self.state {
            State::Running(_) => self.estimate(&sample, arrivals),
            State::Held(held) => {
                held.push(sample);
                self.start_if_known(arrivals);
            }
        }
    }

    /// Begins the estimates if the rate is known.
    fn start_if_known(&mut self, arrivals: &mut VecDeque<Arrived>) {
        let State::Held(held) = &mut self.state else {
            return;
        };
        let rate = match self.given_rate {
            Some(rate) => Some((f64::from(rate), false)),
            None => first_rate(&held.iter().map(LiveSample::time_us).collect::<Vec<_>>()),
        };
        let Some((rate, jitters)) = rate else {
            if held.len() > MOST_HELD {
                held.clear();
            }
            return;
        };
        let held = std::mem::take(held);
        let Some(first) = held.first() else { return };
        let received = first.received;
        self.remark(received, Remark::Rate(Arc::clone(&self.name), rate as f32), arrivals);
        if self.gravity == Gravity::Removed {
            self.remark(received, Remark::NoGravity(Arc::clone(&self.name)), arrivals);
        }
        if jitters {
            self.remark(received, Remark::Smoothed(Arc::clone(&self.name)), arrivals);
        }
        if let Some(problem) = self.start(rate, jitters, first.time_us()) {
            self.remark(received, problem, arrivals);
        }
        for sample in &held {
            self.estimate(sample, arrivals);
        }
    }

    /// Starts an estimator at this rate, Hz, with the values that the previous estimator has learnt. Returns a remark
    /// if the rate is refused.
    fn start(&mut self, rate: f64, jitters: bool, first_us: i64) -> Option<Remark> {
        if let State::Running(before) = &self.state {
            self.params.params.learnt = Some(before.estimator.learnt());
            self.segment += 1;
        }
        let estimator = match Estimator::new(rate as f32, self.gravity, &self.params) {
            Ok(estimator) => estimator,
            // The rate or the window is out of range. Samples are held again, because they may come at another rate
            // later.
            Err(error) => {
                self.state = State::Held(Vec::new());
                return Some(Remark::Problem(format!("{}: {error}", self.name)));
            }
        };
        let mut times = SampleTimes::new(rate, first_us - 1);
        if jitters {
            times.smooth();
        }
        self.state = State::Running(Box::new(Running {
            estimator,
            times,
            check: self.new_check(rate as f32),
            rate: rate as f32,
            since_us: first_us,
            checks: 0,
        }));
        None
    }

    fn new_check(&self, rate: f32) -> Check {
        Check::new(rate, self.gravity).with_thresholds(self.params.params.load)
    }

    fn estimate(&mut self, sample: &LiveSample, arrivals: &mut VecDeque<Arrived>) {
        let State::Running(running) = &mut self.state else {
            return;
        };
        let (time_us, missing) = match running.times.place(sample.time_us()) {
            Placed::At { time_us, missing } => (time_us, missing),
            Placed::OutOfOrder => return self.count_out_of_order(sample.received, arrivals),
            Placed::SetBack => {
                let rate = f64::from(running.rate);
                self.remark(sample.received, Remark::SetBack(Arc::clone(&self.name)), arrivals);
                let problem = self.start(rate, false, sample.time_us());
                problem.into_iter().for_each(|problem| {
                    self.remark(sample.received, problem, arrivals);
                });
                (sample.time_us(), 0)
            }
        };
        let State::Running(running) = &mut self.state else {
            return;
        };
        let timestamp = Timestamp::from_micros(0u64.saturating_add_signed(time_us));
        let stamp = Timestamp::from_micros(0u64.saturating_add_signed(sample.time_us()));
        let readings = self.table.to_si(sample.readings);
        let measured = imu_sample(timestamp, readings, Validity::Valid);
        let sample_here = RecordedSample {
            imu: self.correction.corrected(measured),
            load: sample.load,
            label: None,
        };
        let estimate = running.estimator.update(&sample_here);
        running.check.add(&sample_here);
        let found = running.times.found();
        let load = sample.load.map(|Load(load)| load).filter(|load| load.is_finite());
        let had_load = std::mem::replace(&mut self.has_load, load.is_some());
        let row = ContactRow {
            received: Some(sample.received),
            // Consumers know a sample by its own stamp, even if the estimator has a smoothed time.
            common: Some((stamp, CommonClock::Header)),
            rest_ns: sample.stamp_rest_ns,
            missing: missing.into(),
            interface: Some(Arc::clone(&self.line)),
            foot: Some(Arc::clone(&self.name)),
            segment: self.segment,
            sequence: self.sequence,
            load: load.or(had_load.then_some(f32::NAN)),
            measured: (self.gravity == Gravity::Included).then_some(sample_here.imu),
            ..ContactRow::of_estimate(&estimate)
        };
        self.sequence = self.sequence.wrapping_add(1);
        arrivals.push_back((sample.received, Arrival::Estimate(Box::new(row))));
        match found {
            Some(FoundTiming::Jitter) => {
                self.remark(sample.received, Remark::Smoothed(Arc::clone(&self.name)), arrivals);
            }
            Some(FoundTiming::Rate(rate)) => {
                let remark = Remark::OtherRate(Arc::clone(&self.name), rate as f32);
                self.remark(sample.received, remark, arrivals);
                let problem = self.start(rate, false, time_us + 1);
                problem.into_iter().for_each(|problem| {
                    self.remark(sample.received, problem, arrivals);
                });
            }
            None => {}
        }
        self.check_if_due(time_us, sample.received, arrivals);
    }

    /// Reports new findings about the samples, if they are due to be checked.
    fn check_if_due(
        &mut self,
        time_us: i64,
        received: Timestamp,
        arrivals: &mut VecDeque<Arrived>,
    ) {
        let State::Running(running) = &mut self.state else {
            return;
        };
        let since_s = (time_us - running.since_us).max(0) as u64 / 1_000_000;
        let last_s = CHECKS_S[CHECKS_S.len() - 1];
        let due_s = CHECKS_S.get(running.checks).copied().unwrap_or_else(|| {
            last_s + CHECKED_EACH_S * (running.checks + 1 - CHECKS_S.len()) as u64
        });
        if since_s < due_s {
            return;
        }
        running.checks += 1;
        let findings = running.check.findings();
        if since_s >= CHECK_LASTS_S {
            (running.since_us, running.checks) = (time_us, 0);
            let rate = running.rate;
            let check = self.new_check(rate);
            if let State::Running(running) = &mut self.state {
                running.check = check;
            }
        }
        for finding in findings {
            let kind: FindingKind = finding.kind();
            if self.reported.insert(kind.name()) {
                let finding = finding.with_mounting(&self.correction.mounting);
                let remark = Remark::Implausible(Arc::clone(&self.name), finding);
                self.remark(received, remark, arrivals);
            }
        }
    }

    fn count_out_of_order(&mut self, received: Timestamp, arrivals: &mut VecDeque<Arrived>) {
        self.out_of_order += 1;
        if !std::mem::replace(&mut self.reported_order, true) {
            self.remark(received, Remark::OutOfOrder(Arc::clone(&self.name)), arrivals);
        }
    }

    fn remark(&self, at: Timestamp, remark: Remark, arrivals: &mut VecDeque<Arrived>) {
        arrivals.push_back((at, Arrival::Remark(remark)));
    }
}

impl LiveSample {
    /// Time of the sample, µs: its stamp, or without one its reception.
    fn time_us(&self) -> i64 {
        let received_us = i64::try_from(self.received.as_micros()).unwrap_or(i64::MAX);
        self.stamp_us.unwrap_or(received_us)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::params::STANDARD_GRAVITY;

    /// Rows and remarks of a foot that lies still, whose samples have these stamps; `None` for none. Samples are received
    /// 1 ms after they were taken.
    fn live(
        stamps: impl IntoIterator<Item = Option<i64>>,
        scale: f64,
    ) -> (Vec<ContactRow>, Vec<String>) {
        let mut imu = LiveImu::new("FL".into(), "/fl/imu".into(), &Playback::default()).unwrap();
        let mut arrivals = VecDeque::new();
        for (k, stamp_us) in (0_u64..).zip(stamps) {
            let received = Timestamp::from_micros(1_700_000_000_001_000 + 2500 * k);
            // Noise of a sensor.
            let noise = 0.01 * ((k * 7919 % 100) as f64 / 50.0 - 1.0);
            let up = scale * (f64::from(STANDARD_GRAVITY) + noise);
            let readings = [noise, -noise, up, 0.1 * noise, 0.2 * noise, -0.1 * noise];
            imu.take(
                LiveSample { stamp_us, stamp_rest_ns: 0, received, readings, load: None },
                &mut arrivals,
            );
        }
        let (mut rows, mut remarks) = (Vec::new(), Vec::new());
        for (_, arrival) in arrivals {
            match arrival {
                Arrival::Estimate(row) => rows.push(*row),
                Arrival::Remark(remark) => remarks.push(remark.to_string()),
                other => panic!("{other:?}"),
            }
        }
        (rows, remarks)
    }

    fn even(count: i64) -> impl Iterator<Item = Option<i64>> {
        (0..count).map(|k| Some(1_700_000_000_000_000 + 2500 * k))
    }

    #[test]
    fn every_sample_becomes_a_row_with_its_stamp() {
        let (rows, remarks) = live(even(800), 1.0);
        let stamps = rows.iter().map(|row| row.timestamp.as_micros() as i64);
        assert!(stamps.eq(even(800).flatten()));
        assert!(rows.iter().all(|row| row.common == Some((row.timestamp, CommonClock::Header))));
        assert_eq!(remarks, ["FL: 400 Hz"]);
        let last = rows.last().expect("a row");
        assert!(last.measured.is_some() && last.velocity_sigma.is_some());
    }

    #[test]
    fn samples_without_stamps_have_times_of_reception() {
        let (rows, remarks) = live((0..800).map(|_| None), 1.0);
        assert_eq!(rows.len(), 800);
        assert_eq!(rows[0].timestamp.as_micros(), 1_700_000_000_001_000);
        assert_eq!(remarks, ["FL: 400 Hz"]);
    }

    #[test]
    fn wrong_unit_is_found_while_samples_come() {
        let (_, remarks) = live(even(2100), 1.0 / f64::from(STANDARD_GRAVITY));
        let found = remarks.iter().filter(|remark| remark.contains("looks like g")).count();
        assert_eq!(found, 1, "{remarks:?}");
    }

    #[test]
    fn clock_that_is_set_back_begins_a_segment() {
        let back = even(800).map(|stamp| stamp.map(|us| us - 60_000_000));
        let (rows, remarks) = live(even(800).chain(back), 1.0);
        assert_eq!(rows.len(), 1600);
        assert_eq!((rows[799].segment, rows[800].segment), (0, 1));
        assert!(remarks[1].contains("set back"), "{remarks:?}");
    }

    #[test]
    fn lost_samples_are_counted_in_their_row() {
        let stamps = even(1000).enumerate().filter(|(k, _)| !(500..503).contains(k));
        let (rows, _) = live(stamps.map(|(_, stamp)| stamp), 1.0);
        let missing: i64 = rows.iter().map(|row| row.missing).sum();
        assert_eq!((rows.len(), missing), (997, 3));
    }
}
