//! `PlotJuggler` layout of the pages: one tab per page, with its plots in a column. `PlotJuggler` draws numbers
//! only, so the panel of diagnostics is left out.

use super::pages::{Page, Panel, PanelKind};

/// Distinguishable colours for curves, also for colour-blind readers: Okabe and Ito.
const COLOURS: [&str; 6] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9",
];

/// Returns the text of the layout file.
#[must_use]
pub fn layout(pages: &[Page]) -> String {
    let tabs: String = pages.iter().map(tab).collect();
    format!(
        r#"<?xml version='1.0' encoding='UTF-8'?>
<root>
 <tabbed_widget parent="main_window" name="Main Window">
{tabs}  <currentTabIndex index="0"/>
 </tabbed_widget>
 <use_relative_time_offset enabled="1"/>
</root>
"#
    )
}

fn tab(page: &Page) -> String {
    let panels = page.panels.iter().filter(|panel| !panel.curves.is_empty());
    let panels: Vec<String> = panels.map(dock).collect();
    let count = panels.len();
    let shares = vec![format!("{:.4}", 1.0 / count as f64); count].join(";");
    let (title, panels) = (escaped(&page.title), panels.concat());
    format!(
        r#"  <Tab tab_name="{title}" containers="1">
   <Container>
    <DockSplitter orientation="-" count="{count}" sizes="{shares}">
{panels}    </DockSplitter>
   </Container>
  </Tab>
"#
    )
}

fn dock(panel: &Panel) -> String {
    let (style, limits) = match panel.kind {
        PanelKind::States => ("Steps", ""),
        PanelKind::Probabilities => ("Lines", " min=\"0\" max=\"1\""),
        PanelKind::Lines | PanelKind::Diagnostics => ("Lines", ""),
    };
    let curves = panel.curves.iter().zip(COLOURS.iter().cycle());
    let curves = curves.map(|(curve, colour)| {
        let (topic, field) = (&curve.topic, curve.field.replace('.', "/"));
        format!("       <curve name=\"{topic}/{field}\" color=\"{colour}\"/>\n")
    });
    let (title, curves) = (escaped(&panel.title), curves.collect::<String>());
    format!(
        r#"     <DockArea name="{title}">
      <plot mode="TimeSeries" style="{style}" flip_x="false" flip_y="false">
       <range left="0" right="10" bottom="0" top="1"/>
       <limitY{limits}/>
{curves}      </plot>
     </DockArea>
"#
    )
}

/// Escapes a text for use within quotes.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('"', "&quot;")
}
