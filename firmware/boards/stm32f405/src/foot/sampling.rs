//! Sampling level: tick, edge, burst, estimate and frames.

use core::mem::{self, discriminant};
use core::sync::atomic::Ordering;

use firmware::Foot;
use firmware::costs::Cost;
use firmware::ports::{BusState, Input};
use firmware::sampling::{self, Sensor};

use super::{FAULT, LIGHT, PORTS};

/// Runs tick, edge, burst, estimate and frames, forever.
#[embassy_executor::task]
pub(super) async fn sample(
    sensor: Sensor<crate::sensor::SensorBus>,
    ticks: crate::timebase::Timebase,
    load: crate::load::LoadSensor,
    foot: &'static mut Foot,
    self_test: bool,
) {
    let mut bus = BusState::Active;
    let mut id = 0;
    crate::timebase::discard();
    sampling::run(sensor, crate::sensor::Delay, ticks, self_test, |tick, measurement| {
        // A contact that has waited for the bus since an earlier tick is no cost of the board.
        crate::can::forget_to_mailbox();
        foot.tick(tick, measurement, Some(load.reading()), &PORTS);
        report_bus_state(&mut bus);
        if mem::replace(&mut id, foot.node_id()) != foot.node_id() {
            crate::can::listen_as(foot.node_id());
        }
        let fault = if foot.faults().is_empty() { 0 } else { FAULT };
        LIGHT.store(foot.stage().code() | fault, Ordering::Relaxed);
        crate::flash::note_tick();
        // Ticks without a sample may be long: the sensor starts, or its burst hangs.
        if measurement.raw.is_some() {
            PORTS.costs.take(Cost::Mailbox, crate::can::to_mailbox());
            PORTS.costs.take(Cost::Work, crate::timebase::since_edge());
        }
    })
    .await;
}

/// Reports a change of the bus state to the foot, for its next tick. Bus-off lasts at least 1.4 ms.
fn report_bus_state(known: &mut BusState) {
    let state = crate::can::bus_state();
    // A change of the error counters alone is not reported.
    if discriminant(&state) != discriminant(known) && PORTS.try_put(Input::Bus(state)) {
        *known = state;
    }
}
