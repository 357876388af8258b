//! Playbacks of several sources as one line, in order of time.

use std::fmt;
use std::time::Duration;

use super::clock::PlaybackPace;
use super::{Arrived, LineSource, Link, LinkError, Sending};
use crate::source::Speed;

/// Sources that are played together, at the speed of the first.
pub(crate) struct MergedPlaybacks(pub(crate) Vec<Box<dyn LineSource>>);

impl fmt::Display for MergedPlaybacks {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = self.0.iter().map(ToString::to_string);
        f.write_str(&names.collect::<Vec<_>>().join(" "))
    }
}

impl LineSource for MergedPlaybacks {
    fn open(&self) -> Result<Box<dyn Link>, LinkError> {
        let lines = self.0.iter().map(|source| {
            let link = source.open_unpaced()?;
            Ok(PlayedLine { link, next: None })
        });
        Ok(Box::new(MergedLine {
            lines: lines.collect::<Result<_, LinkError>>()?,
            pace: PlaybackPace::new(self.speed().unwrap_or(Speed::REAL)),
        }))
    }

    fn speed(&self) -> Option<Speed> {
        self.0.first().and_then(|source| source.speed())
    }
}

/// Several playbacks.
struct MergedLine {
    /// Playbacks that have not ended.
    lines: Vec<PlayedLine>,
    pace: PlaybackPace,
}

/// A playback with its next data.
struct PlayedLine {
    link: Box<dyn Link>,
    next: Option<Arrived>,
}

impl MergedLine {
    /// Reads the next data of each playback, and removes those that have ended.
    fn read(&mut self, longest: Duration) -> Result<(), LinkError> {
        let mut index = 0;
        while let Some(line) = self.lines.get_mut(index) {
            if line.next.is_none() {
                match line.link.receive(longest) {
                    Ok(next) => line.next = next,
                    Err(LinkError::Ended(_)) if self.lines.len() > 1 => {
                        self.lines.remove(index);
                        continue;
                    }
                    Err(error) => return Err(error),
                }
            }
            index += 1;
        }
        Ok(())
    }
}

impl Link for MergedLine {
    fn receive(&mut self, longest: Duration) -> Result<Option<Arrived>, LinkError> {
        self.read(longest)?;
        let is_read = |line: &&mut PlayedLine| line.next.is_some();
        let lines = self.lines.iter_mut().filter(is_read);
        let first = lines.min_by_key(|line| line.next.as_ref().map(|(at, _)| *at));
        let Some(line) = first else {
            return Ok(None);
        };
        let at_us = line.next.as_ref().map_or(0, |(at, _)| at.as_micros());
        Ok(if self.pace.wait(at_us, longest) { line.next.take() } else { None })
    }

    fn send(&mut self, sending: &Sending) -> Result<(), LinkError> {
        self.lines.iter_mut().try_for_each(|line| line.link.send(sending))
    }
}

#[cfg(test)]
mod tests {
    use estimator_core::Timestamp;

    use super::*;
    use crate::link::Arrival;

    /// Playback of texts at these times, µs.
    struct Times(Vec<u64>);

    impl fmt::Display for Times {
        fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("times")
        }
    }

    impl LineSource for Times {
        fn open(&self) -> Result<Box<dyn Link>, LinkError> {
            Ok(Box::new(Self(self.0.iter().rev().copied().collect())))
        }

        fn speed(&self) -> Option<Speed> {
            Some(Speed::Max)
        }
    }

    impl Link for Times {
        fn receive(&mut self, _: Duration) -> Result<Option<Arrived>, LinkError> {
            let us = self.0.pop().ok_or_else(|| LinkError::Ended("times".to_owned()))?;
            Ok(Some((Timestamp::from_micros(us), Arrival::Unreadable(us.to_string()))))
        }

        fn send(&mut self, _: &Sending) -> Result<(), LinkError> {
            Ok(())
        }
    }

    #[test]
    fn playbacks_are_merged_in_order_of_time() {
        let sources = [vec![1, 4, 5], vec![2, 3, 9], vec![]];
        let sources = sources.map(|times| Box::new(Times(times)) as Box<dyn LineSource>);
        let mut line = MergedPlaybacks(sources.into()).open().expect("times");
        let mut times = Vec::new();
        let ended = loop {
            match line.receive(Duration::ZERO) {
                Ok(Some((at, _))) => times.push(at.as_micros()),
                Ok(None) => {}
                Err(error) => break error,
            }
        };
        assert_eq!(times, [1, 2, 3, 4, 5, 9]);
        assert_eq!(ended.to_string(), "times has ended");
    }
}
