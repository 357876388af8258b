//! Text of a source file as tokens, and its paths.

/// Path as it is written.
pub(super) type Path = Vec<String>;

/// Name that a `use` item introduces.
pub(super) struct Use {
    /// The name; `*` for all names of a module.
    pub(super) name: String,
    /// Path that the name stands for.
    pub(super) path: Path,
    pub(super) is_public: bool,
}

/// Returns names and punctuation, without comments, literals and what is compiled for tests alone.
pub(super) fn tokens(text: &str) -> Vec<String> {
    let mut tokens: Vec<String> = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let is_name = |letter: char| letter.is_alphanumeric() || letter == '_';
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if ["\"", "r\"", "r#\""].iter().any(|q| rest.starts_with(q)) {
            string_length(rest)
        } else if first == '\'' {
            character_length(rest)
        } else {
            let name = rest.find(|letter| !is_name(letter)).unwrap_or(rest.len());
            let mark = if rest.starts_with("::") {
                2
            } else {
                first.len_utf8()
            };
            let length = name.max(mark);
            if !first.is_whitespace() {
                tokens.push(rest[..length].to_owned());
            }
            length
        };
        rest = &rest[length..];
    }
    without_tests(&tokens)
}

/// Length of a string literal with its quotes, bytes.
fn string_length(rest: &str) -> usize {
    if let Some(raw) = rest.strip_prefix("r#\"") {
        return raw.find("\"#").map_or(rest.len(), |end| 3 + end + 2);
    }
    let is_raw = rest.starts_with('r');
    let begin = if is_raw { 2 } else { 1 };
    let mut is_escaped = false;
    for (at, letter) in rest[begin..].char_indices() {
        match letter {
            '"' if !is_escaped => return begin + at + 1,
            '\\' if !is_raw => is_escaped = !is_escaped,
            _ => is_escaped = false,
        }
    }
    rest.len()
}

/// Length of a character literal with its quotes, bytes; 1 for the quote of a lifetime.
fn character_length(rest: &str) -> usize {
    let letters: Vec<(usize, char)> = rest.char_indices().take(3).collect();
    match letters[..] {
        // The escaped character may be a quote itself.
        [_, (_, '\\'), _] => rest[3..].find('\'').map_or(1, |end| end + 4),
        [_, _, (end, '\'')] => end + 1,
        _ => 1,
    }
}

/// Leaves out each item that is marked `#[cfg(test)]`.
fn without_tests(tokens: &[String]) -> Vec<String> {
    const MARK: [&str; 7] = ["#", "[", "cfg", "(", "test", ")", "]"];
    let mut kept = Vec::new();
    let mut rest = tokens;
    while let Some((first, after)) = rest.split_first() {
        let is_marked = rest.len() > MARK.len() && rest[..MARK.len()] == MARK;
        rest = after;
        if !is_marked {
            kept.push(first.clone());
            continue;
        }
        let mut depth = 0;
        let end = rest.iter().position(|token| {
            match token.as_str() {
                "{" => depth += 1,
                "}" => depth -= 1,
                _ => {}
            }
            depth == 0 && (token == ";" || token == "}")
        });
        rest = end.map_or(&[], |end| &rest[end + 1..]);
    }
    kept
}

/// Returns the names that the `use` items introduce.
pub(super) fn uses(tokens: &[String]) -> Vec<Use> {
    let mut uses = Vec::new();
    for (at, pair) in tokens.windows(2).enumerate() {
        // `use<'a>` in a type captures lifetimes.
        if pair[0] == "use" && pair[1] != "<" {
            let is_public = at > 0 && ["pub", ")"].contains(&tokens[at - 1].as_str());
            let mut rest = &tokens[at + 1..];
            add_tree(&mut rest, &[], is_public, &mut uses);
        }
    }
    uses
}

/// Adds the names of a tree of paths, such as `a::{b, c as d}`.
fn add_tree(rest: &mut &[String], before: &[String], is_public: bool, uses: &mut Vec<Use>) {
    let mut path = before.to_vec();
    let mut alias = None;
    while let Some((token, after)) = rest.split_first() {
        match token.as_str() {
            "," | "}" | ";" => break,
            "{" => {
                *rest = after;
                let is_end = |token: &String| ["}", ";"].contains(&token.as_str());
                while rest.first().is_some_and(|token| !is_end(token)) {
                    add_tree(rest, &path, is_public, uses);
                    if rest.first().is_some_and(|token| token == ",") {
                        *rest = &rest[1..];
                    }
                }
                *rest = rest.get(1..).unwrap_or_default();
                return;
            }
            "as" => alias = after.first().cloned(),
            "*" => alias = Some("*".to_owned()),
            // `self` at the end of a tree is the module before it.
            "self" if !path.is_empty() => {}
            name if name != "::" && alias.is_none() => path.push(name.to_owned()),
            _ => {}
        }
        *rest = after;
    }
    uses.push(Use {
        name: alias.or_else(|| path.last().cloned()).unwrap_or_default(),
        path,
        is_public,
    });
}

/// Returns the tokens outside `use` items.
pub(super) fn outside_uses(tokens: &[String]) -> Vec<String> {
    let mut is_use = false;
    let outside = tokens.iter().filter(|token| {
        is_use |= *token == "use";
        let is_outside = !is_use;
        is_use &= *token != ";";
        is_outside
    });
    outside.cloned().collect()
}

/// Returns the paths of at least two names.
pub(super) fn paths(tokens: &[String]) -> Vec<Path> {
    let mut paths = Vec::new();
    let mut rest = tokens;
    while let Some((first, after)) = rest.split_first() {
        let mut path = vec![first.clone()];
        rest = after;
        while let [mark, next, after @ ..] = rest
            && mark == "::"
        {
            path.push(next.clone());
            rest = after;
        }
        if path.len() > 1 {
            paths.push(path);
        }
    }
    paths
}
