//! Viewer-independent layout: one page of all feet, and one page per foot.

use std::sync::Arc;

use crate::ros::FootTopics;

/// A page of stacked panels.
#[derive(Clone, Debug, PartialEq)]
pub struct Page {
    /// Title of the page.
    pub title: String,
    /// Panels of the page, from top to bottom.
    pub panels: Vec<Panel>,
}

/// A panel of a page.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// Displayed quantity, with its unit.
    pub title: String,
    /// Kind of display.
    pub kind: PanelKind,
    /// Displayed curves.
    pub curves: Vec<PlottedField>,
}

/// Display of the curves in a panel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PanelKind {
    /// Lines over time, on an axis of their own.
    Lines,
    /// Lines over time, from 0 to 1.
    Probabilities,
    /// Coloured bars over time.
    States,
    /// List of the diagnostics reported by the feet; without curves.
    Diagnostics,
}

/// A numeric field of a topic.
#[derive(Clone, Debug, PartialEq)]
pub struct PlottedField {
    /// Label in the panel.
    pub label: String,
    /// Topic of the messages.
    pub topic: Arc<str>,
    /// Field of the messages, with nested fields separated by points.
    pub field: String,
}

fn curve(label: &str, topic: &Arc<str>, field: impl Into<String>) -> PlottedField {
    PlottedField {
        label: label.to_owned(),
        topic: Arc::clone(topic),
        field: field.into(),
    }
}

/// Returns a curve for each of the three axes of a vector.
fn axes(topic: &Arc<str>, vector: &str) -> Vec<PlottedField> {
    let of_axis = |axis| curve(axis, topic, format!("{vector}.{axis}"));
    ["x", "y", "z"].map(of_axis).into()
}

/// Returns the pages of feet with these names.
#[must_use]
pub fn pages(feet: &[String]) -> Vec<Page> {
    let topics = feet.iter().map(|foot| (foot, FootTopics::of(foot)));
    let topics: Vec<(&String, FootTopics)> = topics.collect();
    let of_all = |curve_of: fn(&str, &FootTopics) -> PlottedField| {
        let curves = topics.iter().map(|(foot, topics)| curve_of(foot, topics));
        curves.collect::<Vec<_>>()
    };
    let panel = |title: &str, kind, curves| Panel {
        title: title.to_owned(),
        kind,
        curves,
    };
    let stable = of_all(|foot, topics| curve(foot, &topics.contact, "p_stable"));
    let states = of_all(|foot, topics| curve(foot, &topics.contact, "state"));
    let loads = of_all(|foot, topics| curve(foot, &topics.load, "data"));
    let all = Page {
        title: "Feet".to_owned(),
        panels: vec![
            panel("P of stable contact", PanelKind::Probabilities, stable),
            panel("State", PanelKind::States, states),
            panel("Load (N)", PanelKind::Lines, loads),
            panel("Faults and counters", PanelKind::Diagnostics, Vec::new()),
        ],
    };
    let one = |(foot, topics): &(&String, FootTopics)| {
        let (contact, imu) = (&topics.contact, &topics.imu);
        let probabilities = ["stable", "tangential", "vertical"];
        let probabilities = probabilities.map(|name| curve(name, contact, format!("p_{name}")));
        let decision = ["decision", "state"].map(|name| curve(name, contact, name));
        let load = vec![curve("load", &topics.load, "data")];
        let acceleration = axes(imu, "linear_acceleration");
        let rate = axes(imu, "angular_velocity");
        let (probabilities, decision) = (probabilities.into(), decision.into());
        Page {
            title: (*foot).clone(),
            panels: vec![
                panel("Probabilities", PanelKind::Probabilities, probabilities),
                panel("Decision and state", PanelKind::States, decision),
                panel("Load (N)", PanelKind::Lines, load),
                panel("Acceleration (m/s²)", PanelKind::Lines, acceleration),
                panel("Angular rate (rad/s)", PanelKind::Lines, rate),
            ],
        }
    };
    std::iter::once(all).chain(topics.iter().map(one)).collect()
}
