//! Tests of the installed Python package, and the comparison with other methods.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use xtask::command::{Step, remove_folder, root};

use crate::environment::Environment;

/// Files of tests that need only numpy.
const CORE: [&str; 3] = ["test_bits.py", "test_results.py", "test_select.py"];

/// Tests the package as the first command of its README installs it, without features. Cargo builds it in `target`, which
/// may have packages of another build.
///
/// # Errors
/// A test fails, or a package cannot be installed.
pub fn package(target: &Path) -> Result<()> {
    let environment = Environment::create("package")?;
    environment
        .pip_install()
        .env("CARGO_TARGET_DIR", target)
        .with(["./python", "pytest>=8"])
        .run()?;
    let at = root().join("python/tests");
    environment.python().at(&at).with(["installed_package.py"]).run()?;
    let pytest = ["-m", "pytest", "--quiet", "-p", "no:cacheprovider"];
    environment.python().at(&at).with(pytest).with(CORE).run()
}

/// Tests the package with all features and extras: files, fleets on Ray, types and stubs, documentation, notebooks.
///
/// # Errors
/// A test fails, or a package cannot be installed.
pub fn full() -> Result<()> {
    let environment = Environment::create("full")?;
    let extras = "./python[arrow,docs,fleet,notebooks,test]";
    environment.install([extras, "--config-settings", "build-args=--features all"])?;
    Step::cargo(&["build", "--locked", "--package", "footfall-program", "--features", "all"])
        .with(["--target-dir", "target/full"])
        .run()?;
    // Ray's sockets, whose paths are short, its logs, and all temporary files.
    let ray = root().join("target/ray");
    let temporary = root().join("target/python/tmp");
    remove_folder(&temporary)?;
    fs::create_dir_all(&temporary)?;
    fs::create_dir_all(&ray)?;
    let documents = root().join("target/python/docs").display().to_string();
    let python = |arguments: &[&str]| {
        let mut step = environment
            .python()
            .at(&root().join("python"))
            .env("FOOTFALL_PROGRAM", root().join("target/full/debug/footfall"))
            // No token in the home folder, and no report to anybody.
            .env("RAY_AUTH_MODE", "disabled")
            .env("RAY_USAGE_STATS_ENABLED", "0")
            .env("TMPDIR", &temporary);
        if ray.as_os_str().len() <= 40 {
            step = step.env("RAY_TMPDIR", &ray);
        }
        step.with(arguments).run()
    };
    python(&["-m", "pytest", "--quiet"])?;
    python(&["-m", "mypy", "--strict", "package/footfall", "tests"])?;
    python(&["-m", "mypy", "--strict", "../laboratory/benchmarks"])?;
    let stubs = ["--ignore-missing-stub", "--mypy-config-file", "pyproject.toml"];
    python(&[&["-m", "mypy.stubtest", "footfall._footfall"], &stubs[..]].concat())?;
    // A name or type that does not resolve is a warning of pdoc.
    let pdoc = ["-W", "error::UserWarning", "-m", "pdoc", "--docformat", "numpy"];
    let pages = ["--output-directory", &documents, "footfall", "footfall.fleet"];
    python(&[&pdoc[..], &pages[..]].concat())?;
    python(&["tests/run_notebooks.py"])?;
    fs::remove_dir_all(&ray)?;
    fs::remove_dir_all(&temporary)?;
    if Step::program("pgrep").with(["-f", "target/python/full/lib/.*/ray/"]).output().is_ok() {
        bail!("processes of Ray are left");
    }
    Ok(())
}

/// Compares footfall with other methods on the recordings.
///
/// # Errors
/// A figure differs from the stored one, or a package cannot be installed.
pub fn research() -> Result<()> {
    let datasets = env::var_os("FOOTFALL_DATASETS").map(PathBuf::from);
    let datasets = datasets.unwrap_or_else(|| root().join("../shared/datasets"));
    let is_required = env::var_os("FOOTFALL_REQUIRE_EVERYTHING").is_none_or(|value| value == "1");
    if !is_required && !datasets.is_dir() {
        println!("no recordings: FOOTFALL_DATASETS names their folder");
        return Ok(());
    }
    let environment = Environment::create("research")?;
    environment.install(["./python", "--requirement", "laboratory/research/requirements.txt"])?;
    environment.install(["--no-deps", "--requirement", "laboratory/research/bench/robots.txt"])?;
    for arguments in [
        &["-m", "mypy", "--strict", "--ignore-missing-imports", "research"][..],
        &["-m", "pytest", "--quiet", "research"],
        &["-m", "research.evaluate", "--check"],
        &["-m", "research.bench", "--check"],
    ] {
        environment.python().at(&root().join("laboratory")).with(arguments).run()?;
    }
    Ok(())
}
