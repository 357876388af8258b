//! Short names of feet, from the names of their topics.

use std::collections::BTreeSet;

/// Words in those parts of addresses that name a sensor and not a foot.
const SENSORS: [&str; 3] = ["imu", "data", "raw"];

/// Names of the selected IMUs as feet, by the addresses of all IMUs in the bag. An IMU that is selected alone has a name
/// where the bag has others, so that a foot has one name whichever others are read.
pub(super) fn names_of(selected: &[String], all: &BTreeSet<String>) -> Vec<Option<String>> {
    match selected {
        [only] if all.len() > 1 => vec![of_several(only, all)],
        [_] => vec![None],
        several => names(several).into_iter().map(Some).collect(),
    }
}

/// Name of an IMU among several: its distinct part, if that is one word and not that of a sensor; else [`last_word`].
fn of_several(only: &str, all: &BTreeSet<String>) -> Option<String> {
    let all: Vec<String> = all.iter().cloned().collect();
    let mut named = all.iter().zip(names(&all));
    let distinct = named.find(|(address, _)| *address == only);
    let distinct = distinct.map(|(_, name)| name);
    let is_word = |name: &String| !name.contains('/') && !SENSORS.contains(&name.as_str());
    distinct.filter(is_word).or_else(|| last_word(only))
}

/// Last part of an address that does not name a sensor.
pub(super) fn last_word(address: &str) -> Option<String> {
    let mut parts = address.split('/').filter(|part| !part.is_empty());
    let is_sensor = |part: &&str| SENSORS.iter().any(|word| part.contains(word));
    parts.rfind(|part| !is_sensor(part)).map(str::to_owned)
}

/// The distinct parts of several topics: `fl` and `fr` for `/imu/fl` and `/imu/fr`, `fl_foot` and `fr_foot` for
/// `/fl_foot/imu` and `/fr_foot/imu`.
fn names(topics: &[String]) -> Vec<String> {
    let whole: Vec<&str> = topics.iter().map(|topic| topic.trim_matches('/')).collect();
    let parts: Vec<Vec<&str>> = whole.iter().map(|topic| topic.split('/').collect()).collect();
    // Each topic keeps a part.
    let start = common(parts.iter().map(|parts| parts.iter().rev().skip(1).rev()));
    let end = common(parts.iter().map(|parts| parts.iter().skip(1).rev()));
    let short = parts.iter().map(|parts| {
        let own = parts.get(start..parts.len() - end);
        own.unwrap_or_default().join("/")
    });
    let short: Vec<String> = short.collect();
    if short.iter().any(String::is_empty) {
        return whole.into_iter().map(str::to_owned).collect();
    }
    short
}

/// Number of the first parts that all topics have in common.
fn common<'a, P: Iterator<Item = &'a &'a str>>(mut topics: impl Iterator<Item = P>) -> usize {
    let first: Vec<&&str> = topics.next().into_iter().flatten().collect();
    let equal = |parts: P| parts.zip(&first).take_while(|(a, b)| a == *b).count();
    topics.map(equal).min().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(topics: &[&str]) -> Vec<String> {
        names(&topics.iter().map(|topic| (*topic).to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn foot_is_named_by_the_distinct_part_of_its_topic() {
        for (topics, feet) in [
            (["/imu/fl", "/imu/fr"], ["fl", "fr"]),
            (["/fl_foot/imu", "/fr_foot/imu"], ["fl_foot", "fr_foot"]),
            (["/leg_1/imu/data", "/leg_2/imu/data"], ["leg_1", "leg_2"]),
            (["/imu_left", "/imu_right"], ["imu_left", "imu_right"]),
            (["/robot/1/imu", "/robot/12/imu"], ["1", "12"]),
            (["/a/left/imu", "/b/right/imu"], ["a/left", "b/right"]),
            (["/imu", "/imu/raw"], ["imu", "imu/raw"]),
            (["/x/fl/imu", "/x/fl/imu2"], ["imu", "imu2"]),
        ] {
            assert_eq!(named(&topics), feet, "{topics:?}");
        }
    }

    #[test]
    fn foot_selected_alone_keeps_the_name_that_it_has_among_all() {
        for (one, others, name) in [
            ("/imu/fl", &["/imu/fr"][..], Some("fl")),
            ("/fl_foot/imu", &["/fr_foot/imu"], Some("fl_foot")),
            ("/leg/fl/imu/front", &["/leg/fr/imu/front"], Some("fl")),
            ("/foot_imus/rl_foot", &["/foot_imus/fl_foot"], Some("rl_foot")),
            ("/imu_left", &["/imu_right"], Some("imu_left")),
            // The trunk has nothing in common with the topics of feet.
            ("/imu/fl", &["/imu/fr", "/trunk/imu"], Some("fl")),
            ("/fl/imu", &["/fl/imu2"], Some("fl")),
            ("/imu", &["/trunk_imu"], None),
            ("/imu/fl", &[], None),
        ] {
            let all = others.iter().copied().chain([one]);
            let all = all.map(str::to_owned).collect();
            let names = names_of(&[one.to_owned()], &all);
            assert_eq!(names, [name.map(str::to_owned)], "{one}, {others:?}");
        }
    }
}
