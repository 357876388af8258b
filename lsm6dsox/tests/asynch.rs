//! The asynchronous driver, on a bus and a delay that make it wait.

use core::convert::Infallible;
use core::future::poll_fn;
use core::pin::pin;
use core::task::{Context, Poll, Waker};

use crate::common::{QUIET, part, sensor};
use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::spi::{ErrorType, Operation, SpiDevice};
use lsm6dsox::{Config, asynch};

/// A bus or delay whose futures are pending at the first poll.
struct Late<T>(T);

async fn wait_once() {
    let mut asked = false;
    poll_fn(|context| {
        if asked {
            return Poll::Ready(());
        }
        asked = true;
        context.waker().wake_by_ref();
        Poll::Pending
    })
    .await;
}

impl<T> ErrorType for Late<T> {
    type Error = Infallible;
}

impl<T: SpiDevice<Error = Infallible>> SpiDevice for Late<T> {
    async fn transaction(
        &mut self,
        operations: &mut [Operation<'_, u8>],
    ) -> Result<(), Infallible> {
        wait_once().await;
        self.0.transaction(operations).await
    }
}

impl<T: DelayNs> DelayNs for Late<T> {
    async fn delay_ns(&mut self, ns: u32) {
        wait_once().await;
        self.0.delay_ns(ns).await;
    }
}

/// Runs a future; returns its output and the number of waits.
fn run<F: Future>(future: F) -> (F::Output, usize) {
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    let mut waits = 0;
    loop {
        match future.as_mut().poll(&mut context) {
            Poll::Ready(output) => return (output, waits),
            Poll::Pending => waits += 1,
        }
    }
}

#[test]
fn both_drivers_initialise_alike_and_read_the_same_sample() {
    let part = part(QUIET);
    let mut late = asynch::Lsm6dsox::new(Late(part.spi()), Config::FRESH_KILOHERTZ);
    let (result, waits) = run(late.init(&mut Late(part.delay())));
    assert_eq!(result, Ok(()));
    // Four writes, identity, two writes before the reset, reset, one poll of it, each write and its read-back, three
    // delays.
    assert_eq!(waits, 9 + 2 * Config::WRITES + 3);
    part.advance_by(1_000_000);
    let (sample, waits) = run(late.sample());
    assert_eq!(waits, 1);

    let other = crate::common::part(QUIET);
    let mut blocking = sensor(&other, Config::FRESH_KILOHERTZ);
    assert_eq!(sample, blocking.sample());
    assert!(sample.unwrap().is_fresh());
}
