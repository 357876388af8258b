//! Viewer-independent layout: one page of all feet, and one page per foot.

use std::sync::Arc;

use ros::FootTopics;

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
    pub field: &'static str,
}

fn curve(label: impl Into<String>, topic: &Arc<str>, field: &'static str) -> PlottedField {
    PlottedField {
        label: label.into(),
        topic: Arc::clone(topic),
        field,
    }
}

/// Fields of a sample's acceleration, x, y and z.
const LINEAR_ACCELERATION: [&str; 3] = [
    "linear_acceleration.x",
    "linear_acceleration.y",
    "linear_acceleration.z",
];

/// Fields of a sample's angular rate, x, y and z.
const ANGULAR_VELOCITY: [&str; 3] = [
    "angular_velocity.x",
    "angular_velocity.y",
    "angular_velocity.z",
];

/// Returns a curve for each of three axes.
fn axes(topic: &Arc<str>, fields: [&'static str; 3]) -> Vec<PlottedField> {
    let named = ["x", "y", "z"].into_iter().zip(fields);
    named
        .map(|(name, field)| curve(name, topic, field))
        .collect()
}

/// Returns the pages of feet with these names.
#[must_use]
pub fn pages(feet: &[String]) -> Vec<Page> {
    let topics: Vec<(&String, FootTopics)> = feet
        .iter()
        .map(|foot| (foot, FootTopics::of(foot)))
        .collect();
    let of_all = |curve_of: fn(&String, &FootTopics) -> PlottedField| -> Vec<PlottedField> {
        topics
            .iter()
            .map(|(foot, topics)| curve_of(foot, topics))
            .collect()
    };
    let panel = |title: &str, kind, curves| Panel {
        title: title.to_owned(),
        kind,
        curves,
    };
    let all = Page {
        title: "Feet".to_owned(),
        panels: vec![
            panel(
                "P of stable contact",
                PanelKind::Probabilities,
                of_all(|foot, topics| curve(foot, &topics.contact, "p_stable")),
            ),
            panel(
                "State",
                PanelKind::States,
                of_all(|foot, topics| curve(foot, &topics.contact, "state")),
            ),
            panel(
                "Load (N)",
                PanelKind::Lines,
                of_all(|foot, topics| curve(foot, &topics.load, "data")),
            ),
            panel("Faults and counters", PanelKind::Diagnostics, Vec::new()),
        ],
    };
    let one = |(foot, topics): &(&String, FootTopics)| {
        let FootTopics {
            contact, load, imu, ..
        } = topics;
        Page {
            title: (*foot).clone(),
            panels: vec![
                panel(
                    "Probabilities",
                    PanelKind::Probabilities,
                    vec![
                        curve("stable", contact, "p_stable"),
                        curve("tangential", contact, "p_tangential"),
                        curve("vertical", contact, "p_vertical"),
                    ],
                ),
                panel(
                    "Decision and state",
                    PanelKind::States,
                    vec![
                        curve("decision", contact, "decision"),
                        curve("state", contact, "state"),
                    ],
                ),
                panel(
                    "Load (N)",
                    PanelKind::Lines,
                    vec![curve("load", load, "data")],
                ),
                panel(
                    "Acceleration (m/s²)",
                    PanelKind::Lines,
                    axes(imu, LINEAR_ACCELERATION),
                ),
                panel(
                    "Angular rate (rad/s)",
                    PanelKind::Lines,
                    axes(imu, ANGULAR_VELOCITY),
                ),
            ],
        }
    };
    std::iter::once(all).chain(topics.iter().map(one)).collect()
}
