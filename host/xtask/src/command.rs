//! Programs that are printed and run, by default in the root of the workspace.

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};
use std::time::Instant;

use anyhow::{Context, Result, bail};

/// Root of the workspace.
pub fn root() -> &'static Path {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.ancestors().nth(2).unwrap_or(package)
}

/// Returns the cargo that runs this program.
pub fn cargo() -> String {
    env::var("CARGO").unwrap_or_else(|_| "cargo".into())
}

/// Program with its arguments.
pub struct Step {
    program: String,
    arguments: Vec<String>,
    environment: Vec<(&'static str, String)>,
    folder: PathBuf,
    /// Folder that is searched for programs first.
    tools: Option<PathBuf>,
}

impl Step {
    /// Creates a step that runs `program`, a path relative to the root or a name.
    pub fn program(program: &str) -> Self {
        let at_root = root().join(program);
        Self {
            program: match at_root.is_file() {
                true => at_root.display().to_string(),
                false => program.to_owned(),
            },
            arguments: Vec::new(),
            environment: Vec::new(),
            folder: root().to_owned(),
            tools: None,
        }
    }

    /// Creates a step that runs the cargo that runs this program.
    pub fn cargo(arguments: &[&str]) -> Self {
        Self::program(&cargo()).with(arguments)
    }

    /// Adds arguments.
    pub fn with<T: AsRef<str>>(mut self, arguments: impl IntoIterator<Item = T>) -> Self {
        let owned = arguments.into_iter().map(|text| text.as_ref().to_owned());
        self.arguments.extend(owned);
        self
    }

    /// Adds an environment variable.
    pub fn with_env(mut self, name: &'static str, value: &str) -> Self {
        self.environment.push((name, value.to_owned()));
        self
    }

    /// Searches a folder for programs first.
    pub fn with_path(mut self, folder: &Path) -> Self {
        self.tools = Some(folder.to_owned());
        self
    }

    /// Sets the folder to run in, instead of the root.
    pub fn at(mut self, folder: &Path) -> Self {
        self.folder = folder.to_owned();
        self
    }

    fn command(&self) -> Command {
        let mut command = Command::new(&self.program);
        let variables = self.environment.iter().map(|(name, value)| (name, value));
        command.args(&self.arguments).envs(variables);
        command.current_dir(&self.folder);
        if let Some(tools) = &self.tools {
            let others = env::var("PATH").unwrap_or_default();
            command.env("PATH", format!("{}:{others}", tools.display()));
        }
        command
    }

    fn text(&self) -> String {
        let name = Path::new(&self.program).file_name();
        let name = name.map_or_else(|| self.program.clone(), |name| name.display().to_string());
        let variables = self.environment.iter();
        let variables = variables.map(|(name, value)| format!("{name}={value}"));
        let words = variables.chain([name]).chain(self.arguments.clone());
        words.collect::<Vec<_>>().join(" ")
    }

    /// Runs the program and prints its duration.
    ///
    /// # Errors
    /// The program does not start, or fails.
    pub fn run(&self) -> Result<()> {
        let status = self.status()?;
        if !status.success() {
            bail!("{}: {status}", self.text());
        }
        Ok(())
    }

    /// Like [`Self::run`], but returns the exit code; `None` if the program was ended by a signal.
    ///
    /// # Errors
    /// The program does not start.
    pub fn exit_code(&self) -> Result<Option<i32>> {
        Ok(self.status()?.code())
    }

    fn status(&self) -> Result<ExitStatus> {
        let text = self.text();
        eprintln!("== {text}");
        let begin = Instant::now();
        let status = self.command().status();
        let status = status.with_context(|| format!("{text} does not start"))?;
        eprintln!("   {:.1} s", begin.elapsed().as_secs_f64());
        Ok(status)
    }

    /// Runs the program and returns its standard output.
    ///
    /// # Errors
    /// The program does not start, fails, or prints invalid UTF-8.
    pub fn output(&self) -> Result<String> {
        let text = self.text();
        let output = self.command().output();
        let output = output.with_context(|| format!("{text} does not start"))?;
        if !output.status.success() {
            bail!("{text}: {}", String::from_utf8_lossy(&output.stderr).trim());
        }
        String::from_utf8(output.stdout).with_context(|| format!("{text} prints no text"))
    }
}
