//! The paper's figure as an SVG: load on top, then tangential, vertical and total probability, then a row each for the
//! decision, the labels and the events, over one time axis. The [`page`] has the same rows.
//!
//! The estimator state is shaded: swing grey, quiet swing blue, landing green, slip purple, unknown yellow; stance stays
//! white.
//! Shading uses columns of three pixels, each showing the state of most of its samples. In a long walk, the few
//! milliseconds of slip at every landing and lift-off would otherwise be drawn as hairlines wider than they last.
//! Areas are therefore true; anything narrower than a column appears in the table only. Without any load the state
//! is always unknown and nothing is shaded.
//!
//! The line colours are from Okabe and Ito, which colour-blind readers can distinguish. The file size depends
//! on the width of the picture, not on the length of the recording: every pixel column keeps its first, lowest,
//! highest and last value, so no peak is lost.
//!
//! [`page`] shows several feet with zoom.

pub mod page;
mod series;

use std::io;
use std::ops::Range;

use estimator_core::{ContactEstimate, Decision, Phase};
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use replay::events::{ContactEvent, Events};
use samples::{Label, RecordedSample, Recording};
use series::{DECISION_TRACK, EVENT_TRACK, EventCollector, LABEL_TRACK, LineKind, Series, Trace};

pub use series::{Collector, Width};

/// Width of the picture in user units; viewers may scale it.
const WIDTH: u32 = 1600;
/// Height of the title line.
const TITLE_HEIGHT: u32 = 56;
/// Height of a legend row: lines in the first, states in the second, decision, labels and events in the last.
const LEGEND_HEIGHT: u32 = 40;
const PANEL_HEIGHT: u32 = 210;
/// Height of the row of decision, labels or events.
const TRACK_HEIGHT: u32 = 40;
/// Half the height of blocks and marks in such a row.
const MARK_HALF: i32 = 12;
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
/// Colour of the decision "stable".
const DECISION_COLOUR: RGBColor = TOTAL_COLOUR;
const LABEL_COLOUR: RGBColor = BLACK;
/// Colour of slips among the events.
const SLIDE_COLOUR: RGBColor = RGBColor(204, 121, 167);
/// Colour of touch-downs and lift-offs.
const STEP_COLOUR: RGBColor = RGBColor(26, 26, 26);
const SWING_SHADE: RGBColor = RGBColor(230, 230, 230);
const QUIET_SWING_SHADE: RGBColor = RGBColor(196, 220, 238);
const LANDING_SHADE: RGBColor = RGBColor(203, 232, 205);
const SLIP_SHADE: RGBColor = RGBColor(221, 189, 232);
const UNKNOWN_SHADE: RGBColor = RGBColor(252, 243, 190);
/// Width of a shading column, pixels.
const SHADE_COLUMN: u32 = 3;
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
    events: EventCollector,
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
            collector: Collector::new(width.clone(), SHADE_COLUMN),
            events: EventCollector::new(width),
        }
    }

    /// Adds a sample with its estimate. Load and labels are drawn if present.
    pub fn add(&mut self, sample: &RecordedSample, estimate: &ContactEstimate) {
        self.collector.add(sample, estimate);
    }

    /// Adds the next event.
    pub fn add_event(&mut self, event: &ContactEvent) {
        self.events.add(event);
    }

    /// Draws the figure.
    ///
    /// # Errors
    /// Errors of the drawing library; none are expected when writing to memory.
    pub fn svg(self) -> io::Result<String> {
        let mut text = String::new();
        let series = self.collector.finish();
        let panels = panels(&self.load_title, &series);
        let tracks = Tracks::new(&series, self.events);
        draw(&mut text, &self.title, self.start_us, &panels, &tracks, &series)
            .map_err(io::Error::other)?;
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
/// The errors of [`RecordingPlot::svg`].
pub fn svg(recording: &Recording, estimates: &[ContactEstimate]) -> io::Result<String> {
    let first = recording.samples.first();
    let start_s = first.map_or(0.0, RecordedSample::time_s);
    let span = span(start_s, recording.duration_s(), recording.sample_rate);
    let mut figure = RecordingPlot::new(&recording.name, 0, &recording.load_title, span);
    let mut events = Events::default();
    for (sample, estimate) in recording.samples.iter().zip(estimates) {
        figure.add(sample, estimate);
        events.add(estimate);
        std::iter::from_fn(|| events.pop()).for_each(|event| figure.add_event(&event));
    }
    events.finish().for_each(|event| figure.add_event(&event));
    figure.svg()
}

/// Greatest number of labels on the time axis.
const TIME_LABELS: usize = 12;

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

/// The rows below the lines.
struct Tracks {
    /// Names of the rows from the top down.
    names: Vec<&'static str>,
    decision: ShadedIntervals,
    labels: Option<ShadedIntervals>,
    slips: ShadedIntervals,
    /// Times, s.
    touch_downs: Vec<f64>,
    lift_offs: Vec<f64>,
}

impl Tracks {
    fn new(series: &Series, events: EventCollector) -> Self {
        Self {
            names: series.tracks(),
            decision: ShadedIntervals {
                name: "decision: stable",
                colour: DECISION_COLOUR,
                times: times_of(&series.decisions, Decision::Stable),
            },
            labels: series.labels.as_ref().map(|labels| ShadedIntervals {
                name: "label: stable",
                colour: LABEL_COLOUR,
                times: times_of(labels, Some(Label::Stable)),
            }),
            slips: ShadedIntervals {
                name: "event: slip",
                colour: SLIDE_COLOUR,
                times: events.slips,
            },
            touch_downs: events.touch_downs,
            lift_offs: events.lift_offs,
        }
    }

    /// Returns the blocks of a row.
    fn blocks_of(&self, name: &str) -> Option<&ShadedIntervals> {
        match name {
            DECISION_TRACK => Some(&self.decision),
            LABEL_TRACK => self.labels.as_ref(),
            EVENT_TRACK => Some(&self.slips),
            _ => None,
        }
    }

    fn height(&self) -> u32 {
        self.names.len() as u32 * TRACK_HEIGHT + PANEL_GAP
    }
}

fn draw(
    text: &mut String,
    title: &str,
    start_us: i64,
    panels: &[Panel],
    tracks: &Tracks,
    series: &Series,
) -> Drawn {
    let time = &series.span;
    let shades = shades(series);
    let panels_height = panels.len() as u32 * PANEL_HEIGHT;
    let tracks_height = tracks.height() + TIME_AXIS_HEIGHT;
    let legend_rows = if shades.is_empty() { 2 } else { 3 };
    let legend_height = legend_rows * LEGEND_HEIGHT;
    let height = TITLE_HEIGHT + legend_height + panels_height + tracks_height + BOTTOM_MARGIN;

    let root = SVGBackend::with_string(text, (WIDTH, height)).into_drawing_area();
    root.fill(&WHITE)?;
    let (head, rest) = root.split_vertically(TITLE_HEIGHT);
    let centred = text_style(TITLE_SIZE).pos(Pos::new(HPos::Center, VPos::Center));
    head.draw_text(title, &centred, (PLOT_LEFT + PLOT_WIDTH as i32 / 2, 32))?;
    let (legend, mut rest) = rest.split_vertically(legend_height);
    draw_legend(&legend, panels, &shades, tracks)?;
    for panel in panels {
        let (area, below) = rest.split_vertically(PANEL_HEIGHT);
        draw_panel(&area, panel, &shades, time)?;
        rest = below;
    }
    let (area, _) = rest.split_vertically(tracks_height);
    draw_tracks(&area, tracks, &shades, time, &time_title(start_us))?;
    root.present()?;
    Ok(())
}

/// Returns the title of the time axis.
fn time_title(start_us: i64) -> String {
    if start_us == 0 {
        "time (s)".to_owned()
    } else {
        // This is exact, because an f64 holds these times to a microsecond.
        format!("time (s) since t = {} s", start_us as f64 / 1.0e6)
    }
}

/// Returns the text style of a font size, one of the size constants of this module.
fn text_style(size: u32) -> TextStyle<'static> {
    (FONT, size).into_font().color(&BLACK)
}

fn panels(load_title: &str, series: &Series) -> Vec<Panel> {
    let lines = series.lines(load_title).into_iter();
    let panel = |line: series::Line<'_>| {
        let (range, colour) = match line.kind {
            LineKind::Load => (padded(&line.range), LOAD_COLOUR),
            LineKind::Tangential => (-0.04..1.04, TANGENTIAL_COLOUR),
            LineKind::Vertical => (-0.04..1.04, VERTICAL_COLOUR),
            LineKind::Total => (-0.04..1.04, TOTAL_COLOUR),
        };
        Panel { axis_title: line.name.to_owned(), range, colour, trace: line.trace.clone() }
    };
    lines.map(panel).collect()
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
        ("state: landing", LANDING_SHADE, Phase::Landing),
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
fn draw_legend(
    area: &Area<'_>,
    panels: &[Panel],
    shades: &[ShadedIntervals],
    tracks: &Tracks,
) -> Drawn {
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
    let blocks: Vec<_> =
        [Some(&tracks.decision), tracks.labels.as_ref(), Some(&tracks.slips)].into();
    let rows = [shades.iter().collect(), blocks.into_iter().flatten().collect::<Vec<_>>()];
    for row in rows.into_iter().filter(|row| !row.is_empty()) {
        (x, middle) = (PLOT_LEFT, middle + LEGEND_HEIGHT as i32);
        for shown in row {
            let corners = [(x, middle - MARK_HALF), (x + SWATCH, middle + MARK_HALF)];
            area.draw(&Rectangle::new(corners, shown.colour.filled()))?;
            name_at(&mut x, middle, shown.name)?;
        }
    }
    for (points, name) in [(Points::Down, "touch-down"), (Points::Up, "lift-off")] {
        let at = (x + SWATCH / 2, middle);
        area.draw(&Polygon::new(triangle(at, MARK_HALF, points), STEP_COLOUR.filled()))?;
        name_at(&mut x, middle, name)?;
    }
    Ok(())
}

/// Direction of a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Points {
    /// A touch-down.
    Down,
    /// A lift-off.
    Up,
}

/// Returns the corners of a mark around its middle, pixels.
fn triangle((x, middle): (i32, i32), half_width: i32, points: Points) -> [(i32, i32); 3] {
    let tip = match points {
        Points::Down => MARK_HALF,
        Points::Up => -MARK_HALF,
    };
    [(x, middle + tip), (x - half_width, middle - tip), (x + half_width, middle - tip)]
}

/// Coordinates of a row: time in s and value.
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Creates the chart of a row, with its margins and its shades.
fn shaded_chart<'a, 'b>(
    area: &'a Area<'b>,
    range: Range<f64>,
    shades: &[ShadedIntervals],
    time: &Range<f64>,
    time_axis_height: u32,
) -> Result<Chart<'a, 'b>, Box<dyn std::error::Error + Send + Sync>> {
    let mut chart = ChartBuilder::on(area)
        .margin_left(LEFT_MARGIN)
        .margin_right(RIGHT_MARGIN)
        .margin_top(PANEL_GAP / 2)
        .margin_bottom(PANEL_GAP / 2)
        .set_label_area_size(LabelAreaPosition::Left, VALUE_AXIS_WIDTH)
        .set_label_area_size(LabelAreaPosition::Bottom, time_axis_height)
        .build_cartesian_2d(time.clone(), range.clone())?;
    for shade in shades {
        chart.draw_series(shade.blocks(range.clone()))?;
    }
    Ok(chart)
}

fn draw_panel(
    area: &Area<'_>,
    panel: &Panel,
    shades: &[ShadedIntervals],
    time: &Range<f64>,
) -> Drawn {
    let mut chart = shaded_chart(area, panel.range.clone(), shades, time, 0)?;
    chart
        .configure_mesh()
        .y_desc(&panel.axis_title)
        .y_labels(5)
        .x_labels(TIME_LABELS)
        .y_label_formatter(&tick)
        .x_label_formatter(&tick)
        .axis_style(BLACK)
        .bold_line_style(GRID_COLOUR)
        .light_line_style(TRANSPARENT)
        .label_style(text_style(NUMBER_SIZE))
        .axis_desc_style(text_style(TEXT_SIZE))
        .draw()?;
    let style = panel.colour.stroke_width(LINE_WIDTH);
    let paths = panel.trace.iter();
    chart.draw_series(paths.map(|path| PathElement::new(path.clone(), style)))?;
    Ok(())
}

/// Draws the rows below the lines, and the time axis.
fn draw_tracks(
    area: &Area<'_>,
    tracks: &Tracks,
    shades: &[ShadedIntervals],
    time: &Range<f64>,
    time_title: &str,
) -> Drawn {
    let count = tracks.names.len() as i32;
    // Values count rows from the bottom.
    let range = 0.0..f64::from(count);
    let mut chart = shaded_chart(area, range, shades, time, TIME_AXIS_HEIGHT)?;
    chart
        .configure_mesh()
        .disable_y_mesh()
        .y_labels(0)
        .x_labels(TIME_LABELS)
        .x_label_formatter(&tick)
        .axis_style(BLACK)
        .bold_line_style(GRID_COLOUR)
        .light_line_style(TRANSPARENT)
        .label_style(text_style(NUMBER_SIZE))
        .axis_desc_style(text_style(TEXT_SIZE))
        .x_desc(time_title)
        .draw()?;
    let beside = text_style(TEXT_SIZE).pos(Pos::new(HPos::Right, VPos::Center));
    let half = f64::from(MARK_HALF) / f64::from(TRACK_HEIGHT);
    for (k, name) in (0..).zip(&tracks.names) {
        let middle = f64::from(count - 1 - k) + 0.5;
        let (_, y) = chart.backend_coord(&(time.start, middle));
        area.draw_text(name, &beside, (PLOT_LEFT - 12, y - area.get_base_pixel().1))?;
        if let Some(blocks) = tracks.blocks_of(name) {
            chart.draw_series(blocks.blocks(middle - half..middle + half))?;
        }
        if *name == EVENT_TRACK {
            draw_steps(area, &chart, tracks, middle)?;
        }
    }
    Ok(())
}

/// Draws touch-downs and lift-offs in the row around this value.
fn draw_steps(area: &Area<'_>, chart: &Chart<'_, '_>, tracks: &Tracks, middle: f64) -> Drawn {
    let (left, top) = area.get_base_pixel();
    let count = (tracks.touch_downs.len() + tracks.lift_offs.len()) as i32;
    // Where they are many they become thin.
    let half_width = (PLOT_WIDTH as i32 / (3 * count.max(1))).clamp(1, MARK_HALF);
    let kinds = [(&tracks.touch_downs, Points::Down), (&tracks.lift_offs, Points::Up)];
    for (times, points) in kinds {
        for time in times {
            let (x, y) = chart.backend_coord(&(*time, middle));
            let corners = triangle((x - left, y - top), half_width, points);
            area.draw(&Polygon::new(corners, STEP_COLOUR.filled()))?;
        }
    }
    Ok(())
}

/// Formats a number on an axis without trailing decimals.
fn tick(value: &f64) -> String {
    // Ticks are multiples of a power of ten, except for rounding.
    let rounded = (value * 1.0e6).round() / 1.0e6;
    // Avoids "-0".
    (rounded + 0.0).to_string()
}

/// Estimate whose probabilities have this value.
#[cfg(test)]
fn estimate_with(p: f32) -> ContactEstimate {
    let probabilities = estimator_core::Probabilities {
        stable: p,
        tangential: p,
        vertical: p,
        ..estimator_core::Probabilities::default()
    };
    ContactEstimate { probabilities, ..ContactEstimate::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::{Gravity, ImuSample, Load, Probabilities, Timestamp};
    use replay::events::EventKind;
    use stored::About;

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
            (Phase::Landing, "state: landing", LANDING_SHADE),
            (Phase::Slip, "state: slip", SLIP_SHADE),
            (Phase::Unknown, "state: unknown", UNKNOWN_SHADE),
        ] {
            let svg = picture_of_phases(1000, Some(Load(5.0)), None, |k| match k {
                0..300 => phase,
                _ => Phase::Stance,
            });
            assert!(svg.contains(name), "{name}");
            assert_eq!(svg.matches("state: ").count(), 1, "{name}");
            assert_eq!(blocks(&svg, colour), 1 + 5, "{name}");
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
        assert_eq!(slip_of(50), 1 + 5);
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
        for text in ["force", "label", "state:"] {
            assert!(!svg.contains(text), "{text}");
        }
    }

    /// Returns the row names of a page with one foot, from the top down.
    fn rows_of_page(foot: page::PageFoot) -> Vec<String> {
        let mut bytes = Vec::new();
        page::write(vec![foot], &mut bytes).unwrap();
        let page = String::from_utf8(bytes).unwrap();
        let data = page.split_once("id=\"data\">").unwrap().1.split_once("</script>").unwrap().0;
        let data: serde_json::Value = serde_json::from_str(data).unwrap();
        let foot = &data["feet"][0];
        let lines = foot["lines"].as_array().unwrap().iter().map(|line| &line["name"]);
        let rows = lines.chain(foot["tracks"].as_array().unwrap());
        rows.map(|name| name.as_str().unwrap().to_owned()).collect()
    }

    /// Returns the vertical position of a text beside the rows. If the text occurs more than once,
    /// the last one counts, which is below the legend.
    fn height_of(svg: &str, text: &str) -> f64 {
        let at = svg.rfind(&format!("\n{text}\n")).unwrap_or_else(|| panic!("no {text}"));
        let element = &svg[svg[..at].rfind("<text").unwrap()..at];
        let y = element.split_once(" y=\"").unwrap().1;
        y.split_once('"').unwrap().0.parse().unwrap()
    }

    #[test]
    fn figure_has_the_rows_of_the_page() {
        for (load, label) in
            [(Some(Load(5.0)), Some(Label::Stable)), (Some(Load(5.0)), None), (None, None)]
        {
            let about = About {
                load_title: "vertical force (N)".to_owned(),
                ..About::new("walk".to_owned(), 1000.0, Gravity::Included)
            };
            let mut page = page::PageFoot::new("walk", &about, 0.0..1.0);
            let mut figure = RecordingPlot::new("walk", 0, &about.load_title, 0.0..1.0);
            for k in 0..1000 {
                let imu = ImuSample {
                    timestamp: Timestamp::from_micros(k * 1000),
                    ..ImuSample::default()
                };
                let sample = RecordedSample { imu, load, label };
                page.add(&sample, &ContactEstimate::default());
                figure.add(&sample, &ContactEstimate::default());
            }
            let rows = rows_of_page(page);
            assert_eq!(rows.len(), 5 + usize::from(load.is_some()) + usize::from(label.is_some()));
            let svg = figure.svg().unwrap();
            let heights: Vec<f64> = rows.iter().map(|row| height_of(&svg, row)).collect();
            assert!(heights.is_sorted_by(|a, b| a < b), "{rows:?} at {heights:?}");
        }
    }

    fn event(kind: EventKind, at_us: u64, duration_us: Option<u64>) -> ContactEvent {
        let time = Timestamp::from_micros(at_us);
        ContactEvent { time, kind, duration_us, peak: 1.0, distance_m: None }
    }

    #[test]
    fn events_are_marked_where_they_are() {
        let mut figure = RecordingPlot::new("walk", 0, "", 0.0..10.0);
        let sample = RecordedSample { imu: ImuSample::default(), load: None, label: None };
        figure.add(&sample, &ContactEstimate::default());
        for k in 0..4 {
            figure.add_event(&event(EventKind::TouchDown, 2_000_000 * k, None));
            figure.add_event(&event(EventKind::SlipStart, 2_000_000 * k + 200_000, Some(100_000)));
            figure.add_event(&event(EventKind::SlipEnd, 2_000_000 * k + 300_000, Some(100_000)));
            figure.add_event(&event(EventKind::LiftOff, 2_000_000 * k + 500_000, None));
        }
        // A slip without an end is drawn up to the end of the figure.
        figure.add_event(&event(EventKind::SlipStart, 9_000_000, None));
        let svg = figure.svg().unwrap();
        assert_eq!(blocks(&svg, SLIDE_COLOUR), 1 + 5);
        assert_eq!(svg.matches("<polygon").count(), 2 + 8);
        let lift_off = f64::from(PLOT_LEFT) + 6.5 / 10.0 * f64::from(PLOT_WIDTH);
        let tips = svg.split("points=\"").skip(1).map(|points| {
            let x = points.split_once(',').expect("a point").0;
            x.parse::<f64>().expect("a number")
        });
        assert!(tips.into_iter().any(|tip| (tip - lift_off).abs() <= 1.0), "{lift_off}");
    }

    #[test]
    fn single_sample_can_be_drawn() {
        assert!(picture(1, Some(Load(0.0)), None).contains("</svg>"));
    }

    #[test]
    fn size_stays_below_1_mb_for_any_recording() {
        let mut figure = RecordingPlot::new("busy", 0, "force", 0.0..300.0);
        for k in 0..300_000 {
            let imu =
                ImuSample { timestamp: Timestamp::from_micros(k * 1000), ..ImuSample::default() };
            let label = Some(if k % 300 < 150 { Label::Stable } else { Label::NotStable });
            let load = Some(Load((k % 19) as f32));
            let p = (k % 17) as f32 / 16.0;
            let estimate = ContactEstimate {
                phase: Phase::ALL[k as usize / 200 % Phase::ALL.len()],
                decision: if k % 400 < 200 { Decision::Stable } else { Decision::NotStable },
                ..estimate_with(p)
            };
            figure.add(&RecordedSample { imu, load, label }, &estimate);
            let kinds = [EventKind::TouchDown, EventKind::SlipStart, EventKind::LiftOff];
            figure.add_event(&event(kinds[k as usize % 3], 1000 * k, Some(500)));
        }
        let svg = figure.svg().unwrap();
        assert!(svg.len() < 1_000_000, "{} bytes", svg.len());
        assert!(svg.matches("<polygon").count() > 2000);
    }
}
