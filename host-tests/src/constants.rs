//! The constants of self-calibration by name, for tests and searches that vary each of them.

use estimator_core::{Params, StillnessParams};

/// Name of a constant, and its field.
pub type Constant = (&'static str, fn(&mut StillnessParams) -> &mut f32);

macro_rules! constants {
    ($($($part:ident).+),+ $(,)?) => {
        [$((stringify!($($part).+), |s| &mut s.$($part).+)),+]
    };
}

/// All constants of self-calibration, in the order of [`StillnessParams`].
pub const CONSTANTS: [Constant; 69] = constants![
    acceleration.floor,
    acceleration.still,
    acceleration.moving,
    acceleration.width,
    acceleration.edge,
    acceleration.bandwidth,
    acceleration.indifference,
    acceleration.separation,
    rate.floor,
    rate.still,
    rate.moving,
    rate.width,
    rate.edge,
    rate.bandwidth,
    rate.indifference,
    rate.separation,
    velocity.floor,
    velocity.still,
    velocity.moving,
    velocity.width,
    velocity.edge,
    velocity.bandwidth,
    velocity.indifference,
    velocity.separation,
    window,
    leak,
    impact,
    part_of_the_way,
    least_width,
    largest_width,
    prior,
    memory,
    stance,
    motion,
    relaxation,
    slide.speed,
    slide.spread,
    slide.shaking,
    slide.lever,
    slide.rate,
    slide.largest_rate,
    slide.turn_time_constant,
    slide.impact,
    slide.time_constant,
    slide.moving_time_constant,
    slide.shake_time_constant,
    slide.limit,
    slide.usual,
    slide.quantile,
    slide.gain,
    slide.prior,
    slide.memory,
    slide.learn_from,
    slide.learn_until,
    evidence.rest,
    evidence.lasts,
    evidence.fading,
    evidence.rest_margin,
    evidence.swing,
    evidence.first_swing,
    evidence.calm,
    evidence.calm_time_constant,
    evidence.stride,
    evidence.learns,
    gravity_error.quiet,
    gravity_error.start,
    gravity_error.memory,
    gravity_error.forgetting,
    gravity_error.limit,
];

/// The default preset with other constants, given as `name=value` with spaces between.
///
/// # Errors
/// The first pair without `=`, unknown name or value that is not a number; else the first value out of its range.
pub fn with_constants(text: &str) -> Result<Params, String> {
    let mut stillness = StillnessParams::DEFAULT;
    for pair in text.split_whitespace() {
        let (name, value) =
            (pair.split_once('=')).ok_or_else(|| format!("`{pair}` is not name=value"))?;
        let constant = CONSTANTS.iter().find(|(known, _)| *known == name);
        let (_, field) = constant.ok_or_else(|| format!("there is no constant `{name}`"))?;
        *field(&mut stillness) =
            (value.parse()).map_err(|_| format!("{name}: `{value}` is not a number"))?;
    }
    let stillness = stillness.check().map_err(|error| error.to_string())?;
    Ok(Params {
        stillness,
        ..Params::DEFAULT
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_are_set_by_name_and_others_keep_their_default() {
        let params = with_constants("slide.spread=2.5 memory=9").expect("in range");
        let mut expected = StillnessParams::DEFAULT;
        (expected.slide.spread, expected.memory) = (2.5, 9.0);
        assert_eq!(*params.stillness.params(), expected);
    }

    #[test]
    fn wrong_constants_are_rejected_by_name() {
        for (text, culprit) in [
            ("memory", "`memory`"),
            ("slide.colour=1", "`slide.colour`"),
            ("memory=long", "`long`"),
            ("memory=-1", "memory"),
        ] {
            let error = with_constants(text).expect_err("refused");
            assert!(error.contains(culprit), "{error}");
        }
    }
}
