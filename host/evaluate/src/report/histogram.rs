//! Side-by-side histograms of errors.

use std::io;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::axes;
use footfall::plot::{Area, Drawn, TANGENTIAL_COLOUR, TEXT_SIZE, VERTICAL_COLOUR, text_style};

const WIDTH: u32 = 1200;
const HEIGHT: u32 = 560;
const LEGEND_HEIGHT: u32 = 44;

/// Number of bars over [0, 1].
pub const BARS: usize = 20;

/// Errors of one method.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorSeries {
    /// The method, for the legend.
    pub name: String,
    /// |P − label| of each sample, in [0, 1].
    pub errors: Vec<f64>,
}

/// Draws both distributions as adjacent bars.
///
/// # Errors
/// The drawing library reports an error, which is not expected when writing to memory.
pub fn svg(title: &str, series: &[ErrorSeries; 2]) -> io::Result<String> {
    axes::picture((WIDTH, HEIGHT), title, |area| draw(area, series))
}

fn draw(area: &Area<'_>, series: &[ErrorSeries; 2]) -> Drawn {
    let colours = [TANGENTIAL_COLOUR, VERTICAL_COLOUR];
    let shares = series.each_ref().map(|series| shares(&series.errors));
    let highest = shares.iter().flatten().copied().fold(1.0, f64::max);
    let (legend, rest) = area.split_vertically(LEGEND_HEIGHT);
    for ((series, colour), left) in series.iter().zip(colours).zip([140, 640]) {
        let swatch = Rectangle::new([(left, 10), (left + 44, 34)], colour.filled());
        legend.draw(&swatch)?;
        let beside = text_style(TEXT_SIZE).pos(Pos::new(HPos::Left, VPos::Center));
        legend.draw_text(&series.name, &beside, (left + 56, 22))?;
    }
    let mut chart = axes::chart(&rest, 0.0..1.0, 0.0..1.05 * highest)?;
    let mut mesh = chart.configure_mesh();
    axes::styled(&mut mesh, "|P − label|", "share of samples (%)")
        .disable_x_mesh()
        .draw()?;
    let width = 1.0 / BARS as f64;
    for ((shares, colour), side) in shares.iter().zip(colours).zip([0.08, 0.5]) {
        let bars = shares.iter().enumerate().map(|(bar, share)| {
            let left = width * (bar as f64 + side);
            Rectangle::new(
                [(left, 0.0), (left + 0.42 * width, *share)],
                colour.filled(),
            )
        });
        chart.draw_series(bars)?;
    }
    Ok(())
}

/// Share of values in each bar, %. A bar includes its lower end, the last one also 1.
fn shares(values: &[f64]) -> [f64; BARS] {
    let mut shares = [0.0; BARS];
    for value in values {
        let bar = (value * BARS as f64) as usize;
        shares[bar.min(BARS - 1)] += 100.0 / values.len() as f64;
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_cover_both_ends_and_shares_add_up() {
        let shares = shares(&[0.0, 0.049, 0.5, 1.0]);
        assert_eq!((shares[0], shares[10], shares[19]), (50.0, 25.0, 25.0));
        assert_eq!(shares.iter().sum::<f64>(), 100.0);
    }

    #[test]
    fn picture_labels_both_methods_and_axes() {
        let series = |name: &str| ErrorSeries {
            name: name.to_owned(),
            errors: vec![0.1, 0.9],
        };
        let svg = svg("errors", &[series("one"), series("other")]).unwrap();
        for text in [
            "errors",
            "one",
            "other",
            "|P − label|",
            "share of samples (%)",
        ] {
            assert!(svg.contains(&format!("\n{text}\n")), "{text}");
        }
    }
}
