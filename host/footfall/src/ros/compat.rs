//! Contacts of all feet of a robot, in the messages of programs that do not accept footfall's messages.
//!
//! | name | program | topic | message | content |
//! |---|---|---|---|---|
//! | `champ` | [champ](https://github.com/chvmp/champ) | `/foot_contacts`, read by its state estimation | `champ_msgs/msg/ContactsStamped` | the decisions |
//! | `pronto` | [pronto](https://github.com/ori-drs/pronto) | `/footfall/stance` | `pronto_msgs/msg/QuadrupedStance` | the decisions, as 0 or 1: it treats any number above 0.01 as stance |
//! | `drift` | [DRIFT](https://github.com/UMich-CURLY/drift) | `/footfall/drift/contacts` | `custom_sensor_msgs/msg/ContactArray` | the decisions in the order of its `enum Leg`: right front, left front, right hind, left hind |
//! | `muse` | [MUSE](https://github.com/iit-DLSLab/muse) | `/footfall/contact_detection` | `state_estimator_msgs/msg/ContactDetection` | the decisions |
//! | `bool` | any, such as one that sets the contact flags of [legged_control](https://github.com/qiayuanl/legged_control) | `/footfall/FL/contact/decision` of each foot | `std_msgs/msg/Bool` | the decision |
//! | `unitree` | any that compares the forces of a GO1 or Go2 with a threshold | `/footfall/lowstate` | `unitree_go/msg/LowState` | `foot_force` and `foot_force_est`: [`STANDS`] of a foot that stands, 0 of others, in Unitree's order, right front, left front, right hind, left hind; all else is 0 |
//! | `wrench` | any that takes the force on a foot, such as the node of [SERoW](https://github.com/mrsp/serow) | `/footfall/FL/wrench` of each foot | `geometry_msgs/msg/WrenchStamped` | a force along z of the foot's frame: [`WRENCH_FORCE`], or the one given, of a foot that stands, 0 of others |
//! | `biped` | any that reads `biped_interfaces`, such as the odometry of [bit-bots](https://github.com/bit-bots/bitbots_main) | `/footfall/phase` | `biped_interfaces/msg/Phase` | which of both feet stand; no message while none does |
//!
//! `docs/guide/state-estimators.md` lists the lines of these programs that were read, each with its commit.
//!
//! A robot has four feet, or with `biped` two: see [`Body`]. Unless stated otherwise, the order is left front, right front,
//! left hind, right hind. A message is created as soon as each foot has a new contact. After 20 ms it is created without
//! the silent feet, even if all are silent. Feet that are invalid or have fallen silent are reported as not standing:
//! false, 0. No message can express "unknown", so the first message is created once each foot has sent a contact. `bool`
//! and `wrench` are created only for feet that have sent one.

use std::array;
use std::collections::BTreeSet;

use estimator_core::Timestamp;

use crate::ros::message::{
    Header, LowState, RosContact, RosMessage, Stances, SupportPhase, Time, WrenchStamped,
};
use crate::ros::topics::Published;

/// Names of four feet, in the order of the messages. The first name of each is this program's. Spot and the MIT
/// Cheetah have `HL`, `ANYmal` has `LH`.
pub const FEET: [&[&str]; 4] =
    [&["FL", "LF"], &["FR", "RF"], &["RL", "LH", "HL", "BL"], &["RR", "RH", "HR", "BR"]];

/// The feet in the order right front, left front, right hind, left hind, by their places in [`FEET`].
pub const RIGHT_FIRST: [usize; 4] = [1, 0, 3, 2];

/// Names of two feet.
const BIPED_FEET: [&[&str]; 2] = [&["L", "left"], &["R", "right"]];

/// Longest wait of a message of all feet for the contacts that it lacks, µs.
const COMPLETION_WAIT_US: u64 = 20_000;

/// Topic of the states of a Unitree robot.
pub const LOW_STATE_TOPIC: &str = "/footfall/lowstate";

/// Words for the front and the rear of a robot.
const FRONT: [&str; 2] = ["front", "fore"];
const REAR: [&str; 3] = ["rear", "hind", "back"];

/// The feet that a robot has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Body {
    /// Four feet: [`FEET`].
    #[default]
    FourLegged,
    /// A left and a right foot.
    Biped,
}

/// A form of messages has other feet than the other forms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("--compat biped is of two feet, and {0} of four: give one of them")]
pub struct MixedBodies(pub &'static str);

impl Body {
    /// Returns the body that these forms describe.
    ///
    /// # Errors
    /// One form describes two feet, and another describes four.
    pub fn of(compats: &[Compat]) -> Result<Self, MixedBodies> {
        if !compats.contains(&Compat::Biped) {
            return Ok(Self::FourLegged);
        }
        match compats.iter().find(|compat| compat.is_of_four()) {
            Some(compat) => Err(MixedBodies(compat.name())),
            None => Ok(Self::Biped),
        }
    }

    /// Names of its feet, in the order of the messages; the first name of each is this program's.
    #[must_use]
    pub const fn feet(self) -> &'static [&'static [&'static str]] {
        match self {
            Self::FourLegged => &FEET,
            Self::Biped => &BIPED_FEET,
        }
    }

    /// First names of its feet, separated by commas.
    #[must_use]
    pub fn names(self) -> String {
        let names: Vec<&str> = self.feet().iter().map(|names| names[0]).collect();
        names.join(", ")
    }

    /// Place of a foot in [`feet`](Self::feet), found in its name, topic or frame. One word of the text must be the name of a
    /// foot, such as `FL` in `go1/FL_foot_imu`. For four feet, two words may name the sides, as in `front_left`. Case does not
    /// matter. `None` if there is no such word, or if the words name several feet.
    #[must_use]
    pub fn place(self, name: &str) -> Option<usize> {
        let words: Vec<String> = name
            .split(|letter: char| !letter.is_ascii_alphanumeric())
            .map(str::to_ascii_lowercase)
            .collect();
        let is = |names: &[&str]| {
            let mut own = names.iter();
            own.any(|own| words.iter().any(|word| own.eq_ignore_ascii_case(word)))
        };
        let feet = self.feet();
        let mut named = (0..feet.len()).filter(|at| is(feet[*at]));
        match (named.next(), named.next()) {
            (Some(at), None) => return Some(at),
            (Some(_), Some(_)) => return None,
            (None, _) if self == Self::Biped => return None,
            (None, _) => {}
        }
        let has = |all: &[&str]| all.iter().any(|one| words.iter().any(|word| word == one));
        let one_of = |first: bool, second: bool| (first != second).then_some(usize::from(second));
        let row = one_of(has(&FRONT), has(&REAR))?;
        let side = one_of(has(&["left"]), has(&["right"]))?;
        Some(2 * row + side)
    }
}

/// `foot_force` of a standing foot: above the thresholds of programs that read it, most of which are 20 to 60.
pub const STANDS: i16 = 100;

/// Force of a foot that stands, N, unless another is given.
pub const WRENCH_FORCE: f64 = 100.0;

/// Listening time after the first contact after which feet without one are named as absent, µs.
const ABSENT_US: u64 = 1_000_000;

samples::named! {
    /// Program whose messages are created.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub enum Compat {
        /// Decisions as 0 or 1, for pronto.
        Pronto = "pronto",
        /// Decisions, for champ.
        Champ = "champ",
        /// Numbered decisions, right feet first, for DRIFT.
        Drift = "drift",
        /// Decisions, for MUSE.
        Muse = "muse",
        /// A decision on a topic of each foot.
        Bool = "bool",
        /// Decisions as the forces of Unitree's state.
        Unitree = "unitree",
        /// A decision as the force on each foot.
        Wrench = "wrench",
        /// Which of two feet stand.
        Biped = "biped",
    }
}

impl Compat {
    /// Type and topic of its messages, for the help.
    #[must_use]
    pub const fn about(self) -> &'static str {
        match self {
            Self::Pronto => "`pronto_msgs/msg/QuadrupedStance` on /footfall/stance",
            Self::Champ => "`champ_msgs/msg/ContactsStamped` on `/foot_contacts`",
            Self::Drift => "`custom_sensor_msgs/msg/ContactArray` on /footfall/drift/contacts",
            Self::Muse => {
                "`state_estimator_msgs/msg/ContactDetection` on `/footfall/contact_detection`"
            }
            Self::Bool => {
                "`std_msgs/msg/Bool` on /footfall/FL/contact/decision and those of the other feet"
            }
            Self::Unitree => {
                "`unitree_go/msg/LowState` on /footfall/lowstate, whose forces are 100 or 0"
            }
            Self::Wrench => {
                "`geometry_msgs/msg/WrenchStamped` on /footfall/FL/wrench and those of the other feet, whose force is --wrench-force or 0"
            }
            Self::Biped => {
                "`biped_interfaces/msg/Phase` on /footfall/phase, of the feet L and R; those of the other forms are then L and R, too"
            }
        }
    }

    /// Returns whether each of its messages describes exactly four feet.
    const fn is_of_four(self) -> bool {
        match self {
            Self::Bool | Self::Wrench | Self::Biped => false,
            Self::Pronto | Self::Champ | Self::Drift | Self::Muse | Self::Unitree => true,
        }
    }

    /// Returns whether each of its messages is of one foot.
    #[must_use]
    pub const fn is_of_one(self) -> bool {
        matches!(self, Self::Bool | Self::Wrench)
    }

    /// Topics of its messages about a robot.
    #[must_use]
    pub fn topics(self, body: Body) -> Vec<String> {
        let of_foot = |topic: &str| {
            let names = body.feet().iter().map(|names| names[0]);
            names.map(|name| format!("/footfall/{name}/{topic}")).collect()
        };
        let topic = match self {
            Self::Champ => "/foot_contacts",
            Self::Pronto => "/footfall/stance",
            Self::Drift => "/footfall/drift/contacts",
            Self::Muse => "/footfall/contact_detection",
            Self::Unitree => LOW_STATE_TOPIC,
            Self::Biped => "/footfall/phase",
            Self::Bool => return of_foot("contact/decision"),
            Self::Wrench => return of_foot("wrench"),
        };
        vec![topic.to_owned()]
    }

    /// Messages of these stances, in the order of [`topics`](Self::topics); empty if the form has no message for them.
    fn messages(self, robot: &RobotStances) -> Vec<RosMessage> {
        let header = robot.header.clone();
        let stands = |foot: usize| robot.stands.get(foot).copied().unwrap_or_default();
        let four: [bool; FEET.len()] = array::from_fn(stands);
        let message = match self {
            Self::Champ => RosMessage::Champ(Stances { header, stances: four.to_vec() }),
            Self::Pronto => {
                let stances = four.map(|stands| f32::from(u8::from(stands)));
                RosMessage::Pronto(Stances { header, stances })
            }
            Self::Drift => {
                let numbered = (0..).zip(RIGHT_FIRST.map(stands)).collect();
                RosMessage::Drift(Stances { header, stances: numbered })
            }
            Self::Muse => RosMessage::Muse(Stances { header, stances: four }),
            Self::Unitree => {
                let forces = RIGHT_FIRST.map(|foot| if stands(foot) { STANDS } else { 0 });
                RosMessage::Unitree(Box::new(LowState::with_forces(forces)))
            }
            Self::Biped => match SupportPhase::of(stands(0), stands(1)) {
                Some(phase) => RosMessage::Phase(Stances { header, stances: phase }),
                None => return Vec::new(),
            },
            Self::Bool => return robot.stands.iter().copied().map(RosMessage::Bool).collect(),
            Self::Wrench => {
                let feet = robot.stands.iter().zip(robot.frames);
                let of_foot = feet.map(|(stands, frame)| {
                    let header = Header { frame_id: frame.clone(), ..header.clone() };
                    let force = if *stands { robot.wrench_force } else { 0.0 };
                    RosMessage::Wrench(Box::new(WrenchStamped::along_z(header, force)))
                });
                return of_foot.collect();
            }
        };
        vec![message]
    }
}

/// Stances of all feet of a robot, in the order of its [`Body`].
struct RobotStances<'a> {
    /// Header with the time of the newest sample. It has no frame, because the feet have none in common.
    header: Header,
    stands: &'a [bool],
    /// Frames of the feet.
    frames: &'a [String],
    /// Force of a foot that stands, N.
    wrench_force: f64,
}

/// Newest contacts of all feet of a robot.
#[derive(Debug)]
pub struct AllFeet {
    body: Body,
    compats: Vec<Compat>,
    wrench_force: f64,
    feet: Vec<Option<Stance>>,
    /// Frames of the feet.
    frames: Vec<String>,
    /// Listening time of the newest message, or of the first contact, µs.
    made_us: Option<u64>,
    /// Listening time of the first contact, µs.
    first_us: Option<u64>,
    /// Whether each foot has sent a contact.
    has_contact: Vec<bool>,
    /// Names of feet that the robot does not have, whose contacts are in no message.
    pub(crate) others: BTreeSet<String>,
}

/// Decision of a foot since the newest message.
#[derive(Clone, Copy, Debug)]
struct Stance {
    stands: bool,
    stamp: Time,
}

impl AllFeet {
    /// Creates an empty state. `wrench_force` is the force of a foot that stands, N, in messages of [`Compat::Wrench`].
    ///
    /// # Errors
    /// One of the forms is for a robot with two feet, and another for a robot with four.
    pub fn new(compats: &[Compat], wrench_force: f64) -> Result<Self, MixedBodies> {
        let mut compats = compats.to_vec();
        compats.sort_unstable();
        compats.dedup();
        let body = Body::of(&compats)?;
        let count = body.feet().len();
        Ok(Self {
            body,
            compats,
            wrench_force,
            feet: vec![None; count],
            frames: vec![String::new(); count],
            made_us: None,
            first_us: None,
            has_contact: vec![false; count],
            others: BTreeSet::new(),
        })
    }

    /// Creates an empty state as [`Self::new`]; `None` without a form.
    ///
    /// # Errors
    /// The error of [`Self::new`].
    pub fn unless_empty(
        compats: &[Compat],
        wrench_force: f64,
    ) -> Result<Option<Self>, MixedBodies> {
        (!compats.is_empty()).then(|| Self::new(compats, wrench_force)).transpose()
    }

    /// The feet that the robot has.
    #[must_use]
    pub const fn body(&self) -> Body {
        self.body
    }

    /// Names of the feet without a contact in the second after the first contact of any foot; none before.
    #[must_use]
    pub fn absent(&self, listened_us: u64) -> Vec<&'static str> {
        let feet = self.body.feet().iter().zip(&self.has_contact);
        let absent = feet.filter(|(_, heard)| self.is_late(listened_us) && !**heard);
        absent.map(|(names, _)| names[0]).collect()
    }

    /// Returns whether feet without a contact are no longer waited for.
    fn is_late(&self, listened_us: u64) -> bool {
        let since_us = self.first_us.map(|first_us| listened_us.saturating_sub(first_us));
        since_us >= Some(ABSENT_US)
    }

    /// Processes a contact received at `at` and `listened_us` of the listening time; returns the messages that it completes.
    pub fn take(
        &mut self,
        contact: &RosContact,
        at: Timestamp,
        listened_us: u64,
    ) -> Vec<Published> {
        let name = contact.foot.as_str();
        match self.body.place(name) {
            Some(place) => self.take_at(place, contact, at, listened_us),
            None => {
                self.others.insert(name.to_owned());
                Vec::new()
            }
        }
    }

    /// Processes a contact as [`take`](Self::take) does, for the foot at a place of the [`Body`], whatever its name.
    pub fn take_at(
        &mut self,
        place: usize,
        contact: &RosContact,
        at: Timestamp,
        listened_us: u64,
    ) -> Vec<Published> {
        self.feet[place] =
            Some(Stance { stands: contact.valid && contact.decision, stamp: contact.header.stamp });
        self.has_contact[place] = true;
        self.frames[place].clone_from(&contact.header.frame_id);
        self.first_us.get_or_insert(listened_us);
        self.made_us.get_or_insert(listened_us);
        let is_late = self.is_late(listened_us);
        let mut feet = self.feet.iter().zip(&self.has_contact);
        if feet.all(|(foot, heard)| foot.is_some() || is_late && !heard) {
            return self.make(at, listened_us);
        }
        self.advance(at, listened_us)
    }

    /// Advances the time to `at`; returns the messages due, if there were contacts before.
    pub fn advance(&mut self, at: Timestamp, listened_us: u64) -> Vec<Published> {
        match self.made_us {
            Some(made) if listened_us - made >= COMPLETION_WAIT_US => self.make(at, listened_us),
            _ => Vec::new(),
        }
    }

    /// Ends reception; returns messages in which no foot stands, if there were contacts before.
    pub fn end(&mut self, now: Timestamp) -> Vec<Published> {
        self.feet.fill(None);
        let made = self.made_us.map(|made_us| self.make(now, made_us));
        made.unwrap_or_default()
    }

    /// Creates messages of the known contacts at `at`.
    fn make(&mut self, at: Timestamp, listened_us: u64) -> Vec<Published> {
        self.made_us = Some(listened_us);
        let newest = self.feet.iter().flatten().map(|foot| foot.stamp).max();
        let stands = self.feet.iter().map(|foot| foot.is_some_and(|foot| foot.stands));
        let stands: Vec<bool> = stands.collect();
        self.feet.fill(None);
        let robot = RobotStances {
            header: Header {
                // If all feet are silent, the state applies now.
                stamp: newest.unwrap_or_else(|| at.into()),
                frame_id: String::new(),
            },
            stands: &stands,
            frames: &self.frames,
            wrench_force: self.wrench_force,
        };
        let mut published = Vec::new();
        for compat in &self.compats {
            let messages = compat.topics(self.body).into_iter().zip(compat.messages(&robot));
            // A foot that has never sent a contact may be standing, so no message includes it.
            let is_known: &[bool] = if compat.is_of_one() {
                &self.has_contact
            } else {
                &[self.has_contact.iter().all(|has_contact| *has_contact)]
            };
            let known = messages.zip(is_known).filter(|(_, is_known)| **is_known);
            published.extend(
                known.map(|((topic, message), _)| Published::new(&topic.into(), at, message)),
            );
        }
        published
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use feet::session::Listening;

    fn all_feet(compats: &[Compat]) -> AllFeet {
        AllFeet::new(compats, 70.0).expect("one body")
    }

    fn contact(foot: &str, p_stable: f32, us: u64) -> (RosContact, Timestamp) {
        let at = Timestamp::from_micros(us);
        let header = Header { stamp: at.into(), frame_id: format!("frame_{foot}") };
        let contact = RosContact {
            header,
            foot: foot.to_owned(),
            p_stable,
            decision: p_stable > 0.5,
            valid: p_stable < 0.95,
            ..RosContact::default()
        };
        (contact, at)
    }

    #[test]
    fn place_is_found_in_names_topics_and_frames() {
        for (name, expected) in [
            ("FL", Some(0)),
            ("rh", Some(3)),
            ("hl", Some(2)),
            ("/BR/imu", Some(3)),
            ("FL_foot", Some(0)),
            ("/imu/FR_foot", Some(1)),
            ("go1/RL_foot_imu", Some(2)),
            ("hind_right", Some(3)),
            ("left/front_leg", Some(0)),
            ("leg_1", None),
            ("flat", None),
            ("FL_FR", None),
            ("front_rear_left", None),
            ("", None),
        ] {
            assert_eq!(Body::FourLegged.place(name), expected, "{name}");
        }
    }

    fn one(mut published: Vec<Published>) -> Option<Published> {
        assert!(published.len() < 2);
        published.pop()
    }

    /// All feet with the listening time that a session keeps.
    struct Listened {
        all: AllFeet,
        listening: Listening,
    }

    impl Listened {
        fn new(compat: Compat) -> Self {
            let (all, listening) = (all_feet(&[compat]), Listening::default());
            Self { all, listening }
        }

        fn take(&mut self, contact: &RosContact, at: Timestamp) -> Option<Published> {
            self.listening.arrive(at);
            one(self.all.take(contact, at, self.listening.us()))
        }

        fn hear(&mut self, at: Timestamp) -> Option<Published> {
            self.listening.arrive(at);
            one(self.all.advance(at, self.listening.us()))
        }

        fn idle(&mut self, now: Timestamp) -> Option<Published> {
            self.listening.idle(now);
            one(self.all.advance(now, self.listening.us()))
        }

        fn end(&mut self) -> Option<Published> {
            one(self.all.end(self.listening.now()))
        }
    }

    /// Messages created from `contacts`: times in µs and the four numbers.
    fn made(compat: Compat, contacts: &[(&str, f32, u64)]) -> Vec<(u32, [f32; 4])> {
        let mut all = Listened::new(compat);
        let contacts = contacts.iter();
        let messages = contacts.filter_map(|(foot, p, us)| {
            let (contact, at) = contact(foot, *p, *us);
            all.take(&contact, at)
        });
        let micros = |header: Header| header.stamp.nanosec / 1000;
        messages
            .map(|published| match published.message {
                RosMessage::Pronto(m) => (micros(m.header), m.stances),
                RosMessage::Champ(m) => {
                    let numbers = m.stances.iter().map(|stands| f32::from(u8::from(*stands)));
                    let numbers: Vec<_> = numbers.collect();
                    (micros(m.header), numbers.try_into().expect("four feet"))
                }
                other => panic!("{other:?}"),
            })
            .collect()
    }

    #[test]
    fn newest_contact_of_each_foot_is_used_in_its_place() {
        let contacts = [
            ("RR", 0.1, 400),
            ("FL", 0.9, 100),
            ("FL", 0.6, 1100),
            ("tail", 0.8, 1200),
            ("RF", 0.2, 200),
            ("LH", 0.99, 300),
            ("FL", 0.7, 2100),
        ];
        // Pronto would treat a probability of 0.2 as stance.
        let pronto = [(1100, [1.0, 0.0, 0.0, 0.0])];
        assert_eq!(made(Compat::Pronto, &contacts), pronto);
        let champ = [(1100, [1.0, 0.0, 0.0, 0.0])];
        assert_eq!(made(Compat::Champ, &contacts), champ);
    }

    #[test]
    fn silent_foot_does_not_stand_in_messages_of_the_others() {
        let all = ["FL", "FR", "RL", "RR"].map(|foot| (foot, 0.9, 0));
        let three = (1..60).flat_map(|ms| ["FL", "FR", "RL"].map(|foot| (foot, 0.9, ms * 1000)));
        let contacts: Vec<_> = all.into_iter().chain(three).collect();
        let times = [20_000, 40_000].map(|us| (us, [1.0, 1.0, 1.0, 0.0]));
        assert_eq!(made(Compat::Pronto, &contacts), [vec![(0, [1.0; 4])], times.to_vec()].concat());
    }

    #[test]
    fn foot_that_was_never_heard_is_in_no_message() {
        let contacts: Vec<_> = (0..2000)
            .flat_map(|ms| ["FL", "FR", "RL"].map(|foot| (foot, 0.9, ms * 1000)))
            .collect();
        let of_all = Compat::ALL.into_iter().filter(|compat| !compat.is_of_one());
        for compat in of_all {
            let mut all = Listened::new(compat);
            for (foot, p, us) in &contacts {
                let (contact, at) = contact(foot, *p, *us);
                assert!(all.take(&contact, at).is_none(), "{}", compat.name());
            }
            assert!(all.end().is_none(), "{}", compat.name());
        }
        let (mut all, mut listening) = (all_feet(&[Compat::Bool]), Listening::default());
        let mut topics = BTreeSet::new();
        let mut messages = 0;
        for (foot, p, us) in &contacts {
            let (contact, at) = contact(foot, *p, *us);
            listening.arrive(at);
            let published = all.take(&contact, at, listening.us());
            messages += published.len();
            topics.extend(published.into_iter().map(|published| published.topic.to_string()));
        }
        let expected = ["FL", "FR", "RL"].map(|foot| format!("/footfall/{foot}/contact/decision"));
        assert!(topics.into_iter().eq(expected));
        // One for each contact, once the missing foot is not waited for any longer.
        assert!(messages > 3000, "{messages}");
    }

    #[test]
    fn silent_feet_are_reported_in_swing() {
        let mut all = Listened::new(Compat::Champ);
        let micros = Timestamp::from_micros;
        assert_eq!((all.idle(micros(5)), all.end()), (None, None));
        let of = |published: Option<Published>| match published?.message {
            RosMessage::Champ(message) => Some((message.header.stamp, message.stances)),
            other => panic!("{other:?}"),
        };
        for foot in ["FL", "FR", "RL", "RR"] {
            let (contact, at) = contact(foot, 0.9, 10_000);
            let stands = of(all.take(&contact, at)).map(|(_, contacts)| contacts);
            assert_eq!(stands, (foot == "RR").then(|| vec![true; 4]));
        }
        assert_eq!(all.idle(micros(29_000)), None);
        let none = |us| Some((micros(us).into(), vec![false; 4]));
        assert_eq!(of(all.idle(micros(30_000))), none(30_000));
        assert_eq!(all.idle(micros(49_000)), None);
        assert_eq!(of(all.idle(micros(51_000))), none(51_000));
        all.take(&contact("FL", 0.9, 60_000).0, micros(60_000));
        // Loads and heartbeats continue.
        let mut others = (0..20).filter_map(|ms| of(all.hear(micros(61_000 + 1000 * ms))));
        let (_, contacts) = others.next().expect("one is due");
        assert_eq!((contacts, others.next()), (vec![true, false, false, false], None));
        assert_eq!(of(all.end()), none(80_000));
    }

    #[test]
    fn host_stall_does_not_make_feet_silent() {
        let contacts: Vec<_> = [0, 1000, 901_000, 902_000]
            .into_iter()
            .flat_map(|us| ["FL", "FR", "RL", "RR"].map(|foot| (foot, 0.9, us)))
            .collect();
        let messages = made(Compat::Pronto, &contacts);
        assert_eq!(messages.len(), 4);
        assert!(messages.iter().all(|(_, stands)| *stands == [1.0; 4]));
    }

    #[test]
    fn feet_of_other_names_are_in_no_message() {
        let mut all = all_feet(&[Compat::Bool, Compat::Bool]);
        for (k, name) in ["L", "fl", "L", "node_33"].into_iter().enumerate() {
            let (contact, at) = contact(name, 0.9, 1000 * k as u64);
            assert!(all.take(&contact, at, 1000 * k as u64).is_empty());
        }
        assert!(all.others.iter().eq(["L", "node_33"]));
        let published = all.end(Timestamp::from_micros(5000));
        let topics: Vec<&str> = published.iter().map(|p| p.topic.as_ref()).collect();
        assert_eq!(topics, ["/footfall/FL/contact/decision"]);
    }
    /// Messages of one moment in which feet stand or not.
    fn messages(compat: Compat, feet: &[(&str, bool)]) -> Vec<Published> {
        let mut all = all_feet(&[compat]);
        let contacts = feet.iter().flat_map(|(foot, stands)| {
            let (contact, at) = contact(foot, if *stands { 0.9 } else { 0.1 }, 1000);
            all.take(&contact, at, 0)
        });
        contacts.collect()
    }

    #[test]
    fn wrench_has_the_set_force_in_the_frame_of_a_standing_foot() {
        let published =
            messages(Compat::Wrench, &[("FL", true), ("FR", false), ("RL", true), ("RR", false)]);
        let wrenches = published.iter().map(|published| match &published.message {
            RosMessage::Wrench(wrench) => {
                (published.topic.as_ref(), wrench.header.frame_id.as_str(), wrench.force)
            }
            other => panic!("{other:?}"),
        });
        let expected = [
            ("/footfall/FL/wrench", "frame_FL", [0.0, 0.0, 70.0]),
            ("/footfall/FR/wrench", "frame_FR", [0.0; 3]),
            ("/footfall/RL/wrench", "frame_RL", [0.0, 0.0, 70.0]),
            ("/footfall/RR/wrench", "frame_RR", [0.0; 3]),
        ];
        assert!(wrenches.eq(expected));
    }

    #[test]
    #[cfg(feature = "cdr")]
    fn flight_is_a_message_of_champ_with_four_lifted_feet() {
        let feet = ["FL", "FR", "RL", "RR"];
        let published = messages(Compat::Champ, &feet.map(|foot| (foot, false)));
        let [Published { topic, message, .. }] = &published[..] else {
            panic!("{published:?}");
        };
        assert_eq!(topic.as_ref(), "/foot_contacts");
        // Plain CDR: 1 ms, no frame, and always four numbers, since champ reads the elements 0 to 3.
        let stamp = [[0; 4], 1_000_000_u32.to_le_bytes()].concat();
        let frame = [1, 0, 0, 0, 0, 0, 0, 0];
        let contacts = [4, 0, 0, 0, 0, 0, 0, 0];
        let expected = [&[0, 1, 0, 0][..], &stamp, &frame, &contacts].concat();
        assert_eq!(message.cdr(), expected);
        // On the ground again, the same feet stand in the next message.
        let published = messages(Compat::Champ, &feet.map(|foot| (foot, true)));
        assert!(matches!(&published[..], [Published { message: RosMessage::Champ(message), .. }]
            if message.stances == [true; 4]));
    }

    #[test]
    fn phase_of_a_biped_has_no_value_in_flight() {
        let phase = |left: bool, right: bool| {
            let published = one(messages(Compat::Biped, &[("L", left), ("right_sole", right)]))?;
            assert_eq!(published.topic.as_ref(), "/footfall/phase");
            match published.message {
                RosMessage::Phase(phase) => Some(phase.stances as i32),
                other => panic!("{other:?}"),
            }
        };
        assert_eq!(phase(true, false), Some(0));
        assert_eq!(phase(false, true), Some(1));
        assert_eq!(phase(true, true), Some(2));
        assert_eq!(phase(false, false), None);
    }

    #[test]
    fn biped_has_two_feet_in_all_forms() {
        assert_eq!(Body::of(&[Compat::Biped, Compat::Wrench, Compat::Bool]), Ok(Body::Biped));
        assert_eq!(
            Compat::Wrench.topics(Body::Biped),
            ["/footfall/L/wrench", "/footfall/R/wrench"]
        );
        let mixed = AllFeet::new(&[Compat::Biped, Compat::Champ], 1.0).expect_err("four and two");
        assert_eq!(
            mixed.to_string(),
            "--compat biped is of two feet, and champ of four: give one of them"
        );
        for (name, expected) in
            [("left_foot", Some(0)), ("r_sole", Some(1)), ("sole", None), ("L_R", None)]
        {
            assert_eq!(Body::Biped.place(name), expected, "{name}");
        }
    }
}
