//! A foot at rest: rate, validity, noise, bias, and the counters of the board during the measurement.

use std::time::Duration;

use estimator_core::Decision;
use wire::dictionary::index;
use wire::{Counter, Counters};

use super::board::tick_us;
use super::figure::{self, Figure};
use super::motion::{FootMotion, Moment, MotionSource, watch};
use super::motion::{RestDetector, Statistics};
use super::{AcceptStep, Person, StepFigures};
use crate::foot::calibration::gyroscope_bias_rad_s;
use crate::foot::{Client, RequestError};

/// Time from rest to the measurement, in which the probability rises, and duration of the measurement.
const RISE: Duration = Duration::from_secs(1);
const MEASURE: Duration = Duration::from_secs(5);

/// Contacts of a foot.
#[derive(Default)]
struct ContactStatistics {
    count: usize,
    /// Times of the first and the newest, µs.
    span_us: Option<(u64, u64)>,
    missing: i64,
    valid: usize,
    stable: usize,
    samples: SampleTimes,
}

/// Times between samples, each at one of the sensor's data-ready edges.
#[derive(Clone, Copy, Default)]
struct SampleTimes {
    newest_us: Option<u64>,
    /// Number and sum, µs, of the times with k edges.
    spans: [(u64, u64); 10],
}

impl SampleTimes {
    /// Nominal period of the edges, µs.
    const PERIOD_US: u64 = 150;
    /// Longest time between samples in which edges are counted, µs. At longer times, an edge rate that is 5 % off would
    /// make an error of half a period or more, so that edges are miscounted.
    const LONGEST_US: u64 = 1_400;
    /// Largest mean error of the times with k edges, µs.
    const OFF_US: f64 = 8.0;

    fn take(&mut self, at_us: u64) {
        let before = self.newest_us.replace(at_us);
        let span_us = before.and_then(|before| at_us.checked_sub(before));
        if let Some(span_us @ 1..=Self::LONGEST_US) = span_us {
            let (count, sum_us) =
                &mut self.spans[((span_us + Self::PERIOD_US / 2) / Self::PERIOD_US) as usize];
            *count += 1;
            *sum_us += span_us;
        }
    }

    /// Returns the figure of the rate of the edges, which is not tested if there were too few edges.
    fn figure(self) -> Figure {
        let spans = (0_u64..).zip(self.spans).filter(|(_, (count, _))| *count > 0);
        let edges: u64 = spans.clone().map(|(k, (count, _))| k * count).sum();
        if edges <= 5_000 {
            return figure::DATA_RATE.not_tested("contacts are not sent each millisecond");
        }
        let all_us: u64 = spans.clone().map(|(_, (_, sum_us))| sum_us).sum();
        let period_us = all_us as f64 / edges as f64;
        // The numbers of edges have a common divisor if the edges have another rate, or if a timer triggers the reading of
        // samples.
        let divisor = spans.clone().fold(0, |divisor, (k, _)| greatest_divisor(divisor, k));
        let is_off = |(k, (count, sum_us)): (u64, (u64, u64))| {
            let mean_us = sum_us as f64 / count as f64;
            50 * k * count > edges && (mean_us - k as f64 * period_us).abs() > Self::OFF_US
        };
        if divisor != 1 || spans.clone().any(is_off) {
            return figure::DATA_RATE.failed("the times of the samples are not those of its edges");
        }
        figure::DATA_RATE.measured(1.0e6 / period_us)
    }
}

fn greatest_divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { greatest_divisor(b, a % b) }
}

/// Measures a foot that lies still.
pub(super) fn measure(client: &mut Client, person: &mut Person) -> StepFigures {
    let (patience, tell, has_left) = person.parts();
    tell("put the foot down level, and do not touch it for ten seconds");
    let period_us = contact_period_us(client)?;
    let mut stillness = RestDetector::default();
    let rest = watch(client, has_left, patience, |moment| match moment {
        Moment::Motion(motion) => stillness.take(motion),
        _ => None,
    })?;
    if rest.is_none() {
        let reason = format!("the foot was not at rest within {} s", patience.as_secs());
        return Ok(AcceptStep::Still.failed(&reason));
    }
    client.wait(RISE)?;
    let before = counters(client)?;
    let mut contacts = ContactStatistics::default();
    let mut motions: Vec<FootMotion> = Vec::new();
    watch(client, has_left, MEASURE, |moment| {
        match moment {
            Moment::Contact(row) => {
                let at = row.timestamp.as_micros();
                let (first, _) = contacts.span_us.unwrap_or((at, at));
                contacts.missing += if contacts.count > 0 { row.missing } else { 0 };
                contacts.span_us = Some((first, at));
                contacts.samples.take(at);
                contacts.count += 1;
                contacts.valid += usize::from(row.status.is_valid());
                contacts.stable += usize::from(row.status.decision() == Decision::Stable);
            }
            Moment::Motion(motion) => motions.push(motion),
            Moment::Faults(_) => {}
        }
        None::<()>
    })?;
    let after = counters(client)?;
    let mut figures = of_contacts(&contacts, period_us);
    figures.extend(of_motions(client, &motions)?);
    let grown = |counter| {
        let (before, after) = (before.get(counter), after.get(counter));
        f64::from(after.wrapping_sub(before))
    };
    // On a serial line a CAN bus may be absent, so that its frames do not count.
    let dropped = match client.node() {
        Some(_) => grown(Counter::CanDropped) + grown(Counter::UartDropped),
        None => grown(Counter::UartDropped),
    };
    figures.extend([
        figure::MISSED.measured(grown(Counter::MissedSamples)),
        figure::RESTARTS.measured(grown(Counter::SensorRestarts)),
        figure::LATE.measured(grown(Counter::LateTicks)),
        figure::DROPPED.measured(dropped),
    ]);
    Ok(figures)
}

/// Reads the period at which the foot sends contacts, µs; 0 if SYNCs trigger them.
fn contact_period_us(client: &mut Client) -> Result<u64, RequestError> {
    let ms = match client.node() {
        // With transmission types 1 to 240, the foot sends the contact PDO on SYNC and ignores its event timer.
        Some(_) if (1..=240).contains(&client.read_number(index::TPDO, 2)?) => 0,
        Some(_) => client.read_number(index::TPDO, 5)?,
        None => client.read_number(index::UART_STREAMS, 1)?,
    };
    let (period_us, tick_us) = (u64::from(ms) * 1_000, tick_us(client)?);
    // The foot, too, rounds a period to the nearest number of ticks.
    Ok(match period_us {
        0 => 0,
        _ => ((period_us + tick_us / 2) / tick_us).max(1) * tick_us,
    })
}

/// Reads the number of restarts of the sensor.
pub(super) fn sensor_restarts(client: &mut Client) -> Result<u32, RequestError> {
    client.read_number(index::COUNTERS, Counter::SensorRestarts as u8 + 1)
}

fn counters(client: &mut Client) -> Result<Counters, RequestError> {
    let mut values = Counters::default().to_array();
    for (subindex, value) in (1..).zip(&mut values) {
        *value = client.read_number(index::COUNTERS, subindex)?;
    }
    Ok(Counters::from_array(values))
}

fn of_contacts(contacts: &ContactStatistics, period_us: u64) -> Vec<Figure> {
    let percent = |count: f64, of: f64| 100.0 * count / of;
    let count = contacts.count as f64;
    let (first, last) = contacts.span_us.unwrap_or_default();
    let missing = contacts.missing.max(0) as f64;
    let expected = last.saturating_sub(first) as f64 / period_us as f64;
    let rate = match period_us {
        0 => figure::CONTACT_RATE.not_tested("contacts are not sent by time"),
        _ => figure::CONTACT_RATE.measured(percent(count + missing - 1.0, expected)),
    };
    vec![
        rate,
        contacts.samples.figure(),
        figure::MISSING.measured(percent(missing, count + missing)),
        figure::VALID.measured(percent(contacts.valid as f64, count)),
        figure::STABLE.measured(percent(contacts.stable as f64, count)),
    ]
}

fn of_motions(client: &mut Client, motions: &[FootMotion]) -> StepFigures {
    let [force, force_noise, rate_noise, bias] =
        [&figure::FORCE, &figure::FORCE_NOISE, &figure::RATE_NOISE, &figure::BIAS];
    if motions.is_empty() {
        let missing = "no acceleration, attitude or rate was received";
        let all = [force, force_noise, rate_noise, bias];
        return Ok(all.map(|limit| limit.failed(missing)).into());
    }
    let statistics = Statistics::of(motions.iter());
    let is_raw = motions.iter().all(|motion| motion.source == MotionSource::Raw);
    let axes = if is_raw {
        statistics.rate.to_array().map(Some)
    } else {
        // The rate in frames of a bus has no bias left, because the foot has subtracted it.
        gyroscope_bias_rad_s(client)?.map(|axis| axis.map(f64::from))
    };
    let largest =
        axes.into_iter().try_fold(0.0, |largest: f64, axis| Some(largest.max(axis?.abs())));
    Ok(vec![
        force.measured(statistics.force.length()),
        force_noise.measured(statistics.force_noise),
        rate_noise.measured(statistics.rate_noise.to_degrees()),
        match largest {
            Some(largest) => bias.measured(largest.to_degrees()),
            None => bias.not_tested("the foot does not know it yet"),
        },
    ])
}

#[cfg(test)]
mod tests {
    use super::super::FigureOutcome;
    use super::*;

    /// Times of samples at the first edge after each millisecond; some samples are missing.
    fn times(hertz: f64, step_us: u64) -> SampleTimes {
        let mut times = SampleTimes::default();
        for tick in 0..5_000 {
            let edge = (f64::from(tick) * 1.0e-3 * hertz).ceil() / hertz * 1.0e6;
            if tick % 97 != 0 {
                times.take(edge as u64 / step_us * step_us);
            }
        }
        times
    }

    #[test]
    fn data_rate_is_found_from_rounded_times_of_samples() {
        for (hertz, step_us) in [(6_667.0, 1), (6_400.0, 1), (6_950.0, 1), (6_667.0, 10)] {
            let FigureOutcome::Measured(found) = times(hertz, step_us).figure().outcome else {
                panic!("{hertz}");
            };
            assert!((found - hertz).abs() < hertz * 1.0e-3, "{found} of {hertz}");
        }
        let too_few = SampleTimes::default().figure().outcome;
        assert!(matches!(too_few, FigureOutcome::NotTested(_)));
    }

    #[test]
    fn data_rate_far_from_the_nominal_one_is_refused() {
        // The last is a foot whose samples are read by the timer.
        for hertz in [3_333.0, 5_000.0, 5_714.0, 7_700.0, 8_200.0, 1_000.0] {
            for step_us in [1, 10] {
                let outcome = times(hertz, step_us).figure().outcome;
                assert!(matches!(outcome, FigureOutcome::Failed(_)), "{hertz}: {outcome:?}");
            }
        }
    }
}
