//! Axes of a chart, shared by all pictures of shares.

use std::error::Error;
use std::io;
use std::ops::Range;

use plotters::chart::MeshStyle;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use footfall::plot::{
    Area, Drawn, GRID_COLOUR, NUMBER_SIZE, TEXT_SIZE, TITLE_HEIGHT, TITLE_SIZE, VALUE_AXIS_WIDTH,
    text_style, tick,
};

type Chart<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
type Mesh<'a, 'b> = MeshStyle<'a, 'b, RangedCoordf64, RangedCoordf64, SVGBackend<'a>>;

/// Draws a picture below its title.
pub(super) fn picture(
    (width, height): (u32, u32),
    title: &str,
    draw: impl FnOnce(&Area<'_>) -> Drawn,
) -> io::Result<String> {
    let mut text = String::new();
    let into = |text| -> Drawn {
        let root = SVGBackend::with_string(text, (width, height)).into_drawing_area();
        root.fill(&WHITE)?;
        let (head, rest) = root.split_vertically(TITLE_HEIGHT);
        let centred = text_style(TITLE_SIZE).pos(Pos::new(HPos::Center, VPos::Center));
        head.draw_text(title, &centred, (width as i32 / 2, 32))?;
        draw(&rest)?;
        Ok(root.present()?)
    };
    into(&mut text).map_err(io::Error::other)?;
    Ok(text)
}

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
