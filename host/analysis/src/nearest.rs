//! Suggestions for an unknown name.

use strsim::normalized_damerau_levenshtein as likeness;

/// Least likeness of a suggested name, in [0, 1].
const ALIKE: f64 = 0.7;

/// Least likeness of the last parts where a table is written, because its long name makes all names in it alike.
const ALIKE_IN_LAST_PART: f64 = 0.6;

/// Weight of the likeness of the last part alone, for a name in another table.
const ELSEWHERE: f64 = 0.8;

/// Least length of a part of a name by which the name is found, bytes.
const LEAST_PART: usize = 3;

/// Largest difference in likeness from the best suggestion.
const AS_GOOD: f64 = 0.1;

/// Largest number of suggestions.
const MOST: usize = 3;

/// Suffixes of names that are units.
const UNITS: [&str; 6] = ["_m_s2", "_rad_s", "_m_s", "_hz", "_m", "_s"];

/// Returns up to three names that are most similar to a text or its last part, or contain it, best first. A candidate
/// is a spelling with the name that it stands for.
#[must_use]
pub fn nearest(candidates: impl IntoIterator<Item = (String, String)>, text: &str) -> Vec<String> {
    let candidates = candidates.into_iter();
    let mut found: Vec<(f64, String)> = candidates
        .filter_map(|(spelling, name)| Some((likeness_to(text, &spelling)?, name)))
        .collect();
    // The sort is stable: equally similar names keep the order of the candidates.
    found.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    let best = found.first().map_or(1.0, |(best, _)| *best);
    let mut names: Vec<String> = Vec::new();
    for (likeness, name) in found {
        if likeness > best - AS_GOOD && names.len() < MOST && !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// Returns suggestions as a question: `did you mean a, b or c?`. `None` without any.
#[must_use]
pub fn did_you_mean(names: &[String]) -> Option<String> {
    let (last, others) = names.split_last()?;
    let names = match others {
        [] => last.clone(),
        others => format!("{} or {last}", others.join(", ")),
    };
    Some(format!("did you mean {names}?"))
}

fn likeness_to(text: &str, spelling: &str) -> Option<f64> {
    let last = last_of(text);
    let last = with_or_without_unit(spelling, |spelling| likeness(last, last_of(spelling)));
    let whole = with_or_without_unit(spelling, |spelling| likeness(text, spelling));
    let likeness = whole.max(ELSEWHERE * last);
    let has_table = text.contains('.');
    if likeness >= ALIKE && (last >= ALIKE_IN_LAST_PART || !has_table) {
        return Some(likeness);
    }
    let is_part = text.len() >= LEAST_PART && spelling.contains(text);
    is_part.then_some(ALIKE)
}

/// Returns the likeness with or without the unit of the spelling, whichever is greater.
fn with_or_without_unit(spelling: &str, likeness: impl Fn(&str) -> f64) -> f64 {
    let bare = UNITS
        .into_iter()
        .find_map(|unit| spelling.strip_suffix(unit));
    likeness(spelling).max(bare.map_or(0.0, likeness))
}

fn last_of(path: &str) -> &str {
    path.rsplit('.').next().unwrap_or(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spelling_leads_to_its_name_once() {
        let candidates = [
            ("weight", "mass"),
            ("mass", "mass"),
            ("size.length", "length"),
        ];
        let candidates = candidates.map(|(spelling, name)| (spelling.to_owned(), name.to_owned()));
        let near = |text| nearest(candidates.clone(), text);
        assert_eq!(near("weigth"), ["mass"]);
        assert_eq!(near("mas"), ["mass"]);
        assert_eq!(near("size_length"), ["length"]);
        assert_eq!(near("size.colour"), [""; 0]);
        assert_eq!(near("eng"), ["length"]);
        assert_eq!(near("en"), [""; 0]);
        assert_eq!(near("colour"), [""; 0]);
    }

    #[test]
    fn suggestions_are_a_question() {
        let names = ["a", "b", "c"].map(str::to_owned);
        let question = |names| did_you_mean(names).unwrap_or_default();
        assert_eq!(question(&names), "did you mean a, b or c?");
        assert_eq!(question(&names[..1]), "did you mean a?");
        assert_eq!(question(&[]), "");
    }
}
