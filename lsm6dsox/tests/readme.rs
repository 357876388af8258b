//! Checks the README's table of registers against the code.

use lsm6dsox::register::{ALL, Access};

#[test]
fn the_readme_lists_every_register_with_its_value_after_reset() {
    let readme = include_str!("../README.md");
    let table: String = ALL
        .iter()
        .map(|register| {
            let access = match register.access {
                Access::ReadWrite => "rw",
                Access::ReadOnly => "r",
            };
            format!(
                "| {} | 0x{:02X} | {access} | 0x{:02X} |\n",
                register.name, register.address, register.reset
            )
        })
        .collect();
    assert!(readme.contains(&table), "the table should be:\n{table}");
}
