//! Tests of the Python package.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result};

use crate::command::{Step, remove_folder, root};

/// Files of tests that need only numpy.
pub const CORE: [&str; 3] = ["test_bits.py", "test_results.py", "test_select.py"];

/// A virtual environment of Python.
pub struct Environment {
    folder: PathBuf,
}

impl Environment {
    /// Opens the environment of this name, which is made where it is missing.
    ///
    /// # Errors
    /// The environment cannot be made.
    pub fn open(name: &str) -> Result<Self> {
        let folder = root().join("target/python").join(name);
        if !folder.join("bin/python").is_file() {
            let path = folder.display().to_string();
            Step::program("python3").with(["-m", "venv", &path]).run()?;
        }
        Ok(Self { folder })
    }

    /// Makes an empty environment of this name.
    ///
    /// # Errors
    /// The environment cannot be made.
    pub fn create(name: &str) -> Result<Self> {
        let folder = root().join("target/python").join(name);
        remove_folder(&folder)?;
        Self::open(name)
    }

    /// Runs `pip install`.
    ///
    /// # Errors
    /// A package cannot be installed.
    pub fn install<T: AsRef<str>>(&self, arguments: impl IntoIterator<Item = T>) -> Result<()> {
        self.pip_install().with(arguments).run()
    }

    /// `pip install`, without what it installs.
    #[must_use]
    pub fn pip_install(&self) -> Step {
        self.python().with(["-m", "pip", "--disable-pip-version-check", "--quiet", "install"])
    }

    /// Python, which leaves no compiled files in the tree.
    #[must_use]
    pub fn python(&self) -> Step {
        let python = self.folder.join("bin/python").display().to_string();
        Step::program(&python)
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .env("FOOTFALL_PROGRAM", root().join("target/debug/footfall"))
            .with_path(&self.folder.join("bin"))
    }
}

/// Installs the packages that [`core()`] needs.
///
/// # Errors
/// A package cannot be installed.
pub fn install_core() -> Result<()> {
    Environment::open("core")?.install(["numpy>=1.24", "pytest>=8"])
}

/// Tests the package next to the library that the other tests compiled, after [`install_core`]. Its bits are those of the host.
///
/// # Errors
/// A test fails.
pub fn core() -> Result<()> {
    let environment = Environment::open("core")?;
    let packages = root().join("target/python/core-package");
    let package = packages.join("footfall");
    remove_folder(&packages)?;
    fs::create_dir_all(&package)?;
    for entry in fs::read_dir(root().join("python/package/footfall"))? {
        let entry = entry?;
        if entry.file_type()?.is_file() {
            fs::copy(entry.path(), package.join(entry.file_name()))?;
        }
    }
    let library = root().join("target/debug/lib_footfall.so");
    fs::copy(&library, package.join("_footfall.abi3.so"))
        .with_context(|| library.display().to_string())?;
    environment
        .python()
        .env("PYTHONPATH", &packages)
        .at(&root().join("python/tests"))
        .with(["-m", "pytest", "--quiet", "-p", "no:cacheprovider", "--rootdir", "."])
        .with(CORE)
        .run()
}
