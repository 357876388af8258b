//! How mid-stance is distributed on each axis, with ± its half-width, as an SVG.
//!
//! Like the paper's figure of the six densities: a histogram of the samples, whose area is 1, the
//! interval that counts as rest shaded, and the share of the samples in it.

use std::io;
use std::ops::Range;

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::{
    Area, BOTTOM_MARGIN, GRID_COLOUR, NUMBER_SIZE, RIGHT_MARGIN, TEXT_SIZE, TITLE_HEIGHT,
    TITLE_SIZE, TOTAL_COLOUR, VALUE_AXIS_WIDTH, WIDTH, text_style, tick,
};
use crate::calibrate::half_width::{AxisReport, HalfWidths};

const COLUMNS: usize = 3;
const PANEL_HEIGHT: u32 = 320;
const VALUE_AXIS_HEIGHT: u32 = 60;
/// What a panel shows, in half-widths to either side.
const EXTENT: f64 = 1.5;
const BINS: usize = 90;
/// The interval that counts as rest.
const REST_SHADE: RGBColor = RGBColor(222, 240, 233);
const LIMIT_COLOUR: RGBColor = RGBColor(213, 94, 0);

/// Draws the distribution of mid-stance on each axis.
///
/// # Errors
/// What the drawing library reports; writing to memory gives it no reason to.
pub fn svg(half_widths: &HalfWidths) -> io::Result<String> {
    let mut text = String::new();
    draw(&mut text, half_widths).map_err(io::Error::other)?;
    Ok(text)
}

fn draw(
    text: &mut String,
    half_widths: &HalfWidths,
) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    let rows = half_widths.axes.len().div_ceil(COLUMNS);
    let height = TITLE_HEIGHT + rows as u32 * PANEL_HEIGHT + BOTTOM_MARGIN;
    let root = SVGBackend::with_string(text, (WIDTH, height)).into_drawing_area();
    root.fill(&WHITE)?;
    let (title, rest) = root.split_vertically(TITLE_HEIGHT);
    let centred = text_style(TITLE_SIZE).pos(Pos::new(HPos::Center, VPos::Center));
    let name = format!("mid-stance of {} steps and ± half-width", half_widths.steps);
    title.draw_text(&name, &centred, (WIDTH as i32 / 2, 32))?;
    let (panels, _) = rest.split_vertically(rows as u32 * PANEL_HEIGHT);
    let areas = panels.split_evenly((rows, COLUMNS));
    for ((k, axis), area) in half_widths.axes.iter().enumerate().zip(&areas) {
        let values = half_widths.mid_stance.iter().map(|m| f64::from(m[k]));
        draw_panel(area, axis, values)?;
    }
    root.present()?;
    Ok(())
}

fn draw_panel(
    area: &Area<'_>,
    axis: &AxisReport,
    values: impl ExactSizeIterator<Item = f64>,
) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    let half_width = f64::from(axis.half_width);
    let shown = -EXTENT * half_width..EXTENT * half_width;
    let bars = histogram(values, &shown);
    let top = bars.iter().map(|(_, height)| *height).fold(0.0, f64::max);
    let range = 0.0..1.15 * top.max(f64::MIN_POSITIVE);
    let unit = if axis.axis.starts_with('a') {
        "m/s²"
    } else {
        "rad/s"
    };
    let mut chart: ChartContext<'_, _, Cartesian2d<RangedCoordf64, RangedCoordf64>> =
        ChartBuilder::on(area)
            .margin_right(RIGHT_MARGIN)
            .margin_top(12)
            .set_label_area_size(LabelAreaPosition::Left, VALUE_AXIS_WIDTH)
            .set_label_area_size(LabelAreaPosition::Bottom, VALUE_AXIS_HEIGHT)
            .build_cartesian_2d(shown, range.clone())?;
    let block = |x: Range<f64>, y: Range<f64>, colour: RGBColor| {
        Rectangle::new([(x.start, y.start), (x.end, y.end)], colour.filled())
    };
    chart.draw_series([block(-half_width..half_width, range.clone(), REST_SHADE)])?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .y_labels(4)
        .x_labels(5)
        .x_desc(format!(
            "{} ({unit}): {:.2} % within ±{:.4}",
            axis.axis,
            100.0 * axis.share_within,
            axis.half_width
        ))
        .y_label_formatter(&tick)
        .x_label_formatter(&tick)
        .axis_style(BLACK)
        .bold_line_style(GRID_COLOUR)
        .light_line_style(TRANSPARENT)
        .label_style(text_style(NUMBER_SIZE))
        .axis_desc_style(text_style(TEXT_SIZE))
        .draw()?;
    let bars = bars.into_iter().filter(|(_, height)| *height > 0.0);
    chart.draw_series(bars.map(|(x, height)| block(x, 0.0..height, TOTAL_COLOUR)))?;
    let limits = [-half_width, half_width];
    chart.draw_series(limits.map(|x| {
        PathElement::new(
            [(x, range.start), (x, range.end)],
            LIMIT_COLOUR.stroke_width(3),
        )
    }))?;
    Ok(())
}

/// Bars over `shown` with the density of all values: those beyond it count, but are not shown.
fn histogram(
    values: impl ExactSizeIterator<Item = f64>,
    shown: &Range<f64>,
) -> Vec<(Range<f64>, f64)> {
    let width = (shown.end - shown.start) / BINS as f64;
    let weight = 1.0 / (values.len().max(1) as f64 * width);
    let mut heights = [0.0; BINS];
    for value in values {
        if shown.contains(&value) {
            let bin = ((value - shown.start) / width) as usize;
            heights[bin.min(BINS - 1)] += weight;
        }
    }
    let edge = |bin: usize| shown.start + width * bin as f64;
    heights
        .into_iter()
        .enumerate()
        .map(|(bin, height)| (edge(bin)..edge(bin + 1), height))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::half_width::RecordingSteps;
    use estimator_core::PerAxis;

    fn half_widths(samples: usize) -> HalfWidths {
        let axis = |axis| AxisReport {
            axis,
            spread: 0.1,
            bandwidth: 0.02,
            half_width: 0.4,
            preset_half_width: 0.4,
            share_within: 0.9987,
        };
        HalfWidths {
            steps: 12,
            recordings: vec![RecordingSteps {
                recording: "walk".to_owned(),
                steps: 12,
            }],
            axes: ["ax", "ay", "az", "wx", "wy", "wz"].map(axis).to_vec(),
            mid_stance: (0..samples)
                .map(|k| [(k % 200) as f32 * 0.001 - 0.1; 6])
                .collect(),
            half_width: PerAxis::splat(0.4),
        }
    }

    #[test]
    fn every_axis_has_its_panel_with_unit_share_and_limits() {
        let svg = svg(&half_widths(2000)).unwrap();
        assert!(svg.contains("mid-stance of 12 steps"));
        for (axis, unit) in [
            ("ax", "m/s²"),
            ("az", "m/s²"),
            ("wx", "rad/s"),
            ("wz", "rad/s"),
        ] {
            assert!(
                svg.contains(&format!("{axis} ({unit}): 99.87 % within ±0.4000")),
                "{axis}"
            );
        }
        assert_eq!(svg.matches("stroke=\"#D55E00\"").count(), 12);
    }

    #[test]
    fn the_area_of_a_histogram_is_the_share_that_is_shown() {
        let values = [-2.0, -0.5, 0.0, 0.1, 0.99, 1.0, f64::NAN, 0.3];
        let bars = histogram(values.into_iter(), &(-1.0..1.0));
        let area: f64 = bars
            .iter()
            .map(|(x, height)| (x.end - x.start) * height)
            .sum();
        assert!((area - 5.0 / 8.0).abs() < 1e-12, "{area}");
    }

    #[test]
    fn its_size_does_not_depend_on_how_long_the_recordings_are() {
        let [short, long] = [2_000, 200_000].map(|samples| svg(&half_widths(samples)).unwrap());
        assert!(long.len() < 200_000 && long.len().abs_diff(short.len()) < 2_000);
    }
}
