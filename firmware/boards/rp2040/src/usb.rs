//! The serial line: CDC on USB, with the frames of a UART.

use embassy_futures::join::join3;
use embassy_rp::Peri;
use embassy_rp::peripherals::USB;
use embassy_rp::usb::Driver;
use embassy_time::{Duration, Timer, with_timeout};
use embassy_usb::class::cdc_acm::{CdcAcmClass, Receiver, Sender, State};
use embassy_usb::{Builder, Config};
use firmware::ports::{Input, UartBatch};
use firmware::supervision::Worker;
use firmware::uart_requests::UartReceiver;
use static_cell::StaticCell;

use crate::{Irqs, PORTS, crash};

type Bus = Driver<'static, USB>;

/// Vendor and product: a CDC port of Raspberry Pi's SDK, for which systems bring drivers.
const VENDOR: u16 = 0x2E8A;
const PRODUCT: u16 = 0x000A;

/// Largest packet of a full-speed bulk endpoint, bytes.
const PACKET: usize = 64;

/// Time without a packet taken by the host after which the frames in it are too old.
const DEADLINE: Duration = Duration::from_millis(20);

/// Rate that a host sets, and then closes the port, to ask for the loader, Bd: the custom of Arduino.
const LOADER_RATE: u32 = 1_200;

/// Serves the port of a board with a serial number, hexadecimal.
#[embassy_executor::task]
pub async fn serve(usb: Peri<'static, USB>, serial: &'static str) {
    let mut config = Config::new(VENDOR, PRODUCT);
    config.manufacturer = Some("footfall");
    config.product = Some("footfall foot");
    config.serial_number = Some(serial);
    static DESCRIPTORS: StaticCell<[u8; 256]> = StaticCell::new();
    static BOS: StaticCell<[u8; 32]> = StaticCell::new();
    static CONTROL: StaticCell<[u8; PACKET]> = StaticCell::new();
    static STATE: StaticCell<State> = StaticCell::new();
    let mut builder = Builder::new(
        Driver::new(usb, Irqs),
        config,
        DESCRIPTORS.init([0; 256]),
        BOS.init([0; 32]),
        &mut [],
        CONTROL.init([0; PACKET]),
    );
    let (sender, receiver) =
        CdcAcmClass::new(&mut builder, STATE.init(State::new()), PACKET as u16).split();
    let mut device = builder.build();
    join3(device.run(), send(sender), receive(receiver)).await;
}

/// Sends the frames while a host has opened the port; those that it does not take in time are counted.
async fn send(mut sender: Sender<'static, Bus>) {
    let mut batch = UartBatch::default();
    let mut is_torn = false;
    loop {
        PORTS.liveness.report(Worker::Uart);
        let bytes = match PORTS.take_uart(&mut batch) {
            [] => {
                PORTS.uart_ready().await;
                continue;
            }
            bytes => bytes,
        };
        if !sender.dtr() {
            if sender.line_coding().data_rate() == LOADER_RATE {
                crash::start_loader();
            }
            // No host has opened the port.
            continue;
        }
        // Ends a frame of which only the start was taken.
        if is_torn {
            is_torn = !is_taken(&mut sender, &[0]).await;
        }
        for packet in bytes.chunks(PACKET) {
            is_torn = is_torn || !is_taken(&mut sender, packet).await;
        }
        // A transfer ends with a packet that is not full.
        if bytes.len().is_multiple_of(PACKET) && !is_torn {
            is_torn = !is_taken(&mut sender, &[]).await;
        }
        if is_torn {
            let frames = bytes.iter().filter(|byte| **byte == 0).count();
            PORTS.put(Input::UartDropped(frames as u32)).await;
        }
    }
}

/// Returns whether the host takes a packet before the deadline.
async fn is_taken(sender: &mut Sender<'static, Bus>, packet: &[u8]) -> bool {
    matches!(with_timeout(DEADLINE, sender.write_packet(packet)).await, Ok(Ok(())))
}

/// Passes requests of the host to the foot.
async fn receive(mut receiver: Receiver<'static, Bus>) {
    let mut requests = UartReceiver::new();
    let mut packet = [0; PACKET];
    loop {
        receiver.wait_connection().await;
        while let Ok(length) = receiver.read_packet(&mut packet).await {
            requests.pass(packet.get(..length).unwrap_or_default(), &PORTS).await;
        }
        Timer::after(DEADLINE).await;
    }
}
