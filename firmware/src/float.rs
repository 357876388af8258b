//! Additions and multiplications of f32 on a core without a floating-point unit, with the bits of IEEE 754.
//!
//! They are faster than the compiler's library, whose product of 24 bits needs a 64-bit multiplication. The functions
//! of the boot ROM are as fast, but flush subnormal numbers.
//!
//! Operands and results are bits. Rounding is to nearest, ties to even.

/// Sign of a number.
pub const SIGN: u32 = 0x8000_0000;
const INFINITY: u32 = 0x7F80_0000;
const QUIET: u32 = 0x0040_0000;
const FRACTION: u32 = 0x007F_FFFF;
const HIDDEN: u32 = 0x0080_0000;

/// Bits below the last bit of a fraction. The lowest of them is set if any bit shifted out was set.
const GUARD: u32 = 6;

/// Leading bit of a fraction with its guard bits.
const FIRST: u32 = HIDDEN << GUARD;

/// Sum of two numbers.
#[inline(always)]
pub fn add(a: u32, b: u32) -> u32 {
    let (big, small) = if a << 1 >= b << 1 { (a, b) } else { (b, a) };
    let (mut exponent, below) = (big << 1 >> 24, small << 1 >> 24);
    if below == 0 || exponent >= 0xFE {
        return add_others(big, small);
    }
    let shift = exponent - below;
    // The smaller number is less than half of the larger one's last bit, even if the larger one is a power of two.
    if shift > 25 {
        return big;
    }
    let mut sum = (big | HIDDEN) << 8 >> 2;
    let mut other = (small | HIDDEN) << 8 >> 2;
    if shift != 0 {
        other = other >> shift | u32::from(other << (32 - shift) != 0);
    }
    if (big ^ small) & SIGN == 0 {
        sum += other;
        if sum >= FIRST << 1 {
            sum = sum >> 1 | sum & 1;
            exponent += 1;
        }
    } else {
        sum -= other;
        while sum < FIRST {
            if sum == 0 {
                return 0;
            }
            let step = if sum < FIRST >> 7 { 8 } else { 1 };
            sum <<= step;
            if exponent <= step {
                return add_others(big, small);
            }
            exponent -= step;
        }
    }
    let mut kept = (sum + (1 << (GUARD - 1))) >> GUARD;
    if sum << (32 - GUARD) == SIGN {
        // A tie rounds to even.
        kept &= !1;
    }
    (big & SIGN) | (((exponent - 1) << 23) + kept)
}

/// Adds two numbers, including zeros, subnormals, infinities and NaNs. Requires |`small`| ≤ |`big`|.
#[cold]
#[inline(never)]
fn add_others(big: u32, small: u32) -> u32 {
    let (mut exponent, below) = (big >> 23 & 0xFF, small >> 23 & 0xFF);
    if exponent == 0xFF {
        return if big & !SIGN > INFINITY {
            big | QUIET
        } else if below == 0xFF && big != small {
            // The difference of two infinities.
            INFINITY | QUIET
        } else {
            big
        };
    }
    if small & !SIGN == 0 {
        // Zeros of both signs are +0.
        return if big & !SIGN == 0 { big & small } else { big };
    }
    let shift = exponent.max(1) - below.max(1);
    let mut sum = fraction(big, exponent) << GUARD;
    let mut other = fraction(small, below) << GUARD;
    exponent = exponent.max(1);
    if shift != 0 {
        other = if shift < 31 { other >> shift | u32::from(other << (32 - shift) != 0) } else { 1 };
    }
    if (big ^ small) & SIGN == 0 {
        sum += other;
        if sum >= FIRST << 1 {
            sum = sum >> 1 | sum & 1;
            exponent += 1;
            if exponent == 0xFF {
                return big & SIGN | INFINITY;
            }
        }
    } else {
        sum -= other;
        if sum == 0 {
            return 0;
        }
        if sum < FIRST {
            let mut zeros = 0;
            let mut normal = sum;
            for step in [16, 8, 4, 2, 1] {
                if normal < FIRST >> (step - 1) {
                    normal <<= step;
                    zeros += step;
                }
            }
            if zeros < exponent {
                sum = normal;
                exponent -= zeros;
            } else {
                sum <<= exponent - 1;
                exponent = 1;
            }
        }
    }
    let (kept, rest) = (sum >> GUARD, sum & ((1 << GUARD) - 1));
    const HALF: u32 = 1 << (GUARD - 1);
    let up = u32::from(rest > HALF) | u32::from(rest == HALF) & kept;
    (big & SIGN) | (((exponent - 1) << 23) + kept + (up & 1))
}

/// Product of two numbers.
#[inline(always)]
pub fn multiply(a: u32, b: u32) -> u32 {
    /// Offset of the sum of two exponents: the bias, plus one for the leading bit of the result.
    const LEAST: u32 = 128;
    let (ea, eb) = (a << 1 >> 24, b << 1 >> 24);
    // The products below are for normal numbers, whose exponents are neither 0 nor 0xFF.
    if ea.wrapping_sub(1) >= 0xFE || eb.wrapping_sub(1) >= 0xFE {
        return multiply_others(a, b);
    }
    let (ah, al) = ((a | HIDDEN) << 8 >> 16, a & 0xFF);
    let (bh, bl) = ((b | HIDDEN) << 8 >> 16, b & 0xFF);
    let last = al * bl;
    let middle = ah * bl + al * bh + (last >> 8);
    let high = ah * bh + (middle >> 8);
    let is_long = high >> 31;
    let exponent = (ea + eb + is_long).wrapping_sub(LEAST);
    if exponent >= 0xFE {
        return multiply_others(a, b);
    }
    let product = if is_long == 0 { high << 1 | middle << 24 >> 31 } else { high };
    let mut kept = (product >> 8) + (product << 24 >> 31);
    if product & 0xFF == 0x80 {
        let lost = last & 0xFF | middle & (0x7F | is_long << 7);
        if lost == 0 {
            // A tie rounds to even.
            kept &= !1;
        }
    }
    (a ^ b) & SIGN | ((exponent << 23) + kept)
}

#[cold]
#[inline(never)]
fn multiply_others(a: u32, b: u32) -> u32 {
    let sign = (a ^ b) & SIGN;
    let (a, b) = (a & !SIGN, b & !SIGN);
    if a > INFINITY {
        return a | QUIET;
    }
    if b > INFINITY {
        return b | QUIET;
    }
    if a == INFINITY || b == INFINITY {
        return if a == 0 || b == 0 { INFINITY | QUIET } else { sign | INFINITY };
    }
    if a == 0 || b == 0 {
        return sign;
    }
    let (ea, fa) = normalised(a);
    let (eb, fb) = normalised(b);
    rounded(sign, ea + eb, fa, fb)
}

/// Fraction of a finite number, with its leading bit.
fn fraction(bits: u32, exponent: u32) -> u32 {
    if exponent == 0 { bits & FRACTION } else { bits & FRACTION | HIDDEN }
}

/// Exponent and fraction of a number that is not zero.
fn normalised(bits: u32) -> (i32, u32) {
    match bits >> 23 {
        0 => {
            let shift = bits.leading_zeros() - 8;
            (1 - shift as i32, bits << shift)
        }
        exponent => (exponent as i32, bits & FRACTION | HIDDEN),
    }
}

/// Rounded product of two fractions of 24 bits, each with its leading bit set. `exponents` is the sum of their
/// exponents.
fn rounded(sign: u32, exponents: i32, a: u32, b: u32) -> u32 {
    const BIAS: i32 = 127;
    let (ah, al) = (a >> 8, a & 0xFF);
    let (bh, bl) = (b >> 8, b & 0xFF);
    // The product without its last 16 bits. Its lowest bit is set if any of the dropped bits is set.
    let last = al * bl;
    let middle = ah * bl + al * bh + (last >> 8);
    let mut product = ah * bh + (middle >> 8);
    let mut exponent = exponents - BIAS;
    if product & SIGN == 0 {
        product = product << 1 | middle >> 7 & 1;
    } else {
        exponent += 1;
        product |= u32::from(middle & 0x80 != 0);
    }
    product |= u32::from((last & 0xFF) | (middle & 0x7F) != 0);
    if exponent >= 0xFF {
        return sign | INFINITY;
    }
    if exponent < 1 {
        let shift = (1 - exponent) as u32;
        product =
            if shift < 32 { product >> shift | u32::from(product << (32 - shift) != 0) } else { 1 };
        exponent = 1;
    }
    let (kept, rest) = (product >> 8, product & 0xFF);
    let up = u32::from(rest > 0x80) | u32::from(rest == 0x80) & kept;
    sign | ((((exponent - 1) as u32) << 23) + kept + (up & 1))
}
