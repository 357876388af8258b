//! Error of an estimated track.

use samples::space::Vector;

/// Error of a track as in `PyShoe`, m: the mean over all samples of the root of the mean square of the
/// three axes' errors. The mean distance in space is √3 times as long.
///
/// Both tracks are shifted to start at the origin. The estimated one is then rotated about the vertical by
/// the angle that fits the true one best by least squares, because an IMU does not know its heading.
#[must_use]
pub fn position_error(estimated: &[Vector], truth: &[Vector]) -> f64 {
    let (Some(start), Some(true_start)) = (estimated.first(), truth.first()) else {
        return 0.0;
    };
    let pairs = || {
        let pairs = estimated.iter().zip(truth);
        pairs.map(|(at, truth)| (*at - *start, *truth - *true_start))
    };
    let (sine, cosine) = pairs().fold((0.0, 0.0), |(sine, cosine), (at, truth)| {
        (
            sine + at.x * truth.y - at.y * truth.x,
            cosine + at.x * truth.x + at.y * truth.y,
        )
    });
    let (sine, cosine) = libm::sincos(libm::atan2(sine, cosine));
    let distances = pairs().map(|(at, truth)| {
        let turned = Vector::new(
            cosine * at.x - sine * at.y,
            sine * at.x + cosine * at.y,
            at.z,
        );
        (turned - truth).length()
    });
    distances.sum::<f64>() / pairs().count() as f64 / libm::sqrt(3.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track() -> Vec<Vector> {
        let corner = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 3.0)];
        corner.map(|(x, y)| Vector::new(x, y, 0.0)).into()
    }

    #[test]
    fn heading_and_start_do_not_affect_the_error() {
        let turned: Vec<_> = track()
            .iter()
            .map(|at| Vector::new(7.0 - at.y, 5.0 + at.x, -3.0))
            .collect();
        assert!(position_error(&turned, &track()) < 1.0e-12);
    }

    #[test]
    fn mirrored_track_is_an_error() {
        let mirrored: Vec<_> = track()
            .iter()
            .map(|at| Vector::new(at.x, -at.y, 0.0))
            .collect();
        assert!(position_error(&mirrored, &track()) > 0.3);
    }

    #[test]
    fn height_counts_a_third_in_the_mean_square() {
        let mut higher = track();
        for at in higher.iter_mut().skip(1) {
            at.z = 0.4;
        }
        let expected = 0.75 * 0.4 / 3.0_f64.sqrt();
        assert!((position_error(&higher, &track()) - expected).abs() < 1.0e-12);
    }
}
