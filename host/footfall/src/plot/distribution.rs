//! Distribution of a foot's amplitudes at rest and in motion, as an SVG.
//!
//! One panel per quantity, on a logarithmic scale: samples weighted by their probability of being still or moving,
//! the learnt amplitudes of both classes, and the stillness threshold between them.

use std::io;
use std::ops::Range;

use plotters::coord::combinators::LogCoord;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use recordings::analysis::calibrate::learnt::{Amplitudes, LearntFoot, QuantityReport};

use super::{
    Area, BOTTOM_MARGIN, Drawn, GRID_COLOUR, NUMBER_SIZE, RIGHT_MARGIN, TANGENTIAL_COLOUR,
    TEXT_SIZE, TITLE_HEIGHT, TITLE_SIZE, TOTAL_COLOUR, VALUE_AXIS_WIDTH, VERTICAL_COLOUR, WIDTH,
    text_style, tick,
};

const PANEL_HEIGHT: u32 = 300;
const VALUE_AXIS_HEIGHT: u32 = 60;
const LEGEND_HEIGHT: u32 = 44;
/// Factor by which a panel extends beyond the classes, below and above.
const BEYOND: f64 = 30.0;
const BINS: usize = 120;
const STILL_COLOUR: RGBColor = TOTAL_COLOUR;
const MOVING_COLOUR: RGBColor = TANGENTIAL_COLOUR;
const EDGE_COLOUR: RGBColor = VERTICAL_COLOUR;

/// Draws the amplitude distribution of each quantity.
///
/// # Errors
/// Errors of the drawing library; none are expected when writing to memory.
pub fn svg(foot: &LearntFoot) -> io::Result<String> {
    let mut text = String::new();
    draw(&mut text, foot).map_err(io::Error::other)?;
    Ok(text)
}

fn draw(text: &mut String, foot: &LearntFoot) -> Drawn {
    let rows = foot.quantities.len();
    let height = TITLE_HEIGHT + LEGEND_HEIGHT + rows as u32 * PANEL_HEIGHT + BOTTOM_MARGIN;
    let root = SVGBackend::with_string(text, (WIDTH, height)).into_drawing_area();
    root.fill(&WHITE)?;
    let (title, rest) = root.split_vertically(TITLE_HEIGHT);
    let centred = text_style(TITLE_SIZE).pos(Pos::new(HPos::Center, VPos::Center));
    let name = format!(
        "amplitudes, learnt from {:.1} s of stance and {:.1} s of swing",
        foot.stance_s, foot.swing_s
    );
    title.draw_text(&name, &centred, (WIDTH as i32 / 2, 32))?;
    let (legend, rest) = rest.split_vertically(LEGEND_HEIGHT);
    draw_legend(&legend)?;
    let (panels, _) = rest.split_vertically(rows as u32 * PANEL_HEIGHT);
    let areas = panels.split_evenly((rows, 1));
    for ((k, quantity), area) in foot.quantities.iter().enumerate().zip(&areas) {
        draw_panel(area, quantity, k, &foot.amplitudes)?;
    }
    root.present()?;
    Ok(())
}

fn draw_legend(area: &Area<'_>) -> Drawn {
    let entries = [
        ("still, by P", STILL_COLOUR),
        ("in motion, by 1 − P", MOVING_COLOUR),
        ("edge of stillness", EDGE_COLOUR),
    ];
    for ((name, colour), left) in entries.into_iter().zip([140, 480, 900]) {
        let swatch = Rectangle::new([(left, 10), (left + 44, 34)], colour.filled());
        area.draw(&swatch)?;
        let beside = text_style(TEXT_SIZE).pos(Pos::new(HPos::Left, VPos::Center));
        area.draw_text(name, &beside, (left + 56, 22))?;
    }
    Ok(())
}

fn draw_panel(
    area: &Area<'_>,
    quantity: &QuantityReport,
    index: usize,
    amplitudes: &[Amplitudes],
) -> Drawn {
    let [at_rest, edge, in_motion] =
        [quantity.at_rest, quantity.edge, quantity.in_motion].map(f64::from);
    let shown = at_rest / BEYOND..in_motion * BEYOND;
    let samples = amplitudes.iter();
    let still = samples.clone().map(|of| (of.values[index], of.stable));
    let moving = samples.map(|of| (of.values[index], 1.0 - of.stable));
    let (still, moving) = (histogram(still, &shown), histogram(moving, &shown));
    let bars = still.iter().chain(&moving);
    let top = bars.map(|(_, height)| *height).fold(0.0, f64::max);
    let range = 0.0..1.15 * top.max(f64::MIN_POSITIVE);
    let mut chart: ChartContext<'_, _, Cartesian2d<LogCoord<f64>, RangedCoordf64>> =
        ChartBuilder::on(area)
            .margin_right(RIGHT_MARGIN)
            .margin_top(12)
            .set_label_area_size(LabelAreaPosition::Left, VALUE_AXIS_WIDTH)
            .set_label_area_size(LabelAreaPosition::Bottom, VALUE_AXIS_HEIGHT)
            .build_cartesian_2d(shown.clone().log_scale(), range.clone())?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .y_labels(4)
        .x_labels(8)
        .x_desc(format!(
            "{} ({}): {at_rest:.3} at rest, still below {edge:.3}, {in_motion:.2} in motion",
            quantity.quantity, quantity.unit
        ))
        .y_desc("samples (%)")
        .y_label_formatter(&tick)
        .x_label_formatter(&tick)
        .axis_style(BLACK)
        .bold_line_style(GRID_COLOUR)
        .light_line_style(TRANSPARENT)
        .label_style(text_style(NUMBER_SIZE))
        .axis_desc_style(text_style(TEXT_SIZE))
        .draw()?;
    for (bars, colour) in [(still, STILL_COLOUR), (moving, MOVING_COLOUR)] {
        let bars = bars.into_iter().filter(|(_, height)| *height > 0.0);
        chart.draw_series(bars.map(|(x, height)| {
            Rectangle::new([(x.start, 0.0), (x.end, height)], colour.mix(0.6).filled())
        }))?;
    }
    let colours = [STILL_COLOUR, MOVING_COLOUR, EDGE_COLOUR];
    for (x, colour) in [at_rest, in_motion, edge].into_iter().zip(colours) {
        let ends = [(x, range.start), (x, range.end)];
        chart.draw_series([PathElement::new(ends, colour.stroke_width(3))])?;
    }
    Ok(())
}

/// Returns bars over `shown`, even on a logarithmic scale, each with its share of the total weight, %. Values
/// outside `shown` count towards the total only.
fn histogram(
    values: impl ExactSizeIterator<Item = (f64, f64)>,
    shown: &Range<f64>,
) -> Vec<(Range<f64>, f64)> {
    let [low, high] = [shown.start, shown.end].map(libm::log);
    let width = (high - low) / BINS as f64;
    let share = 100.0 / values.len().max(1) as f64;
    let mut heights = [0.0; BINS];
    for (value, weight) in values {
        if shown.contains(&value) {
            let bin = ((libm::log(value) - low) / width) as usize;
            heights[bin.min(BINS - 1)] += share * weight;
        }
    }
    let edge = |bin: usize| libm::exp(low + width * bin as f64);
    let bars = heights.into_iter().enumerate();
    bars.map(|(bin, height)| (edge(bin)..edge(bin + 1), height))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::Learnt;
    use recordings::analysis::calibrate::learnt::LearntFrom;

    fn foot(samples: usize) -> LearntFoot {
        let quantity = |quantity, unit| QuantityReport {
            quantity,
            unit,
            at_rest: 0.2,
            edge: 1.0,
            in_motion: 12.0,
        };
        LearntFoot {
            recordings: vec![LearntFrom {
                recording: "walk".to_owned(),
                duration_s: 12.0,
            }],
            quantities: [
                quantity("acceleration", "m/s²"),
                quantity("rate", "rad/s"),
                quantity("velocity", "m/s²"),
            ],
            stance_s: 3.0,
            swing_s: 2.0,
            settled: true,
            object: [0.0; Learnt::NUMBERS],
            learnt: Learnt::default(),
            amplitudes: (0..samples)
                .map(|k| Amplitudes {
                    values: [0.01 * (k % 2000) as f64; 3],
                    stable: if k % 2000 < 100 { 1.0 } else { 0.1 },
                })
                .collect(),
        }
    }

    #[test]
    fn each_quantity_has_a_panel_with_unit_classes_and_edge() {
        let svg = svg(&foot(4000)).unwrap();
        assert!(svg.contains("learnt from 3.0 s of stance and 2.0 s of swing"));
        for (quantity, unit) in [
            ("acceleration", "m/s²"),
            ("rate", "rad/s"),
            ("velocity", "m/s²"),
        ] {
            let title =
                format!("{quantity} ({unit}): 0.200 at rest, still below 1.000, 12.00 in motion");
            assert!(svg.contains(&title), "{quantity}");
        }
        assert_eq!(svg.matches("stroke=\"#D55E00\"").count(), 3);
    }

    #[test]
    fn histogram_holds_the_shown_weight() {
        let values = [0.05, 0.1, 0.5, 1.0, 9.99, 10.0, f64::NAN, 0.0];
        let weighted = values.into_iter().map(|value| (value, 0.5));
        let bars = histogram(weighted, &(0.1..10.0));
        let weight: f64 = bars.iter().map(|(_, height)| height).sum();
        // Four of eight values, each with weight 0.5.
        assert!((weight - 25.0).abs() < 1e-9, "{weight}");
    }

    #[test]
    fn size_is_independent_of_recording_length() {
        let [short, long] = [2_000, 200_000].map(|samples| svg(&foot(samples)).unwrap());
        assert!(long.len() < 200_000 && long.len().abs_diff(short.len()) < 2_000);
    }
}
