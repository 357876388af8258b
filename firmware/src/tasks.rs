//! Tasks that a board spawns: [`sample`] at the sampling level, and those of the thread level, which have no deadline:
//! settings, watchdog, LED.

use core::mem::discriminant;

use embedded_hal::digital::OutputPin;
use embedded_hal_async::delay::DelayNs;
use embedded_storage::nor_flash::NorFlash;
use lsm6dsox::{AsyncBus, SetBusSpeed};
use storage::{Storage, StoreFailed};

use crate::board::Board;
use crate::exchange::{BusState, Exchange, Input, Reloaded, Request};
use crate::foot::{Foot, Inputs};
use crate::ports::{Mailboxes, Ports};
use crate::sampling::{self, Measurement, Sensor, Tick, Ticks};
use crate::supervision::{Cost, StackDepth};

/// Time in which the response to a stop is sent, ms. It is enough for some frames at 125 kbit/s.
const ANSWERING_MS: u32 = 20;

/// Time for which the watchdog is fed before a new program is confirmed, ms.
const CONFIRMED_MS: u32 = 10_000;

/// Runs the sensor and the foot of a board at each tick, forever. The sensor tests itself first if the settings request
/// that.
pub async fn sample<BUS: AsyncBus + SetBusSpeed>(
    sensor: Sensor<BUS>,
    delay: impl DelayNs,
    ticks: impl Ticks,
    foot: &mut Foot,
    board: &impl Board,
    ports: &Ports<impl Mailboxes>,
) -> ! {
    let self_test = foot.settings().self_test();
    let mut bus = BusState::Active;
    let mut node_id = 0;
    let mut exchange = Exchange::new();
    sampling::run(sensor, delay, ticks, self_test, |tick, measurement| {
        board.begin_tick();
        run_tick(foot, ports, &mut exchange, tick, measurement, board.load_reading());
        // The foot takes the state on its next tick, which is soon enough: bus-off lasts at least 1.4 ms. A change of
        // the error counters alone is not reported.
        let state = board.bus_state();
        if discriminant(&state) != discriminant(&bus) && ports.try_put(Input::Bus(state)) {
            bus = state;
        }
        if foot.node_id() != node_id {
            node_id = foot.node_id();
            board.listen_as(node_id);
        }
        ports.light.show(foot.stage(), foot.faults());
        board.end_tick();
        // Ticks without a sample may be long, because the sensor starts or its burst hangs.
        if measurement.raw.is_some() {
            ports.costs.raise_to(Cost::Mailbox, board.micros_to_mailbox());
            ports.costs.raise_to(Cost::Work, board.micros_since_edge(tick));
        }
    })
    .await
}

/// Runs a foot for one tick: what has arrived at `ports` goes in, and what it sends goes out. `load_reading` is the
/// newest reading of the analog load input, if the board has one.
pub fn run_tick(
    foot: &mut Foot,
    ports: &Ports<impl Mailboxes>,
    exchange: &mut Exchange,
    tick: &Tick,
    measurement: &Measurement,
    load_reading: Option<u16>,
) {
    let Exchange { received, outbox } = exchange;
    ports.receive(received);
    let costs = ports.costs.largest();
    let inputs = Inputs { tick, measurement, load_reading, received, costs };
    foot.tick(&inputs, outbox);
    foot.count_dropped(ports.send(outbox));
    foot.stream(&inputs, outbox);
    foot.count_dropped(ports.send(outbox));
    // Responses have no deadline. They follow when the frames of the tick are sent.
    foot.respond(&inputs, outbox);
    foot.count_dropped(ports.send(outbox));
}

/// Serves requests of the foot that take longer than a tick, forever.
pub async fn serve_requests<F: NorFlash>(
    mut storage: Storage<F>,
    mut delay: impl DelayNs,
    board: &impl Board,
    ports: &Ports<impl Mailboxes>,
) -> !
where
    StoreFailed: From<F::Error>,
{
    loop {
        match ports.next_request().await {
            Request::Store(settings, erase) => {
                let stored = storage.store(&settings, erase);
                ports.put(Input::Stored(stored)).await;
            }
            Request::Restore(erase) => {
                let restored = storage.restore(erase);
                ports.put(Input::Stored(restored)).await;
            }
            Request::ProtectSupply => ports.put(Input::Completed(board.protect())).await,
            Request::ConfirmProgram => ports.put(Input::Completed(board.confirm_program())).await,
            Request::StopProgram => {
                delay.delay_ms(ANSWERING_MS).await;
                board.start_bootloader();
            }
            Request::Reload => {
                let (settings, origin) = storage.load();
                board.apply_rates(&settings);
                ports.reload(Reloaded { settings, origin });
            }
            Request::Reset => board.reset(),
        }
    }
}

/// Feeds the watchdog while all workers are alive, confirms a new program, and measures the depth of the stack,
/// forever.
///
/// A new program is confirmed once another node has acknowledged a frame or sent a request. The foot can then be
/// reached over one of its lines, and so be updated again. Sending on the serial line proves nothing, because it also
/// works without a receiver.
pub async fn feed_watchdog<B: Board>(
    mut delay: impl DelayNs,
    board: &B,
    ports: &Ports<impl Mailboxes>,
) -> ! {
    let mut depth = StackDepth::default();
    let (mut feedings, mut is_confirmed) = (0_u32, false);
    loop {
        ports.wake_senders();
        delay.delay_ms(B::FEEDING_MS).await;
        if ports.liveness.all_alive() {
            board.feed_watchdog();
            feedings = feedings.saturating_add(1);
            let is_reachable = || ports.has_had_request() || board.is_acknowledged();
            if !is_confirmed && feedings >= CONFIRMED_MS / B::FEEDING_MS && is_reachable() {
                is_confirmed = board.confirm_program().is_ok();
                // A failure may come from a low supply, so another attempt follows in ten seconds.
                feedings = 0;
            }
        }
        if let Some(used) = board.look_at_stack(&mut depth) {
            ports.costs.raise_to(Cost::Stack, used as u32);
        }
    }
}

/// Shows the stage and a fault, forever. The LED is lit when its pin is high.
pub async fn blink(
    mut led: impl OutputPin,
    mut delay: impl DelayNs,
    ports: &Ports<impl Mailboxes>,
) -> ! {
    loop {
        let (on_ms, off_ms) = ports.light.on_off_ms();
        // The pins of a chip do not fail.
        let _ = led.set_high();
        delay.delay_ms(on_ms).await;
        let _ = led.set_low();
        delay.delay_ms(off_ms).await;
    }
}

#[cfg(test)]
mod tests {
    use core::cell::{Cell, RefCell};
    use core::future::poll_fn;
    use core::pin::pin;
    use core::task::{Context, Poll, Waker};
    use std::vec::Vec;

    use super::*;
    use crate::supervision::Worker;
    use wire::Settings;

    /// Board that counts calls.
    #[derive(Default)]
    struct Counting {
        fed: Cell<u32>,
        is_acknowledged: Cell<bool>,
        confirms: Cell<bool>,
        /// Number of feedings before each attempt to confirm the program.
        attempts: RefCell<Vec<u32>>,
    }

    impl Board for Counting {
        const FEEDING_MS: u32 = 100;

        fn load_reading(&self) -> Option<u16> {
            None
        }

        fn micros_since_edge(&self, _: &Tick) -> u32 {
            0
        }

        fn is_acknowledged(&self) -> bool {
            self.is_acknowledged.get()
        }

        fn feed_watchdog(&self) {
            self.fed.set(self.fed.get() + 1);
        }

        fn look_at_stack(&self, _: &mut StackDepth) -> Option<usize> {
            Some(self.fed.get() as usize)
        }

        fn apply_rates(&self, _: &Settings) {}

        fn protect(&self) -> Result<(), StoreFailed> {
            Ok(())
        }

        fn confirm_program(&self) -> Result<(), StoreFailed> {
            self.attempts.borrow_mut().push(self.fed.get());
            if self.confirms.get() { Ok(()) } else { Err(StoreFailed::SupplyLow) }
        }

        fn start_bootloader(&self) -> ! {
            panic!("no request asks for it")
        }

        fn reset(&self) -> ! {
            panic!("no request asks for it")
        }
    }

    /// A delay that ends at the next poll.
    struct NextPoll;

    impl DelayNs for NextPoll {
        async fn delay_ns(&mut self, _: u32) {
            let mut is_over = false;
            poll_fn(|_| {
                if is_over {
                    return Poll::Ready(());
                }
                is_over = true;
                Poll::Pending
            })
            .await;
        }
    }

    /// Feeds the watchdog of `board`, and calls `act` with the number of each interval before it.
    fn feed(board: &Counting, ports: &Ports, intervals: u32, mut act: impl FnMut(u32)) {
        let mut future = pin!(feed_watchdog(NextPoll, board, ports));
        let mut context = Context::from_waker(Waker::noop());
        for interval in 0..=intervals {
            assert!(future.as_mut().poll(&mut context).is_pending());
            act(interval);
        }
    }

    fn report_all(ports: &Ports) {
        for worker in Worker::ALL {
            ports.liveness.report(worker);
        }
    }

    #[test]
    fn the_watchdog_is_fed_while_all_workers_report() {
        let (board, ports) = (Counting::default(), Ports::new());
        feed(&board, &ports, 30, |interval| {
            if interval < 20 {
                report_all(&ports);
            }
        });
        assert_eq!(board.fed.get(), 20);
        assert_eq!(ports.costs.largest().stack_bytes, 20);
    }

    #[test]
    fn a_program_is_confirmed_once_it_has_run_and_can_be_reached() {
        let (board, ports) = (Counting::default(), Ports::new());
        feed(&board, &ports, 500, |interval| {
            report_all(&ports);
            board.is_acknowledged.set(interval >= 150);
            board.confirms.set(interval >= 300);
        });
        // The foot can be reached after fifteen seconds. A failed confirmation is repeated after ten, and a success is final.
        assert_eq!(*board.attempts.borrow(), [151, 251, 351]);
    }

    #[test]
    fn a_request_over_the_serial_line_shows_that_a_foot_can_be_reached() {
        let (board, ports) = (Counting::default(), Ports::new());
        board.confirms.set(true);
        let request = wire::uart::NmtRequest(wire::node::NmtCommand::StartRemoteNode);
        let request = Input::Uart(crate::uart_requests::UartRequest::Nmt(request));
        let mut put = pin!(ports.put(request));
        let mut context = Context::from_waker(Waker::noop());
        assert!(put.as_mut().poll(&mut context).is_ready());
        feed(&board, &ports, 200, |_| report_all(&ports));
        assert_eq!(*board.attempts.borrow(), [100]);
    }
}
