//! Colours of 8 bits a channel as screens and image files have them, in the colour space sRGB.

/// Linear red, green and blue, each from 0 to 1, of the 8-bit values of sRGB.
///
/// The transfer function is that of IEC 61966-2-1: c / 12.92 up to 0.04045, and ((c + 0.055) / 1.055)^2.4 above.
///
/// ```
/// use quantity::srgb;
/// assert_eq!(srgb::linear([0, 255, 0]), [0.0, 1.0, 0.0]);
/// let [grey, ..] = srgb::linear([188; 3]);
/// assert!((grey - 0.5029).abs() < 1e-4);
/// ```
#[must_use]
pub fn linear(srgb8: [u8; 3]) -> [f64; 3] {
    srgb8.map(|channel| {
        let encoded = f64::from(channel) / 255.0;
        if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
    })
}

/// The 8-bit values of `#rrggbb`, six hexadecimal digits of either case; `None` for any other text.
///
/// ```
/// use quantity::srgb;
/// assert_eq!(srgb::parse_hex("#e73f0A"), Some([0xE7, 0x3F, 0x0A]));
/// assert_eq!(srgb::parse_hex("#fff"), None);
/// ```
#[must_use]
pub fn parse_hex(text: &str) -> Option<[u8; 3]> {
    let digits = text.strip_prefix('#')?;
    // A sign is no digit, although an integer may begin with one.
    if digits.len() != 6 || !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return None;
    }
    let [_, red, green, blue] = u32::from_str_radix(digits, 16).ok()?.to_be_bytes();
    Some([red, green, blue])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_transfer_function_is_that_of_the_standard() {
        // 10 is the last value of the linear part.
        for (channel, linear_share) in [
            (0, 0.0),
            (1, 0.000_303_527),
            (10, 0.003_035_270),
            (11, 0.003_346_536),
            (128, 0.215_860_500),
            (255, 1.0),
        ] {
            let [red, green, blue] = linear([channel, 0, 255]);
            assert!((red - linear_share).abs() < 1e-9, "{channel}: {red}");
            assert_eq!([green, blue].map(f64::to_bits), [0.0_f64, 1.0].map(f64::to_bits));
        }
        let rising: Vec<f64> = (0..=255).map(|channel| linear([channel; 3])[0]).collect();
        assert!(rising.is_sorted_by(|a, b| a < b));
    }

    #[test]
    fn only_six_hexadecimal_digits_after_a_hash_are_a_colour() {
        assert_eq!(parse_hex("#00ff7F"), Some([0, 255, 127]));
        for text in
            ["", "#", "00ff7f", "#00ff7", "#00ff7f0", "#00ff7g", "#+0ff7f", "# 0ff7f", "#00ff7é", "red"]
        {
            assert_eq!(parse_hex(text), None, "{text}");
        }
    }
}
