//! `footfall evaluate` on the real recordings: what is known of each method, what the texts say
//! about it, and the tables and pictures that are committed.

use std::path::PathBuf;
use std::sync::OnceLock;

use footfall::evaluate::labelled::SOURCES;
use footfall::evaluate::method::{Causality, Method};
use footfall::evaluate::score::Figures;
use footfall::evaluate::table::Style;
use footfall::evaluate::{Evaluation, Group};
use host_tests::committed::{assert_block, assert_current, assert_readme_block, workspace};
use host_tests::datasets::recorded;

const SLIP: usize = 2;

/// Everything, evaluated once for all tests; `None` where a recording is absent.
fn evaluation() -> Option<&'static Evaluation> {
    static EVALUATION: OnceLock<Option<Evaluation>> = OnceLock::new();
    EVALUATION
        .get_or_init(|| {
            let paths: Option<Vec<PathBuf>> =
                SOURCES.iter().map(|source| recorded(source.path)).collect();
            let paths = paths?;
            let datasets = paths.first()?.parent()?.parent()?;
            Some(Evaluation::run(datasets).expect("readable recordings"))
        })
        .as_ref()
}

fn on_recording(evaluation: &Evaluation, method: Method, place: usize) -> &Figures {
    let found = evaluation.methods.iter().find(|e| e.method == method);
    &found.expect("every method is there").recordings[place].figures
}

fn on_group(evaluation: &Evaluation, method: Method, group: Group) -> &Figures {
    let found = evaluation.methods.iter().find(|e| e.method == method);
    let groups = &found.expect("every method is there").groups;
    let found = groups.iter().find(|on| on.group == group);
    &found.expect("every group is there").figures
}

fn assert_near(actual: f64, expected: f64, tolerance: f64, what: &str) {
    assert!(
        (actual - expected).abs() <= tolerance,
        "{what}: {actual} instead of {expected}"
    );
}

#[test]
fn the_authors_script_gives_what_it_gives_in_python() {
    let Some(evaluation) = evaluation() else {
        return;
    };
    for (place, rmse, auc, f1) in [
        (0, 0.2440, 0.964, 0.910),
        (1, 0.2438, 0.955, 0.917),
        (SLIP, 0.3538, 0.927, 0.691),
    ] {
        let figures = on_recording(evaluation, Method::Authors, place);
        assert_near(figures.rmse, rmse, 0.00005, SOURCES[place].path);
        assert_near(
            figures.roc_auc.expect("both labels"),
            auc,
            0.0005,
            "ROC-AUC",
        );
        assert_near(figures.f1_at_0_5.expect("both labels"), f1, 0.0005, "F1");
    }
}

#[test]
fn the_paper_preset_gives_the_parity_target_on_whole_files() {
    let Some(evaluation) = evaluation() else {
        return;
    };
    for (place, rmse) in [(0, 0.2493), (1, 0.2566), (SLIP, 0.3472)] {
        let figures = on_recording(evaluation, Method::Paper, place);
        assert_near(figures.rmse, rmse, 0.0005, SOURCES[place].path);
    }
}

/// RMSE, ROC-AUC and best F1 on the slip file as computed independently, in double precision with
/// numpy. Thresholds there gave the best F1, wherefore RMSE may differ a little more.
#[test]
fn the_peers_give_what_an_independent_computation_gave() {
    let Some(evaluation) = evaluation() else {
        return;
    };
    for (method, rmse, auc, best_f1) in [
        (Method::Shoe, 0.343, 0.928, 0.760),
        (Method::Amvd, 0.359, 0.920, 0.724),
        (Method::Ared, 0.429, 0.895, 0.678),
    ] {
        let figures = on_recording(evaluation, method, SLIP);
        assert_near(figures.rmse, rmse, 0.003, method.name());
        assert_near(figures.roc_auc.expect("labels"), auc, 0.0006, method.name());
        assert_near(
            figures.best_f1.expect("labels"),
            best_f1,
            0.0006,
            method.name(),
        );
    }
    let trigger = on_recording(evaluation, Method::ForceTrigger, SLIP);
    assert_near(trigger.rmse, 0.667, 0.001, "trigger");
    assert_near(trigger.roc_auc.expect("labels"), 0.723, 0.0006, "trigger");
}

#[test]
fn a_map_of_the_same_kind_of_labels_mends_the_calibration_and_one_of_other_kinds_much_less() {
    let Some(evaluation) = evaluation() else {
        return;
    };
    for group in [Group::Atlas, Group::Lcd] {
        let error = |method| on_group(evaluation, method, group).calibration_error;
        let plain = error(Method::Calibrated);
        assert!(error(Method::Mapped) < 0.9 * plain, "{group:?}");
        let mapped = error(Method::Mapped);
        assert!(error(Method::MappedAcross) > 1.3 * mapped, "{group:?}");
        // The order of samples is not touched, so neither is what depends on nothing else.
        let auc = |method| on_group(evaluation, method, group).roc_auc;
        assert_eq!(auc(Method::Mapped), auc(Method::Calibrated));
    }
}

#[test]
fn no_method_but_the_authors_script_looks_ahead() {
    let ahead = Method::ALL.into_iter();
    let ahead: Vec<_> = ahead
        .filter(|m| m.causality() == Causality::LooksAhead)
        .collect();
    assert_eq!(ahead, [Method::Authors]);
}

#[test]
fn the_readme_shows_how_the_methods_compare() {
    let Some(evaluation) = evaluation() else {
        return;
    };
    let pooled = |method| on_group(evaluation, method, Group::Atlas).rmse;
    let (ours, paper) = (pooled(Method::Default), pooled(Method::Paper));
    assert_readme_block(
        "evaluate",
        &format!(
            "{}\nSo over the three ATLAS files together the default preset has an RMSE of {ours:.3}, \
             the paper's\nparameters have {paper:.3}.\n",
            evaluation.brief_table(Style::Markdown)
        ),
    );
}

#[test]
fn the_evaluation_is_documented_in_full() {
    let Some(evaluation) = evaluation() else {
        return;
    };
    let tables = evaluation.full_tables(Style::Markdown);
    assert_block("docs/evaluation.md", "evaluate", &tables);
}

#[test]
fn the_pictures_are_those_of_the_evaluation() {
    let Some(evaluation) = evaluation() else {
        return;
    };
    let docs = workspace().join("docs");
    let histogram = evaluation.histogram().expect("a picture");
    assert_current(&docs.join("errors.svg"), &histogram);
    let reliability = evaluation.reliability().expect("a picture");
    assert_current(&docs.join("reliability.svg"), &reliability);
}
