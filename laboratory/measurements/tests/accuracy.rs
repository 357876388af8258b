//! The product's tests hold each set to the RMSE of the result.

use host_tests::sets::Set;
use results::Stored;

#[test]
fn tests_hold_each_set_to_the_rmse_of_the_result() {
    let result = Stored::read("rmse-by-set").unwrap_or_else(|problem| panic!("{problem:#}"));
    let rows = result.rows();
    for set in Set::ALL {
        let row = rows.iter().find(|row| row.text("set").is_ok_and(|name| name == set.name()));
        let row = row.unwrap_or_else(|| panic!("no result of {}", set.name()));
        let rmse = row.figures("rmse").and_then(|rmse| rmse.number("default"));
        let rmse = rmse.unwrap_or_else(|problem| panic!("{problem:#}"));
        assert!((set.rmse() - rmse).abs() < 1e-9, "{}: {rmse}", set.name());
    }
}
