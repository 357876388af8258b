//! Foxglove layout of the pages: one tab per page, with its panels in a column.

use crate::ros::topics::DIAGNOSTICS;
use serde_json::{Map, Value, json};

use super::pages::{Page, Panel, PanelKind};

/// Time range shown of streaming data, s.
const SHOWN_S: f64 = 10.0;

/// Name of the panel that contains all others.
const TABS: &str = "Tab!pages";

/// Returns the text of the layout file.
#[must_use]
pub fn layout(pages: &[Page]) -> String {
    let mut panels = Map::new();
    let mut tabs = Vec::new();
    for (number, page) in pages.iter().enumerate() {
        let mut names = Vec::new();
        for (place, panel) in page.panels.iter().enumerate() {
            let (kind, settings) = settings(panel);
            let name = format!("{kind}!page{number}panel{place}");
            panels.insert(name.clone(), settings);
            names.push(name);
        }
        tabs.push(json!({"title": page.title, "layout": column(&names)}));
    }
    panels.insert(TABS.to_owned(), json!({"activeTabIdx": 0, "tabs": tabs}));
    let layout = json!({
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": TABS,
    });
    format!("{layout:#}\n")
}

/// Stacks panels of equal height.
fn column(names: &[String]) -> Value {
    match names {
        [] => Value::Null,
        [only] => json!(only),
        [first, rest @ ..] => json!({
            "direction": "column",
            "first": first,
            "second": column(rest),
            "splitPercentage": 100.0 / names.len() as f64,
        }),
    }
}

/// Returns the Foxglove type and settings of a panel.
fn settings(panel: &Panel) -> (&'static str, Value) {
    let paths = panel.curves.iter().map(|curve| {
        json!({
            "value": format!("{}.{}", curve.topic, curve.field),
            "label": curve.label,
            "enabled": true,
            "timestampMethod": "receiveTime",
        })
    });
    let paths: Vec<_> = paths.collect();
    let title = &panel.title;
    let mut plot = json!({
        "foxglovePanelTitle": title,
        "paths": paths,
        "isSynced": true,
        "xAxisVal": "timestamp",
        "followingViewWidth": SHOWN_S,
        "showLegend": true,
        "legendDisplay": "floating",
        "showXAxisLabels": true,
        "showYAxisLabels": true,
    });
    match panel.kind {
        PanelKind::Lines => ("Plot", plot),
        PanelKind::Probabilities => {
            plot["minYValue"] = json!(0);
            plot["maxYValue"] = json!(1);
            ("Plot", plot)
        }
        PanelKind::States => (
            "StateTransitions",
            json!({"foxglovePanelTitle": title, "paths": paths, "isSynced": true}),
        ),
        PanelKind::Diagnostics => (
            "DiagnosticSummary",
            json!({
                "foxglovePanelTitle": title,
                "topicToRender": DIAGNOSTICS,
                "minLevel": 0,
                "pinnedIds": [],
                "hardwareIdFilter": "",
                "sortByLevel": true,
            }),
        ),
    }
}
