//! Pictures of the documents that are not plots: SVG, readable on light and on dark pages.

use std::fmt::Write;

/// Colours of a picture. A page is dark if the system of its reader is.
const STYLE: &str = "text{font:13px sans-serif;fill:#24292f}.small{font-size:11px;fill:#57606a}\
.title{font-weight:bold}.box{fill:#f6f8fa;stroke:#57606a}.line{stroke:#57606a;fill:none}\
.grid{stroke:#d0d7de;fill:none}.strong{stroke:#0969da;stroke-width:2;fill:none}\
.bar{fill:#bc4c00}.board{fill:#1a7f37}.body{fill:#d0d7de;stroke:#57606a}.soft{fill:#8c959f;stroke:#57606a}\
.head{fill:#57606a}@media (prefers-color-scheme:dark){text{fill:#e6edf3}.small{fill:#9198a1}\
.box{fill:#21262d;stroke:#9198a1}.line{stroke:#9198a1}.grid{stroke:#30363d}.strong{stroke:#4493f8}\
.bar{fill:#f0883e}.board{fill:#3fb950}.body{fill:#30363d;stroke:#9198a1}.soft{fill:#6e7681;stroke:#9198a1}\
.head{fill:#9198a1}}";

/// Elements of a picture, in the order in which they are painted. Lengths are pixels.
struct Drawing {
    svg: String,
}

impl Drawing {
    fn new(width: u32, height: u32, title: &str) -> Self {
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
             height=\"{height}\" role=\"img\">\n<title>{title}</title>\n<style>{STYLE}</style>\n"
        );
        svg += "<defs><marker id=\"head\" viewBox=\"0 0 8 8\" refX=\"7\" refY=\"4\" markerWidth=\"9\" \
                markerHeight=\"9\" markerUnits=\"userSpaceOnUse\" orient=\"auto\"><path class=\"head\" d=\"M0 0 8 4 0 8z\"/></marker></defs>\n";
        Self { svg }
    }

    fn element(&mut self, text: &str) {
        self.svg += text;
        self.svg.push('\n');
    }

    /// Writes lines of text around a centre, the first of them bold.
    fn label(&mut self, x: f64, y: f64, lines: &[&str]) {
        let top = y - 8.0 * (lines.len() - 1) as f64 + 4.0;
        for (k, line) in lines.iter().enumerate() {
            let class = if k == 0 { "title" } else { "small" };
            self.text(x, top + 16.0 * k as f64, class, "middle", line);
        }
    }

    fn text(&mut self, x: f64, y: f64, class: &str, anchor: &str, text: &str) {
        self.element(&format!(
            "<text class=\"{class}\" x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\">{text}</text>"
        ));
    }

    fn rectangle(&mut self, class: &str, x: f64, y: f64, width: f64, height: f64) {
        self.element(&format!(
            "<rect class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" rx=\"3\"/>"
        ));
    }

    fn boxed(&mut self, x: f64, y: f64, width: f64, height: f64, lines: &[&str]) {
        self.rectangle("box", x, y, width, height);
        self.label(x + width / 2.0, y + height / 2.0, lines);
    }

    fn path(&mut self, class: &str, data: &str) {
        self.element(&format!("<path class=\"{class}\" d=\"{data}\"/>"));
    }

    fn arrow(&mut self, data: &str) {
        self.element(&format!("<path class=\"line\" marker-end=\"url(#head)\" d=\"{data}\"/>"));
    }

    fn finish(mut self) -> String {
        self.svg += "</svg>\n";
        self.svg
    }
}

/// Draws the way of a sample from the sensor to the CAN bus.
#[must_use]
pub fn way_of_a_sample() -> String {
    let mut drawing = Drawing::new(900, 330, "The way of a sample, from the sensor to the CAN bus");
    let first: [&[&str]; 4] = [
        &["LSM6DSOX", "accelerometer", "and gyroscope"],
        &["Driver", "bytes to m/s² and rad/s,", "with time and validity"],
        &["Mounting", "corrects the accelerometer,", "turns to the foot's axes"],
        &["Attitude", "removes gravity", "and the gyroscope's bias"],
    ];
    for (k, lines) in first.into_iter().enumerate() {
        let x = 10.0 + 233.0 * k as f64;
        drawing.boxed(x, 20.0, 180.0, 74.0, lines);
        if k > 0 {
            drawing.arrow(&format!("M{} 57H{}", x - 53.0, x - 1.0));
        }
    }
    drawing.text(216.0, 48.0, "small", "middle", "SPI");
    drawing.text(216.0, 74.0, "small", "middle", "1 kHz");
    // From the attitude to the three questions, on the left of the second row.
    drawing.path("line", "M799 94V122H20V283");
    let questions: [&[&str]; 3] = [
        &["M", "moves as little as in its stances?"],
        &["S", "does not slide?"],
        &["E", "has rested or landed lately?"],
    ];
    for (k, lines) in questions.into_iter().enumerate() {
        let y = 144.0 + 58.0 * k as f64;
        drawing.boxed(40.0, y, 230.0, 46.0, lines);
        drawing.arrow(&format!("M20 {0}H39", y + 23.0));
        drawing.path("line", &format!("M270 {0}H300", y + 23.0));
    }
    drawing.path("line", "M300 167V283");
    drawing.arrow("M300 225H339");
    drawing.boxed(
        340.0,
        188.0,
        150.0,
        74.0,
        &["P = M · S · E", "probability of", "stable contact"],
    );
    drawing.arrow("M490 225H529");
    drawing.boxed(
        530.0,
        188.0,
        160.0,
        74.0,
        &["Decision and phase", "debounced; stance, slip", "or swing with a load"],
    );
    drawing.arrow("M690 225H729");
    drawing.boxed(
        730.0,
        188.0,
        160.0,
        74.0,
        &["CAN frame", "probabilities, status", "and time in 8 bytes"],
    );
    drawing.finish()
}

/// Draws where the board sits on a foot, and its axes.
#[must_use]
pub fn board_on_the_foot() -> String {
    let mut drawing =
        Drawing::new(640, 340, "Where the board sits on the foot, seen from the side");
    drawing.path("line", "M20 300H620");
    for x in (30..620).step_by(20) {
        drawing.path("grid", &format!("M{x} 300l-10 12"));
    }
    // Leg, the part that gives, foot, sole.
    drawing.path("body", "M180 20 230 20 290 180 240 180Z");
    drawing.rectangle("soft", 225.0, 180.0, 80.0, 22.0);
    drawing.path("body", "M190 202H380Q400 202 404 228L410 280H170L176 228Q180 202 190 202Z");
    drawing.path("soft", "M166 280H414V294Q414 300 406 300H174Q166 300 166 294Z");
    drawing.rectangle("board", 320.0, 190.0, 62.0, 12.0);
    // The cable runs along the leg, with a loop where the leg moves against the foot.
    drawing.path("line", "M322 194C300 196 318 150 338 160S330 190 306 160L262 40");
    drawing.element("<path class=\"strong\" marker-end=\"url(#head)\" d=\"M351 190V120\"/>");
    drawing.element("<path class=\"strong\" marker-end=\"url(#head)\" d=\"M382 196H452\"/>");
    drawing.text(362.0, 130.0, "title", "start", "z: up, away from the sole");
    drawing.text(458.0, 200.0, "title", "start", "x: to the front");
    drawing.text(428.0, 240.0, "", "start", "board: fixed to the foot itself");
    drawing.path("line", "M424 236 360 203");
    drawing.text(150.0, 196.0, "", "end", "a part that gives");
    drawing.path("line", "M154 192H222");
    drawing.text(150.0, 250.0, "", "end", "foot");
    drawing.path("line", "M154 246H182");
    drawing.text(150.0, 292.0, "", "end", "sole");
    drawing.path("line", "M154 288H170");
    drawing.text(150.0, 70.0, "", "end", "leg");
    drawing.path("line", "M154 66H196");
    drawing.text(300.0, 66.0, "", "start", "cable: a loop at each joint");
    drawing.finish()
}

/// Part of a recording, with the flags of its estimates.
pub struct Panel<'a> {
    /// Content of the part.
    pub title: &'a str,
    /// First and last time, s.
    pub span: (f64, f64),
    /// Times, s, and probabilities.
    pub probability: Vec<(f64, f64)>,
    /// Names of flags, each with the times at which it begins and ends, s.
    pub flags: Vec<(&'a str, Vec<(f64, f64)>)>,
}

/// Draws the probability above bars that show when each flag is set.
#[must_use]
pub fn flags(panels: &[Panel<'_>]) -> String {
    const LEFT: f64 = 180.0;
    const WIDTH: f64 = 690.0;
    const CURVE: f64 = 90.0;
    const ROW: f64 = 24.0;
    /// Longest time between two samples that the curve joins.
    const BREAK_S: f64 = 0.02;
    let height_of = |panel: &Panel<'_>| 90.0 + CURVE + ROW * panel.flags.len() as f64;
    let height: f64 = panels.iter().map(height_of).sum();
    let mut drawing =
        Drawing::new(900, height as u32, "Flags, and the probability while they are set");
    let mut top = 0.0;
    for panel in panels {
        let (from, to) = panel.span;
        let x = |t: f64| LEFT + WIDTH * (t - from) / (to - from);
        let y = |p: f64| top + 40.0 + CURVE * (1.0 - p);
        drawing.text(LEFT, top + 24.0, "title", "start", panel.title);
        let bottom = y(0.0) + ROW * panel.flags.len() as f64 + 10.0;
        let seconds = (from.ceil() as i32..=to.floor() as i32).map(f64::from);
        for second in seconds {
            drawing.path("grid", &format!("M{:.1} {:.1}V{:.1}", x(second), y(1.0), bottom));
            drawing.text(
                x(second).round(),
                bottom + 16.0,
                "small",
                "middle",
                &format!("{second} s"),
            );
        }
        for (p, name) in [(1.0, "1"), (0.5, "P"), (0.0, "0")] {
            drawing.text(LEFT - 10.0, y(p) + 4.0, "small", "end", name);
            drawing.path("grid", &format!("M{LEFT} {:.1}h{WIDTH}", y(p)));
        }
        let mut curve = String::new();
        let mut previous = f64::NEG_INFINITY;
        for &(t, p) in &panel.probability {
            let letter = if t - previous > BREAK_S { 'M' } else { 'L' };
            previous = t;
            // Writing to a string cannot fail.
            let _ = write!(curve, "{letter}{:.1} {:.1}", x(t), y(p));
        }
        drawing.path("strong", &curve);
        for (k, (name, times)) in panel.flags.iter().enumerate() {
            let middle = y(0.0) + 10.0 + ROW * (k as f64 + 0.5);
            drawing.text(LEFT - 10.0, middle + 4.0, "", "end", name);
            for &(begin, end) in times {
                let width = (x(end) - x(begin)).max(2.0);
                drawing.rectangle("bar", x(begin), middle - 6.0, width, 12.0);
            }
        }
        top += height_of(panel);
    }
    drawing.finish()
}
