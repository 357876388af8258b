//! What comes from the feet, taken in until something is to be shown.

use std::time::{Duration, Instant};

use live::Feed;

use super::Robot;

/// Time from one picture to the next.
pub const PICTURE: Duration = Duration::from_millis(50);

/// Takes in what comes until `due`.
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

/// The next moment to show something, and the end where that comes first.
#[must_use]
pub fn next(period: Duration, end: Option<Instant>) -> Instant {
    let due = Instant::now() + period;
    end.map_or(due, |end| due.min(end))
}
