//! Bus and delay with arbitrary behaviour: they answer, fail, or take any time.

use core::future::Future;
use core::task::{Context, Poll};

use embedded_hal_async::spi::{ErrorType, Operation, SpiDevice};

use crate::inputs::{any, any_bool};
use crate::used;

/// Bus that answers anything, or fails, or is not ready.
pub struct AnyBus;

#[derive(Debug)]
pub struct BusError;

impl embedded_hal_async::spi::Error for BusError {
    fn kind(&self) -> embedded_hal_async::spi::ErrorKind {
        embedded_hal_async::spi::ErrorKind::Other
    }
}

impl ErrorType for AnyBus {
    type Error = BusError;
}

impl AnyBus {
    fn answer(operations: &mut [Operation<'_, u8>]) -> Result<(), BusError> {
        for operation in operations {
            if let Operation::Read(bytes)
            | Operation::Transfer(bytes, _)
            | Operation::TransferInPlace(bytes) = operation
            {
                bytes.iter_mut().for_each(|byte| *byte = any());
            }
        }
        if any_bool() { Ok(()) } else { Err(BusError) }
    }
}

impl lsm6dsox::SetSpiClock for AnyBus {
    fn set_spi_clock(&mut self, _: lsm6dsox::SpiClock) {}
}

impl SpiDevice for AnyBus {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), BusError> {
        Maybe.await;
        Self::answer(operations)
    }
}

impl embedded_hal::spi::SpiDevice for AnyBus {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), BusError> {
        Self::answer(operations)
    }
}

/// Future that is ready at some time.
struct Maybe;

impl Future for Maybe {
    type Output = ();

    fn poll(self: core::pin::Pin<&mut Self>, _: &mut Context<'_>) -> Poll<()> {
        if any_bool() {
            Poll::Ready(())
        } else {
            Poll::Pending
        }
    }
}

/// Delay of any length.
pub struct AnyDelay;

impl embedded_hal_async::delay::DelayNs for AnyDelay {
    async fn delay_ns(&mut self, ns: u32) {
        used(ns);
        Maybe.await;
    }
}

impl embedded_hal::delay::DelayNs for AnyDelay {
    fn delay_ns(&mut self, ns: u32) {
        used(ns);
    }
}
