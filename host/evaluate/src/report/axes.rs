//! Axes of a chart, shared by all pictures of shares.

use std::error::Error;
use std::ops::Range;

use plotters::chart::MeshStyle;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use footfall::plot::{
    Area, GRID_COLOUR, NUMBER_SIZE, TEXT_SIZE, VALUE_AXIS_WIDTH, text_style, tick,
};

type Chart<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
type Mesh<'a, 'b> = MeshStyle<'a, 'b, RangedCoordf64, RangedCoordf64, SVGBackend<'a>>;

/// Builds a chart over two ranges with room for numbers and titles.
pub(super) fn chart<'a>(
    area: &Area<'a>,
    across: Range<f64>,
    up: Range<f64>,
) -> Result<Chart<'a>, Box<dyn Error + Send + Sync>> {
    Ok(ChartBuilder::on(area)
        .margin(12)
        .margin_right(36)
        .set_label_area_size(LabelAreaPosition::Left, VALUE_AXIS_WIDTH)
        .set_label_area_size(LabelAreaPosition::Bottom, 66)
        .build_cartesian_2d(across, up)?)
}

/// Sets the style of the numbers, titles and lines of a grid.
pub(super) fn styled<'a, 'b, 'm>(
    mesh: &'m mut Mesh<'a, 'b>,
    across: &str,
    up: &str,
) -> &'m mut Mesh<'a, 'b> {
    mesh.x_desc(across)
        .y_desc(up)
        .x_label_formatter(&tick)
        .y_label_formatter(&tick)
        .bold_line_style(GRID_COLOUR)
        .light_line_style(TRANSPARENT)
        .label_style(text_style(NUMBER_SIZE))
        .axis_desc_style(text_style(TEXT_SIZE))
}
