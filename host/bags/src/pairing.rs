//! Pairs loads with feet by their names: `/imu/lf` with `/force/lf`, `/front_left/imu` with `/ft/FL`.

/// Place of a leg on a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Leg {
    is_left: bool,
    /// `None` of a robot with two legs.
    is_front: Option<bool>,
}

/// Short names of legs: `fl` is front left, `lh` left hind, `rr` rear right.
const SHORT: [(&str, bool, bool); 14] = [
    ("fl", true, true),
    ("lf", true, true),
    ("fr", false, true),
    ("rf", false, true),
    ("hl", true, false),
    ("lh", true, false),
    ("bl", true, false),
    ("lb", true, false),
    ("rl", true, false),
    ("hr", false, false),
    ("rh", false, false),
    ("br", false, false),
    ("rb", false, false),
    ("rr", false, false),
];

/// Words for front and rear.
const FRONT: [&str; 3] = ["front", "fore", "forward"];
const REAR: [&str; 4] = ["rear", "hind", "back", "aft"];

/// Words of a name, in lower case.
fn words(name: &str) -> Vec<String> {
    let words = name.split(|letter: char| !letter.is_alphanumeric());
    words.filter(|word| !word.is_empty()).map(str::to_lowercase).collect()
}

/// Numbers of a Unitree's foot forces by leg. The places are front right, front left, rear right, rear left.
const UNITREE: ([&str; 2], [&str; 4]) = (["foot_force", "footforce"], ["fr", "fl", "rr", "rl"]);

/// Short name of the leg of a force in the state of a Unitree, such as `/lowstate:foot_force[1]`.
fn leg_of_unitree(name: &str) -> Option<&'static str> {
    let (fields, legs) = UNITREE;
    let lower = name.to_lowercase();
    let (before, place) = lower.strip_suffix(']')?.rsplit_once('[')?;
    let is_force = fields.iter().any(|field| {
        before.strip_suffix(field).is_some_and(|rest| rest.ends_with(['.', ':']) || rest.is_empty())
    });
    is_force.then(|| legs.get(place.parse::<usize>().ok()?).copied())?
}

/// Leg in a name.
fn leg(name: &str) -> Option<Leg> {
    let words = words(leg_of_unitree(name).unwrap_or(name));
    let short = SHORT.iter().find(|(short, ..)| words.iter().any(|word| word == short));
    if let Some((_, is_left, is_front)) = short {
        return Some(Leg { is_left: *is_left, is_front: Some(*is_front) });
    }
    let has = |all: &[&str]| words.iter().any(|word| all.iter().any(|other| word.contains(other)));
    let side =
        |long: &str, letter: &str| words.iter().any(|word| word.contains(long) || word == letter);
    let is_left = match (side("left", "l"), side("right", "r")) {
        (true, false) => true,
        (false, true) => false,
        _ => return None,
    };
    let is_front = match (has(&FRONT), has(&REAR)) {
        (true, false) => Some(true),
        (false, true) => Some(false),
        _ => None,
    };
    Some(Leg { is_left, is_front })
}

/// Returns whether a name names a part of a leg.
pub(super) fn names_a_foot(name: &str) -> bool {
    const PARTS: [&str; 9] =
        ["foot", "feet", "leg", "ankle", "sole", "toe", "shank", "shoe", "heel"];
    let words = words(name);
    leg(name).is_some() || words.iter().any(|word| PARTS.iter().any(|part| word.contains(part)))
}

/// Returns whether a load belongs to a foot by their names.
fn belongs(load: &str, foot: &str) -> bool {
    let (load_words, foot_words) = (words(load), words(foot));
    let is_within = !foot_words.is_empty()
        && load_words.windows(foot_words.len()).any(|within| within == foot_words);
    is_within || leg(load).is_some_and(|load| leg(foot) == Some(load))
}

/// Returns whether a load is named after another leg than the foot.
pub(super) fn names_another_leg(load: &str, foot: &str) -> bool {
    leg(load).zip(leg(foot)).is_some_and(|(load, foot)| {
        let ends = load.is_front.zip(foot.is_front);
        load.is_left != foot.is_left || ends.is_some_and(|(load, foot)| load != foot)
    })
}

/// Index of the load of each foot by their names; `None` unless each foot has exactly one and each load is taken.
pub(super) fn pairs(loads: &[String], feet: &[String]) -> Option<Vec<usize>> {
    let mut pairs = Vec::new();
    for foot in feet {
        let mut own = (0..loads.len()).filter(|load| belongs(&loads[*load], foot));
        let (Some(only), None) = (own.next(), own.next()) else {
            return None;
        };
        pairs.push(only);
    }
    let mut taken = pairs.clone();
    taken.sort_unstable();
    taken.dedup();
    (taken.len() == loads.len() && taken.len() == feet.len()).then_some(pairs)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paired(loads: &[&str], feet: &[&str]) -> Option<Vec<usize>> {
        let owned =
            |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        pairs(&owned(loads), &owned(feet))
    }

    #[test]
    fn loads_are_paired_by_name_in_any_order() {
        let feet = ["lf", "lh", "rf", "rh"];
        let typed = ["/force/lf", "/force/rf", "/force/lh", "/force/rh"];
        assert_eq!(paired(&typed, &feet), Some(vec![0, 2, 1, 3]));
        let other = ["/ft/FR_foot", "/ft/RL_foot", "/ft/FL_foot", "/ft/RR_foot"];
        assert_eq!(paired(&other, &feet), Some(vec![2, 1, 0, 3]));
        let long = ["/front_right/ft", "/hind_left/ft", "/front_left/ft", "/hind_right/ft"];
        assert_eq!(paired(&long, &feet), Some(vec![2, 1, 0, 3]));
        assert_eq!(
            paired(&["/right/ft", "/left/ft"], &["imu_left", "imu_right"]),
            Some(vec![1, 0])
        );
        assert_eq!(paired(&["/load/leg_2", "/load/leg_1"], &["leg_1", "leg_2"]), Some(vec![1, 0]));
    }

    #[test]
    fn load_of_another_leg_is_told_from_one_without_a_leg() {
        assert!(names_another_leg("/force/fr", "/imu/fl"));
        assert!(names_another_leg("/left_hind/ft", "/left_front/imu"));
        for load in ["/force/fl", "/ft/left", "/lowstate:foot_force[1]", "/front_left/wrench"] {
            assert!(!names_another_leg(load, "/imu/fl"), "{load}");
        }
    }

    #[test]
    fn names_that_do_not_pair_are_refused() {
        assert_eq!(paired(&["/lowstate:force[0]", "/lowstate:force[1]"], &["fl", "fr"]), None);
        // In the state of a Unitree, the place of a force names its leg.
        let forces = [0, 1, 2, 3].map(|place| format!("/lowstate:foot_force[{place}]"));
        let forces = forces.each_ref().map(String::as_str);
        assert_eq!(paired(&forces, &["fl", "fr", "rl", "rr"]), Some(vec![1, 0, 3, 2]));
        assert_eq!(paired(&forces, &["fr", "fl", "rr", "lr"]), None);
        assert!(names_another_leg("/low_state:footForce[0]", "/imu/fl"));
        assert_eq!(paired(&["/force/lf", "/force/lf2"], &["lf", "lh"]), None);
        assert_eq!(paired(&["/force/lf", "/force/rf"], &["lf", "lh"]), None);
    }
}
