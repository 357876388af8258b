//! Programs that are printed and run, by default in the root of the workspace.

use std::env;
use std::ffi::OsStr;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::Instant;

use anyhow::{Context, Result, bail};

/// Root of the repository.
#[must_use]
pub fn root() -> &'static Path {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.ancestors().nth(2).unwrap_or(package)
}

/// Returns the cargo that runs this program.
#[must_use]
pub fn cargo() -> String {
    env::var("CARGO").unwrap_or_else(|_| "cargo".into())
}

/// Program with its arguments.
pub struct Step {
    command: Command,
    /// Name of the program and arguments, for messages.
    text: String,
}

impl Step {
    /// Creates a step that runs `program`, a path relative to the root or a name.
    pub fn program(program: &str) -> Self {
        let at_root = root().join(program);
        let mut command =
            if at_root.is_file() { Command::new(at_root) } else { Command::new(program) };
        // All tasks look for built files in `target`.
        command.current_dir(root()).env_remove("CARGO_TARGET_DIR");
        let name = Path::new(program).file_name();
        let text = name.map_or_else(|| program.to_owned(), |name| name.display().to_string());
        Self { command, text }
    }

    /// Creates a step that runs the cargo that runs this program.
    pub fn cargo(arguments: &[&str]) -> Self {
        Self::program(&cargo()).with(arguments)
    }

    /// Adds arguments.
    pub fn with<T: AsRef<str>>(mut self, arguments: impl IntoIterator<Item = T>) -> Self {
        for argument in arguments {
            self.command.arg(argument.as_ref());
            self.text.extend([" ", argument.as_ref()]);
        }
        self
    }

    /// Sets a variable of the environment.
    pub fn env(mut self, name: &str, value: impl AsRef<OsStr>) -> Self {
        self.command.env(name, value);
        self
    }

    /// Searches a folder for programs first.
    pub fn with_path(mut self, folder: &Path) -> Self {
        let others = env::var("PATH").unwrap_or_default();
        let path = format!("{}:{others}", folder.display());
        self.command.env("PATH", path);
        self
    }

    /// Sets the folder to run in, instead of the root.
    pub fn at(mut self, folder: &Path) -> Self {
        self.command.current_dir(folder);
        self
    }

    /// Runs the program and prints its duration.
    ///
    /// # Errors
    /// The program does not start, or fails.
    pub fn run(mut self) -> Result<()> {
        let status = self.status()?;
        if !status.success() {
            bail!("{}: {status}", self.text);
        }
        Ok(())
    }

    fn status(&mut self) -> Result<ExitStatus> {
        let text = &self.text;
        eprintln!("== {text}");
        let begin = Instant::now();
        let status = self.command.status();
        let status = status.with_context(|| format!("{text} does not start"))?;
        eprintln!("   {:.1} s", begin.elapsed().as_secs_f64());
        Ok(status)
    }

    /// Runs the program with its output in a file, and returns whether it succeeded.
    ///
    /// # Errors
    /// The program does not start, or the file cannot be written.
    pub fn run_into(mut self, file: &Path) -> Result<bool> {
        let output = File::create(file).with_context(|| file.display().to_string())?;
        self.command.stdin(Stdio::null()).stderr(output.try_clone()?).stdout(output);
        Ok(self.status()?.success())
    }

    /// Runs the program and returns its standard output.
    ///
    /// # Errors
    /// The program does not start, fails, or prints invalid UTF-8.
    pub fn output(mut self) -> Result<String> {
        let text = &self.text;
        let output = self.command.output();
        let output = output.with_context(|| format!("{text} does not start"))?;
        if !output.status.success() {
            bail!("{text}: {}", String::from_utf8_lossy(&output.stderr).trim());
        }
        String::from_utf8(output.stdout).with_context(|| format!("{text} prints no text"))
    }
}

/// Finds a program as the shell would; `None` if it is not installed.
pub fn find(program: &str) -> Option<PathBuf> {
    let path = env::var_os("PATH").unwrap_or_default();
    let mut files = env::split_paths(&path).map(|folder| folder.join(program));
    files.find(|file| file.is_file())
}

/// Returns whether the shell would find a program of this name.
pub fn is_installed(program: &str) -> bool {
    find(program).is_some()
}

/// Removes a folder with its contents, if there is one.
///
/// # Errors
/// The folder cannot be removed.
pub fn remove_folder(folder: &Path) -> Result<()> {
    if folder.exists() {
        fs::remove_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    Ok(())
}

/// Processor time of the programs that have run so far, s.
///
/// # Errors
/// The system has no `/proc`.
pub fn cpu_s_of_children() -> Result<f64> {
    /// Unit of the times in `/proc` on each architecture of Linux (proc(5), `USER_HZ`).
    const TICKS_PER_SECOND: f64 = 100.0;
    let text = fs::read_to_string("/proc/self/stat").context("processor time is read on Linux")?;
    // The second field is the name in brackets; `cutime` and `cstime` are the fields 16 and 17.
    let after_name = text.rsplit_once(')').map_or("", |(_, rest)| rest);
    let fields = after_name.split_whitespace().skip(13).take(2);
    let ticks = fields.map(|field| field.parse::<f64>().unwrap_or(0.0));
    Ok(ticks.sum::<f64>() / TICKS_PER_SECOND)
}
