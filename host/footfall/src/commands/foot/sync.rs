//! `footfall foot … sync`: compares the clocks of the feet on a bus.

use std::time::Duration;

use feet::decode::live::{FootKey, Listener};
use feet::foot::scan;
use feet::foot::sync::Clocks;
use feet::{Arrival, Link, Sending};
use serde_json::{Value as Json, json};
use wire::CanFrame;
use wire::foot::cob_id;
use wire::pdo::ClockReading;

use super::{FootArguments, to_json};
use crate::foot_error::FootError;
use crate::messages;

/// Period of SYNCs sent from here.
const PERIOD: Duration = Duration::from_millis(10);

/// Receive timeout.
const LISTEN: Duration = Duration::from_millis(2);

/// Time to wait for a SYNC master; robots send SYNCs at least every 100 ms.
const MASTER: Duration = Duration::from_millis(500);

/// Returns whether another node already sends SYNCs.
fn has_sync(link: &mut dyn Link) -> Result<bool, FootError> {
    let clock = link.clock();
    let end = clock.now() + MASTER;
    while clock.now() < end {
        if let Some((_, Arrival::Frame { frame, .. })) = link.receive(LISTEN)?
            && frame.id() == cob_id::SYNC
        {
            return Ok(true);
        }
    }
    Ok(false)
}

impl FootArguments {
    /// Listens for `seconds` and compares the clocks.
    pub(super) fn sync(
        &self,
        link: &mut dyn Link,
        seconds: f64,
        send: bool,
    ) -> Result<String, FootError> {
        if send && has_sync(link)? {
            return Err(FootError::HasSync);
        }
        let mut listener = Listener::default();
        // Feet may have ids other than the defaults of their positions.
        scan::feet(link, &mut listener, scan::SCAN)?;
        let mut clocks = Clocks::default();
        let clock = link.clock();
        let begin = clock.now();
        let end = begin + Duration::from_secs_f64(seconds);
        let mut next = begin;
        let mut number = 0;
        while clock.now() < end {
            if send && clock.now() >= next {
                number = ClockReading::sync_after(number);
                next += PERIOD;
                if let Some(frame) = CanFrame::new(cob_id::SYNC, &[number]) {
                    link.send(&Sending::Frame(frame))?;
                    clocks.take_sync(Some(number));
                }
            }
            if let Some((at, arrival)) = link.receive(LISTEN)? {
                if let Arrival::Frame { frame, .. } = &arrival
                    && frame.id() == cob_id::SYNC
                {
                    let heard = frame.data().first().copied();
                    // Some adapters echo sent frames.
                    if !send || heard != Some(number) {
                        clocks.take_sync(heard);
                    }
                }
                // Errors of unreadable data are irrelevant to SYNCs.
                arrival.hand_to(&mut listener, at);
            }
            while let Some(heard) = listener.next_heard() {
                clocks.take(&heard);
            }
        }
        let times = clocks.interruptions();
        if times > 0 {
            messages::warn(format!(
                "feet started again, or were not heard, {times} times: what they reported before does not count"
            ));
        }
        let (first, compared) = clocks.compare()?;
        let name = |foot: &FootKey| {
            let name = listener.name(foot).map(|name| name.to_string());
            let node = foot.node.map(|node| format!("node {node}"));
            name.or(node).unwrap_or_else(|| foot.line.to_string())
        };
        let reference = name(&first);
        if self.json {
            let feet = compared.iter().map(|compared| {
                json!({
                    "foot": name(&compared.foot),
                    "offset_us": compared.offset_us,
                    "offset_error_us": compared.offset_error_us,
                    "drift_ppm": compared.drift_ppm,
                    "drift_error_ppm": compared.drift_error_ppm,
                    "syncs": compared.syncs,
                    "span_s": compared.span_s,
                })
            });
            let feet: Vec<Json> = feet.collect();
            let compared = json!({ "reference": reference, "feet": feet });
            return Ok(to_json(&compared));
        }
        let lines = compared.iter().map(|compared| {
            format!(
                "{} − {reference}: {:+.3} ± {:.3} ms, drift {:+.1} ± {:.1} ppm ({} SYNCs in {:.1} s)\n",
                name(&compared.foot),
                compared.offset_us / 1000.0,
                compared.offset_error_us / 1000.0,
                compared.drift_ppm,
                compared.drift_error_ppm,
                compared.syncs,
                compared.span_s,
            )
        });
        Ok(lines.collect())
    }
}
