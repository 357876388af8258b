//! What a layout shows of feet, whichever viewer it is for: a page of all of them, and one of each.

use std::sync::Arc;

use ros::Topics;

/// A page of panels, one below the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Page {
    /// What it is called.
    pub title: String,
    /// Its panels.
    pub panels: Vec<Panel>,
}

/// A part of a page.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// What it shows, with its unit.
    pub title: String,
    /// How.
    pub kind: Kind,
    /// What of.
    pub curves: Vec<Curve>,
}

/// How a panel shows its curves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// As lines over time, on an axis of its own.
    Lines,
    /// As lines over time, from 0 to 1.
    Probabilities,
    /// As coloured bars over time.
    States,
    /// As a list of what feet say about themselves; without curves.
    Diagnostics,
}

/// A number of a topic.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// What it is called in its panel.
    pub label: String,
    /// The topic.
    pub topic: Arc<str>,
    /// The field of its messages, with a point before each part of a part.
    pub field: &'static str,
}

fn curve(label: impl Into<String>, topic: &Arc<str>, field: &'static str) -> Curve {
    Curve {
        label: label.into(),
        topic: Arc::clone(topic),
        field,
    }
}

/// The fields of a sample's acceleration, x, y and z.
const LINEAR_ACCELERATION: [&str; 3] = [
    "linear_acceleration.x",
    "linear_acceleration.y",
    "linear_acceleration.z",
];

/// The fields of its angular rate, x, y and z.
const ANGULAR_VELOCITY: [&str; 3] = [
    "angular_velocity.x",
    "angular_velocity.y",
    "angular_velocity.z",
];

/// A curve for each of three axes.
fn axes(topic: &Arc<str>, fields: [&'static str; 3]) -> Vec<Curve> {
    let named = ["x", "y", "z"].into_iter().zip(fields);
    named
        .map(|(name, field)| curve(name, topic, field))
        .collect()
}

/// The pages of feet of these names.
#[must_use]
pub fn pages(feet: &[String]) -> Vec<Page> {
    let topics: Vec<(&String, Topics)> = feet.iter().map(|foot| (foot, Topics::of(foot))).collect();
    let of_all = |curve_of: fn(&String, &Topics) -> Curve| -> Vec<Curve> {
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
                Kind::Probabilities,
                of_all(|foot, topics| curve(foot, &topics.contact, "p_stable")),
            ),
            panel(
                "State",
                Kind::States,
                of_all(|foot, topics| curve(foot, &topics.contact, "state")),
            ),
            panel(
                "Load (N)",
                Kind::Lines,
                of_all(|foot, topics| curve(foot, &topics.load, "data")),
            ),
            panel("Faults and counters", Kind::Diagnostics, Vec::new()),
        ],
    };
    let one = |(foot, topics): &(&String, Topics)| {
        let Topics {
            contact, load, imu, ..
        } = topics;
        Page {
            title: (*foot).clone(),
            panels: vec![
                panel(
                    "Probabilities",
                    Kind::Probabilities,
                    vec![
                        curve("stable", contact, "p_stable"),
                        curve("tangential", contact, "p_tangential"),
                        curve("vertical", contact, "p_vertical"),
                    ],
                ),
                panel(
                    "Decision and state",
                    Kind::States,
                    vec![
                        curve("decision", contact, "decision"),
                        curve("state", contact, "state"),
                    ],
                ),
                panel("Load (N)", Kind::Lines, vec![curve("load", load, "data")]),
                panel(
                    "Acceleration (m/s²)",
                    Kind::Lines,
                    axes(imu, LINEAR_ACCELERATION),
                ),
                panel(
                    "Angular rate (rad/s)",
                    Kind::Lines,
                    axes(imu, ANGULAR_VELOCITY),
                ),
            ],
        }
    };
    std::iter::once(all).chain(topics.iter().map(one)).collect()
}
