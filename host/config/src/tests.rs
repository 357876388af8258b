//! Tests of the merged settings, of configuration files and of presets.

use samples::mounting::axes_text;

use super::*;
use estimator_core::any::Method;
use estimator_core::half_widths::WindowLength;
use estimator_core::params::{AttitudeParams, DecisionParams, GyroTiming, LoadParams, RestParams};
use estimator_core::velocity::VelocityParams;
use estimator_core::{Learning, Learnt};

fn applied(text: &str) -> AnyParams {
    let mut params = AnyParams::DEFAULT;
    Overrides::parse(text, "x.toml").unwrap().apply(&mut params);
    params
}

fn message(text: &str) -> String {
    Overrides::parse(text, "x.toml").unwrap_err().to_string()
}

#[test]
fn an_empty_file_changes_nothing() {
    assert_eq!(applied(""), AnyParams::DEFAULT);
}

#[test]
fn every_key_reaches_its_parameter() {
    let overrides = Overrides::parse(
        "sample_rate_hz = 500\ngravity = 'removed'\nwindow = '25samples'\n\
         method = 'half_widths'\nlearning = 'frozen'\n\
         [learnt]\nstill = 2.2\nmoving = 2.3\nspeed = 2.5\nstill_seconds = 31\nmoving_seconds = 32\n\
         version = 1\n\
         [bandwidth]\nacceleration_m_s2 = 1\nangular_rate_rad_s = 2.0\n\
         [half_width]\nacceleration_m_s2 = { ax = 3, ay = 4, az = 5 }\n\
         angular_rate_rad_s = { wx = 6, wy = 7, wz = 8 }\n\
         [attitude]\ngyro_timing = '9ms'\nmotion_time_constant_s = 10\nquiet_gain = 11\n\
         quiet_acceleration_m_s2 = 12\nquiet_rate_rad_s = 13\n\
         [attitude.rest]\nduration_s = 14\nacceleration_m_s2 = 15\nrate_rad_s = 16\n\
         bias_limit_rad_s = 17\nbias_time_constant_s = 18\n\
         [decision]\nthreshold = 0.6\non_delay_s = 0.1\noff_delay_s = 0.2\n\
         [load]\non_threshold = 20\noff_threshold = 10\n\
         [velocity]\nspeed_m_s = 0.3\nlever_m = 0.4\nfloor_m_s = 0.05\n",
        "x.toml",
    );
    let overrides = overrides.unwrap();
    assert_eq!(overrides.all.sample_rate, Some(500.0));
    assert_eq!(overrides.all.gravity, Some(Gravity::Removed));
    let mut params = AnyParams::DEFAULT;
    overrides.apply(&mut params);
    let expected = Params {
        learning: Learning::Frozen,
        learnt: Some(Learnt::from_array([2.2, 2.3, 2.5, 31.0, 32.0])),
        // No key reaches these.
        constants: Params::DEFAULT.constants,
        attitude: AttitudeParams {
            gyro_timing: GyroTiming::Delay(0.009),
            motion_time_constant: 10.0,
            quiet_gain: 11.0,
            quiet_acceleration: 12.0,
            quiet_rate: 13.0,
            rest: RestParams {
                duration: 14.0,
                acceleration: 15.0,
                rate: 16.0,
                bias_limit: 17.0,
                bias_time_constant: 18.0,
            },
        },
        decision: DecisionParams { threshold: 0.6, on_delay: 0.1, off_delay: 0.2 },
        load: LoadParams { on_threshold: 20.0, off_threshold: 10.0 },
        velocity: VelocityParams { speed: 0.3, lever: 0.4, floor: 0.05 },
    };
    assert_eq!(params.params, expected);
    let expected = HalfWidthParams {
        window: WindowLength::Samples(25),
        bandwidth: PerAxis::by_sensor(1.0, 2.0),
        half_width: PerAxis::from_array([3.0, 4.0, 5.0, 6.0, 7.0, 8.0]),
    };
    assert_eq!((params.method, params.half_widths), (Method::HalfWidths, expected));
}

#[test]
fn incomplete_learnt_table_is_rejected() {
    assert_eq!(
        message("[learnt]\nstill_seconds = 1\nmoving_seconds = 1\n"),
        "x.toml, line 1, column 1: missing field `still`"
    );
    let numbers =
        "[learnt]\nstill = 0\nmoving = 2\nspeed = -5\nstill_seconds = 1\nmoving_seconds = 1\n";
    for (seal, expected) in [
        (
            "",
            "missing field `version`: these numbers may mean something else: calibrate the foot again",
        ),
        ("version = 2", "learnt has version 2, expected 1: calibrate the foot again"),
        (
            "version = 1\ncrc = 1",
            "learnt is damaged: its CRC does not match: calibrate the foot again",
        ),
    ] {
        let found = message(&format!("{numbers}{seal}\n"));
        assert!(found.ends_with(expected), "{found}");
    }
    assert_eq!(
        message("method = 'kernel'\n"),
        "x.toml, line 1, column 10, key method: \"kernel\" is neither \"self_calibrating\" nor \"half_widths\""
    );
}

#[test]
fn left_handed_axes_error_suggests_a_flip() {
    assert_eq!(
        message("gravity = 'included'\naxes = 'x,z,y'\n"),
        "x.toml, line 2, column 8, key axes: x,z,y is left-handed, and a sensor is not: \
         flip the sign of one axis, as in x,-z,y or -x,z,y"
    );
    assert!(
        message("axes = [1, 2, 3]\n")
            .starts_with("x.toml, line 1, column 8, key axes: invalid type")
    );
}

#[test]
fn unnamed_axis_keeps_its_value() {
    let params = applied("half_width.acceleration_m_s2 = { az = 0.8 }");
    assert_eq!(params.half_widths.half_width.to_array()[..3], [0.4, 0.4, 0.8]);
}

#[test]
fn value_of_wrong_type_is_named_by_key() {
    assert_eq!(
        message("[load]\non_threshold = 'high'\n"),
        "x.toml, line 2, column 16, key load.on_threshold: invalid type: string \"high\", expected a number"
    );
    assert_eq!(
        message("[bandwidth]\nangular_rate_rad_s = 'low'\n"),
        "x.toml, line 2, column 22, key bandwidth.angular_rate_rad_s: \
         invalid type: string \"low\", expected a number or a table of axes"
    );
}

#[test]
fn too_large_number_is_named_by_key() {
    assert_eq!(
        message("[load]\non_threshold = 1e400\n"),
        "x.toml, line 2, column 16, key load.on_threshold: floating-point number overflowed"
    );
}

#[test]
fn an_unknown_axis_is_named() {
    let message = message("[bandwidth]\nangular_rate_rad_s = { ax = 1 }\n");
    assert!(
        message.starts_with(
            "x.toml, line 2, column 24, key bandwidth.angular_rate_rad_s: unknown field `ax`"
        ),
        "{message}"
    );
}

#[test]
fn sample_rate_is_checked_like_the_option() {
    for wrong in ["0", "-5", "nan", "inf"] {
        assert!(
            message(&format!("sample_rate_hz = {wrong}\n"))
                .starts_with("x.toml, line 1, column 18, key sample_rate_hz: "),
        );
    }
    assert_eq!(
        message("sample_rate_hz = -5\n"),
        "x.toml, line 1, column 18, key sample_rate_hz: -5 is not a sample rate: write a number of Hz above 0"
    );
}

#[test]
fn the_load_trigger_is_in_the_unit_of_the_formats_load() {
    for (format, with_its_load) in [
        (Format::Csv, AnyParams::DEFAULT),
        (Format::PceAtlas, AnyParams::PAPER),
        (Format::Lcd, AnyParams::DEFAULT),
        (Format::PceGo1, AnyParams::PAPER_GO1),
    ] {
        let mut expected = default_params();
        expected.params.load = with_its_load.params.load;
        assert_eq!(Preset::Default.params(format), expected, "{format:?}");
    }
}

#[test]
fn every_preset_is_valid_for_every_format() {
    for preset in [Preset::Default, Preset::Paper] {
        for format in Format::ALL {
            let checked = estimate::check(&preset.params(format), preset.stream(format));
            assert_eq!(checked, Ok(()), "{preset:?}, {format:?}");
        }
    }
}

#[test]
fn numbers_of_a_foot_override_those_of_all() {
    let text =
        "load.on_threshold = 40\n[feet.FL]\nload.on_threshold = 20\ndecision.threshold = 0.7\n";
    let overrides = Overrides::parse(text, "x.toml").unwrap();
    let of = |foot: &str| {
        let mut params = AnyParams::DEFAULT;
        overrides.apply(&mut params);
        overrides.apply_foot(&[foot], &mut params);
        (params.params.load.on_threshold, params.params.decision.threshold)
    };
    assert_eq!(of("fl"), (20.0, 0.7));
    assert_eq!(of("fr"), (40.0, Params::DEFAULT.decision.threshold));
}

#[test]
fn invalid_number_of_a_foot_is_refused_by_its_key() {
    let refusal = |text: &str| {
        let overrides = Overrides::parse(text, "x.toml").unwrap();
        let mut params = AnyParams::DEFAULT;
        overrides.apply(&mut params);
        let origins = Origins {
            file: Some("x.toml"),
            text,
            overrides: &overrides,
            window: None,
            recording: "x.csv",
            sample_rate: RateOrigin::Recording,
        };
        let refusal = origins.check_effects(&params).err();
        refusal.map(|refusal| refusal.to_string())
    };
    for (text, expected) in [
        ("[feet.fl]\nload.on_threshold = 20\n", None),
        (
            "[feet.fl]\ndecision.threshold = 1.5\n",
            Some(
                "x.toml, line 2, column 10, key feet.fl.decision.threshold is 1.5, allowed is 0.01 to 0.99",
            ),
        ),
        (
            "[feet.fl.load]\non_threshold = 5\n",
            Some(
                "x.toml, line 1, column 10, key feet.fl.load.off_threshold is 6, allowed is -1e9 to 5, and not \
                 above load.on_threshold",
            ),
        ),
        // An error of the file is reported when the foot is estimated.
        ("decision.threshold = 1.5\n[feet.fl]\nload.on_threshold = 20\n", None),
    ] {
        assert_eq!(refusal(text).as_deref(), expected, "{text}");
    }
}

fn of_file(text: &str) -> Resolved {
    Resolved::of_file(ConfigFile { name: "c.toml".to_owned(), text: text.to_owned() })
        .expect("a configuration")
}

fn input_options(resolved: &Resolved) -> InputOptions {
    let (table, bag) = (TableOptions::default(), BagOptions::default());
    resolved.input_options(table, bag, ContactUse::default())
}

#[test]
fn options_override_the_file_and_the_file_the_preset() {
    let text = "sample_rate_hz = 500\ngravity = 'removed'\naxes = 'x,-z,y'\n\
            window = '40ms'\n[feet.FL]\naxes = '-x,-y,z'";
    let file = of_file(text);
    let options = Resolved {
        window: Some(WindowLength::Samples(7)),
        sample_rate: Some(400.0),
        gravity: Some(Gravity::Included),
        axes: "y,-x,z".parse().ok(),
        ..file.clone()
    };
    let [preset, file, options] = [&Resolved::default(), &file, &options].map(|resolved| {
        let input_options = input_options(resolved);
        (
            resolved.params(Format::Csv).half_widths.window,
            input_options.sample_rate,
            input_options.gravity,
            axes_text(&input_options.correction.mounting),
            axes_text(&input_options.correction_of(&["FL"]).mounting),
        )
    });
    let window = Preset::Default.params(Format::Csv).half_widths.window;
    let axes = |text: &str| text.to_owned();
    let [identity, of_all, own] = ["x,y,z", "x,-z,y", "-x,-y,z"].map(axes);
    let given = axes("y,-x,z");
    assert_eq!(preset, (window, None, None, identity.clone(), identity));
    let removed = Some(Gravity::Removed);
    let duration = WindowLength::Duration(0.04);
    assert_eq!(file, (duration, Some(500.0), removed, of_all, own));
    let count = WindowLength::Samples(7);
    let included = Some(Gravity::Included);
    assert_eq!(options, (count, Some(400.0), included, given.clone(), given));
}

#[test]
fn rate_equal_to_that_of_the_file_is_attributed_to_the_option() {
    let origin = |resolved: &Resolved| resolved.origins("x.csv").sample_rate;
    let file = of_file("sample_rate_hz = 500");
    assert_eq!(origin(&Resolved::default()), RateOrigin::Recording);
    assert_eq!(origin(&file), RateOrigin::Configuration);
    let option = Resolved { sample_rate: Some(500.0), ..file };
    assert_eq!(origin(&option), RateOrigin::Option);
}

#[test]
fn axes_of_each_foot_are_read() {
    let axes = |text: &str| text.parse::<FootAxes>();
    let turned = parse_axes("x,-z,y").unwrap();
    assert_eq!(axes("x,-z,y"), Ok(FootAxes::All(turned)));
    let Ok(FootAxes::Each(feet)) = axes("FL=x,-z,y,fr=1,0,0,0") else {
        panic!("two feet");
    };
    assert_eq!(feet["FL"], turned);
    assert_eq!(feet["fr"], Mounting::IDENTITY);
    for (text, why) in [
        ("x,FL=y,z", "has \"x\" before the name of a foot"),
        ("FL=x,y,z,fl=x,y,z", "one twice"),
        ("=x,y,z", "names no foot"),
        ("FL=x,y", "FL: \"x,y\" is neither axes nor a quaternion"),
    ] {
        let said = axes(text).unwrap_err();
        assert!(said.contains(why), "{text}: {said}");
    }
}

#[test]
fn bandwidths_follow_the_noise_if_it_is_known() {
    let noise = Noise { specific_force: Some(0.5), angular_rate: None };
    let params = with_bandwidth_of(&noise, HalfWidthParams::DEFAULT);
    assert_eq!((params.bandwidth.ax, params.bandwidth.az), (0.5, 0.5));
    assert_eq!(params.bandwidth.wz, HalfWidthParams::DEFAULT.bandwidth.wz);
    assert_eq!(params.half_width, HalfWidthParams::DEFAULT.half_width);
}
