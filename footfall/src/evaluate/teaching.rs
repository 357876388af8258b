//! Which recordings a method may learn from before it is scored on one.
//!
//! Labels never come from the recording that is scored. A place is an index into the recordings, in
//! the order of their sets.

use serde::Serialize;

use super::labelled::Labelled;
use super::sets::Family;

/// Whose labels a method has learnt from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Teachers {
    /// Those of all other families: nothing is known of this robot, sensor or kind of label.
    OtherFamilies,
    /// Those of another recording of the same family.
    SameFamily,
}

impl Teachers {
    /// The places of the recordings whose labels may be used for the one at `place`.
    #[must_use]
    pub fn places(self, recordings: &[Labelled], place: usize) -> Vec<usize> {
        match self {
            Self::OtherFamilies => {
                let family = |place: usize| recordings[place].set.family();
                let all = 0..recordings.len();
                all.filter(|other| family(*other) != family(place))
                    .collect()
            }
            Self::SameFamily => first_relative(recordings, place).into_iter().collect(),
        }
    }
}

/// The place of the recording that is looked at without its labels for the one at `place`: another
/// one of the same robot, or itself where the robot has no other.
#[must_use]
pub fn unlabelled(recordings: &[Labelled], place: usize) -> usize {
    match recordings[place].set.family() {
        // Its two recordings are of two robots.
        Family::Lcd => place,
        Family::Atlas | Family::Shoe | Family::Simulated => {
            first_relative(recordings, place).unwrap_or(place)
        }
    }
}

/// The first other recording of the same family.
fn first_relative(recordings: &[Labelled], place: usize) -> Option<usize> {
    let family = |place: usize| recordings[place].set.family();
    (0..recordings.len()).find(|other| *other != place && family(*other) == family(place))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::sets::Set;
    use crate::evaluate::testing::labelled;

    fn recordings(sets: &[Set]) -> Vec<Labelled> {
        let empty = |set: &Set| labelled(*set, std::iter::empty());
        sets.iter().map(empty).collect()
    }

    #[test]
    fn no_threshold_comes_from_the_recording_that_is_scored() {
        use Set::{Atlas7k, Demo, Ground, Nao, Shoe, Slip, ThreeSteps, Walk};
        let recordings = recordings(&[
            Ground, ThreeSteps, Slip, Atlas7k, Nao, Shoe, Shoe, Demo, Walk,
        ]);
        for place in 0..recordings.len() {
            for teachers in [Teachers::OtherFamilies, Teachers::SameFamily] {
                let places = teachers.places(&recordings, place);
                assert!(!places.is_empty() && !places.contains(&place), "{place}");
            }
        }
        let same = |place| Teachers::SameFamily.places(&recordings, place);
        assert_eq!([same(0), same(1), same(2)], [[1], [0], [0]]);
        assert_eq!([same(3), same(4)], [[4], [3]]);
        let others = Teachers::OtherFamilies.places(&recordings, 3);
        assert_eq!(others, [0, 1, 2, 5, 6, 7, 8]);
    }

    #[test]
    fn a_recording_without_relatives_has_no_teacher_of_its_family() {
        let recordings = recordings(&[Set::Ground, Set::Demo]);
        assert!(Teachers::SameFamily.places(&recordings, 0).is_empty());
        assert_eq!(unlabelled(&recordings, 0), 0);
    }

    #[test]
    fn what_needs_no_labels_is_learnt_on_the_same_robot() {
        let recordings = recordings(&[Set::Ground, Set::Slip, Set::Atlas7k, Set::Nao]);
        let learnt_on: Vec<_> = (0..4).map(|place| unlabelled(&recordings, place)).collect();
        assert_eq!(learnt_on, [1, 0, 2, 3]);
    }
}
