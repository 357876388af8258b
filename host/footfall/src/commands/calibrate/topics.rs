//! Calibration of feet whose IMUs are topics of ROS 2: their samples are collected until each has learnt enough, and then
//! calibrated like recordings.

use std::collections::BTreeMap;
use std::time::Duration;

use estimator_core::{Flag, Flags, Gravity, Load};
use feet::feed::FeedEvent;
use feet::link::Remark;
use feet::{Arrival, Playback};
use options::{ContactUse, Format};
use samples::{RecordedSample, Recording};
use stored::{Loaded, Repairs};

use super::{CalibrateArguments, Input};
use crate::commands::foot::check_interruption;
use crate::error::Error;
use crate::interruption::finish_when_interrupted;
use crate::messages::{aside, warn};
use crate::source::{Source, text_of};
use crate::stream::{NothingHeard, deadline, feed_of, is_detail, is_over, line_event_text};

/// Shortest duration of the samples of a foot, s. The foot must stand and walk in that time.
const LEAST_S: f64 = 10.0;

/// Longest wait for an event.
const LISTEN: Duration = Duration::from_millis(50);

/// Samples of a foot.
struct Collected {
    rate: f32,
    samples: Vec<RecordedSample>,
    /// Time of the first sample, µs.
    start_us: u64,
    has_learnt: bool,
}

/// Calibrates the feet of these topics.
pub(super) fn calibrate(arguments: &CalibrateArguments, sources: Vec<Source>) -> Result<(), Error> {
    arguments.check_output(&[])?;
    let resolved = arguments.recording.resolved(None)?;
    let input_options = arguments.recording.reading.input_options(&resolved, ContactUse::Ignored);
    let playback = Playback {
        input_options: input_options.clone(),
        settings: resolved.clone(),
        estimator_options: Vec::new(),
    };
    let sources = arguments.topics.apply(sources)?.into_iter();
    let sources: Vec<Source> = sources.map(|source| source.played_with(playback.clone())).collect();
    let text = text_of(&sources);
    finish_when_interrupted();
    aside("let the robot stand still for some seconds, and then walk");
    let feet = collect(arguments, sources)?;
    check_interruption()?;
    if feet.is_empty() {
        return Err(NothingHeard.into());
    }
    let input = |(name, collected): (String, Collected)| {
        let recording = Recording {
            name: name.clone(),
            sample_rate: collected.rate,
            gravity: input_options.gravity.unwrap_or(Gravity::Included),
            load_title: "load".to_owned(),
            samples: collected.samples,
        };
        let loaded = Loaded {
            recording,
            start_us: i64::try_from(collected.start_us).unwrap_or(i64::MAX),
            notices: Vec::new(),
            repairs: Repairs::default(),
        };
        (name, vec![Input { file: text.clone(), format: Format::Mcap, loaded }])
    };
    arguments.learn_each(&resolved, &input_options, feet.into_iter().map(input).collect())
}

/// Collects samples until all feet have learnt enough, or until the time is over.
fn collect(
    arguments: &CalibrateArguments,
    sources: Vec<Source>,
) -> Result<BTreeMap<String, Collected>, Error> {
    let topics = sources.iter().filter_map(|source| match source {
        Source::Topics(topics) => Some(topics.feet.len()),
        _ => None,
    });
    let least: usize = topics.sum();
    let feed = feed_of(sources);
    let end = deadline(feed.clock(), Some(arguments.walking.seconds.into()));
    let mut rates: BTreeMap<String, f32> = BTreeMap::new();
    let mut feet: BTreeMap<String, Collected> = BTreeMap::new();
    while !is_over(feed.clock(), end) {
        match feed.next(LISTEN) {
            Some(FeedEvent::Arrived((_, Arrival::Estimate(row)))) => {
                let (Some(name), Some(mut imu)) = (row.foot.clone(), row.measured) else {
                    continue;
                };
                let collected = feet.entry(name.to_string()).or_insert_with(|| Collected {
                    rate: rates.get(&*name).copied().unwrap_or_default(),
                    samples: Vec::new(),
                    start_us: imu.timestamp.as_micros(),
                    has_learnt: false,
                });
                let since_us = imu.timestamp.as_micros().saturating_sub(collected.start_us);
                imu.timestamp = estimator_core::Timestamp::from_micros(since_us);
                let load = row.load.filter(|load| load.is_finite()).map(Load);
                collected.samples.push(RecordedSample { imu, load, label: None });
                let flags = Flags::from_bits(row.flags.unwrap_or_default());
                let is_settled = !flags.contains(Flag::Settling);
                if is_settled
                    && since_us as f64 / 1.0e6 >= LEAST_S
                    && !std::mem::replace(&mut collected.has_learnt, true)
                {
                    aside(format!("{name}: has learnt enough"));
                }
            }
            Some(FeedEvent::Remark(Remark::Rate(name, rate))) => {
                rates.insert(name.to_string(), rate);
            }
            Some(FeedEvent::Remark(remark)) if is_detail(&remark) => {}
            // Findings are reported with the result.
            Some(FeedEvent::Remark(Remark::Implausible(..))) => {}
            Some(FeedEvent::Ended(error)) => return Err(error.into()),
            Some(event) => line_event_text(&event).into_iter().for_each(warn),
            None => {}
        }
        if feet.len() >= least && feet.values().all(|foot| foot.has_learnt) {
            break;
        }
    }
    Ok(feet)
}
