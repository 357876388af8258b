//! The paper's figure as an SVG: load on top, then tangential and vertical probability, then the total with the
//! labels, over one time axis.
//!
//! The estimator state is shaded: swing grey, quiet swing blue, slip purple, unknown yellow; stance stays white.
//! Shading uses columns of three pixels, each showing the state of most of its samples. In a long walk, the few
//! milliseconds of slip at every landing and lift-off would otherwise be drawn as hairlines wider than they last.
//! Areas are therefore true; anything narrower than a column appears in the table only. Without any load the state
//! is always unknown and nothing is shaded.
//!
//! The line colours are those of Okabe and Ito, which colour-blind readers can distinguish. The file size depends
//! on the width of the picture, not on the length of the recording: every pixel column keeps its first, lowest,
//! highest and last value, so no peak is lost.
//!
//! [`page`] shows several feet with zoom.

pub mod page;
mod series;

use std::io;
use std::ops::Range;

use estimator_core::{ContactEstimate, Phase};
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use recordings::samples::{Label, RecordedSample, Recording};
use series::{Series, Trace};

pub use series::{Collector, Width};

/// Width of the picture in user units; viewers may scale it.
const WIDTH: u32 = 1600;
/// Height of the title line.
const TITLE_HEIGHT: u32 = 56;
/// Height of a legend row: lines in the first, labels and states in the second.
const LEGEND_HEIGHT: u32 = 40;
const PANEL_HEIGHT: u32 = 210;
/// Height of the numbers and the title of the time axis, below the last panel only.
const TIME_AXIS_HEIGHT: u32 = 66;
const BOTTOM_MARGIN: u32 = 12;
const LEFT_MARGIN: u32 = 16;
/// Width of the numbers and the title of a vertical axis.
const VALUE_AXIS_WIDTH: u32 = 104;
const RIGHT_MARGIN: u32 = 40;
/// Left end and width of the data area, pixels.
const PLOT_LEFT: i32 = (LEFT_MARGIN + VALUE_AXIS_WIDTH) as i32;
const PLOT_WIDTH: u32 = WIDTH - LEFT_MARGIN - VALUE_AXIS_WIDTH - RIGHT_MARGIN;
/// Gap between panels, half above and half below.
const PANEL_GAP: u32 = 18;

/// Font family only: the viewer picks the font.
const FONT: &str = "sans-serif";
/// Font size of a title.
const TITLE_SIZE: u32 = 32;
/// Font size of axis titles and legends.
const TEXT_SIZE: u32 = 24;
/// Font size of axis numbers.
const NUMBER_SIZE: u32 = 22;

const LOAD_COLOUR: RGBColor = RGBColor(64, 64, 64);
/// Colour of the first line: the tangential probability.
const TANGENTIAL_COLOUR: RGBColor = RGBColor(0, 114, 178);
/// Colour of the second line: the vertical probability.
const VERTICAL_COLOUR: RGBColor = RGBColor(213, 94, 0);
/// Colour of the third line: the probability.
const TOTAL_COLOUR: RGBColor = RGBColor(0, 158, 115);
const LABEL_COLOUR: RGBColor = BLACK;
const SWING_SHADE: RGBColor = RGBColor(230, 230, 230);
const QUIET_SWING_SHADE: RGBColor = RGBColor(196, 220, 238);
const SLIP_SHADE: RGBColor = RGBColor(221, 189, 232);
const UNKNOWN_SHADE: RGBColor = RGBColor(252, 243, 190);
/// Width of a shading column, pixels.
const SHADE_COLUMN: u32 = 3;
/// Position of the labels above the total probability, as values on its axis.
const TRACK: Range<f64> = 1.1..1.22;
/// Colour of a grid.
const GRID_COLOUR: RGBColor = RGBColor(205, 205, 205);

/// A part of a picture.
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Result of drawing.
type Drawn = Result<(), Box<dyn std::error::Error + Send + Sync>>;

/// Figure of one recording, drawn once all samples are added.
pub struct RecordingPlot {
    title: String,
    start_us: i64,
    load_title: String,
    collector: Collector,
}

impl RecordingPlot {
    /// Creates a figure of a recording from `span.start` to `span.end`, s, whose clock reads `start_us`, µs, at
    /// timestamp 0. The axis counts from that time and states it, since a time since 1970 does not fit at every
    /// tick.
    #[must_use]
    pub fn new(title: &str, start_us: i64, load_title: &str, span: Range<f64>) -> Self {
        let columns = PLOT_WIDTH;
        let width = Width { span, columns };
        Self {
            title: title.to_owned(),
            start_us,
            load_title: load_title.to_owned(),
            collector: Collector::new(width, SHADE_COLUMN),
        }
    }

    /// Adds a sample with its estimate. Load and labels are drawn if present.
    pub fn add(&mut self, sample: &RecordedSample, estimate: &ContactEstimate) {
        self.collector.add(sample, estimate);
    }

    /// Draws the figure.
    ///
    /// # Errors
    /// Errors of the drawing library; none are expected when writing to memory.
    pub fn svg(self) -> io::Result<String> {
        let mut text = String::new();
        let series = self.collector.finish();
        let panels = panels(&self.load_title, &series);
        draw(&mut text, &self.title, self.start_us, panels, &series).map_err(io::Error::other)?;
        Ok(text)
    }
}

/// Returns the time range of a recording, s: `samples` at `sample_rate` in Hz, over `duration_s` from the first at
/// `start_s`. A single sample still needs an axis.
#[must_use]
pub fn span(start_s: f64, duration_s: f64, sample_rate: f32) -> Range<f64> {
    start_s..start_s + duration_s.max(1.0 / f64::from(sample_rate))
}

/// Draws a recording with its estimates, one per sample.
///
/// # Errors
/// Those of [`RecordingPlot::svg`].
pub fn svg(recording: &Recording, estimates: &[ContactEstimate]) -> io::Result<String> {
    let first = recording.samples.first();
    let start_s = first.map_or(0.0, RecordedSample::time_s);
    let span = span(start_s, recording.duration_s(), recording.sample_rate);
    let mut figure = RecordingPlot::new(&recording.name, 0, &recording.load_title, span);
    for (sample, estimate) in recording.samples.iter().zip(estimates) {
        figure.add(sample, estimate);
    }
    figure.svg()
}

/// Width of the lines in panels.
const LINE_WIDTH: u32 = 2;

/// A panel: its axis and its line, which the axis title also names in the legend.
struct Panel {
    axis_title: String,
    range: Range<f64>,
    colour: RGBColor,
    trace: Trace,
}

/// Time intervals to be shaded.
struct ShadedIntervals {
    name: &'static str,
    colour: RGBColor,
    times: Vec<Range<f64>>,
}

impl ShadedIntervals {
    /// Returns blocks between two values.
    fn blocks(&self, between: Range<f64>) -> impl Iterator<Item = Rectangle<(f64, f64)>> {
        let style = self.colour.filled();
        self.times.iter().map(move |time| {
            let corners = [(time.start, between.start), (time.end, between.end)];
            Rectangle::new(corners, style)
        })
    }
}

fn draw(
    text: &mut String,
    title: &str,
    start_us: i64,
    mut panels: Vec<Panel>,
    series: &Series,
) -> Drawn {
    let time = &series.span;
    let shades = shades(series);
    let labels = series.labels.as_ref().map(|labels| ShadedIntervals {
        name: "label: stable",
        colour: LABEL_COLOUR,
        times: times_of(labels, Some(Label::Stable)),
    });
    if let (Some(_), Some(total)) = (&labels, panels.last_mut()) {
        total.range.end = TRACK.end + 0.06;
    }
    let panels_height = panels.len() as u32 * PANEL_HEIGHT + TIME_AXIS_HEIGHT + BOTTOM_MARGIN;
    let blocks: Vec<&ShadedIntervals> = labels.iter().chain(&shades).collect();
    let legend_rows = if blocks.is_empty() { 1 } else { 2 };
    let legend_height = legend_rows * LEGEND_HEIGHT;
    let height = TITLE_HEIGHT + legend_height + panels_height;

    let root = SVGBackend::with_string(text, (WIDTH, height)).into_drawing_area();
    root.fill(&WHITE)?;
    let (head, rest) = root.split_vertically(TITLE_HEIGHT);
    let centred = text_style(TITLE_SIZE).pos(Pos::new(HPos::Center, VPos::Center));
    head.draw_text(title, &centred, (PLOT_LEFT + PLOT_WIDTH as i32 / 2, 32))?;
    let (legend, mut rest) = rest.split_vertically(legend_height);
    draw_legend(&legend, &panels, &blocks)?;
    let last = panels.len() - 1;
    for (k, panel) in panels.iter().enumerate() {
        // The last panel shows the total probability, to which the labels belong.
        let (panel_height, track, time_axis) = if k == last {
            let height = PANEL_HEIGHT + TIME_AXIS_HEIGHT;
            (height, labels.as_ref(), Some(time_title(start_us)))
        } else {
            (PANEL_HEIGHT, None, None)
        };
        let (area, below) = rest.split_vertically(panel_height);
        draw_panel(&area, panel, &shades, track, time, time_axis.as_deref())?;
        rest = below;
    }
    root.present()?;
    Ok(())
}

/// Returns the title of the time axis.
fn time_title(start_us: i64) -> String {
    if start_us == 0 {
        "time (s)".to_owned()
    } else {
        // Exact: an f64 holds these times to a microsecond.
        format!("time (s) since t = {} s", start_us as f64 / 1.0e6)
    }
}

/// Returns the text style of a font size, one of the size constants of this module.
fn text_style(size: u32) -> TextStyle<'static> {
    (FONT, size).into_font().color(&BLACK)
}

fn panels(load_title: &str, series: &Series) -> Vec<Panel> {
    let panel = |axis_title: &str, range, colour, trace: &Trace| Panel {
        axis_title: axis_title.to_owned(),
        range,
        colour,
        trace: trace.clone(),
    };
    let load = series.load.as_ref();
    let load = load.map(|(trace, range)| panel(load_title, padded(range), LOAD_COLOUR, trace));
    let shown = [
        ("P tangential", TANGENTIAL_COLOUR),
        ("P vertical", VERTICAL_COLOUR),
        ("P stable", TOTAL_COLOUR),
    ];
    let shown = shown.into_iter().zip(&series.probabilities);
    let shown = shown.map(|((title, colour), trace)| panel(title, -0.04..1.04, colour, trace));
    load.into_iter().chain(shown).collect()
}

/// Returns a value range with a small margin.
fn padded(Range { start, end }: &Range<f64>) -> Range<f64> {
    let padding = if end > start { 0.06 * (end - start) } else { 1.0 };
    start - padding..end + padding
}

/// Returns the shaded states that occur.
fn shades(series: &Series) -> Vec<ShadedIntervals> {
    let shades = [
        ("state: swing", SWING_SHADE, Phase::Swing),
        ("state: quiet swing", QUIET_SWING_SHADE, Phase::QuietSwing),
        ("state: slip", SLIP_SHADE, Phase::Slip),
        ("state: unknown", UNKNOWN_SHADE, Phase::Unknown),
    ];
    let shades = shades.map(|(name, colour, phase)| ShadedIntervals {
        name,
        colour,
        times: times_of(&series.phases, phase),
    });
    let occurs = |shade: &ShadedIntervals| !shade.times.is_empty();
    shades.into_iter().filter(occurs).collect()
}

/// Returns the intervals of `intervals` with this value.
fn times_of<T: Copy + PartialEq>(intervals: &[(Range<f64>, T)], of: T) -> Vec<Range<f64>> {
    let holding = intervals.iter().filter(|(_, value)| *value == of);
    holding.map(|(times, _)| times.clone()).collect()
}

/// Draws the legend in a strip of its own, so that it never covers data.
fn draw_legend(area: &Area<'_>, panels: &[Panel], blocks: &[&ShadedIntervals]) -> Drawn {
    const SWATCH: i32 = 44;
    const SPACE: i32 = 10;
    /// Approximate width of a character; no font metrics are available.
    const CHARACTER: i32 = 12;
    let style = text_style(TEXT_SIZE).pos(Pos::new(HPos::Left, VPos::Center));
    let name_at = |x: &mut i32, middle: i32, name: &str| {
        *x += SWATCH + SPACE;
        let drawn = area.draw_text(name, &style, (*x, middle));
        *x += name.chars().count() as i32 * CHARACTER + 3 * SPACE;
        drawn
    };
    let (mut x, mut middle) = (PLOT_LEFT, LEGEND_HEIGHT as i32 / 2);
    for panel in panels {
        let stroke = panel.colour.stroke_width(LINE_WIDTH + 2);
        let ends = [(x, middle), (x + SWATCH, middle)];
        area.draw(&PathElement::new(ends, stroke))?;
        name_at(&mut x, middle, &panel.axis_title)?;
    }
    (x, middle) = (PLOT_LEFT, middle + LEGEND_HEIGHT as i32);
    for shown in blocks {
        let corners = [(x, middle - 12), (x + SWATCH, middle + 12)];
        area.draw(&Rectangle::new(corners, shown.colour.filled()))?;
        name_at(&mut x, middle, shown.name)?;
    }
    Ok(())
}

fn draw_panel(
    area: &Area<'_>,
    panel: &Panel,
    shades: &[ShadedIntervals],
    track: Option<&ShadedIntervals>,
    time: &Range<f64>,
    time_title: Option<&str>,
) -> Drawn {
    let time_axis_height = time_title.map_or(0, |_| TIME_AXIS_HEIGHT);
    let mut chart: ChartContext<'_, _, Cartesian2d<RangedCoordf64, RangedCoordf64>> =
        ChartBuilder::on(area)
            .margin_left(LEFT_MARGIN)
            .margin_right(RIGHT_MARGIN)
            .margin_top(PANEL_GAP / 2)
            .margin_bottom(PANEL_GAP / 2)
            .set_label_area_size(LabelAreaPosition::Left, VALUE_AXIS_WIDTH)
            .set_label_area_size(LabelAreaPosition::Bottom, time_axis_height)
            .build_cartesian_2d(time.clone(), panel.range.clone())?;
    for shade in shades {
        chart.draw_series(shade.blocks(panel.range.clone()))?;
    }
    let mut mesh = chart.configure_mesh();
    mesh.y_desc(&panel.axis_title)
        .y_labels(5)
        .x_labels(12)
        .y_label_formatter(&tick)
        .x_label_formatter(&tick)
        .axis_style(BLACK)
        .bold_line_style(GRID_COLOUR)
        .light_line_style(TRANSPARENT)
        .label_style(text_style(NUMBER_SIZE))
        .axis_desc_style(text_style(TEXT_SIZE));
    if let Some(title) = time_title {
        mesh.x_desc(title);
    }
    mesh.draw()?;
    if let Some(track) = track {
        chart.draw_series(track.blocks(TRACK))?;
    }
    let style = panel.colour.stroke_width(LINE_WIDTH);
    let paths = panel.trace.iter();
    chart.draw_series(paths.map(|path| PathElement::new(path.clone(), style)))?;
    Ok(())
}

/// Formats a number on an axis without trailing decimals.
fn tick(value: &f64) -> String {
    // Ticks are multiples of a power of ten, except for rounding.
    let rounded = (value * 1.0e6).round() / 1.0e6;
    // Avoids "-0".
    (rounded + 0.0).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::{Gravity, ImuSample, Load, Probabilities, Timestamp};

    fn picture(samples: u64, load: Option<Load>, label: Option<Label>) -> String {
        let phases = [Phase::Stance, Phase::Slip, Phase::Swing];
        picture_of_phases(samples, load, label, |k| match load {
            Some(_) => phases[k / 7 % 3],
            None => Phase::Unknown,
        })
    }

    fn picture_of_phases(
        samples: u64,
        load: Option<Load>,
        label: Option<Label>,
        phase: impl Fn(usize) -> Phase,
    ) -> String {
        let samples: Vec<_> = (0..samples)
            .map(|k| RecordedSample {
                imu: ImuSample {
                    timestamp: Timestamp::from_micros(k * 1000),
                    ..ImuSample::default()
                },
                load,
                label,
            })
            .collect();
        let estimates: Vec<_> = (0..samples.len())
            .map(|k| ContactEstimate {
                phase: phase(k),
                probabilities: Probabilities {
                    stable: (k % 17) as f32 / 16.0,
                    ..Probabilities::default()
                },
                ..ContactEstimate::default()
            })
            .collect();
        let recording = Recording {
            name: "busy walk".to_owned(),
            sample_rate: 1000.0,
            gravity: Gravity::Removed,
            load_title: "vertical force (N)".to_owned(),
            samples,
        };
        svg(&recording, &estimates).unwrap()
    }

    /// Returns the number of blocks of a colour: one per panel and interval, plus one in the legend.
    fn blocks(svg: &str, RGBColor(r, g, b): RGBColor) -> usize {
        svg.matches(&format!("fill=\"#{r:02X}{g:02X}{b:02X}\"")).count()
    }

    #[test]
    fn each_state_has_its_own_shade_and_name() {
        for (phase, name, colour) in [
            (Phase::Swing, "state: swing", SWING_SHADE),
            (Phase::QuietSwing, "state: quiet swing", QUIET_SWING_SHADE),
            (Phase::Slip, "state: slip", SLIP_SHADE),
            (Phase::Unknown, "state: unknown", UNKNOWN_SHADE),
        ] {
            let svg = picture_of_phases(1000, Some(Load(5.0)), None, |k| match k {
                0..300 => phase,
                _ => Phase::Stance,
            });
            assert!(svg.contains(name), "{name}");
            assert_eq!(svg.matches("state: ").count(), 1, "{name}");
            assert_eq!(blocks(&svg, colour), 1 + 4, "{name}");
        }
    }

    #[test]
    fn brief_state_is_not_drawn_as_a_hairline() {
        // At 14 s, a shading column is 29 ms wide.
        let slip_of = |milliseconds: usize| {
            let svg = picture_of_phases(14_000, Some(Load(5.0)), None, |k| match k {
                0..7000 => Phase::Swing,
                _ if k < 7000 + milliseconds => Phase::Slip,
                _ => Phase::Stance,
            });
            blocks(&svg, SLIP_SHADE)
        };
        assert_eq!(slip_of(5), 0);
        assert_eq!(slip_of(50), 1 + 4);
    }

    #[test]
    fn axes_and_legend_name_the_drawn_series() {
        let svg = picture(1000, Some(Load(5.0)), Some(Label::Stable));
        let alone = ["busy walk", "time (s)", "label: stable", "state: swing", "state: slip"];
        for text in alone {
            assert!(svg.contains(text), "{text}");
        }
        for text in ["vertical force (N)", "P tangential", "P vertical", "P stable"] {
            assert_eq!(svg.matches(&format!("\n{text}\n")).count(), 2, "{text}");
        }
    }

    #[test]
    fn unrecorded_series_are_not_drawn() {
        let svg = picture(1000, None, None);
        for text in ["force", "label:", "state:"] {
            assert!(!svg.contains(text), "{text}");
        }
    }

    #[test]
    fn single_sample_can_be_drawn() {
        assert!(picture(1, Some(Load(0.0)), None).contains("</svg>"));
    }

    #[test]
    fn size_stays_below_1_mb_for_any_recording() {
        let svg = picture(300_000, Some(Load(5.0)), Some(Label::Stable));
        assert!(svg.len() < 1_000_000, "{} bytes", svg.len());
    }
}
