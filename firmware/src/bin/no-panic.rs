//! Links only where no panic can be reached from the public API of `estimator-core`, `lsm6dsox`
//! and `wire`: the panic handler calls a function that does not exist, and what cannot be reached
//! the linker drops.
//!
//! It is never run. Every input comes from memory that the compiler must take for unknown, and
//! every result goes there. `.ci/no-panic` builds it, and builds it once more with the feature
//! `one-panic`, where it must not link.

#![no_std]
#![no_main]

use core::cell::UnsafeCell;
use core::future::Future;
use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use core::pin::pin;
use core::task::{Context, Poll, Waker};

use embedded_hal_async::spi::{ErrorType, Operation, SpiDevice};
use estimator_core::stillness::{GravityErrorParams, QuantityParams, SlideParams};
use estimator_core::{
    AngularRate, AttitudeParams, ContactEstimate, ContactEstimator, DecisionParams, Gravity,
    ImuSample, Learning, Learnt, Load, LoadParams, Method, Parameter, Params, PerAxis, Phase,
    Probabilities, Quaternion, RestParams, Saturation, SpecificForce, StillnessParams, Timestamp,
    Validity, Vec3, WindowLength,
};
use lsm6dsox::{Config, FrequencyFine, FrozenDetector, Lsm6dsox, SensorTimestamp};
use wire::node::BootCause;
use wire::{CanFrame, Event, Fault, Faults, Node, Settings, pdo, uart};
// The vector table.
use stm32_metapac as _;

/// What the compiler leaves in every `async fn` that it does not see through. `await` never polls
/// a future again that was ready, and nothing else polls futures here.
const RESUMED: &str = "`async fn` resumed after completion";

// The compiler says that it ignores the attribute on such functions, but passes it on: without it
// the question below is asked at run time.
#[allow(unused_attributes)]
#[inline(always)]
#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    unsafe extern "C" {
        fn a_panic_can_be_reached() -> !;
    }
    // Only where no other panic is left can the compiler tell how this turns out.
    if info.message().as_str() == Some(RESUMED) {
        loop {}
    }
    // SAFETY: it does not exist, so it is never called.
    unsafe { a_panic_can_be_reached() }
}

/// Memory of which the compiler knows nothing.
struct Unknown(UnsafeCell<[u32; 64]>);

// SAFETY: there is only one thread.
unsafe impl Sync for Unknown {}

static UNKNOWN: Unknown = Unknown(UnsafeCell::new([0; 64]));

/// Any value of a type for which all bits are one.
fn any<T: Bits>() -> T {
    const { assert!(size_of::<T>() <= size_of::<[u32; 64]>()) };
    // SAFETY: the memory is large enough and aligned, and all its bits make a `T`.
    unsafe { UNKNOWN.0.get().cast::<T>().read_volatile() }
}

/// Types for which all bits are a value.
///
/// # Safety
/// They must be.
unsafe trait Bits: Copy {}

// SAFETY: all of them numbers.
unsafe impl Bits for u8 {}
// SAFETY: as above.
unsafe impl Bits for i8 {}
// SAFETY: as above.
unsafe impl Bits for u16 {}
// SAFETY: as above.
unsafe impl Bits for i16 {}
// SAFETY: as above.
unsafe impl Bits for u32 {}
// SAFETY: as above.
unsafe impl Bits for u64 {}
// SAFETY: as above.
unsafe impl Bits for f32 {}
// SAFETY: as above.
unsafe impl<T: Bits, const N: usize> Bits for [T; N] {}

fn any_bool() -> bool {
    any::<u8>() & 1 == 1
}

/// Makes the compiler compute `value`.
fn used<T>(value: T) {
    let mut place = MaybeUninit::<T>::uninit();
    // SAFETY: the place is one for a `T`; the volatile write is only there to be done.
    unsafe { place.as_mut_ptr().write_volatile(value) };
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
            7 => one_panic(),
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

fn any_vec3() -> Vec3 {
    Vec3::new(any(), any(), any())
}

fn any_per_axis() -> PerAxis<f32> {
    PerAxis::from_array(any())
}

fn any_window() -> WindowLength {
    if any_bool() {
        WindowLength::Duration(any())
    } else {
        WindowLength::Samples(any())
    }
}

fn any_quantity() -> QuantityParams {
    QuantityParams {
        floor: any(),
        still: any(),
        moving: any(),
        width: any(),
        edge: any(),
        inflation: any(),
        bandwidth: any(),
        indifference: any(),
        separation: any(),
    }
}

fn any_stillness() -> StillnessParams {
    StillnessParams {
        acceleration: any_quantity(),
        rate: any_quantity(),
        velocity: any_quantity(),
        window: any(),
        leak: any(),
        impact: any(),
        part_of_the_way: any(),
        least_bandwidth: any(),
        least_width: any(),
        largest_width: any(),
        prior: any(),
        memory: any(),
        stance: any(),
        motion: any(),
        relaxation: any(),
        slide: SlideParams {
            speed: any(),
            lever: any(),
            time_constant: any(),
            limit: any(),
        },
        gravity_error: GravityErrorParams {
            quiet: any(),
            start: any(),
            memory: any(),
            forgetting: any(),
            limit: any(),
        },
    }
}

fn any_learnt() -> Learnt {
    Learnt::from_array(any())
}

fn any_params() -> Params {
    Params {
        sample_rate: any(),
        method: if any_bool() {
            Method::SelfCalibrating
        } else {
            Method::HalfWidths
        },
        learning: if any_bool() {
            Learning::On
        } else {
            Learning::Frozen
        },
        learnt: any_bool().then(any_learnt),
        stillness: any_stillness().check().unwrap_or_default(),
        window: any_window(),
        bandwidth: any_per_axis(),
        half_width: any_per_axis(),
        gravity: if any_bool() {
            Gravity::Included
        } else {
            Gravity::Removed
        },
        attitude: AttitudeParams {
            motion_time_constant: any(),
            quiet_gain: any(),
            quiet_acceleration: any(),
            quiet_rate: any(),
            rest: RestParams {
                duration: any(),
                acceleration: any(),
                rate: any(),
                bias_limit: any(),
                bias_time_constant: any(),
            },
            ..AttitudeParams::DEFAULT
        },
        decision: DecisionParams {
            threshold: any(),
            on_delay: any(),
            off_delay: any(),
        },
        load: LoadParams {
            on_threshold: any(),
            off_threshold: any(),
        },
    }
}

fn any_sample() -> ImuSample {
    ImuSample {
        timestamp: Timestamp::from_micros(any()),
        specific_force: SpecificForce(any_vec3()),
        angular_rate: AngularRate(any_vec3()),
        validity: match any::<u8>() {
            0 => Validity::Valid,
            1 => Validity::Saturated(Saturation::Both),
            2 => Validity::Stale,
            _ => Validity::Invalid,
        },
    }
}

fn any_estimate() -> ContactEstimate {
    ContactEstimate {
        timestamp: Timestamp::from_micros(any()),
        probabilities: Probabilities {
            axes: any_per_axis(),
            tangential: any(),
            vertical: any(),
            stable: any(),
        },
        phase: Phase::ALL
            .get(usize::from(any::<u8>()))
            .copied()
            .unwrap_or_default(),
        orientation: Quaternion {
            w: any(),
            x: any(),
            y: any(),
            z: any(),
        },
        linear_acceleration: estimator_core::LinearAcceleration(any_vec3()),
        angular_rate: AngularRate(any_vec3()),
        gyro_bias: AngularRate(any_vec3()),
        ..ContactEstimate::default()
    }
}

fn any_faults() -> Faults {
    Faults::from_bits(any())
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

/// A bus that answers anything, or fails, or is not ready.
struct Bus;

#[derive(Debug)]
struct BusError;

impl embedded_hal_async::spi::Error for BusError {
    fn kind(&self) -> embedded_hal_async::spi::ErrorKind {
        embedded_hal_async::spi::ErrorKind::Other
    }
}

impl ErrorType for Bus {
    type Error = BusError;
}

impl Bus {
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

impl lsm6dsox::SetSpiClock for Bus {
    fn set_spi_clock(&mut self, _: lsm6dsox::SpiClock) {}
}

impl SpiDevice for Bus {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), BusError> {
        Maybe.await;
        Self::answer(operations)
    }
}

impl embedded_hal::spi::SpiDevice for Bus {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), BusError> {
        Self::answer(operations)
    }
}

/// Ready at some time.
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

/// A delay of any length.
struct Delay;

impl embedded_hal_async::delay::DelayNs for Delay {
    async fn delay_ns(&mut self, ns: u32) {
        used(ns);
        Maybe.await;
    }
}

impl embedded_hal::delay::DelayNs for Delay {
    fn delay_ns(&mut self, ns: u32) {
        used(ns);
    }
}

fn blocking_driver() {
    let mut sensor = Lsm6dsox::new(Bus, Config::FRESH_KILOHERTZ);
    while any_bool() {
        match any::<u8>() {
            0 => used(sensor.init(&mut Delay)),
            1 => used(sensor.sample()),
            2 => used(sensor.verify()),
            3 => used(sensor.self_test(&mut Delay)),
            4 => used(sensor.status()),
            5 => used(sensor.timestamp()),
            6 => used(sensor.frequency_fine()),
            7 => used(sensor.check_identity()),
            8 => used(sensor.power_down()),
            9 => used(sensor.reset_timestamp()),
            10 => used(sensor.reconfigure(Config::FRESH_KILOHERTZ, &mut Delay)),
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
    let mut sensor = lsm6dsox::asynch::Lsm6dsox::new(Bus, Config::FRESH_KILOHERTZ);
    while any_bool() {
        match any::<u8>() {
            0 => used(finish(sensor.init(&mut Delay))),
            1 => used(finish(sensor.sample())),
            2 => used(finish(sensor.verify())),
            3 => used(finish(sensor.self_test(&mut Delay))),
            4 => used(finish(sensor.check_identity())),
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

fn any_can_frame() -> Option<CanFrame> {
    let data: [u8; 8] = any();
    CanFrame::new(any(), data.get(..usize::from(any::<u8>()))?)
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
                    Some(Event::Store | Event::Restore | Event::ProtectSupply)
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
