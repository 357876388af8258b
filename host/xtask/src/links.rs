//! Links of Markdown documents, `[text](target)`. Blocks of code have none.

use std::ops::Range;

/// A link of a document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Link<'a> {
    /// Text of the link.
    pub text: &'a str,
    /// File or address that it leads to, and the anchor in it.
    pub target: &'a str,
    /// Bytes of the document from the bracket before the text to the parenthesis after the target.
    pub place: Range<usize>,
}

/// Returns the links of a document, in order.
pub fn links(document: &str) -> impl Iterator<Item = Link<'_>> {
    let mut is_code = false;
    let mut start = 0;
    document.split_inclusive('\n').flat_map(move |line| {
        is_code ^= line.trim_start().starts_with("```");
        let at = start;
        start += line.len();
        if is_code { Vec::new() } else { links_of(document, at..start) }
    })
}

/// Returns the links whose middle, `](`, is in a part of the document. The text of a link may begin on the line before.
fn links_of(document: &str, part: Range<usize>) -> Vec<Link<'_>> {
    let middles = document[part.clone()].match_indices("](");
    let link = |(offset, _): (usize, &str)| {
        let middle = part.start + offset;
        let begin = opening(&document[..middle])?;
        let target = document[middle + 2..].split_once(')')?.0;
        let place = begin..middle + 2 + target.len() + 1;
        Some(Link { text: &document[begin + 1..middle], target, place })
    };
    middles.filter_map(link).collect()
}

/// Returns the place of the bracket that begins the text of a link, given the document before the link's middle. A text
/// may contain pairs of brackets.
fn opening(before: &str) -> Option<usize> {
    let mut open = 0;
    before.char_indices().rev().find_map(|(at, letter)| match letter {
        '[' if open == 0 => Some(at),
        '[' => {
            open -= 1;
            None
        }
        ']' => {
            open += 1;
            None
        }
        _ => None,
    })
}

/// Returns the document with other targets. A link without one is replaced by its text.
pub fn with_targets(document: &str, target: impl Fn(&str) -> Option<String>) -> String {
    let mut changed = String::with_capacity(document.len());
    let mut done = 0;
    for link in links(document) {
        // A picture in the text of a link is a link, too.
        let (text, from) = match link.place.start.checked_sub(done) {
            Some(_) => (link.text, link.place.start),
            None => {
                let from = done;
                let end = link.place.end - link.target.len() - ")](".len();
                (&document[from..end], from)
            }
        };
        changed += &document[done..from];
        let opening = if from == link.place.start { "[" } else { "" };
        match target(link.target) {
            Some(target) => changed.extend([opening, text, "](", &target, ")"]),
            None => changed += text,
        }
        done = link.place.end;
    }
    changed + &document[done..]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn targets(document: &str) -> Vec<&str> {
        links(document).map(|link| link.target).collect()
    }

    #[test]
    fn links_have_text_and_target() {
        let found: Vec<_> = links("see [`a[0]`](b.md#c) and\n[d\ne](f)").collect();
        let found: Vec<_> = found.iter().map(|link| (link.text, link.target)).collect();
        assert_eq!(found, [("`a[0]`", "b.md#c"), ("d\ne", "f")]);
    }

    #[test]
    fn block_of_code_has_no_links() {
        let document = "[a](b)\n```cpp\nauto f = [](int x) { return x; };\n```\n[c](d)\n";
        assert_eq!(targets(document), ["b", "d"]);
    }

    #[test]
    fn targets_are_replaced_and_links_without_one_become_text() {
        let keep = |target: &str| (target != "x.md").then(|| format!("./{target}"));
        let document = "[a](x.md) (b) [c](d)\n```\n[e](f)\n```\n";
        assert_eq!(with_targets(document, keep), "a (b) [c](./d)\n```\n[e](f)\n```\n");
    }

    #[test]
    fn picture_in_a_link_keeps_both_targets() {
        let document = "[![a](b.svg)](c.md) end";
        let unchanged = with_targets(document, |target| Some(target.to_owned()));
        assert_eq!(unchanged, document);
    }
}
