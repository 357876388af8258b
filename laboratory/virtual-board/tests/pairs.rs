//! Every ordered pair of faults, at once and 12 ms apart. `FOOTFALL_PAIRS` in the environment selects pairs: by names,
//! separated by commas, or with a number N every N-th.

use crate::common::product;
use crate::digest::assert_reproduced_on;
use results::Measurement;
use virtual_board::emulator::wiring::Wiring;
use virtual_board::product::on_all_cores;
use virtual_board::product::scenario::pairs::{self, Pair};

#[test]
#[ignore = "full: 5100 pairs of faults, an hour"]
fn the_board_survives_two_simultaneous_or_close_faults() {
    let elf = product();
    let wish = std::env::var("FOOTFALL_PAIRS").unwrap_or_else(|_| "1".to_owned());
    let all: Vec<Pair> = pairs::all().collect();
    let is_named = |pair: &Pair| wish.split(',').any(|name| name == pair.name());
    let chosen: Vec<Pair> = match wish.parse::<usize>() {
        Ok(stride) => all.iter().copied().step_by(stride.max(1)).collect(),
        Err(_) => all.iter().copied().filter(is_named).collect(),
    };
    assert!(!chosen.is_empty(), "no pair is called {wish}");
    let outcomes = on_all_cores(&chosen, |pair| match pair.run(&elf) {
        Ok(outcome) => outcome.violations,
        Err(problem) => vec![problem.to_string()],
    });
    let wrong = chosen.iter().map(Pair::name).zip(outcomes);
    let wrong: Vec<_> = wrong.filter(|(_, found)| !found.is_empty()).collect();
    println!("{} of {} pairs", chosen.len(), all.len());
    assert!(wrong.is_empty(), "{} pairs: {wrong:#?}", wrong.len());
    if chosen.len() == all.len() {
        let result = Measurement::new(
            "pairs",
            "Every ordered pair of faults, at once and 12 ms apart: no frame may say \"stable\" on invalid data, and the \
             board has to recover.",
        )
        .measured_by("cargo test -p virtual-board pairs:: -- --ignored")
        .value("pairs", all.len())
        .value("pairs_beyond_their_bounds", wrong.len());
        assert_reproduced_on(&[Wiring::reference().program], result);
    }
}
