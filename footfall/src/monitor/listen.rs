//! Reception from the feet until the display is next updated.

use std::time::{Duration, Instant};

use live::Feed;

use super::Robot;

/// Period of screen updates.
pub const PICTURE: Duration = Duration::from_millis(50);

/// Receives from the feed until `due`.
pub fn listen(feed: &Feed, robot: &mut Robot, due: Instant) {
    loop {
        let left = due.saturating_duration_since(Instant::now());
        if left.is_zero() || robot.has_ended() {
            return;
        }
        match feed.next(left) {
            Some(fed) => robot.take(fed),
            None => robot.idle(robot.quiet_for()),
        }
    }
}

/// Returns the time of the next update, or the end if it comes first.
#[must_use]
pub fn next(period: Duration, end: Option<Instant>) -> Instant {
    let due = Instant::now() + period;
    end.map_or(due, |end| due.min(end))
}
