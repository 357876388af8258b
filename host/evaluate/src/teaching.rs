//! Recordings that a method may learn from before it is scored on one.
//!
//! Labels never come from the scored recording. Indices refer to the recordings in the order of their sets.

use serde::Serialize;

use crate::labelled::Labelled;
use crate::sets::Family;

samples::named! {
    /// Whose labels a method has learnt from.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Teachers {
        /// Those of all other families ([`teaches_other_families`](crate::sets::Set::teaches_other_families)): nothing is known of this robot,
        /// sensor or kind of label.
        OtherFamilies = "on other families",
        /// Those of another recording of the same family.
        SameFamily = "on its family",
    }
}

impl Teachers {
    /// Indices of the recordings whose labels may be used for the one at `index`.
    #[must_use]
    pub fn indices(self, recordings: &[Labelled], index: usize) -> Vec<usize> {
        match self {
            Self::OtherFamilies => {
                let family = |index: usize| recordings[index].set.family();
                let all = 0..recordings.len();
                all.filter(|other| family(*other) != family(index))
                    .filter(|other| recordings[*other].set.teaches_other_families())
                    .collect()
            }
            Self::SameFamily => first_relative(recordings, index).into_iter().collect(),
        }
    }
}

/// Index of the recording used without its labels for the one at `index`: another one of the same robot, or
/// itself if the robot has no other.
#[must_use]
pub fn unlabelled(recordings: &[Labelled], index: usize) -> usize {
    match recordings[index].set.family() {
        // The two recordings are from two robots.
        Family::Lcd => index,
        Family::Atlas | Family::Shoe | Family::Simulated => {
            first_relative(recordings, index).unwrap_or(index)
        }
        // Each of the sets is from another robot.
        Family::Robots => {
            let set = |index: usize| recordings[index].set;
            let other =
                (0..recordings.len()).find(|other| *other != index && set(*other) == set(index));
            other.unwrap_or(index)
        }
    }
}

/// The first other recording of the same family.
fn first_relative(recordings: &[Labelled], index: usize) -> Option<usize> {
    let family = |index: usize| recordings[index].set.family();
    (0..recordings.len()).find(|other| *other != index && family(*other) == family(index))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sets::Set;
    use crate::testing::labelled;

    fn recordings(sets: &[Set]) -> Vec<Labelled> {
        let empty = |set: &Set| labelled(*set, std::iter::empty());
        sets.iter().map(empty).collect()
    }

    #[test]
    fn threshold_never_comes_from_the_scored_recording() {
        use Set::{Atlas7k, Demo, Ground, Nao, Shoe, Slip, ThreeSteps, Walk};
        let recordings = recordings(&[
            Ground, ThreeSteps, Slip, Atlas7k, Nao, Shoe, Shoe, Demo, Walk,
        ]);
        for index in 0..recordings.len() {
            for teachers in [Teachers::OtherFamilies, Teachers::SameFamily] {
                let indices = teachers.indices(&recordings, index);
                assert!(!indices.is_empty() && !indices.contains(&index), "{index}");
            }
        }
        let same = |index| Teachers::SameFamily.indices(&recordings, index);
        assert_eq!([same(0), same(1), same(2)], [[1], [0], [0]]);
        assert_eq!([same(3), same(4)], [[4], [3]]);
        let others = Teachers::OtherFamilies.indices(&recordings, 3);
        assert_eq!(others, [0, 1, 2, 5, 6, 7, 8]);
    }

    #[test]
    fn real_robots_do_not_teach_other_families() {
        use Set::{Atlas500, Demo, Go1, Ground, Talos};
        let recordings = recordings(&[Ground, Demo, Atlas500, Talos, Go1, Go1]);
        let others = |index| Teachers::OtherFamilies.indices(&recordings, index);
        assert_eq!([others(0), others(3)], [vec![1], vec![0, 1]]);
        assert_eq!(
            [3, 4, 5].map(|index| unlabelled(&recordings, index)),
            [3, 5, 4]
        );
    }

    #[test]
    fn single_recording_of_a_family_has_no_teacher_in_it() {
        let recordings = recordings(&[Set::Ground, Set::Demo]);
        assert!(Teachers::SameFamily.indices(&recordings, 0).is_empty());
        assert_eq!(unlabelled(&recordings, 0), 0);
    }

    #[test]
    fn unlabelled_learning_uses_the_same_robot() {
        let recordings = recordings(&[Set::Ground, Set::Slip, Set::Atlas7k, Set::Nao]);
        let learnt_on: Vec<_> = (0..4).map(|index| unlabelled(&recordings, index)).collect();
        assert_eq!(learnt_on, [1, 0, 2, 3]);
    }
}
