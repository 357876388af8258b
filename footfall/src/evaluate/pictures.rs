//! An evaluation's pictures: how large the errors are, and whether a probability means what it
//! says.

use std::io;

use super::Evaluation;
use super::method::Method;
use super::sets::{Pool, Set};
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
            name: method.name(),
            errors: self
                .scored(method, |set| set == Set::Slip)
                .iter()
                .map(|s| (s.probability - s.truth()).abs())
                .collect(),
        });
        let title = "Distance of the probability from the label, ATLAS on a slippery floor";
        histogram::svg(title, &series)
    }

    /// The reliability diagrams of the methods that give a probability, on the two robots' families,
    /// as one SVG.
    ///
    /// # Errors
    /// What the drawing library reports.
    pub fn reliability(&self) -> io::Result<String> {
        let panels = Pool::ALL.map(|pool| {
            let methods = [Method::Default, Method::Paper, Method::FuzzyCMeans];
            reliability::Panel {
                title: pool.family().name().to_owned(),
                series: methods.map(|method| {
                    let scored = self.scored(method, |set| set.family() == pool.family());
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

    fn scored(&self, method: Method, of: impl Fn(Set) -> bool) -> Vec<Scored> {
        let sets = self.evaluated(method).into_iter().flat_map(|e| &e.sets);
        let scored = sets.filter(|on| of(on.set)).flat_map(|on| &on.scored);
        scored.copied().collect()
    }
}
