//! A virtual environment of Python.

use std::path::PathBuf;

use anyhow::Result;

use xtask::command::{Step, remove_folder, root};

/// A virtual environment of Python.
pub struct Environment {
    folder: PathBuf,
}

impl Environment {
    /// Opens the environment of this name. Creates it if it does not exist.
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
