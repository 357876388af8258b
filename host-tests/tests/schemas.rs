//! The schemas in `docs/schemas` are those of the program.

use footfall::schema::Kind;
use host_tests::committed::{assert_current, workspace};

#[test]
fn the_schemas_in_the_documents_are_those_of_the_program() {
    for kind in Kind::ALL {
        let path = workspace().join(format!("docs/schemas/{}.json", kind.name()));
        assert_current(&path, &kind.text());
    }
}
