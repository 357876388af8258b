//! Communication level: frames that wait go to the buses, requests come from them.

use core::ops::Range;
use core::sync::atomic::Ordering;

use embassy_futures::select::{Either, select};
use embassy_time::{Duration, Timer, with_timeout};
use firmware::ports::{Input, UartBatch};
use firmware::supervision::Worker;
use firmware::uart_requests::UartReceiver;

use super::{PORTS, REQUESTED, UART_RATE};

/// Time without a frame taken by the bus after which queued frames are too old.
const BUS_DEADLINE: Duration = Duration::from_millis(20);

/// Identifiers of process data: a later frame supersedes an earlier one.
const PROCESS_DATA: Range<u16> = 0x180..0x580;

/// Sends the frames that the bus did not take at once. If it takes none until the deadline, process
/// data are withdrawn, from the mailboxes too: the first frames after a recovery are new.
#[embassy_executor::task]
pub(super) async fn send_can(mut can: crate::can::Sender) {
    loop {
        PORTS.can_ready().await;
        PORTS.liveness.report(Worker::Can);
        PORTS.send_can();
        if !PORTS.can_is_empty() && with_timeout(BUS_DEADLINE, can.freed()).await.is_err() {
            let count = can.withdraw(&PROCESS_DATA).await + PORTS.withdraw_can();
            if count > 0 {
                PORTS.put(Input::CanWithdrawn(count)).await;
            }
        }
    }
}

/// Passes frames from the bus to the foot.
#[embassy_executor::task]
pub(super) async fn receive_can(mut can: crate::can::Receiver) {
    loop {
        let (frame, at) = can.receive().await;
        if can.take_overrun() {
            PORTS.put(Input::CanLost(1)).await;
        }
        PORTS.put(Input::Can(frame, at)).await;
    }
}

/// Sends frames over the serial line, all queued ones in one transfer.
#[embassy_executor::task]
pub(super) async fn send_uart(mut uart: crate::uart::Sender) {
    let mut batch = UartBatch::default();
    loop {
        let rate = match PORTS.take_uart(&mut batch) {
            bytes @ [_, ..] => {
                if uart.send(bytes).await.is_err() {
                    // Each frame ends with its only zero.
                    let frames = bytes.iter().filter(|byte| **byte == 0).count();
                    PORTS.put(Input::UartDropped(frames as u32)).await;
                }
                UART_RATE.try_take()
            }
            [] => match select(PORTS.uart_ready(), UART_RATE.wait()).await {
                Either::First(()) => None,
                Either::Second(rate) => Some(rate),
            },
        };
        if let Some(rate) = rate {
            uart.set_rate(rate).await;
        }
        PORTS.liveness.report(Worker::Uart);
    }
}

/// Passes requests from the serial line to the foot.
#[embassy_executor::task]
pub(super) async fn receive_uart(mut uart: crate::uart::Receiver) {
    /// More bytes than arrive during two ticks of the timer, at the largest rate.
    const CHUNK: usize = 128;
    let mut requests = UartReceiver::new();
    let mut bytes = [0; CHUNK];
    loop {
        let Some(bytes) = uart.receive(&mut bytes).await else {
            PORTS.put(Input::UartLost(1)).await;
            // A line with the wrong rate causes only errors.
            Timer::after_millis(1).await;
            continue;
        };
        for byte in bytes {
            if let Some(request) = requests.push(*byte) {
                REQUESTED.store(true, Ordering::Relaxed);
                PORTS.put(request).await;
            }
        }
        if let Some(refused) = requests.refused() {
            PORTS.put(refused).await;
        }
        // In an unbroken stream the next byte is always ready, and no other task of this or a lower level would run.
        Timer::after_ticks(1).await;
    }
}
