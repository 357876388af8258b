//! Feet of decoded rows: their contacts as the estimates of a recording, for events and pictures.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::sync::Arc;

use estimator_core::{Flag, Flags, Params, PerAxis, Probabilities};
use feet::decode::ContactRow;
use recordings::analysis::replay::foot::{ReplayError, Table, Wanted, replay};
use recordings::analysis::replay::span::Span;
use recordings::input::Stored;
use recordings::input::store::contacts::{
    Contacts, NO_VECTOR, NewestOrientation, SentContact, flags_of_contact,
};

use crate::progress::Bars;
use crate::replay::{Picture, ReplayedFoot, Watched};
use crate::targets::Drawing;

/// Longest step back of the common clock that is evened out, µs: times of reception, which a sample's own time follows,
/// are milliseconds late.
const LONGEST_STEP_BACK_US: i64 = 1_000_000;

/// Rows of one foot on one clock. Each restart begins another where there is none but the foot's own: on a serial line,
/// and in logs without times.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    interface: Option<Arc<str>>,
    /// Node id on a bus. That of a foot on a serial line is not known from the start.
    node: Option<u8>,
    /// Number of restarts before, if each begins another clock.
    restarts: u32,
}

/// Feet, in the order of their interfaces and nodes.
#[derive(Default)]
pub struct DecodedFeet(BTreeMap<Key, DecodedFoot>);

#[derive(Default)]
struct DecodedFoot {
    name: Option<Arc<str>>,
    node: Option<u8>,
    contacts: Contacts,
    orientation: NewestOrientation,
    newest_us: Option<i64>,
    left_out: u64,
}

impl DecodedFeet {
    /// Adds a row.
    ///
    /// # Errors
    /// A temporary file cannot be written.
    pub fn add(&mut self, row: &ContactRow) -> io::Result<()> {
        let is_on_bus = row.received.is_some() || row.interface.is_some();
        let key = Key {
            interface: row.interface.clone(),
            node: row.node.filter(|_| is_on_bus).map(wire::NodeId::get),
            restarts: if row.common.is_some() { 0 } else { row.segment },
        };
        self.0.entry(key).or_default().add(row)
    }

    /// Estimates nothing again: makes events and a picture of the contacts of each foot as they were sent. `name` is that
    /// of the log. Also returns a sentence on rows that were left out of each.
    ///
    /// # Errors
    /// A temporary file cannot be written or read.
    pub fn finish(
        self,
        name: &str,
        events: bool,
        drawing: Option<Drawing>,
    ) -> Result<(Vec<ReplayedFoot>, Vec<String>), ReplayError> {
        let bars = Bars::default();
        let names = names(&self.0);
        let is_only = self.0.len() == 1;
        let mut feet = Vec::new();
        let mut notices = Vec::new();
        for (foot, shown) in self.0.into_values().zip(names) {
            if foot.left_out > 0 {
                let rows = foot.left_out;
                notices.push(format!(
                    "{shown}: {rows} rows are not among events and plots, as their clock went back by more than a second"
                ));
            }
            let own = foot.name.is_some() || foot.node.is_some() || !is_only;
            let own = own.then_some(shown);
            let Some(mut stored) = Stored::of_contacts(name.to_owned(), own, foot.contacts) else {
                continue;
            };
            let wanted = Wanted {
                events: match (events, is_only) {
                    (false, _) => Table::None,
                    (true, true) => Table::OneFoot,
                    (true, false) => Table::SeveralFeet,
                },
                ..Wanted::default()
            };
            let mut watched = Watched {
                bar: bars.estimating(stored.about.samples as u64),
                picture: drawing.map(|drawing| Picture::new(drawing, &stored, Span::default())),
                events: None,
            };
            let foot = replay(&mut stored, &Params::default(), &wanted, &mut watched)?;
            watched.bar.finish_and_clear();
            let picture = watched.picture;
            feet.push(ReplayedFoot { foot, picture });
        }
        Ok((feet, notices))
    }

    /// Returns whether the table of events names the feet.
    #[must_use]
    pub fn are_several(&self) -> bool {
        self.0.len() > 1
    }
}

/// Names of the feet, no two alike.
fn names(feet: &BTreeMap<Key, DecodedFoot>) -> Vec<String> {
    let own = |foot: &DecodedFoot| match (&foot.name, foot.node) {
        (Some(name), _) => name.to_string(),
        (None, Some(node)) => format!("node_{node}"),
        (None, None) => "foot".to_owned(),
    };
    let interfaces = |name: &str| {
        let named = feet.iter().filter(|(_, foot)| own(foot) == name);
        let interfaces: BTreeSet<_> = named.map(|(key, _)| &key.interface).collect();
        interfaces.len()
    };
    let name = |(key, foot): (&Key, &DecodedFoot)| {
        let mut name = own(foot);
        if let Some(interface) = key.interface.as_deref().filter(|_| interfaces(&name) > 1) {
            name = format!("{interface} {name}");
        }
        match key.restarts {
            0 => name,
            restarts => format!("{name} after restart {restarts}"),
        }
    };
    feet.iter().map(name).collect()
}

impl DecodedFoot {
    fn add(&mut self, row: &ContactRow) -> io::Result<()> {
        // On a serial line they are known from the first health message on.
        if row.foot.is_some() {
            self.name.clone_from(&row.foot);
        }
        self.node = row.node.map(wire::NodeId::get).or(self.node);
        let common = row.common.map(|(common, _)| common);
        let time_us = common.unwrap_or(row.timestamp).as_micros().cast_signed();
        let time_us = match self.newest_us {
            Some(newest_us) if time_us <= newest_us => {
                if newest_us - time_us > LONGEST_STEP_BACK_US {
                    self.left_out += 1;
                    return Ok(());
                }
                newest_us + 1
            }
            _ => time_us,
        };
        self.newest_us = Some(time_us);
        if let Some(orientation) = row.orientation {
            self.orientation.set(time_us, orientation);
        }
        let contact = SentContact {
            time_us,
            probabilities: Probabilities {
                axes: row.axes.unwrap_or(PerAxis::splat(f32::NAN)),
                tangential: row.tangential,
                vertical: row.vertical,
                stable: row.stable,
            },
            velocity_sigma: f32::NAN,
            decision: row.status.decision(),
            phase: row.status.phase(),
            flags: flags(row),
            is_valid: row.status.is_valid(),
            orientation: self.orientation.at(time_us),
            acceleration: row.acceleration.unwrap_or(NO_VECTOR),
        };
        self.contacts.push(&contact).map(|_| ())
    }
}

/// Flags of a row; most frames on CAN have those of their status alone.
fn flags(row: &ContactRow) -> Flags {
    let status = row.status;
    let flags = match row.flags {
        Some(bits) => Flags::from_bits(bits),
        None => [
            (status.is_saturated(), Flag::Saturated),
            (status.is_starting(), Flag::WindowNotFull),
        ]
        .into_iter()
        .filter_map(|(is_set, flag)| is_set.then_some(flag))
        .fold(Flags::NONE, Flags::with),
    };
    flags_of_contact(flags, status.is_valid())
}
