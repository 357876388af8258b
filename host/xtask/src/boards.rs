//! The boards that the firmware is built for.

use anyhow::{Context, Result};

use crate::command::Step;

/// A board.
pub struct Board {
    /// Name of its folder and of its feature.
    pub name: String,
    /// Name of its program.
    pub program: String,
}

/// All boards, as `.ci/boards` lists them.
///
/// # Errors
/// The script fails, or a board has no program.
pub fn all() -> Result<Vec<Board>> {
    let listed = Step::program(".ci/boards").output()?;
    listed.lines().map(parse).collect()
}

fn parse(line: &str) -> Result<Board> {
    let words = line.split_once(' ');
    let words = words.filter(|(_, program)| !program.is_empty());
    let words = words.with_context(|| format!("{line}: the board has no program"))?;
    let (name, program) = (words.0.to_owned(), words.1.to_owned());
    Ok(Board { name, program })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_board_has_a_name_and_a_program() {
        let boards = all().expect("the list");
        let names: Vec<&str> = boards.iter().map(|board| board.name.as_str()).collect();
        assert_eq!(names, ["feather", "reference"]);
        assert!(parse("feather ").is_err());
    }
}
