//! Quantities as people read them: the unit that leaves the number between 1 and 1000.

/// A time of `seconds` to at most seven digits, in the unit that fits it: `5 ns`, `36.53223 us`, `1.5 s`.
/// Zero, and what is not finite, are told in seconds.
pub fn time(seconds: f64) -> String {
    let size = seconds.abs();
    let (unit, scale) = match size {
        _ if size == 0.0 || !size.is_finite() || size >= 1.0 => ("s", 1.0),
        _ if size >= 1e-3 => ("ms", 1e3),
        _ if size >= 1e-6 => ("us", 1e6),
        _ => ("ns", 1e9),
    };
    format!("{} {unit}", rounded(seconds * scale))
}

/// The number with at most seven significant digits and no zeros at its end.
fn rounded(value: f64) -> f64 {
    // What Rust prints with an exponent, it reads.
    format!("{value:.6e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::time;

    #[test]
    fn a_time_is_told_in_the_unit_that_fits() {
        let told = [
            (0.0, "0 s"),
            (5e-9, "5 ns"),
            (13.373_651_9e-9, "13.37365 ns"),
            (36_532.226_08e-9, "36.53223 us"),
            (0.02e-3, "20 us"),
            (0.999, "999 ms"),
            (1.0, "1 s"),
            (-1.5e-3, "-1.5 ms"),
            (7200.0, "7200 s"),
            (2e-13, "0.0002 ns"),
            (f64::INFINITY, "inf s"),
        ];
        for (seconds, text) in told {
            assert_eq!(time(seconds), text);
        }
    }
}
