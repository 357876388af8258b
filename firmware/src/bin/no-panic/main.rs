//! Links only if no panic can be reached from the public API of `estimator-core`, `lsm6dsox`
//! and `wire`: the panic handler calls a function that does not exist, and the linker drops what
//! cannot be reached.
//!
//! It is never run. Every input comes from memory unknown to the compiler, and
//! every result is written. `.ci/no-panic` builds it, and builds it once more with the feature
//! `one-panic`, where it must not link.

#![no_std]
#![no_main]

mod bus;
mod inputs;

use core::future::Future;
use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use core::pin::pin;
use core::task::{Context, Poll, Waker};

use estimator_core::{ContactEstimator, Load, Parameter, Timestamp};
use lsm6dsox::{Config, FrequencyFine, FrozenDetector, Lsm6dsox, SensorTimestamp};
use wire::node::BootCause;
use wire::{Event, Fault, Node, Settings, pdo, uart};
// The vector table.
use stm32_metapac as _;

use bus::{AnyBus, AnyDelay};
use inputs::{
    any, any_bool, any_can_frame, any_estimate, any_faults, any_learnt, any_mounting, any_params,
    any_sample,
};

/// The message of the panic that the compiler leaves in every `async fn` that it cannot analyse. `await`
/// never polls a future again that was ready, and nothing else polls futures here.
const RESUMED: &str = "`async fn` resumed after completion";

// The compiler reports that it ignores the attribute on such functions, but passes it on: without it
// the condition below is evaluated at run time.
#[allow(unused_attributes)]
#[inline(always)]
#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    unsafe extern "C" {
        fn a_panic_can_be_reached() -> !;
    }
    // The compiler can evaluate this condition only if no other panic is left.
    if info.message().as_str() == Some(RESUMED) {
        loop {}
    }
    // SAFETY: the function does not exist, so it is never called.
    unsafe { a_panic_can_be_reached() }
}

/// Makes the compiler compute `value`.
fn used<T>(value: T) {
    let mut sink = MaybeUninit::<T>::uninit();
    // SAFETY: `sink` has room for a `T`; the volatile write only forces the compiler to compute it.
    unsafe { sink.as_mut_ptr().write_volatile(value) };
}

#[cortex_m_rt::entry]
fn main() -> ! {
    loop {
        match any::<u8>() {
            0 => estimator(),
            1 => blocking_driver(),
            2 => async_driver(),
            3 => decoders_of_the_driver(),
            4 => node(),
            5 => uart(),
            6 => codecs(),
            7 => mounting(),
            8 => one_panic(),
            _ => {}
        }
    }
}

#[cfg(not(feature = "one-panic"))]
fn one_panic() {}

#[cfg(feature = "one-panic")]
fn one_panic() {
    let table: [u8; 64] = any();
    used(table[usize::from(any::<u8>())]);
}

fn estimator() {
    let mut params = any_params();
    for parameter in Parameter::ALL.into_iter().filter(|_| any_bool()) {
        parameter.set(&mut params, any());
        used(parameter.get(&params));
        used(parameter.row());
    }
    let Ok(config) = params.validate::<256>() else {
        return;
    };
    let mut estimator = ContactEstimator::new(&config);
    while any_bool() {
        let load = any_bool().then(|| Load(any()));
        used(estimator.update(&any_sample(), load));
        let learnt = estimator.learnt();
        used(learnt.is_settled());
        used(learnt.to_array());
    }
    used(estimator_core::erf::erf(any()));
    used(estimator_core::logarithm::ln(any()));
    used(estimator_core::logarithm::exp(any()));
}

fn mounting() {
    let params = any_mounting();
    used(params.validate());
    if let Ok(mounting) = params.validate() {
        let mut sample = any_sample();
        mounting.apply(&mut sample.specific_force, &mut sample.angular_rate);
        used(sample);
        used(mounting.params());
    }
}

fn blocking_driver() {
    let mut sensor = Lsm6dsox::new(AnyBus, Config::FRESH_KILOHERTZ);
    while any_bool() {
        match any::<u8>() {
            0 => used(sensor.init(&mut AnyDelay)),
            1 => used(sensor.sample()),
            2 => used(sensor.verify()),
            3 => used(sensor.self_test(&mut AnyDelay)),
            4 => used(sensor.status()),
            5 => used(sensor.timestamp()),
            6 => used(sensor.frequency_fine()),
            7 => used(sensor.check_identity()),
            8 => used(sensor.power_down()),
            9 => used(sensor.reset_timestamp()),
            10 => used(sensor.reconfigure(Config::FRESH_KILOHERTZ, &mut AnyDelay)),
            11 => used(sensor.fifo_status()),
            _ => {
                let mut buffer = [[0; 7]; 32];
                if let Ok(batch) = sensor.read_fifo(&mut buffer) {
                    batch.words().for_each(used);
                }
            }
        }
    }
}

/// Polls until ready.
fn finish<T>(future: impl Future<Output = T>) -> T {
    let mut future = pin!(future);
    loop {
        if let Poll::Ready(value) = future
            .as_mut()
            .poll(&mut Context::from_waker(Waker::noop()))
        {
            return value;
        }
    }
}

fn async_driver() {
    let mut sensor = lsm6dsox::asynch::Lsm6dsox::new(AnyBus, Config::FRESH_KILOHERTZ);
    while any_bool() {
        match any::<u8>() {
            0 => used(finish(sensor.init(&mut AnyDelay))),
            1 => used(finish(sensor.sample())),
            2 => used(finish(sensor.verify())),
            3 => used(finish(sensor.self_test(&mut AnyDelay))),
            4 => {
                used(finish(sensor.check_identity()));
                used(finish(sensor.check_identity_and_rate()));
            }
            _ => {
                let mut buffer = [[0; 7]; 32];
                if let Ok(batch) = finish(sensor.read_fifo(&mut buffer)) {
                    batch.words().for_each(used);
                }
            }
        }
    }
}

fn decoders_of_the_driver() {
    let mut frozen = FrozenDetector::new();
    while any_bool() {
        if let Ok(raw) = lsm6dsox::RawSample::decode(&any(), &Config::FRESH_KILOHERTZ) {
            used(raw.to_si());
            used(frozen.update(&raw));
        }
    }
    used(lsm6dsox::FifoStatus::decode(any()));
    used(lsm6dsox::FifoWord::decode(any(), &Config::FRESH_KILOHERTZ));
    used(SensorTimestamp(any()).micros_since(SensorTimestamp(any()), FrequencyFine(any())));
    used(Config::FRESH_KILOHERTZ.noise());
}

fn node() {
    let mut node = Node::new(Settings::default(), any());
    used(node.boot(BootCause::PowerUp));
    while any_bool() {
        match any::<u8>() {
            0 => {
                let Some(frame) = any_can_frame() else {
                    continue;
                };
                let outcome = node.receive(&frame, Timestamp::from_micros(any()));
                used(outcome.reply);
                if matches!(
                    outcome.event,
                    Some(
                        Event::Store
                            | Event::Restore
                            | Event::ProtectSupply
                            | Event::ConfirmProgram
                    )
                ) {
                    let result = any_bool().then_some(()).ok_or(wire::AbortCode::Hardware);
                    used(node.finish(result));
                }
                used(outcome.event);
            }
            1 => node.tick(&any_estimate(), any(), &wire::Counters::default(), used),
            2 => {
                let Some(fault) = Fault::from_number(any()) else {
                    continue;
                };
                used(node.raise(fault, any()));
                used(node.clear(fault));
            }
            3 => used(node.read(wire::Address::new(any(), any()))),
            4 => {
                let bytes: [u8; 8] = any();
                let Some(bytes) = bytes.get(..usize::from(any::<u8>())) else {
                    continue;
                };
                used(node.write(wire::Address::new(any(), any()), bytes));
            }
            5 => {
                let (settings, refused) = Settings::set_all(node.settings().iter());
                used(refused);
                node.set_settings(settings);
                used(node.boot(BootCause::Commanded));
            }
            6 => {
                let accelerometer = node.settings().accelerometer();
                used(accelerometer.apply(any_sample().specific_force));
            }
            7 => node.set_learnt(any_learnt()),
            8 => used(wire::dictionary::concern(wire::Address::new(any(), any()))),
            _ => used(node.settings().params().validate::<256>()),
        }
    }
}

fn uart() {
    let mut decoder = uart::Decoder::new();
    while any_bool() {
        if let Some(Ok(frame)) = decoder.push(any()) {
            used(uart::encode(any(), &frame.message));
        }
    }
    used(decoder.drops());
    let contact = uart::ContactMessage::new(&any_estimate(), any_faults());
    used(uart::encode(any(), &uart::Message::Contact(contact)));
    let text: [u8; 256] = any();
    let text = text.get(..usize::from(any::<u8>())).unwrap_or(&[]);
    if let Ok(text) = core::str::from_utf8(text) {
        let log = uart::LogMessage::new(any(), text);
        used(log.text().len());
        used(uart::encode(any(), &uart::Message::Log(log)));
    }
}

fn codecs() {
    let contact = pdo::Contact::new(&any_estimate(), any(), any_faults());
    used(contact.encode());
    used(pdo::Contact::decode(&any()));
    used(pdo::Axes::decode(&any()).encode());
    used(pdo::Attitude::decode(&any()).encode());
    used(pdo::Acceleration::decode(&any()).encode());
    used(pdo::Rate::decode(&any()).encode());
    used(pdo::Bias::decode(&any()).encode());
    used(pdo::Health::decode(&any()).encode());
    used(wire::Emergency::decode(&any()).encode());
}
