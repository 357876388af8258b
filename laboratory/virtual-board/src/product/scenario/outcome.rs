//! The outcome of a scenario, measured from everything that the board sent.

use wire::{Counter, Fault, Value};

use super::watch::{ContactFrame, Line, Reported, SHORT_US, Watch};
use super::{Invalid, Reports, Scenario};
use crate::emulator::board::Board;
use crate::emulator::part::rcc::ResetCause;
use crate::emulator::time::{from_us, to_us};

/// Outcome of a scenario. Times are in µs. "Injection" is the time at which the fault is injected. "Clearance" is the
/// time at which it is cleared, or the time of the injection if it ends without clearing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScenarioOutcome {
    /// Time from the injection to the first contact frame flagged as invalid.
    pub first_invalid_us: Option<f64>,
    /// Time from the injection to the first report: emergency message, log line, boot-up message.
    pub reported_us: Option<f64>,
    /// Faults reported by emergency messages.
    pub emergencies: Vec<Fault>,
    /// Faults reported over the serial line.
    pub serial: Vec<Fault>,
    /// Whether the board has sent a boot-up message since the injection.
    pub boot_up: bool,
    /// Causes of the resets since the injection.
    pub resets: Vec<ResetCause>,
    /// Counters that have increased, although they are constant without a fault.
    pub counters: Vec<Counter>,
    /// Whether data were invalid for a time.
    pub had_invalid_data: bool,
    /// Time from the injection to the last frame that said "stable" before data were valid again.
    pub last_stable_us: Option<f64>,
    /// Number of contact frames sent while data were invalid, without those sent while the fault could not be
    /// detected yet.
    pub checked: u64,
    /// Longest period of invalid data, from when it could be detected.
    pub invalid_us: f64,
    /// Number of checked frames that said "stable": zero is required.
    pub stable_while_invalid: u64,
    /// Greatest delay of a frame that said "stable", beyond the usual one.
    pub late_us: f64,
    /// Time from clearance to the first valid frame on every line in use; `None` if frames never stopped, or never
    /// resumed.
    pub recovered_us: Option<f64>,
    /// Time from clearance to the emergency message that reports the fault cleared.
    pub cleared_us: Option<f64>,
    /// Longest time without a contact frame: on CAN, on the serial line.
    pub silent_us: [f64; 2],
    /// Whether the last frames on every line in use are valid and say "stable".
    pub healthy: bool,
    /// Whether sample times on the serial line increase, each by less than two ticks.
    pub steady_clock: bool,
    /// Last sample time on the serial line, on the board's clock.
    pub last_sample_us: u64,
    /// Time from the injection to the first health message in which one of `counters` had increased.
    pub counted_us: Option<f64>,
    /// Number of runs after which the setting had its old value, the new one, any other.
    pub kept: [u64; 3],
    /// Requirements that were not met, in words.
    pub violations: Vec<String>,
    /// Time from the injection to the end of the run.
    pub watched_us: f64,
}

/// Gap between frames, µs, above which a line counts as disturbed.
const DISTURBED_US: f64 = 5_000.0;

/// Counters that are constant without a fault.
const STILL: [Counter; 9] = [
    Counter::SaturatedSamples,
    Counter::MissedSamples,
    Counter::SensorRestarts,
    Counter::CanDropped,
    Counter::CanBusOff,
    Counter::UartDropped,
    Counter::UartRefused,
    Counter::UartOverruns,
    Counter::LateTicks,
];

impl ScenarioOutcome {
    pub(super) fn of(
        scenario: &Scenario,
        watch: &Watch,
        board: &Board,
        at: u64,
        end: Option<u64>,
    ) -> Self {
        let now = board.now();
        let since = |time: u64| to_us(time - at);
        let resets: Vec<(u64, ResetCause)> =
            board.resets().into_iter().filter(|&(time, _)| time >= at).collect();
        let last_reset = resets.last().map(|&(time, _)| time);
        let invalid = Invalidity::of(scenario, watch, at, end, &resets, now);
        let contacts = || watch.contacts.iter().filter(move |contact| contact.time >= at);
        let usual = usual_ages(&watch.contacts, at);
        let mut outcome = Self {
            resets: resets.iter().map(|&(_, cause)| cause).collect(),
            watched_us: since(now),
            steady_clock: is_steady(contacts()),
            had_invalid_data: !invalid.spans.is_empty(),
            invalid_us: invalid.longest_us(),
            last_sample_us: contacts().rev().find_map(|contact| contact.sample_us).unwrap_or(0),
            ..Self::default()
        };
        for contact in contacts() {
            if !contact.valid {
                outcome.first_invalid_us.get_or_insert(since(contact.time));
            }
            if invalid.covers(contact.time) {
                outcome.checked += 1;
                outcome.stable_while_invalid += u64::from(contact.stable);
            }
            if contact.stable && contact.time < invalid.end {
                outcome.last_stable_us = Some(since(contact.time));
            }
            // The clock of a board restarts with a reset.
            if contact.stable && resets.is_empty() && !scenario.clock_stops {
                let late = lateness(contact, &usual);
                outcome.late_us = outcome.late_us.max(late);
            }
        }
        outcome.take_reports(scenario, watch, at, end);
        outcome.take_counters(watch, at, &resets);
        let silences = Line::BOTH.map(|line| longest_silence(contacts(), line, at, now));
        outcome.silent_us = silences.map(|(silent_us, _)| silent_us);
        let lines: &[Line] = if scenario.with_can { &Line::BOTH } else { &[Line::Uart] };
        outcome.healthy = lines.iter().all(|&line| {
            let of_line = |contact: &&ContactFrame| contact.line == line;
            let last = watch.contacts.iter().rev().find(of_line);
            let recent = from_us(DISTURBED_US as u64);
            last.is_some_and(|contact| {
                contact.valid && contact.stable && now - contact.time < recent
            })
        });
        let silence = lines
            .iter()
            .map(|&line| silences[line as usize])
            .filter(|&(silent_us, _)| silent_us > DISTURBED_US)
            .map(|(_, ended)| ended)
            .max();
        let first_invalid = contacts().find(|contact| !contact.valid);
        let first_invalid = first_invalid.map(|contact| contact.time);
        if let Some(disturbed_at) = last_reset.or(first_invalid).or(silence) {
            let from = end.unwrap_or(disturbed_at);
            let first = |line: Line| {
                let good = |contact: &&ContactFrame| {
                    contact.line == line && contact.valid && contact.time >= from
                };
                contacts().find(good).map(|contact| contact.time)
            };
            let all: Option<Vec<u64>> = lines.iter().map(|&line| first(line)).collect();
            let back = all.and_then(|all| all.into_iter().max());
            outcome.recovered_us = back.map(|back| to_us(back - end.unwrap_or(at)));
        }
        outcome
    }

    fn take_reports(&mut self, scenario: &Scenario, watch: &Watch, at: u64, end: Option<u64>) {
        for &(time, reported) in watch.reported.iter().filter(|(time, _)| *time >= at) {
            let is_new = match reported {
                Reported::Emergency(fault) => insert(&mut self.emergencies, fault),
                Reported::Serial(fault) => insert(&mut self.serial, fault),
                Reported::BootUp => {
                    // A boot-up message is always sent at power-up, so it does not count as a report there.
                    self.boot_up |= !scenario.at_power_up;
                    !scenario.at_power_up
                }
                Reported::Cleared(fault) => {
                    if scenario.reports == Reports::Fault(fault)
                        && let Some(end) = end
                        && time >= end
                    {
                        self.cleared_us.get_or_insert(to_us(time - end));
                    }
                    false
                }
            };
            if is_new {
                self.reported_us.get_or_insert(to_us(time - at));
            }
        }
    }

    /// Counters restart with a reset, and then show nothing.
    fn take_counters(&mut self, watch: &Watch, at: u64, resets: &[(u64, ResetCause)]) {
        let before = watch.health.iter().rev().find(|(time, _)| *time < at);
        let (Some((_, before)), true) = (before, resets.is_empty()) else {
            return;
        };
        for (time, health) in watch.health.iter().filter(|(time, _)| *time >= at) {
            for counter in STILL {
                if before.counters.get(counter) != health.counters.get(counter) {
                    self.counted_us.get_or_insert(to_us(time - at));
                    insert(&mut self.counters, counter);
                }
            }
        }
    }

    /// Counts the final value of the setting.
    pub(super) fn take_setting(&mut self, answer: Option<&[u8]>, values: [Value; 2]) {
        let is_answer = |value: &Value| answer == Some(&value.to_raw().to_le_bytes());
        let index = values.iter().position(is_answer);
        self.kept[index.unwrap_or(2)] += 1;
    }

    /// Time from the injection to the first sign of the fault in anything that the board sends, µs.
    #[must_use]
    pub fn detected_us(&self) -> Option<f64> {
        let signs = [self.first_invalid_us, self.reported_us, self.counted_us];
        signs.into_iter().flatten().reduce(f64::min)
    }

    /// Returns whether the required report has been sent.
    #[must_use]
    pub fn has_reported(&self, reports: Reports) -> bool {
        match reports {
            Reports::Fault(fault) => {
                self.emergencies.contains(&fault) || self.serial.contains(&fault)
            }
            Reports::Counter(counter) => self.counters.contains(&counter),
            Reports::BootUp => self.boot_up,
            Reports::Nothing => self.detected_us().is_none(),
            Reports::Any => true,
        }
    }

    /// Returns whether nothing more is awaited.
    pub(super) fn is_complete(&self, scenario: &Scenario) -> bool {
        let gone = scenario.lasts_ms.is_none()
            || self.emergencies.is_empty()
            || self.recovered_us.is_some()
            || self.cleared_us.is_some();
        self.watched_us > 300_000.0 && self.healthy && gone && self.has_reported(scenario.reports)
    }

    /// Merges this outcome with the outcome of another run, taking the worst of each.
    #[must_use]
    pub fn worst(mut self, other: &Self) -> Self {
        let most = |a: Option<f64>, b: Option<f64>| a.into_iter().chain(b).reduce(f64::max);
        self.first_invalid_us = most(self.first_invalid_us, other.first_invalid_us);
        self.reported_us = most(self.reported_us, other.reported_us);
        self.last_stable_us = most(self.last_stable_us, other.last_stable_us);
        self.recovered_us = most(self.recovered_us, other.recovered_us);
        self.cleared_us = most(self.cleared_us, other.cleared_us);
        self.counted_us = most(self.counted_us, other.counted_us);
        self.kept = core::array::from_fn(|i| self.kept[i] + other.kept[i]);
        self.last_sample_us = self.last_sample_us.max(other.last_sample_us);
        self.late_us = self.late_us.max(other.late_us);
        self.checked += other.checked;
        self.invalid_us = self.invalid_us.max(other.invalid_us);
        self.stable_while_invalid += other.stable_while_invalid;
        self.boot_up |= other.boot_up;
        self.healthy &= other.healthy;
        self.had_invalid_data |= other.had_invalid_data;
        self.steady_clock &= other.steady_clock;
        self.silent_us = core::array::from_fn(|i| self.silent_us[i].max(other.silent_us[i]));
        self.violations.extend(other.violations.iter().cloned());
        merge(&mut self.emergencies, &other.emergencies);
        merge(&mut self.serial, &other.serial);
        merge(&mut self.resets, &other.resets);
        merge(&mut self.counters, &other.counters);
        self
    }
}

fn insert<T: PartialEq>(all: &mut Vec<T>, item: T) -> bool {
    let new = !all.contains(&item);
    if new {
        all.push(item);
    }
    new
}

fn merge<T: PartialEq + Copy>(all: &mut Vec<T>, others: &[T]) {
    for &other in others {
        insert(all, other);
    }
}

/// A period of invalid data that can be detected.
struct Invalidity {
    spans: Vec<(u64, u64)>,
    end: u64,
}

impl Invalidity {
    fn of(
        scenario: &Scenario,
        watch: &Watch,
        at: u64,
        end: Option<u64>,
        resets: &[(u64, ResetCause)],
        now: u64,
    ) -> Self {
        let sample_after = |from: u64| {
            let fresh = |&&(time, edge): &&(u64, Option<u64>)| {
                time > from && edge.is_some_and(|edge| edge > from)
            };
            let first = watch.samples.iter().find(fresh);
            first.map_or(now, |&(time, _)| time)
        };
        let mut spans: Vec<(u64, u64)> =
            resets.iter().map(|&(time, _)| (time, sample_after(time))).collect();
        let restarted = resets.last().map_or(at, |&(time, _)| time);
        let known = at + from_us(scenario.blind_us);
        match scenario.invalid {
            Invalid::Never => {}
            Invalid::UntilCleared => spans.push((known, end.unwrap_or(now))),
            Invalid::UntilNextSample => spans.push((known, sample_after(restarted))),
        }
        let end = spans.iter().map(|&(_, to)| to).max().unwrap_or(at);
        Self { spans, end }
    }

    fn covers(&self, time: u64) -> bool {
        let within = |&(from, to): &(u64, u64)| (from..to).contains(&time);
        self.spans.iter().any(within)
    }

    fn longest_us(&self) -> f64 {
        let lengths = self.spans.iter().map(|(from, to)| to.saturating_sub(*from));
        to_us(lengths.max().unwrap_or(0))
    }
}

/// Longest time without a contact frame on a line: duration, µs, and its end.
fn longest_silence<'a>(
    contacts: impl Iterator<Item = &'a ContactFrame>,
    line: Line,
    at: u64,
    now: u64,
) -> (f64, u64) {
    let (mut longest, mut last) = ((0.0, at), at);
    let times = contacts.filter(|contact| contact.line == line);
    for time in times.map(|contact| contact.time).chain([now]) {
        let silent_us = to_us(time - last);
        if silent_us > longest.0 {
            longest = (silent_us, time);
        }
        last = time;
    }
    longest
}

/// Smallest age of a frame on each line before the injection.
fn usual_ages(contacts: &[ContactFrame], at: u64) -> [f64; 2] {
    let mut usual = [f64::INFINITY; 2];
    for contact in contacts.iter().filter(|contact| contact.time < at) {
        let least = &mut usual[contact.line as usize];
        *least = least.min(contact.age_us);
    }
    usual
}

fn lateness(contact: &ContactFrame, usual: &[f64; 2]) -> f64 {
    let late = contact.age_us - usual[contact.line as usize];
    match (contact.line, late.is_finite()) {
        (_, false) => 0.0,
        // A difference below a step of the short time does not count as a delay.
        (Line::Can, true) => {
            let late = late.rem_euclid(SHORT_US);
            if late > SHORT_US - 20.0 { 0.0 } else { late }
        }
        (Line::Uart, true) => late,
    }
}

fn is_steady<'a>(contacts: impl Iterator<Item = &'a ContactFrame>) -> bool {
    let mut last: Option<u64> = None;
    for sample_us in contacts.filter_map(|contact| contact.sample_us) {
        if let Some(last) = last.replace(sample_us)
            && !(last + 1..last + 2_000).contains(&sample_us)
        {
            return false;
        }
    }
    true
}

/// The requirements that an outcome violates; empty if it meets all.
#[must_use]
pub fn violations(scenario: &Scenario, outcome: &ScenarioOutcome) -> Vec<String> {
    let mut all = Vec::new();
    let mut refuse_if = |wrong: bool, text: String| {
        if wrong {
            all.push(format!("{}: {text}", scenario.name));
        }
    };
    refuse_if(
        outcome.stable_while_invalid > 0,
        format!("{} frames said stable on invalid data", outcome.stable_while_invalid),
    );
    refuse_if(
        outcome.late_us > Invalid::MAX_LATE_MS as f64 * 1000.0,
        format!("a frame said stable {} µs late", outcome.late_us),
    );
    refuse_if(
        outcome.detected_us() > Some(scenario.detected_within_us as f64),
        format!("detected after {:?} µs", outcome.detected_us()),
    );
    refuse_if(
        !outcome.has_reported(scenario.reports),
        format!("{:?} was not reported", scenario.reports),
    );
    let was_silent = outcome.silent_us.iter().all(|&silent| silent >= outcome.invalid_us);
    refuse_if(
        scenario.invalid != Invalid::Never
            && outcome.checked == 0
            && !(scenario.may_be_silent && was_silent),
        "no frame was checked".into(),
    );
    refuse_if(
        !scenario.any_reset && outcome.resets != scenario.resets,
        format!("resets: {:?}", outcome.resets),
    );
    refuse_if(
        outcome.healthy == scenario.stays(),
        format!("recovered afterwards: {}", outcome.healthy),
    );
    refuse_if(outcome.kept[2] > 0, format!("settings old, new, other: {:?}", outcome.kept));
    let refused = outcome.has_reported(Reports::Fault(Fault::ConfigStore));
    refuse_if(
        scenario.keeps_new && !refused && outcome.kept[1] == 0,
        "settings are not those that were stored, and no fault was reported".into(),
    );
    refuse_if(
        !outcome.steady_clock && scenario.keeps_time,
        "a sample's time is not a tick after the one before".into(),
    );
    refuse_if(
        outcome.last_sample_us < scenario.clock_beyond_us,
        format!("the clock came to {} µs", outcome.last_sample_us),
    );
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contact(line: Line, age_us: f64, sample_us: u64) -> ContactFrame {
        ContactFrame {
            line,
            time: 0,
            stable: true,
            valid: true,
            age_us,
            sample_us: Some(sample_us),
        }
    }

    #[test]
    fn lateness_is_relative_to_the_youngest_frame_before() {
        let usual =
            usual_ages(&[contact(Line::Can, 655_000.0, 0), contact(Line::Uart, 500.0, 0)], 1);
        let late = |line, age_us| lateness(&contact(line, age_us, 0), &usual);
        assert_eq!(late(Line::Uart, 31_500.0), 31_000.0);
        // Over the wrap of the short time.
        assert_eq!(late(Line::Can, 640.0), 1_000.0);
        assert_eq!(late(Line::Can, 654_995.0), 0.0);
        assert_eq!(lateness(&contact(Line::Can, 1.0, 0), &[f64::INFINITY; 2]), 0.0);
    }

    #[test]
    fn a_steady_clock_advances_by_less_than_two_ticks() {
        let times = |all: &[u64]| {
            let contacts: Vec<ContactFrame> =
                all.iter().map(|&t| contact(Line::Uart, 0.0, t)).collect();
            is_steady(contacts.iter())
        };
        assert!(times(&[4_294_966_900, 4_294_967_900, 4_294_968_850]));
        assert!(!times(&[4_294_966_900, 604]));
        assert!(!times(&[1000, 3001]));
    }
}
