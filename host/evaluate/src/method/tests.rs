//! Tests of the knowledge and the answers of each method.

use samples::recording::Label;

use super::*;
use crate::sets::{Family, Set};
use crate::testing::labelled;

/// Sets of every kind, each with more than one recording.
const SETS: [Set; 9] = [
    Set::Ground,
    Set::ThreeSteps,
    Set::Slip,
    Set::Atlas7k,
    Set::Nao,
    Set::Shoe,
    Set::Shoe,
    Set::Demo,
    Set::Walk,
];

/// Index of a recording that is no teacher within its family.
const SLIP: usize = 2;

type Row = (
    recordings::input::published::simulated::Wrench,
    [f64; 6],
    Label,
);

/// Walk of a foot that turns `slowness` times slower in its swing than in the first walk.
fn rows(slowness: f64) -> impl Iterator<Item = Row> {
    (0..2000_u32).map(move |k| {
        let noise = 0.01 * (f64::from(k * 7919 % 1000) / 1000.0 - 0.5);
        let tremble = [10.0 * noise, noise, noise, noise, noise, noise];
        if k / 125 % 2 == 0 {
            ([0.0, 0.0, 800.0, 0.0, 0.0, 0.0], tremble, Label::Stable)
        } else {
            let swing = tremble.map(|m| 8.0 / slowness + m);
            ([0.0; 6], swing, Label::NotStable)
        }
    })
}

fn walks() -> Vec<Labelled> {
    let slowness = (0..).map(|index| 1.0 + 0.1 * f64::from(index % 4));
    let sets = SETS.into_iter().zip(slowness);
    sets.map(|(set, slowness)| labelled(set, rows(slowness)))
        .collect()
}

fn with_labels_turned(walks: &[Labelled], turns: impl Fn(usize) -> bool) -> Vec<Labelled> {
    let mut turned = walks.to_vec();
    for (_, file) in turned.iter_mut().enumerate().filter(|(k, _)| turns(*k)) {
        for sample in &mut file.recording.samples {
            sample.label = sample.label.map(|label| match label {
                Label::Stable => Label::NotStable,
                Label::NotStable => Label::Stable,
            });
        }
    }
    turned
}

fn probabilities(run: Option<&MethodRun>) -> Option<Vec<f64>> {
    let scored = run?.answers.scored.iter();
    Some(scored.map(|s| s.probability).collect())
}

#[test]
fn threshold_depends_on_the_other_recordings_only() {
    for teachers in [Teachers::OtherFamilies, Teachers::SameFamily] {
        let method = ComparedMethod::tuned(Detector::Shoe, teachers);
        let mut files = walks();
        let before = method.run(&files).unwrap().swap_remove(0).unwrap();
        // Another motion in the recordings that tune the first changes its threshold …
        for index in teachers.indices(&files, 0) {
            files[index] = labelled(SETS[index], rows(2000.0));
        }
        let after = method.run(&files).unwrap().swap_remove(0).unwrap();
        assert_ne!(before.answers.scored, after.answers.scored, "{teachers:?}");
        // … but not its ranking.
        assert_eq!(before.answers.ranking, after.answers.ranking);
    }
}

#[test]
fn causal_methods_do_not_depend_on_later_samples() {
    let files = walks();
    let mut cut = files.clone();
    // The learnt values do not change, because no method learns from the slip set here.
    let keep = 1000;
    cut[SLIP] = labelled(Set::Slip, rows(1.2).take(keep));
    for method in ComparedMethod::ALL {
        let slip = |files| method.run(files).unwrap().swap_remove(SLIP);
        let whole = slip(&files).unwrap().answers.scored;
        let part = slip(&cut).unwrap().answers.scored;
        let same = part.iter().zip(&whole).all(|(a, b)| a == b);
        let reaches_the_end = part.len() == keep;
        match method.causality() {
            Causality::Causal => assert!(same && reaches_the_end, "{method:?}"),
            Causality::LooksAhead => assert!(!reaches_the_end, "{method:?}"),
        }
    }
}

#[test]
fn scored_recording_does_not_provide_labels() {
    let files = walks();
    for method in ComparedMethod::ALL {
        let before = method.run(&files).unwrap();
        for (index, run) in before.iter().enumerate() {
            let turned = with_labels_turned(&files, |other| other == index);
            let after = method.run(&turned).unwrap();
            assert_eq!(
                probabilities(run.as_ref()),
                probabilities(after[index].as_ref()),
                "{method:?} on {index}"
            );
        }
    }
}

#[test]
fn other_families_tuning_uses_no_labels_of_the_own_family() {
    let files = walks();
    let tuned = ComparedMethod::ALL.into_iter().filter(|method| {
        matches!(method, ComparedMethod::Tuned { teachers, .. } if *teachers == Teachers::OtherFamilies)
    });
    for method in tuned {
        let before = method.run(&files).unwrap();
        for family in SETS.map(Set::family) {
            let own = |index: usize| SETS[index].family() == family;
            let after = method.run(&with_labels_turned(&files, own)).unwrap();
            for index in (0..files.len()).filter(|index| own(*index)) {
                assert_eq!(
                    probabilities(before[index].as_ref()),
                    probabilities(after[index].as_ref()),
                    "{method:?} on {index}"
                );
                let knowledge = before[index].as_ref().map(|run| &run.knowledge.learnt);
                assert!(knowledge.is_none_or(|learnt| !learnt.contains(family.name())));
            }
        }
    }
}

#[test]
fn force_methods_are_skipped_without_a_force() {
    let files = walks();
    for method in ComparedMethod::ALL {
        let needs_robot = matches!(
            method,
            ComparedMethod::Authors
                | ComparedMethod::ForceTrigger
                | ComparedMethod::FuzzyCMeans
                | ComparedMethod::Tuned {
                    detector: Detector::Force,
                    ..
                }
        );
        for (file, run) in files.iter().zip(method.run(&files).unwrap()) {
            let robot = matches!(file.set.family(), Family::Atlas | Family::Lcd);
            assert_eq!(run.is_some(), robot || !needs_robot, "{method:?}");
        }
    }
}

#[test]
fn knowledge_of_several_runs_is_merged() {
    let runs = ComparedMethod::tuned(Detector::Ared, Teachers::SameFamily)
        .run(&walks())
        .unwrap();
    let atlas: Vec<&MethodRun> = runs[..3].iter().flatten().collect();
    let knowledge = Knowledge::of_all(&atlas);
    assert_eq!(
        knowledge.learnt,
        "threshold from made up for 3 steps; threshold from made up for ground"
    );
    assert_eq!(knowledge.labels_of.len(), 2);
}
