//! MBGTD: memory-based graph-theoretic detector.
//!
//! The samples of a window are the nodes of a graph; the length of an edge is the difference of the
//! accelerations. A cut has the samples 0…s on one side and t…N−1 on the other; its weight is the
//! length of all edges across, over (t − s)(N − t + 1). The statistic is the largest weight over
//! all cuts s < t, which is small if all samples are similar.
//!
//! Source: Z. Wang, H. Zhao, S. Qiu, Q. Gao, *Stance-Phase Detection for ZUPT-Aided Foot-Mounted
//! Pedestrian Navigation System*, IEEE/ASME Trans. Mechatronics 20(6), 2015, with the weight as in
//! the implementation at github.com/utiasSTARS/pyshoe, but over a trailing window instead of a
//! leading one.

use std::collections::VecDeque;

use crate::window::Reading;

/// Statistic at each sample, m/s², computed in N² steps per sample.
#[must_use]
pub fn statistic(readings: &[Reading], window: usize) -> Vec<f64> {
    // Edges from each sample in the window to those before it, nearest first.
    let mut edges: VecDeque<Vec<f64>> = VecDeque::with_capacity(window + 1);
    let of_sample = |(index, reading): (usize, &Reading)| {
        let before = index.min(window - 1);
        let earlier = readings[index - before..index].iter().rev();
        edges.push_back(earlier.map(|other| distance(reading, other)).collect());
        if edges.len() > window {
            edges.pop_front();
        }
        heaviest_cut(&edges)
    };
    readings.iter().enumerate().map(of_sample).collect()
}

fn distance(a: &Reading, b: &Reading) -> f64 {
    let squares = (0..3).map(|axis| (a[axis] - b[axis]).powi(2));
    squares.sum::<f64>().sqrt()
}

fn heaviest_cut(edges: &VecDeque<Vec<f64>>) -> f64 {
    let samples = edges.len();
    // Element s is the length of all edges from the samples t and later to 0…s.
    let mut across = vec![0.0; samples];
    let mut heaviest: f64 = 0.0;
    for t in (1..samples).rev() {
        let mut to_sample = 0.0;
        for s in 0..t {
            to_sample += edges[t][t - s - 1];
            across[s] += to_sample;
            let weight = across[s] / ((t - s) * (samples - t + 1)) as f64;
            heaviest = heaviest.max(weight);
        }
    }
    heaviest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Computes the statistic by its definition, without state between samples.
    fn by_definition(window: &[Reading]) -> f64 {
        let n = window.len();
        let mut heaviest: f64 = 0.0;
        for t in 1..n {
            for s in 0..t {
                let pairs = (0..=s).flat_map(|i| (t..n).map(move |j| (i, j)));
                let length: f64 = pairs.map(|(i, j)| distance(&window[i], &window[j])).sum();
                heaviest = heaviest.max(length / ((t - s) * (n - t + 1)) as f64);
            }
        }
        heaviest
    }

    #[test]
    fn incremental_statistic_equals_the_definition() {
        let readings: Vec<Reading> = (0..40_u32)
            .map(|k| [0, 1, 2, 3, 4, 5].map(|axis| f64::from((k * k * 7 + axis * 13) % 23)))
            .collect();
        let statistic = statistic(&readings, 6);
        for (k, value) in statistic.iter().enumerate() {
            let expected = by_definition(&readings[k.saturating_sub(5)..=k]);
            assert!((value - expected).abs() < 1e-9, "{k}: {value}, {expected}");
        }
    }

    #[test]
    fn equal_samples_have_statistic_zero() {
        assert_eq!(statistic(&[[5.0; 6]; 8], 4), [0.0; 8]);
    }
}
