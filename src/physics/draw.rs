//! Draws that depend on a seed and a place alone, never on the order in which they are made.

/// One step of the splitmix64 sequence (Steele, Lea & Flood, OOPSLA 2014): adds the golden ratio, then mixes.
pub fn splitmix64(state: u64) -> u64 {
    let z = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A number in (0, 1) for yarn `yarn` of domain `domain`: splitmix64 of the seed, then of that plus the domain, then of
/// that plus the yarn; the upper 53 bits, centred in their interval.
pub fn uniform(seed: u64, domain: u32, yarn: u32) -> f64 {
    let z = splitmix64(splitmix64(splitmix64(seed).wrapping_add(u64::from(domain))).wrapping_add(u64::from(yarn)));
    ((z >> 11) as f64 + 0.5) * (1.0 / (1u64 << 53) as f64)
}

/// Weibull variate with the given mean and shape at probability `u` in (0, 1): mean/Γ(1 + 1/k)·(−ln u)^(1/k).
pub fn weibull(mean: f64, shape: f64, u: f64) -> f64 {
    mean / libm::tgamma(1.0 + 1.0 / shape) * libm::pow(-libm::log(u), 1.0 / shape)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splitmix_gives_its_published_sequence() {
        // First outputs for the seed 1234567, as published with the reference implementation.
        let mut state = 1_234_567_u64;
        let mut next = || {
            let out = splitmix64(state);
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            out
        };
        assert_eq!([next(), next(), next()], [6457827717110365317, 3203168211198807973, 9817491932198370423]);
    }

    #[test]
    fn weibull_strengths_have_the_asked_mean_and_scatter() {
        let (mean, shape, count) = (0.035, 8.0, 20_000);
        let draws: Vec<f64> = (0..count).map(|yarn| weibull(mean, shape, uniform(7, 0, yarn))).collect();
        let average = draws.iter().sum::<f64>() / f64::from(count);
        let variance = draws.iter().map(|draw| (draw - average).powi(2)).sum::<f64>() / f64::from(count);
        let (one, two) = (libm::tgamma(1.0 + 1.0 / shape), libm::tgamma(1.0 + 2.0 / shape));
        let expected = (two / (one * one) - 1.0).sqrt();
        assert!((average / mean - 1.0).abs() < 4.0 * expected / f64::from(count).sqrt());
        assert!((variance.sqrt() / mean / expected - 1.0).abs() < 0.03);
    }
}
