//! Blocks of the pages that tests outside of the default run generate: each names the digests of the programs that it
//! was run on, which have to be those of the programs that are built now.

use crate::common::digest::{RUN_ON, digest_of, page_of};
use crate::common::is_built_here;
use host_tests::committed::workspace;

/// Blocks, each with the module of the test that generates it.
const BLOCKS: [(&str, &str); 10] = [
    ("faults", "matrix"),
    ("corners", "matrix"),
    ("pairs", "pairs"),
    ("updates", "update"),
    ("updates-others", "update"),
    ("update-corners", "update"),
    ("recordings", "recordings"),
    ("hour", "hour"),
    ("full-load-reference", "budgets"),
    ("full-load-feather", "budgets"),
];

fn read(page: &str) -> String {
    std::fs::read_to_string(workspace().join(page)).expect("the page can be read")
}

/// Last line of a block.
fn last_line<'a>(page: &'a str, block: &str) -> &'a str {
    let begin = format!("<!-- begin {block} -->\n");
    let end = format!("\n<!-- end {block} -->");
    let (_, content) = page.split_once(&begin).expect("the block begins");
    let (content, _) = content.split_once(&end).expect("the block ends");
    content.lines().last().unwrap_or_default()
}

/// Programs and digests that a line names.
fn named(line: &str) -> Option<Vec<(&str, &str)>> {
    let pairs = line.strip_prefix(RUN_ON)?.strip_suffix('.')?.split(", ");
    pairs.map(|pair| pair.strip_prefix('`')?.split_once("` ")).collect()
}

#[test]
fn generated_blocks_come_from_the_programs_that_are_built() {
    if !is_built_here() {
        return;
    }
    let mut old = Vec::new();
    for (block, test) in BLOCKS {
        let page = read(page_of(block));
        let line = last_line(&page, block);
        let is_current = named(line).is_some_and(|named| {
            let mut named = named.into_iter();
            named.all(|(name, digest)| digest_of(name).is_none_or(|built| built == digest))
        });
        if !is_current {
            old.push(format!(
                "`{block}`: FOOTFALL_UPDATE=1 cargo test -p virtual-board {test}:: -- --ignored"
            ));
        }
    }
    assert!(old.is_empty(), "blocks come from other programs than those that are built: {old:#?}");
}
