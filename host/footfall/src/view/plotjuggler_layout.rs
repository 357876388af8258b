//! `PlotJuggler` layout of the pages: one tab per page, with its plots in a column. `PlotJuggler` draws numbers
//! only, so the panel of diagnostics is left out.

use std::fmt::{self, Write};

use super::pages::{Page, Panel, PanelKind};

/// Distinguishable colours for curves, also for colour-blind readers: Okabe and Ito.
const COLOURS: [&str; 6] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9",
];

/// Returns the text of the layout file.
#[must_use]
pub fn layout(pages: &[Page]) -> String {
    let mut text = String::new();
    // Writing to memory does not fail.
    let _: fmt::Result = write_layout(pages, &mut text);
    text
}

fn write_layout(pages: &[Page], to: &mut String) -> fmt::Result {
    writeln!(to, "<?xml version='1.0' encoding='UTF-8'?>\n<root>")?;
    writeln!(
        to,
        " <tabbed_widget parent=\"main_window\" name=\"Main Window\">"
    )?;
    for page in pages {
        let is_drawn = |panel: &&Panel| !panel.curves.is_empty();
        let panels: Vec<_> = page.panels.iter().filter(is_drawn).collect();
        let share = format!("{:.4}", 1.0 / panels.len() as f64);
        let shares = vec![share; panels.len()].join(";");
        let title = escaped(&page.title);
        writeln!(to, "  <Tab tab_name=\"{title}\" containers=\"1\">")?;
        writeln!(to, "   <Container>")?;
        writeln!(
            to,
            "    <DockSplitter orientation=\"-\" count=\"{}\" sizes=\"{shares}\">",
            panels.len()
        )?;
        for panel in panels {
            write_panel(panel, to)?;
        }
        writeln!(to, "    </DockSplitter>\n   </Container>\n  </Tab>")?;
    }
    writeln!(to, "  <currentTabIndex index=\"0\"/>\n </tabbed_widget>")?;
    writeln!(to, " <use_relative_time_offset enabled=\"1\"/>\n</root>")
}

fn write_panel(panel: &Panel, to: &mut String) -> fmt::Result {
    let (style, limits) = match panel.kind {
        PanelKind::States => ("Steps", ""),
        PanelKind::Probabilities => ("Lines", " min=\"0\" max=\"1\""),
        PanelKind::Lines | PanelKind::Diagnostics => ("Lines", ""),
    };
    let title = escaped(&panel.title);
    writeln!(to, "     <DockArea name=\"{title}\">")?;
    writeln!(
        to,
        "      <plot mode=\"TimeSeries\" style=\"{style}\" flip_x=\"false\" flip_y=\"false\">"
    )?;
    writeln!(
        to,
        "       <range left=\"0\" right=\"10\" bottom=\"0\" top=\"1\"/>"
    )?;

    writeln!(to, "       <limitY{limits}/>")?;
    for (curve, colour) in panel.curves.iter().zip(COLOURS.iter().cycle()) {
        let field = curve.field.replace('.', "/");
        writeln!(
            to,
            "       <curve name=\"{}/{field}\" color=\"{colour}\"/>",
            curve.topic
        )?;
    }
    writeln!(to, "      </plot>\n     </DockArea>")
}

/// Escapes a text for use within quotes.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('"', "&quot;")
}
