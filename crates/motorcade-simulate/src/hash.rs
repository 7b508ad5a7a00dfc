//! Random numbers by hashing integers: independent of the order in which pixels are visited.

/// Scrambles 64 bits (SplitMix64, Steele et al. 2014).
pub(crate) fn mix(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Uniform number in [0, 1) of a cell of a grid.
pub(crate) fn unit(seed: u64, i: i64, j: i64) -> f32 {
    let bits = mix(seed ^ mix(i as u64 ^ mix(j as u64)));
    (bits >> 40) as f32 / (1u64 << 24) as f32
}

/// Approximately normal with mean 0 and standard deviation 1: four uniforms of 16 bits each.
pub(crate) fn normal(key: u64) -> f32 {
    let bits = mix(key);
    let sum = (bits & 0xffff) + ((bits >> 16) & 0xffff) + ((bits >> 32) & 0xffff) + (bits >> 48);
    (sum as f32 / 65535.0 - 2.0) * 1.732_050_8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_those_of_a_normal() {
        let n = 20_000;
        let values: Vec<f64> = (0..n).map(|i| f64::from(normal(i))).collect();
        let mean = values.iter().sum::<f64>() / n as f64;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n as f64;
        assert!(mean.abs() < 0.03 && (variance - 1.0).abs() < 0.05, "mean {mean}, variance {variance}");
    }
}
