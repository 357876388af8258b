//! The bootloader of a board: installs a received program, starts the program, or serves the bus and the serial line.

#![no_std]
#![no_main]

mod chip;

use bootloader::adapter::Request;
use bootloader::node::{Line, Message, Node};
use bootloader::update::{ProgramState, Start, settle};
use bootloader::verify::KEY;

use chip::can::Can;
use chip::flash::ChipFlash;
use chip::serial::Serial;
use chip::{clock, note, settings, sleep, watchdog};
use wire::slcan::{BEL, CR};

#[cortex_m_rt::entry]
fn main() -> ! {
    watchdog::start();
    let mut flash = ChipFlash::new();
    if note::take_stay() {
        // The program has asked for the bootloader, so it has just run. It is not checked again, because a master waits
        // for the response.
        serve(flash, ProgramState::CanRun)
    }
    clock::speed_up();
    let settled = settle(&mut flash, KEY);
    clock::restore_speed();
    match settled {
        Ok(Start::Program) => chip::start_program(),
        Ok(Start::Nothing(why)) => serve(flash, ProgramState::Missing(why)),
        Err(_) => serve(flash, ProgramState::Unsettled),
    }
}

/// Serves the bus and the serial line until a master asks for a start, or is silent for a minute.
fn serve(flash: ChipFlash, program: ProgramState) -> ! {
    sleep::prepare();
    let mut ticks = clock::start();
    let (id, bit_rate, baud) = settings::read();
    let mut can = Can::start(bit_rate, id);
    let mut serial = Serial::start(baud);
    let mut node = Node::new(id, flash, chip::BOARD, chip::serial(), KEY);
    node.boot(program);
    let mut waiting = Some(Message::BootUp);
    let mut answer = match program {
        ProgramState::CanRun => Some(Message::Stopped),
        ProgramState::Missing(_) | ProgramState::Unsettled => None,
    };
    loop {
        watchdog::feed();
        sleep::forget();
        let mut is_idle = true;
        if let Some(can) = &mut can
            && let Some(frame) = can.receive()
        {
            is_idle = false;
            if let Some(answer) = node.receive(&frame, Line::Can) {
                can.send(&answer);
            }
            can.accept(node.id(Line::Can));
        }
        if let Some(serial) = &mut serial
            && let Some(word) = serial.receive()
        {
            is_idle = false;
            match word {
                Request::Frame(frame) => {
                    serial.send(&[CR]);
                    if let Some(answer) = node.receive(&frame, Line::Serial) {
                        serial.send_frame(&answer);
                    }
                }
                Request::Done => serial.send(&[CR]),
                Request::Unknown => serial.send(&[BEL]),
            }
        }
        for message in [waiting.take(), answer.take()].into_iter().flatten() {
            if let (Some(can), Some(frame)) = (&mut can, node.frame(message, Line::Can)) {
                can.send(&frame);
            }
            if let (Some(serial), Some(frame)) = (&serial, node.frame(message, Line::Serial)) {
                serial.send_frame(&frame);
            }
        }
        if ticks.has_passed() {
            waiting = node.tick(program);
        }
        if let Some(restart) = node.take_restart() {
            if let Some(can) = &mut can {
                can.finish();
            }
            if let Some(serial) = &serial {
                serial.finish();
            }
            note::write_for(restart);
            cortex_m::peripheral::SCB::sys_reset();
        }
        if is_idle {
            sleep::until_frame_or_tick();
        }
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    // The watchdog ends this loop.
    loop {
        cortex_m::asm::nop();
    }
}
