//! Pictures of an evaluation: distribution of the errors, and reliability of the probabilities.

use std::io;

use crate::evaluation::Evaluation;
use crate::method::ComparedMethod;
use crate::sets::{Pool, Set};
use scoring::reliability::{bins, calibration_error};

use super::{histogram as histogram_plot, reliability as reliability_diagram};

/// Draws the paper's comparison as an SVG: the histogram of |P − label| of this estimator and of fuzzy c-means
/// on the recording with slip.
///
/// # Errors
/// The drawing library reports an error.
pub fn histogram(evaluation: &Evaluation) -> io::Result<String> {
    let series = [ComparedMethod::Default, ComparedMethod::FuzzyCMeans].map(|method| {
        histogram_plot::ErrorSeries {
            name: method.name(),
            errors: evaluation
                .scored(method, |set| set == Set::Slip)
                .iter()
                .map(|s| (s.probability - s.truth()).abs())
                .collect(),
        }
    });
    let title = "Distance of the probability from the label, ATLAS on a slippery floor";
    histogram_plot::svg(title, &series)
}

/// Draws the reliability diagrams of the methods that give a probability, on the two robots' families, as one
/// SVG.
///
/// # Errors
/// The drawing library reports an error.
pub fn reliability(evaluation: &Evaluation) -> io::Result<String> {
    let panels = Pool::ALL.map(|pool| {
        let methods = [
            ComparedMethod::Default,
            ComparedMethod::Paper,
            ComparedMethod::FuzzyCMeans,
        ];
        reliability_diagram::ReliabilityDiagram {
            // All sets of a pool have the same family.
            title: pool.sets()[0].family().name().to_owned(),
            series: methods.map(|method| {
                let scored = evaluation.scored(method, |set| pool.sets().contains(&set));
                let error = calibration_error(&scored).unwrap_or(0.0);
                reliability_diagram::BinSeries {
                    name: format!("{}: {error:.3}", method.name()),
                    bins: bins(&scored),
                }
            }),
        }
    });
    reliability_diagram::svg(
        "How often P comes true, with the calibration error",
        &panels,
    )
}
