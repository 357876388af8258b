//! Requests to the foot, and the resulting requests to the board.

use wire::dictionary::{self, Concern};
use wire::node::{BootCause, Calibration, State};
use wire::uart::Message;
use wire::{AbortCode, Address, Counter, Event, Fault};

use super::Foot;
use super::renewal::Renewal;
use crate::outlet::Lane;
use crate::ports::{Input, Ports, Reloaded, Request};
use crate::uart_requests;
use storage::{Erase, Origin, StoreFailed};

/// Maximum number of requests handled per tick; more wait for the next.
pub const INPUTS_PER_TICK: usize = 8;

/// Stores and restores that may follow each other at once after power-up; then there is one in each 1024 ticks: a sector of
/// flash endures 10 000 erases (STM32F405 data sheet, DS8626), and 50 stores a second would use them up in hours. After a
/// commanded reset there is none at first, so that resets do not raise the rate.
pub const STORES_AT_ONCE: u8 = 4;

/// Destination of the response to a store or a restore.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Requester {
    Can,
    Uart(Address),
}

/// Pending requests.
#[derive(Debug, Default)]
pub(super) struct Requests {
    storing: Option<Requester>,
    /// Number of stores that are possible now, at most [`STORES_AT_ONCE`].
    stores_left: u8,
    /// Request that needs a response, deferred until the estimate is sent.
    deferred: Option<Input>,
    /// Request to the board for which the queue had no room yet.
    pending_request: Option<Request>,
}

impl Foot {
    /// Handles inputs in order, up to the first request that needs a response. Returns the number of
    /// inputs handled.
    pub(super) fn take_inputs(&mut self, ports: &Ports) -> usize {
        if let Some(reloaded) = ports.take_reloaded() {
            self.take_reloaded(reloaded, ports);
        }
        for taken in 0..INPUTS_PER_TICK {
            let Some(input) = ports.take_input() else {
                return taken;
            };
            if input.needs_answer() {
                self.requests.deferred = Some(input);
                return taken;
            }
            self.take_input(&input, ports);
        }
        INPUTS_PER_TICK
    }

    /// Answers the deferred request, and handles later inputs: `most` in all.
    pub(super) fn answer(&mut self, most: usize, ports: &Ports) {
        if let Some(input) = self.requests.deferred.take() {
            self.node.set_learnt(self.learnt());
            self.node.set_costs(ports.costs.largest());
            self.take_input(&input, ports);
            for _ in 1..most {
                let Some(input) = ports.take_input() else {
                    break;
                };
                self.take_input(&input, ports);
            }
        }
        self.pass_pending_request(ports);
    }

    /// Passes the request to the board if the queue has room, otherwise again on the next tick.
    fn pass_pending_request(&mut self, ports: &Ports) {
        if let Some(request) = self.requests.pending_request.take()
            && !ports.request(request.clone())
        {
            self.requests.pending_request = Some(request);
        }
    }

    fn take_reloaded(&mut self, reloaded: Reloaded, ports: &Ports) {
        let Reloaded { settings, origin } = reloaded;
        let renewal = if settings.learnt() == self.settings().learnt() {
            Renewal::Continue
        } else {
            Renewal::Restart
        };
        self.node.set_settings(settings);
        self.renew(renewal);
        self.boot(BootCause::Commanded, ports);
        self.check_origin(origin, ports);
    }

    /// Raises or clears the fault of settings that are not those stored.
    pub(super) fn check_origin(&mut self, origin: Origin, ports: &Ports) {
        match origin.fault_detail() {
            Some(detail) => self.raise(Fault::ConfigCorrupted, detail, ports),
            None => self.clear(Fault::ConfigCorrupted, ports),
        }
    }

    fn take_input(&mut self, input: &Input, ports: &Ports) {
        match input {
            Input::Can(frame, at) => {
                let outcome = self.node.receive(frame, *at);
                if let Some(reply) = outcome.reply {
                    self.push_can(Lane::Answer, reply, ports);
                }
                if let Some(event) = outcome.event {
                    self.act(event, Requester::Can, ports);
                }
            }
            Input::Uart(request) => {
                let outcome = uart_requests::answer(&mut self.node, request);
                if let Some(response) = outcome.response {
                    self.push_uart(Lane::Answer, &Message::ConfigResponse(response), ports);
                }
                if let Some(event) = outcome.event {
                    let address = outcome.address.unwrap_or(Address::new(0, 0));
                    self.act(event, Requester::Uart(address), ports);
                }
            }
            Input::UartRefused(count) => self.counters.add(Counter::UartRefused, *count),
            Input::UartLost(count) => {
                self.counters.add(Counter::UartOverruns, *count);
                let lost = self.counters.get(Counter::UartOverruns);
                self.raise_event(Fault::UartOverrun, lost, ports);
            }
            Input::UartDropped(count) => self.counters.add(Counter::UartDropped, *count),
            Input::CanWithdrawn(count) => self.counters.add(Counter::CanDropped, *count),
            Input::CanLost(count) => self.count_lost_can(*count, ports),
            Input::Bus(state) => self.take_bus_state(*state, ports),
            Input::Stored(result) => self.finish_settings(*result, ports),
            Input::Protected(result) => self.finish_store(*result, ports),
        }
    }

    fn act(&mut self, event: Event, requester: Requester, ports: &Ports) {
        match event {
            Event::Changed(address) => match dictionary::concern(address) {
                Some(Concern::Learnt) => self.renew(Renewal::Restart),
                Some(
                    Concern::Correction
                    | Concern::Load
                    | Concern::Estimator
                    | Concern::Parameter(_),
                ) => self.renew(Renewal::Continue),
                Some(Concern::Node | Concern::Stream | Concern::Sensor) | None => {}
            },
            Event::Store | Event::Restore if self.requests.stores_left == 0 => {
                self.answer_store(requester, Err(AbortCode::TooSoon), ports);
            }
            Event::Store => {
                let request = Request::Store(self.settings().clone(), self.erase());
                self.store(requester, request, ports);
            }
            Event::Restore => self.store(requester, Request::Restore(self.erase()), ports),
            Event::ProtectSupply => self.store(requester, Request::ProtectSupply, ports),
            Event::ConfirmProgram => self.store(requester, Request::ConfirmProgram, ports),
            Event::StopProgram => self.requests.pending_request = Some(Request::StopProgram),
            Event::ResetNode => self.requests.pending_request = Some(Request::Reset),
            // A reset of the node includes a reset of the communication.
            Event::ResetCommunication if self.requests.pending_request == Some(Request::Reset) => {}
            Event::ResetCommunication => self.requests.pending_request = Some(Request::Reload),
            Event::Calibration(Calibration::Forget) => self.renew(Renewal::Restart),
            // The estimator has the values already.
            Event::Calibration(Calibration::Keep) => {}
            // The node keeps the load and the time, with their age.
            Event::Load(_) | Event::State(_) | Event::Sync(_) | Event::Time(_) => {}
        }
    }

    /// Process data never stop for an erase: only a foot that sends none may erase.
    fn erase(&self) -> Erase {
        match self.node.state() {
            State::Operational => Erase::Refused,
            _ => Erase::Allowed,
        }
    }

    fn store(&mut self, requester: Requester, request: Request, ports: &Ports) {
        if self.requests.storing.is_none() && ports.request(request) {
            self.requests.storing = Some(requester);
        } else {
            self.answer_store(requester, Err(AbortCode::Hardware), ports);
        }
    }

    /// Sets the number of stores that are possible now.
    pub(super) const fn allow_stores(&mut self, count: u8) {
        self.requests.stores_left = count;
    }

    /// Makes one more store possible.
    pub(super) fn allow_store(&mut self) {
        self.allow_stores(self.requests.stores_left.saturating_add(1).min(STORES_AT_ONCE));
    }

    fn finish_settings(&mut self, result: Result<(), StoreFailed>, ports: &Ports) {
        if result != Err(StoreFailed::NeedsErase) {
            self.allow_stores(self.requests.stores_left.saturating_sub(1));
        }
        match result {
            Ok(()) => {
                self.clear(Fault::ConfigStore, ports);
                self.clear(Fault::ConfigCorrupted, ports);
            }
            Err(StoreFailed::NeedsErase) => {}
            Err(error) => self.raise(Fault::ConfigStore, error as u32, ports),
        }
        self.finish_store(result, ports);
    }

    fn finish_store(&mut self, result: Result<(), StoreFailed>, ports: &Ports) {
        if let Some(requester) = self.requests.storing.take() {
            self.answer_store(requester, result.map_err(StoreFailed::abort_code), ports);
        }
    }

    fn answer_store(&mut self, requester: Requester, result: Result<(), AbortCode>, ports: &Ports) {
        match requester {
            Requester::Can => {
                if let Some(frame) = self.node.finish(result) {
                    self.push_can(Lane::Answer, frame, ports);
                }
            }
            Requester::Uart(address) => {
                let response = uart_requests::finished(address, result);
                self.push_uart(Lane::Answer, &Message::ConfigResponse(response), ports);
            }
        }
    }
}
