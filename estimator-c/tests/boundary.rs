//! Calls as a faulty program makes them: NULL, misaligned, too little memory, and any bits.

use std::ffi::{CStr, c_void};
use std::mem::{MaybeUninit, align_of, size_of};
use std::ptr;

use estimator_c::boundary::*;
use estimator_c::error::Error;
use estimator_c::estimator::{Estimator, MOST_SAMPLES, SIZE};
use estimator_c::types::{CEstimate, CLearnt, CParams, CSample};
use estimator_core::Learnt;
use host_tests::changed::Chance;

#[repr(align(8))]
struct Memory([u8; SIZE + 8]);

/// Returns a struct of random bytes. Every bit pattern must be a valid value of its type.
fn fill<T: Copy>(chance: &mut Chance) -> T {
    let mut value = MaybeUninit::<T>::zeroed();
    let start = value.as_mut_ptr().cast::<u8>();
    for at in 0..size_of::<T>() {
        // SAFETY: Within the value.
        unsafe { start.add(at).write(chance.bits() as u8) };
    }
    // SAFETY: The structs of the header have only floats and integers.
    unsafe { value.assume_init() }
}

fn init(memory: *mut c_void, size: usize, params: &CParams) -> Result<*mut Estimator, i32> {
    let mut estimator = ptr::dangling_mut();
    // SAFETY: NULL, or memory of at least `size` bytes.
    let error = unsafe { footfall_estimator_init(memory, size, params, &raw mut estimator) };
    assert_eq!(error == 0, !estimator.is_null());
    if error == 0 { Ok(estimator) } else { Err(error) }
}

fn update(estimator: *mut Estimator, sample: &CSample, load: Option<f32>) -> (i32, CEstimate) {
    let mut estimate = fill(&mut Chance::new(2));
    let load = load.as_ref().map_or(ptr::null(), ptr::from_ref);
    // SAFETY: NULL, or an estimator's size of memory.
    let error = unsafe { footfall_estimator_update(estimator, sample, load, &raw mut estimate) };
    (error, estimate)
}

/// The estimate after an error.
const DOUBTFUL: CEstimate = CEstimate {
    timestamp_us: 0,
    stable: 0.0,
    tangential: 0.0,
    vertical: 0.0,
    axes: [0.0; 6],
    orientation: [1.0, 0.0, 0.0, 0.0],
    linear_acceleration_m_s2: [0.0; 3],
    angular_rate_rad_s: [0.0; 3],
    gyro_bias_rad_s: [0.0; 3],
    velocity_sigma_m_s: 100.0,
    flags: 16,
    decision: 0,
    phase: 0,
    reserved: [0; 6],
};

fn memory() -> Box<Memory> {
    Box::new(Memory([0; SIZE + 8]))
}

fn start(memory: &mut Memory) -> *mut c_void {
    memory.0.as_mut_ptr().cast()
}

#[test]
fn null_and_misaligned_pointers_are_errors() {
    let mut memory = memory();
    let at = start(&mut memory);
    let params = CParams::default();
    let sample = CSample::default();
    let [null, misaligned, uninitialised] =
        [Error::Null, Error::Misaligned, Error::NotInitialised].map(|e| e as i32);
    assert_eq!(init(ptr::null_mut(), SIZE, &params), Err(null));
    assert_eq!(init(at.wrapping_byte_add(1), SIZE, &params), Err(misaligned));
    assert_eq!(init(at, size_of::<Estimator>() - 1, &params), Err(Error::TooSmall as i32));
    assert_eq!(update(at.cast(), &sample, None), (uninitialised, DOUBTFUL));
    let this = init(at, size_of::<Estimator>(), &params).expect("enough memory");
    let (mut estimate, mut learnt, mut force) = (DOUBTFUL, CLearnt::default(), 0.0);
    let (estimate, learnt) = (&raw mut estimate, &raw mut learnt);
    let mut numbers = [0.0_f32; 64];
    let odd = numbers.as_mut_ptr().wrapping_byte_add(1);
    let (mut other, sample, no_load) = (ptr::null_mut(), &raw const sample, ptr::null());
    let (other, params) = (&raw mut other, &raw const params);
    // SAFETY: Each pointer is NULL, misaligned, or to an object of its type.
    let errors = unsafe {
        [
            (footfall_default_params(ptr::null_mut()), null),
            (footfall_default_params(odd.cast()), misaligned),
            (footfall_estimator_init(at, SIZE, params, ptr::null_mut()), null),
            (footfall_estimator_init(at, SIZE, odd.cast(), other), misaligned),
            (footfall_estimator_learnt(this, learnt), uninitialised),
            (footfall_estimator_force_at_rest(this, &raw mut force), uninitialised),
            (footfall_estimator_init(at, SIZE, ptr::null(), other), null),
            (footfall_estimator_init(at, SIZE, params, other), 0),
            (footfall_estimator_update(this, sample, no_load, ptr::null_mut()), null),
            (footfall_estimator_update(this, sample, odd, estimate), misaligned),
            (footfall_estimator_update(this, ptr::null(), no_load, estimate), null),
            (footfall_estimator_update(ptr::null_mut(), sample, no_load, estimate), null),
            (footfall_estimator_learnt(this, ptr::null_mut()), null),
            (footfall_estimator_force_at_rest(this, ptr::null_mut()), null),
            (footfall_estimator_force_at_rest(ptr::null(), &raw mut force), null),
            (footfall_estimator_learnt(this, learnt), 0),
        ]
    };
    for (number, (error, expected)) in errors.into_iter().enumerate() {
        assert_eq!(error, expected, "call {number}");
    }
}

/// A stored state with this number, and the right CRC.
fn learnt_with(still: f32) -> CLearnt {
    (&Learnt::from_array([still, 2.0, -4.5, 4.0, 3.0])).into()
}

#[test]
fn each_error_of_an_update_leaves_the_doubtful_estimate() {
    let mut memory = memory();
    let at = start(&mut memory);
    let this = init(at, SIZE, &CParams::default()).expect("valid");
    let mut sample = CSample { specific_force_m_s2: [0.0, 0.0, 9.81], ..CSample::default() };
    for ms in 0..1_000 {
        sample.timestamp_us = 1_000 * ms;
        let (error, estimate) = update(this, &sample, None);
        assert!(error == 0 && (ms < 300 || estimate.decision == 1), "{ms}: {estimate:?}");
    }
    for validity in 6..=u8::MAX {
        let wrong = CSample { validity, ..sample };
        assert_eq!(update(this, &wrong, None), (Error::Choice as i32, DOUBTFUL));
    }
    let mut estimate = CEstimate { stable: 1.0, decision: 1, velocity_sigma_m_s: 0.0, ..DOUBTFUL };
    // SAFETY: NULL, or objects of their types.
    let error =
        unsafe { footfall_estimator_update(this, ptr::null(), ptr::null(), &raw mut estimate) };
    assert_eq!((error, estimate), (Error::Null as i32, DOUBTFUL));
    assert_eq!(update(ptr::null_mut(), &sample, None), (Error::Null as i32, DOUBTFUL));
    // The estimator has not changed.
    sample.timestamp_us += 1_000;
    let (error, estimate) = update(this, &sample, None);
    assert_eq!((error, estimate.decision), (0, 1));
}

#[test]
fn each_flipped_bit_of_the_learnt_state_is_rejected() {
    let mut memory = memory();
    let at = start(&mut memory);
    let learnt = learnt_with(-1.0);
    let accepted = CParams { learnt, has_learnt: 1, ..CParams::default() };
    assert!(init(at, SIZE, &accepted).is_ok());
    for bit in 0..8 * size_of::<CLearnt>() {
        let mut params = accepted;
        // SAFETY: Within the state, in which every bit pattern is a value.
        unsafe { *(&raw mut params.learnt).cast::<u8>().add(bit / 8) ^= 1 << (bit % 8) };
        assert_eq!(init(at, SIZE, &params), Err(Error::Learnt as i32), "bit {bit}");
    }
}

#[test]
fn learnt_state_has_the_bytes_of_rust_on_any_machine() {
    // Version 1, then numbers in binary32, the least byte first.
    let learnt = learnt_with(-1.0).bytes;
    assert_eq!(learnt, Learnt::from_array([-1.0, 2.0, -4.5, 4.0, 3.0]).to_bytes());
    assert_eq!(learnt[4..8], [0, 0, 0x80, 0xBF]);
}

#[test]
fn estimator_goes_on_in_other_memory() {
    let (mut first, mut second) = (memory(), memory());
    let this = init(start(&mut first), SIZE, &CParams::default()).expect("valid");
    let sample = |ms: u64| {
        let push = if ms % 500 < 250 { 8.0 * (ms % 7) as f32 } else { 0.0 };
        CSample {
            timestamp_us: 1_000 * ms,
            specific_force_m_s2: [push, 0.0, 9.81],
            ..CSample::default()
        }
    };
    (0..2_000).for_each(|ms| assert_eq!(update(this, &sample(ms), None).0, 0));
    second.0 = first.0;
    first.0.fill(0);
    let moved = start(&mut second).cast::<Estimator>();
    let mut third = memory();
    let same = init(start(&mut third), SIZE, &CParams::default()).expect("valid");
    (0..2_000).for_each(|ms| assert_eq!(update(same, &sample(ms), None).0, 0));
    for ms in 2_000..3_000 {
        assert_eq!(update(moved, &sample(ms), None), update(same, &sample(ms), None), "{ms}");
    }
}

/// Estimates of a foot that stands for 10 s at 1 kHz. Each 250th stamp is wrong by `jump_us`.
fn standing(jump_us: i64) -> Vec<CEstimate> {
    let mut memory = memory();
    let this = init(start(&mut memory), SIZE, &CParams::default()).expect("valid");
    let estimates = (0..10_000_u64).map(|ms| {
        let jump_us = if ms % 250 == 249 { jump_us } else { 0 };
        let sample = CSample {
            timestamp_us: (1_000_000 + 1_000 * ms).saturating_add_signed(jump_us),
            specific_force_m_s2: [0.0, 0.0, 9.81],
            ..CSample::default()
        };
        let (error, estimate) = update(this, &sample, None);
        assert_eq!((error, estimate.timestamp_us), (0, sample.timestamp_us));
        estimate
    });
    estimates.collect()
}

#[test]
fn stamps_that_jump_and_come_back_cost_one_sample_each() {
    let without = standing(0);
    for jump_us in [100_000, -100_000] {
        for (ms, (estimate, expected)) in standing(jump_us).iter().zip(&without).enumerate() {
            if ms % 250 == 249 {
                assert_eq!((estimate.stable, estimate.decision), (0.0, 0), "{ms}: {jump_us} µs");
                assert_eq!(estimate.flags & 16, 16, "{ms}: {jump_us} µs");
            } else {
                assert_eq!(estimate.decision, expected.decision, "{ms}: {jump_us} µs");
                assert!((estimate.stable - expected.stable).abs() < 0.01, "{ms}: {jump_us} µs");
            }
        }
    }
}

/// Number of invalid samples of a foot that stands for 2 s at 1 kHz. Samples are read eight at a time, and `newest_us`
/// gives the time of the newest sample of a read.
fn invalid_of_reads(newest_us: impl Fn(u64) -> u64) -> usize {
    flags_of_reads(newest_us).iter().filter(|flags| **flags & 16 != 0).count()
}

/// Flags of these samples.
fn flags_of_reads(newest_us: impl Fn(u64) -> u64) -> Vec<u32> {
    let mut memory = memory();
    let this = init(start(&mut memory), SIZE, &CParams::default()).expect("valid");
    let mut flags = Vec::new();
    for read in 0..250 {
        let standing = CSample { specific_force_m_s2: [0.0, 0.0, 9.81], ..CSample::default() };
        let mut samples = [standing; 8];
        samples[7].timestamp_us = newest_us(8 * read);
        // SAFETY: An estimator, and as many samples as the count says.
        let error = unsafe {
            footfall_estimator_spread_timestamps(this, samples.as_mut_ptr(), samples.len())
        };
        assert_eq!(error, 0);
        flags.extend(samples.iter().map(|sample| update(this, sample, None).1.flags));
    }
    flags
}

#[test]
fn read_whose_time_jumps_costs_its_samples_alone() {
    for jump_us in [100_000, -100_000] {
        let flags = flags_of_reads(|sample| {
            let jump_us = if sample == 8 * 125 { jump_us } else { 0 };
            (7_000_000 + 1_000 * sample).saturating_add_signed(jump_us)
        });
        // The foot is proven to stand, and remains so.
        for (sample, flags) in flags.iter().enumerate().skip(900) {
            let expected = if (1_000..1_008).contains(&sample) { 16 } else { 0 };
            assert_eq!(flags & !32, expected | flags & 64, "{sample}: {jump_us} µs");
        }
    }
}

#[test]
fn clock_of_32_bits_costs_no_sample_when_it_starts_again() {
    assert_eq!(invalid_of_reads(|sample| (7_000_000 + 1_000 * sample) % (1 << 32)), 0);
    let start = (1 << 32) - 1_000_500;
    assert_eq!(invalid_of_reads(|sample| (start + 1_000 * sample) % (1 << 32)), 0);
    // A clock that starts with the first read, and one of 64 bits that ends.
    assert!(invalid_of_reads(|sample| 500 + 1_000 * sample) <= 1);
    assert!(invalid_of_reads(|sample| (u64::MAX - 1_000_500).wrapping_add(1_000 * sample)) <= 1);
}

#[test]
fn gravity_that_is_not_removed_has_a_flag() {
    for (gravity, force, expected) in [
        (1, [9.81, 0.0, 0.0], CEstimate::GRAVITY),
        (1, [0.0, 0.0, 0.0], 0),
        (0, [0.0, 0.0, 9.81], 0),
    ] {
        let params = CParams { gravity, ..CParams::default() };
        let mut memory = memory();
        let this = init(start(&mut memory), SIZE, &params).expect("valid");
        let mut last = CEstimate::doubtful();
        for ms in 0..1_000 {
            let sample = CSample {
                timestamp_us: 1_000 * ms,
                specific_force_m_s2: force,
                ..CSample::default()
            };
            last = update(this, &sample, None).1;
        }
        assert_eq!(last.flags & CEstimate::GRAVITY, expected, "{gravity} {force:?}");
        assert_eq!(last.decision == 1, expected == 0, "{gravity} {force:?}");
    }
}

#[test]
fn samples_of_one_read_get_times_of_their_own() {
    let mut memory = memory();
    let this = init(start(&mut memory), SIZE, &CParams::default()).expect("valid");
    let mut samples = [CSample { timestamp_us: 8_000, ..CSample::default() }; 8];
    let at = samples.as_mut_ptr();
    // SAFETY: NULL, misaligned, or as many samples as the count says.
    let errors = unsafe {
        [
            footfall_estimator_spread_timestamps(ptr::null_mut(), at, 8),
            footfall_estimator_spread_timestamps(this, ptr::null_mut(), 8),
            footfall_estimator_spread_timestamps(this, at.wrapping_byte_add(1), 8),
            footfall_estimator_spread_timestamps(this, at, MOST_SAMPLES + 1),
            footfall_estimator_spread_timestamps(this, at, 0),
        ]
    };
    let expected = [Error::Null, Error::Null, Error::Misaligned, Error::Count].map(|e| e as i32);
    assert_eq!(errors[..4], expected);
    assert_eq!((errors[4], samples[0].timestamp_us), (0, 8_000));
    // SAFETY: As above.
    assert_eq!(unsafe { footfall_estimator_spread_timestamps(this, at, 8) }, 0);
    let times = samples.map(|sample| sample.timestamp_us);
    assert_eq!(times, [1_000, 2_000, 3_000, 4_000, 5_000, 6_000, 7_000, 8_000]);
}

#[test]
fn readings_in_g_or_mg_or_of_a_wrong_scale_are_an_error() {
    let unit = Error::Unit as i32;
    for (gravity, expected) in
        [(9.81, 0), (1.0, unit), (1_000.0, unit), (0.8 * 9.81, unit), (1.2 * 9.81, unit)]
    {
        let mut memory = memory();
        let this = init(start(&mut memory), SIZE, &CParams::default()).expect("valid");
        // SAFETY: An estimator, or NULL.
        let before = unsafe {
            [footfall_estimator_check_unit(this), footfall_estimator_check_unit(ptr::null())]
        };
        assert_eq!(before, [0, Error::Null as i32]);
        let mut flags = 0;
        for ms in 0..3_000 {
            let noise = gravity * 2.0e-3 * ((ms * 7 % 13) as f32 / 6.0 - 1.0);
            let sample = CSample {
                timestamp_us: 1_000 * ms,
                specific_force_m_s2: [noise, 0.0, gravity + noise],
                ..CSample::default()
            };
            let (error, estimate) = update(this, &sample, None);
            assert_eq!(error, 0);
            flags = estimate.flags;
        }
        // SAFETY: An estimator.
        assert_eq!(unsafe { footfall_estimator_check_unit(this) }, expected, "{gravity}");
        assert_eq!(flags & CEstimate::UNIT != 0, expected != 0, "{gravity}");
        let mut force = 0.0;
        // SAFETY: An estimator, and a number.
        assert_eq!(unsafe { footfall_estimator_force_at_rest(this, &raw mut force) }, 0);
        // In mg, the noise is a motion of a thousand m/s².
        assert!((force / gravity - 1.0).abs() < 1.0e-3 || gravity > 100.0, "{force}");
        let moving = CSample {
            timestamp_us: 3_000_000,
            specific_force_m_s2: [50.0, 0.0, gravity],
            ..CSample::default()
        };
        assert_eq!(update(this, &moving, None).0, 0);
        // SAFETY: As above.
        assert_eq!(unsafe { footfall_estimator_force_at_rest(this, &raw mut force) }, 0);
        assert!(force.is_nan(), "{force}");
    }
}

#[test]
fn invalid_group_of_parameters_has_its_error() {
    type Set = fn(&mut CParams);
    let mut memory = memory();
    let at = start(&mut memory);
    let cases: [(Set, Error); 9] = [
        (|p| p.sample_rate_hz = f32::NAN, Error::SampleRate),
        (|p| p.decision_on_delay_s = f32::NAN, Error::Decision),
        (|p| p.load_off = p.load_on + 1.0, Error::Load),
        (|p| p.velocity_lever_m = f32::INFINITY, Error::Velocity),
        (|p| (p.has_learnt, p.learnt) = (1, CLearnt::default()), Error::Learnt),
        (|p| (p.has_learnt, p.learnt) = (1, learnt_with(f32::NAN)), Error::Learnt),
        (|p| p.has_learnt = 2, Error::Choice),
        (|p| p.gravity = 255, Error::Choice),
        (|p| p.learning = 2, Error::Choice),
    ];
    for (set, error) in cases {
        let mut params = CParams::default();
        set(&mut params);
        assert_eq!(init(at, SIZE, &params), Err(error as i32));
        let after = update(at.cast(), &CSample::default(), None).0;
        assert_eq!(after, Error::NotInitialised as i32);
    }
}

#[test]
fn learnt_state_survives_a_warm_start() {
    let (mut first, mut second) = (memory(), memory());
    let this = init(start(&mut first), SIZE, &CParams::default()).expect("valid");
    for ms in 0..4_000_u64 {
        let push = if ms % 500 < 250 { 8.0 * (ms % 7) as f32 } else { 0.0 };
        let sample = CSample {
            timestamp_us: 1_000 * ms,
            specific_force_m_s2: [push, 0.0, 9.81],
            ..CSample::default()
        };
        assert_eq!(update(this, &sample, None).0, 0);
    }
    let [mut learnt, mut restored] = [CLearnt::default(); 2];
    // SAFETY: Objects of their types.
    let first_error = unsafe { footfall_estimator_learnt(this, &raw mut learnt) };
    let params = CParams { learnt, has_learnt: 1, ..CParams::default() };
    let this = init(start(&mut second), SIZE, &params).expect("what was learnt is valid");
    // SAFETY: As above.
    let second_error = unsafe { footfall_estimator_learnt(this, &raw mut restored) };
    assert_eq!([first_error, second_error], [0, 0]);
    assert_ne!(learnt, CLearnt::default());
    // A warm start gives little weight to what was observed before.
    assert_eq!(restored.bytes[..16], learnt.bytes[..16]);
    // A call that fails leaves a state that no estimator takes.
    // SAFETY: NULL, and an object of its type.
    let error = unsafe { footfall_estimator_learnt(ptr::null(), &raw mut learnt) };
    assert_eq!((error, learnt), (Error::Null as i32, CLearnt::default()));
}

#[test]
fn any_bits_give_an_error_or_a_number_from_0_to_1() {
    let mut random = Chance::new(1);
    let mut memory = memory();
    let at = start(&mut memory);
    let (mut accepted, mut rejected) = (0, 0);
    for _ in 0..2_000 {
        // The bits change one to three fields. If they changed all fields, no parameters would be accepted.
        let (mut params, bits) = (CParams::default(), fill::<CParams>(&mut random));
        for _ in 0..=random.bits() % 3 {
            match random.bits() % 6 {
                0 => params.sample_rate_hz = (random.bits() % 12_000) as f32,
                1 => params.decision_threshold = bits.decision_threshold,
                2 => params.load_off = bits.load_off,
                3 => params.velocity_lever_m = bits.velocity_lever_m,
                4 => {
                    let numbers: [u32; Learnt::NUMBERS] = fill(&mut random);
                    let numbers = numbers.map(|bits| f32::from_bits(bits) % 4.0);
                    let sealed = (&Learnt::from_array(numbers)).into();
                    params.has_learnt = (random.bits() % 3) as u8;
                    params.learnt =
                        if random.bits().is_multiple_of(2) { sealed } else { bits.learnt };
                }
                _ => params.gravity = (random.bits() % 3) as u8,
            }
        }
        let _ = init(at, SIZE, &bits);
        let Ok(this) = init(at, SIZE, &params) else {
            rejected += 1;
            continue;
        };
        accepted += 1;
        for _ in 0..50 {
            let mut sample = fill::<CSample>(&mut random);
            sample.validity %= 8;
            let load = f32::from_bits(random.bits() as u32);
            let (error, estimate) = update(this, &sample, (load > 0.0).then_some(load));
            assert_eq!(error == Error::Choice as i32, sample.validity >= 6);
            assert!(error == 0 || sample.validity >= 6, "{error}");
            let is_finite = estimate.velocity_sigma_m_s.is_finite();
            let is_right = (0.0..=1.0).contains(&estimate.stable) && is_finite;
            assert!(is_right, "{sample:?}: {estimate:?}");
        }
    }
    assert!(accepted > 200 && rejected > 200, "{accepted} {rejected}");
}

#[test]
fn every_error_has_its_own_text() {
    let text = |error| {
        // SAFETY: A string of the library.
        unsafe { CStr::from_ptr(footfall_error_text(error)) }.to_str().expect("ASCII")
    };
    let mut texts: Vec<_> = (0..=Error::ALL.len() as i32).map(text).collect();
    assert!(Error::ALL.into_iter().zip(1..).all(|(error, number)| error as i32 == number));
    assert!([i32::MIN, -1, 13, i32::MAX].into_iter().all(|error| text(error) == "unknown error"));
    texts.push("unknown error");
    texts.sort_unstable();
    texts.dedup();
    assert_eq!(texts.len(), Error::ALL.len() + 2);
}

#[test]
fn size_and_alignment_are_within_the_header() {
    assert_eq!(footfall_estimator_size(), size_of::<Estimator>());
    assert_eq!(footfall_estimator_align(), align_of::<Estimator>());
    assert!(footfall_estimator_size() <= SIZE);
    // SAFETY: A string of the library.
    let version = unsafe { CStr::from_ptr(footfall_version()) };
    assert_eq!(version.to_str(), Ok(env!("CARGO_PKG_VERSION")));
}
