//! The serial line: CDC on USB, with the frames of a UART.

use core::cell::Cell;
use core::future::poll_fn;
use core::pin::pin;
use core::task::Poll;

use embassy_futures::join::join4;
use embassy_futures::select::select;
use embassy_rp::Peri;
use embassy_rp::peripherals::USB;
use embassy_rp::usb::Driver;
use embassy_time::{Duration, Timer, with_timeout};
use embassy_usb::class::cdc_acm::{CdcAcmClass, ControlChanged, Receiver, Sender, State};
use embassy_usb::driver::EndpointError;
use embassy_usb::{Builder, Config};
use firmware::exchange::Input;
use firmware::ports::UartBatch;
use firmware::supervision::Worker;
use firmware::uart_requests::UartReceiver;

use crate::PORTS;
use crate::board::{Irqs, usb_errata};
use crate::usb_watch::{self, Watch};
use crate::wiring;

type Bus<'d> = Driver<'d, USB>;

/// Vendor and product of the CDC port of Raspberry Pi's SDK. Operating systems have a driver for it.
const VENDOR: u16 = 0x2E8A;
const PRODUCT: u16 = 0x000A;

/// Current that the board may take, mA. Arduino's programs for it request as much, because pins of the board supply
/// other devices.
const MAX_POWER: u16 = 500;

/// Largest packet of a full-speed bulk endpoint, bytes.
const PACKET: usize = 64;

/// Time without a packet taken by the host after which the queued frames are too old.
const DEADLINE: Duration = Duration::from_millis(20);

/// Baud rate that a host sets before it closes the port, to start the loader (Arduino's convention).
const LOADER_RATE: u32 = 1_200;

/// Time after which the host has the answer to a request, so that the loader may take the port away.
const ANSWERED: Duration = Duration::from_millis(20);

/// Serves the port of a board with the serial number `serial`, hexadecimal. A controller that hangs is reset.
#[embassy_executor::task]
pub async fn serve(mut usb: Peri<'static, USB>, serial: &'static str) {
    loop {
        select(run(usb.reborrow(), serial), usb_watch::hung()).await;
        usb_watch::reset_controller().await;
    }
}

/// Serves the port, forever.
async fn run(usb: Peri<'_, USB>, serial: &str) {
    let mut config = Config::new(VENDOR, PRODUCT);
    config.manufacturer = Some("footfall");
    config.product = Some("footfall foot");
    config.serial_number = Some(serial);
    config.max_power = MAX_POWER;
    let (mut descriptors, mut bos, mut control) = ([0; 256], [0; 32], [0; PACKET]);
    let (mut watch, mut state) = (Watch, State::new());
    let mut builder = Builder::new(
        Driver::new(usb, Irqs),
        config,
        &mut descriptors,
        &mut bos,
        &mut [],
        &mut control,
    );
    builder.handler(&mut watch);
    let port = CdcAcmClass::new(&mut builder, &mut state, PACKET as u16);
    let (sender, receiver, control) = port.split_with_control();
    let mut device = builder.build();
    usb_watch::watch_frames();
    join4(device.run(), usb_errata::connect(), send(sender, control), receive(receiver)).await;
}

/// Sends frames while a host has the port open. Frames that the host does not take in time are dropped and counted.
/// Starts the loader when a host asks for it.
async fn send<'d>(mut sender: Sender<'d, Bus<'d>>, control: ControlChanged<'d>) {
    let mut batch = UartBatch::default();
    let mut is_torn = false;
    loop {
        PORTS.liveness.report(Worker::Uart);
        if !sender.dtr() && sender.line_coding().data_rate() == LOADER_RATE {
            Timer::after(ANSWERED).await;
            wiring::start_loader();
        }
        let bytes = PORTS.take_uart(&mut batch);
        if bytes.is_empty() {
            select(PORTS.uart_ready(), control.control_changed()).await;
            continue;
        }
        if !sender.dtr() {
            // No host has opened the port.
            continue;
        }
        // Ends a frame that was sent only in part.
        if is_torn {
            is_torn = !is_taken(&mut sender, &[0]).await;
        }
        for packet in bytes.chunks(PACKET) {
            is_torn = is_torn || !is_taken(&mut sender, packet).await;
        }
        // A packet that is not full ends the transfer.
        if bytes.len().is_multiple_of(PACKET) && !is_torn {
            is_torn = !is_taken(&mut sender, &[]).await;
        }
        if is_torn {
            let frames = bytes.iter().filter(|byte| **byte == 0).count();
            PORTS.put(Input::UartDropped(frames as u32)).await;
        }
    }
}

/// Returns whether the host takes the previous packet before the deadline, so that this one is ready to be taken.
async fn is_taken<'d>(sender: &mut Sender<'d, Bus<'d>>, packet: &[u8]) -> bool {
    matches!(with_timeout(DEADLINE, write(sender, packet)).await, Ok(Ok(())))
}

/// Prepares a packet once the previous one is taken, early in a frame where the chip needs it: see [`usb_errata`].
async fn write<'d>(sender: &mut Sender<'d, Bus<'d>>, packet: &[u8]) -> Result<(), EndpointError> {
    let mut write = pin!(sender.write_packet(packet));
    loop {
        // No interrupt comes between the check and the packet.
        let poll = poll_fn(|cx| {
            Poll::Ready(cortex_m::interrupt::free(|_| {
                usb_errata::is_early().then(|| write.as_mut().poll(cx))
            }))
        });
        match poll.await {
            Some(Poll::Ready(result)) => return result,
            Some(Poll::Pending) => next_wake().await,
            None => usb_errata::until_early().await,
        }
    }
}

/// Waits until the task is woken.
async fn next_wake() {
    let is_first = Cell::new(true);
    poll_fn(|_| if is_first.take() { Poll::Pending } else { Poll::Ready(()) }).await;
}

/// Passes requests of the host to the foot.
async fn receive<'d>(mut receiver: Receiver<'d, Bus<'d>>) {
    let mut requests = UartReceiver::new();
    let mut packet = [0; PACKET];
    loop {
        receiver.wait_connection().await;
        while let Ok(length) = receiver.read_packet(&mut packet).await {
            PORTS.put_uart(&mut requests, packet.get(..length).unwrap_or_default()).await;
        }
        Timer::after(DEADLINE).await;
    }
}
