//! Conversion between sRGB bytes and linear light (IEC 61966-2-1).
//!
//! The tables use only + - * /, which IEEE 754 defines exactly. Power functions differ between machines.

/// Linear value of each byte.
const LINEAR: [f32; 256] = linear_from(0.0);
/// Linear value halfway between each byte and the next.
const MIDDLES: [f32; 256] = linear_from(0.5);

/// Linear value of an sRGB byte, from 0 to 1.
pub(crate) const fn linear_of(srgb: u8) -> f32 {
    LINEAR[srgb as usize]
}

/// Nearest sRGB byte of a linear value, clamped to 0..=1.
pub(crate) fn srgb_of(linear: f32) -> u8 {
    MIDDLES[..255].partition_point(|middle| *middle <= linear) as u8
}

/// Linear values of all bytes plus `offset`.
const fn linear_from(offset: f64) -> [f32; 256] {
    let mut table = [0.0; 256];
    let mut byte = 0;
    while byte < table.len() {
        table[byte] = decoded((byte as f64 + offset) / 255.0) as f32;
        byte += 1;
    }
    table
}

/// Linear value of an sRGB value from 0 to 1.
const fn decoded(srgb: f64) -> f64 {
    if srgb <= 0.040_45 {
        return srgb / 12.92;
    }
    // x^2.4 is the fifth root of x^12.
    let base = (srgb + 0.055) / 1.055;
    let square = base * base;
    let power = square * square * square;
    let power = power * power;
    // Newton's method for the fifth root. It starts at or above the root, where it never overshoots. The steps suffice
    // for small bytes, whose start at 1 is far from the root.
    let mut root = if power > 1.0 { power } else { 1.0 };
    let mut step = 0;
    while step < 64 {
        let square = root * root;
        root = (4.0 * root + power / (square * square)) / 5.0;
        step += 1;
    }
    root
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The value by the power function in double precision.
    fn expected(srgb: f64) -> f64 {
        if srgb <= 0.040_45 {
            srgb / 12.92
        } else {
            ((srgb + 0.055) / 1.055).powf(2.4)
        }
    }

    #[test]
    fn tables_match_the_power_function() {
        for (byte, (linear, middle)) in LINEAR.into_iter().zip(MIDDLES).enumerate() {
            for (found, at) in [(linear, byte as f64), (middle, byte as f64 + 0.5)] {
                let expected = expected(at / 255.0);
                let off = (f64::from(found) - expected).abs();
                assert!(off <= expected * 6e-8, "{at}: {found}, {expected}");
            }
        }
    }

    #[test]
    fn bytes_round_trip() {
        for byte in 0..=u8::MAX {
            assert_eq!(srgb_of(linear_of(byte)), byte);
        }
        assert_eq!([-1.0, 0.0, 1.0, 7.0].map(srgb_of), [0, 0, 255, 255]);
        assert_eq!([f32::NAN, f32::INFINITY].map(srgb_of), [0, 255]);
        assert!((linear_of(188) - 0.5).abs() < 0.005);
    }

    #[test]
    fn srgb_of_rounds_to_the_nearest_byte() {
        for byte in 0..u8::MAX {
            let middle = expected((f64::from(byte) + 0.5) / 255.0);
            let [below, above] = [1.0 - 1e-6, 1.0 + 1e-6].map(|share| (middle * share) as f32);
            assert_eq!([below, above].map(srgb_of), [byte, byte + 1]);
        }
    }
}
