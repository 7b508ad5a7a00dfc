//! Posterior of the camera's height over a grid of log heights.

use super::options::HeightOptions;

/// Height by the evidence so far.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct HeightEstimate {
    /// Logarithm of 1 / height \[odometry units\].
    pub log_inverse_height: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// Histogram filter: several heights stay possible until the evidence decides.
pub(crate) struct HeightFilter {
    options: HeightOptions,
    /// Log likelihood of every cell, relative to that of a flat picture.
    log_likelihood: Vec<f64>,
    /// Probabilities, kept for their memory.
    weights: Vec<f64>,
    estimate: Option<HeightEstimate>,
    /// Pairs of frames compared so far.
    pairs: usize,
}

/// State of a [`HeightFilter`] between two frames.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct FilterState {
    log_likelihood: Vec<f64>,
    estimate: Option<HeightEstimate>,
    pairs: usize,
}

impl HeightFilter {
    /// Every height is equally likely.
    pub fn new(options: HeightOptions) -> Self {
        let [low, high] = options.range_units;
        let cells = ((high / low).ln() / options.step).ceil() as usize + 1;
        let log_likelihood = vec![0.0; cells];
        Self { options, log_likelihood, weights: Vec::with_capacity(cells), estimate: None, pairs: 0 }
    }

    /// The state after a frame.
    pub fn state(&self) -> FilterState {
        let Self { options: _, log_likelihood, weights: _, estimate, pairs } = self;
        FilterState { log_likelihood: log_likelihood.clone(), estimate: *estimate, pairs: *pairs }
    }

    /// As after the frame of a state.
    pub fn from_state(options: HeightOptions, state: FilterState) -> Self {
        let FilterState { log_likelihood, estimate, pairs } = state;
        Self { options, weights: Vec::with_capacity(log_likelihood.len()), log_likelihood, estimate, pairs }
    }

    /// Forgets everything.
    pub fn reset(&mut self) {
        self.log_likelihood.fill(0.0);
        self.estimate = None;
        self.pairs = 0;
    }

    /// Log |m| of a cell.
    pub fn log_inverse_height(&self, cell: usize) -> f64 {
        -self.options.range_units[1].ln() + self.options.step * cell as f64
    }

    /// Cells to evaluate: all while the height is unknown or when `whole` is set, else those around it.
    pub fn cells(&self, whole: bool) -> std::ops::Range<usize> {
        let all = 0..self.log_likelihood.len();
        if whole {
            return all;
        }
        let Some(known) = self.estimate() else { return all };
        let reach = (4.0 * self.options.mode_width / self.options.step) as usize;
        let middle =
            ((known.log_inverse_height - self.log_inverse_height(0)) / self.options.step).round() as usize;
        middle.saturating_sub(reach)..(middle + reach + 1).min(all.end)
    }

    /// Adds the log likelihoods of the cells from `first` on by the pairs of one frame, `elapsed_s` after the last one.
    pub fn add(&mut self, first: usize, log_likelihood: &[f64], (pairs, elapsed_s): (usize, f64)) {
        let kept = (-elapsed_s / self.options.forget_s).exp();
        self.log_likelihood.iter_mut().for_each(|l| *l *= kept);
        for (total, l) in self.log_likelihood.iter_mut().skip(first).zip(log_likelihood) {
            *total += l;
        }
        let most = self.log_likelihood.iter().copied().fold(0.0, f64::max);
        let excess = most / self.options.most_evidence;
        if excess > 1.0 {
            self.log_likelihood.iter_mut().for_each(|l| *l /= excess);
        }
        self.pairs += pairs;
        self.estimate = (self.pairs >= self.options.least_pairs).then(|| self.best()).flatten();
    }

    /// The height, once it is known.
    pub fn estimate(&self) -> Option<HeightEstimate> {
        self.estimate
    }

    /// The highest peak, if it holds enough of the probability.
    fn best(&mut self) -> Option<HeightEstimate> {
        probabilities(self.log_likelihood.iter().copied(), &mut self.weights);
        let weights = &self.weights;
        let best = (0..weights.len()).max_by(|a, b| weights[*a].total_cmp(&weights[*b]))?;
        // A best height at the end of the range is none: a wet road that mirrors the sky looks like a plane far below.
        if best < 2 || best + 2 >= weights.len() {
            return None;
        }
        let reach = (self.options.mode_width / self.options.step) as usize;
        let peak = best.saturating_sub(reach)..(best + reach + 1).min(weights.len());
        let mass: f64 = weights[peak.clone()].iter().sum();
        let mean = peak.clone().map(|k| weights[k] * self.log_inverse_height(k)).sum::<f64>() / mass;
        let spread = |k: usize| weights[k] * (self.log_inverse_height(k) - mean).powi(2);
        let sigma = (peak.map(spread).sum::<f64>() / mass).sqrt().max(self.options.least_sigma);
        (mass > self.options.least_mass).then_some(HeightEstimate { log_inverse_height: mean, sigma })
    }

    /// What one frame alone says near a known height, as a Gaussian: the posterior under a wide prior about it, with the prior
    /// taken out again. `None` when it says next to nothing.
    pub fn measure(
        &mut self,
        first: usize,
        log_likelihood: &[f64],
        about: &HeightEstimate,
    ) -> Option<HeightEstimate> {
        let prior_variance = self.options.mode_width.powi(2);
        let start = self.log_inverse_height(first) - about.log_inverse_height;
        let step = self.options.step;
        let x = |k: usize| start + step * k as f64;
        let posterior =
            log_likelihood.iter().enumerate().map(|(k, l)| l - 0.5 * x(k).powi(2) / prior_variance);
        probabilities(posterior, &mut self.weights);
        let weights = || self.weights.iter().enumerate();
        let mean: f64 = weights().map(|(k, w)| w * x(k)).sum();
        let variance: f64 = weights().map(|(k, w)| w * (x(k) - mean).powi(2)).sum();
        let variance = variance.max(self.options.least_sigma.powi(2));
        let information = 1.0 / variance - 1.0 / prior_variance;
        let sigma = information.max(1e-12).powf(-0.5);
        (sigma < self.options.most_sigma).then(|| HeightEstimate {
            log_inverse_height: about.log_inverse_height + mean / variance / information,
            sigma,
        })
    }
}

/// Probabilities out of log likelihoods.
fn probabilities(log_likelihood: impl Iterator<Item = f64>, out: &mut Vec<f64>) {
    out.clear();
    out.extend(log_likelihood);
    let most = out.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    out.iter_mut().for_each(|l| *l = (*l - most).exp());
    let sum: f64 = out.iter().sum();
    out.iter_mut().for_each(|w| *w /= sum);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn peak(filter: &HeightFilter, at: f64, width: f64, height: f64) -> Vec<f64> {
        let cells = 0..filter.log_likelihood.len();
        cells.map(|k| height * (-0.5 * ((filter.log_inverse_height(k) - at) / width).powi(2)).exp()).collect()
    }

    #[test]
    fn weak_peaks_that_stay_beat_strong_ones_that_move() {
        let mut filter = HeightFilter::new(HeightOptions::default());
        for k in 0..12 {
            let steady = peak(&filter, -0.4, 0.05, 3.0);
            let false_one = peak(&filter, -2.0 + 0.35 * f64::from(k), 0.05, 5.0);
            let sum: Vec<f64> = steady.iter().zip(&false_one).map(|(a, b)| a + b).collect();
            filter.add(0, &sum, (1, 0.1));
        }
        let found = filter.estimate().unwrap();
        assert!((found.log_inverse_height + 0.4).abs() < 0.02, "{found:?}");
    }

    #[test]
    fn a_flat_likelihood_is_no_measurement_and_a_sharp_one_is_where_it_lies() {
        let mut filter = HeightFilter::new(HeightOptions::default());
        let about = HeightEstimate { log_inverse_height: 0.3, sigma: 0.03 };
        assert!(filter.estimate().is_none());
        let (flat, sharp) = (peak(&filter, 0.3, 0.05, 0.1), peak(&filter, 0.35, 0.1, 12.0));
        assert!(filter.measure(0, &flat, &about).is_none());
        let found = filter.measure(0, &sharp, &about).unwrap();
        assert!((found.log_inverse_height - 0.35).abs() < 0.01 && found.sigma < 0.05, "{found:?}");
    }
}
