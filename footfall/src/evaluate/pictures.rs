//! An evaluation's pictures: how large the errors are, and whether a probability means what it
//! says.

use std::io;

use super::method::Method;
use super::{Evaluation, Group};
use crate::metrics::Scored;
use crate::plot::{histogram, reliability};
use crate::reliability::{bins, calibration_error};

impl Evaluation {
    /// The paper's comparison: the histogram of |P − label| of this estimator and of fuzzy c-means
    /// on the recording with slip, as an SVG.
    ///
    /// # Errors
    /// What the drawing library reports.
    pub fn histogram(&self) -> io::Result<String> {
        let series = [Method::Default, Method::FuzzyCMeans].map(|method| histogram::Series {
            name: method.name().to_owned(),
            errors: self
                .scored(method, Group::Slip)
                .iter()
                .map(|s| (s.probability - s.truth()).abs())
                .collect(),
        });
        let title = "Distance of the probability from the label, ATLAS on a slippery floor";
        histogram::svg(title, &series)
    }

    /// The reliability diagrams of this estimator on both kinds of recordings, as one SVG.
    ///
    /// # Errors
    /// What the drawing library reports.
    pub fn reliability(&self) -> io::Result<String> {
        let panels = [Group::Atlas, Group::Lcd].map(|group| {
            let methods = [Method::Default, Method::Calibrated, Method::Mapped];
            reliability::Panel {
                title: group.name().to_owned(),
                series: methods.map(|method| {
                    let scored = self.scored(method, group);
                    let error = calibration_error(&scored).unwrap_or(0.0);
                    reliability::Series {
                        name: format!("{}: {error:.3}", method.name()),
                        bins: bins(&scored),
                    }
                }),
            }
        });
        reliability::svg(
            "How often P comes true, with the calibration error",
            &panels,
        )
    }

    fn scored(&self, method: Method, group: Group) -> Vec<Scored> {
        let outcomes = self.outcomes(method, group);
        outcomes.iter().flat_map(|o| &o.scored).copied().collect()
    }
}
