//! Reliability diagrams: observed share of stable samples over the estimated probability.

use std::io;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use scoring::reliability::Bin;

use super::axes;
use footfall::plot::{
    Area, Drawn, TANGENTIAL_COLOUR, TEXT_SIZE, TOTAL_COLOUR, VALUE_AXIS_WIDTH, VERTICAL_COLOUR,
    text_style,
};

const WIDTH: u32 = 1600;
const HEIGHT: u32 = 860;
/// Height of a title and three lines of legend, pixels.
const LEGEND_HEIGHT: u32 = 150;

/// One line of a diagram.
#[derive(Clone, Debug, PartialEq)]
pub struct BinSeries {
    /// Name in the legend.
    pub name: String,
    /// Bins in order of probability.
    pub bins: Vec<Bin>,
}

/// One diagram.
#[derive(Clone, Debug, PartialEq)]
pub struct ReliabilityDiagram {
    /// Title of the diagram.
    pub title: String,
    /// Lines of the diagram.
    pub series: [BinSeries; 3],
}

/// Draws two diagrams side by side. The area of a dot grows with the number of samples in its bin.
///
/// # Errors
/// The drawing library reports an error, which is not expected when writing to memory.
pub fn svg(title: &str, panels: &[ReliabilityDiagram; 2]) -> io::Result<String> {
    axes::picture((WIDTH, HEIGHT), title, |area| {
        let areas = area.split_evenly((1, 2));
        let mut panels = areas.iter().zip(panels);
        panels.try_for_each(|(area, panel)| draw_panel(area, panel))
    })
}

fn draw_panel(area: &Area<'_>, panel: &ReliabilityDiagram) -> Drawn {
    let colours = [TANGENTIAL_COLOUR, VERTICAL_COLOUR, TOTAL_COLOUR];
    let (legend, area) = area.split_vertically(LEGEND_HEIGHT);
    let beside = text_style(TEXT_SIZE).pos(Pos::new(HPos::Left, VPos::Center));
    let left = VALUE_AXIS_WIDTH as i32 + 24;
    legend.draw_text(&panel.title, &beside, (left, 20))?;
    for ((series, colour), line) in panel.series.iter().zip(colours).zip(1..) {
        let middle = 20 + 36 * line;
        let dot = Circle::new((left + 16, middle), 9, colour.filled());
        legend.draw(&dot)?;
        legend.draw_text(&series.name, &beside, (left + 40, middle))?;
    }
    let mut chart = axes::chart(&area, -0.02..1.02, -0.02..1.02)?;
    let mut mesh = chart.configure_mesh();
    axes::styled(&mut mesh, "P", "share that is stable")
        .x_labels(6)
        .y_labels(6)
        .draw()?;
    let ideal = PathElement::new([(0.0, 0.0), (1.0, 1.0)], BLACK.stroke_width(1));
    chart.draw_series([ideal])?;
    for (series, colour) in panel.series.iter().zip(colours) {
        let points = || series.bins.iter().map(|bin| (bin.probability, bin.stable));
        let path = PathElement::new(points().collect::<Vec<_>>(), colour.stroke_width(2));
        chart.draw_series([path])?;
        let all: usize = series.bins.iter().map(|bin| bin.samples).sum();
        let dots = series.bins.iter().zip(points()).map(|(bin, point)| {
            Circle::new(point, radius(bin.samples, all), colour.mix(0.7).filled())
        });
        chart.draw_series(dots)?;
    }
    Ok(())
}

/// Radius of the dot for a share of the samples, pixels, limited to a visible minimum.
fn radius(samples: usize, all: usize) -> i32 {
    let share = samples as f64 / all.max(1) as f64;
    4 + (28.0 * share.sqrt()).round() as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(title: &str) -> ReliabilityDiagram {
        ReliabilityDiagram {
            title: title.to_owned(),
            series: [1, 2, 3].map(|k| BinSeries {
                name: format!("{title} {k}"),
                bins: vec![
                    Bin {
                        samples: 10 * k,
                        probability: 0.1,
                        stable: 0.2,
                    };
                    k
                ],
            }),
        }
    }

    #[test]
    fn every_bin_has_a_dot_and_every_line_a_name() {
        let svg = svg("reliability", &[panel("left"), panel("right")]).unwrap();
        // Six bins and three legend entries in each panel.
        assert_eq!(svg.matches("<circle").count(), 2 * (6 + 3));
        for text in ["reliability", "left 1", "right 3", "share that is stable"] {
            assert!(svg.contains(&format!("\n{text}\n")), "{text}");
        }
    }

    #[test]
    fn dot_area_grows_with_samples_from_a_visible_minimum() {
        assert_eq!(radius(0, 100), 4);
        assert_eq!(radius(100, 100), 32);
        assert_eq!(radius(25, 100), 18);
    }
}
