//! Requirements of a release for users: an address, and a key of its own.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use program_images::{DEVELOPMENT_KEY, public_key};
use xtask::address::{self, ADDRESS, PLACEHOLDER};
use xtask::command::root;
use xtask::image::read_key;

/// Variable that names the public key of the bootloader.
const PUBLIC: &str = "FOOTFALL_KEY";

/// Variable that names the private key of the images.
const PRIVATE: &str = "FOOTFALL_SIGNING_KEY";

/// Recipient of the files of a release.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Users.
    Users,
    /// Whoever builds them, to look at.
    Draft,
}

/// Refuses a project that has no address, or documents that name another one.
///
/// # Errors
/// The manifest has the placeholder, or a document another address than the manifest.
pub fn check_address() -> Result<()> {
    let manifest = fs::read_to_string(root().join("Cargo.toml")).context("Cargo.toml")?;
    let differing = address::differing()?.into_iter().map(|(file, _)| file).collect::<Vec<_>>();
    check(ADDRESS, &manifest, &differing)
}

/// Checks an address, the manifest that has it, and the names of the files that have another one.
fn check(address: &str, manifest: &str, differing: &[&str]) -> Result<()> {
    if address == PLACEHOLDER {
        let mut lines = (1..).zip(manifest.lines());
        let line = lines.find(|(_, line)| line.starts_with("repository = "));
        let (number, line) = line.context("Cargo.toml has no line with the repository")?;
        bail!(
            "the project has no address yet. Write it in place of {PLACEHOLDER}, and then run \
             `FOOTFALL_UPDATE=1 cargo test -p xtask --lib address::`:\nCargo.toml:{number}: {line}"
        );
    }
    if !differing.is_empty() {
        bail!(
            "{} without {address}, the address in Cargo.toml: \
             `FOOTFALL_UPDATE=1 cargo test -p xtask --lib address::` writes it",
            differing.join(", ")
        );
    }
    Ok(())
}

/// Keys of a release. Images that the private key signs are accepted by a bootloader that contains the public one.
#[derive(Debug)]
pub struct Keys {
    /// File with the private key.
    pub private: PathBuf,
    public: [u8; 32],
}

impl Keys {
    /// Reads the keys that the environment names.
    ///
    /// # Errors
    /// One is missing or has another length, they do not belong together, or they are the development key.
    pub fn from_environment() -> Result<Self> {
        let path = |variable: &str, what: &str| {
            let path = env::var_os(variable).map(PathBuf::from);
            path.with_context(|| {
                format!(
                    "a release needs a key of its own: set {variable} to the file with the {what} \
                     (SECURITY.md), or build a draft with --draft"
                )
            })
        };
        Self::read(&path(PRIVATE, "private key")?, &path(PUBLIC, "public key")?)
    }

    fn read(private: &Path, public: &Path) -> Result<Self> {
        let key = read_key(private)?;
        if key == *DEVELOPMENT_KEY {
            bail!("{}: the development key, which everybody has", private.display());
        }
        let own = read_key(public)?;
        if own != public_key(&key) {
            let (public, private) = (public.display(), private.display());
            bail!(
                "{public} is not the public half of {private}: a bootloader with it would refuse each image. \
                 `cargo xtask public-key {private} FILE` writes the right one"
            );
        }
        Ok(Self { private: private.to_owned(), public: own })
    }

    /// Checks that a built bootloader contains the public key.
    ///
    /// # Errors
    /// It does not, or its ELF cannot be read.
    pub fn check_bootloader(&self, elf: &Path) -> Result<()> {
        let bytes = fs::read(elf).with_context(|| elf.display().to_string())?;
        if !bytes.windows(self.public.len()).any(|part| part == self.public) {
            bail!("{}: it was built with another key than {PUBLIC}", elf.display());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Files of a private key, its public half, the public half of another key, and a key that is too short. Each test has a
    /// folder of its own, because tests run at the same time.
    fn keys(test: &str) -> [PathBuf; 4] {
        let folder = root().join("target/tmp/keys-test").join(test);
        fs::create_dir_all(&folder).expect("a folder");
        let write = |name: &str, bytes: &[u8]| {
            let path = folder.join(name);
            fs::write(&path, bytes).expect("a file");
            path
        };
        let (own, other) = ([7; 32], [8; 32]);
        [
            write("own.key", &own),
            write("own.pub", &public_key(&own)),
            write("other.pub", &public_key(&other)),
            write("short.key", &[7; 31]),
        ]
    }

    #[test]
    fn release_takes_only_a_key_that_matches_its_bootloader() {
        let [own, public, other, short] = keys("release");
        let keys = Keys::read(&own, &public).expect("keys that belong together");
        assert_eq!(keys.private, own);
        let refused = |private: &Path, public: &Path| {
            Keys::read(private, public).expect_err("wrong keys").to_string()
        };
        assert!(refused(&own, &other).contains("is not the public half of"));
        assert!(refused(&short, &public).contains("a key of 31 bytes"));
        let development = root().join("bootloader/keys");
        let of_everybody =
            refused(&development.join("development.key"), &development.join("development.pub"));
        assert!(of_everybody.contains("the development key, which everybody has"));
    }

    #[test]
    fn bootloader_with_another_key_is_refused() {
        let [own, public, other, _] = keys("bootloader");
        let keys = Keys::read(&own, &public).expect("keys that belong together");
        let bootloader = |key: &Path| {
            let path = key.with_extension("elf");
            let bytes = [vec![1; 40], fs::read(key).expect("a key"), vec![2; 8]].concat();
            fs::write(&path, bytes).expect("a file");
            path
        };
        keys.check_bootloader(&bootloader(&public)).expect("its own key");
        let error = keys.check_bootloader(&bootloader(&other)).expect_err("another key");
        assert!(error.to_string().contains("another key than FOOTFALL_KEY"));
    }

    #[test]
    fn missing_address_is_named_with_its_line() {
        let line = format!("repository = \"{PLACEHOLDER}\"");
        let refused = check(PLACEHOLDER, &format!("[package]\n{line}\n"), &[]);
        let refused = refused.expect_err("a placeholder").to_string();
        assert!(refused.ends_with(&format!(":\nCargo.toml:2: {line}")), "{refused}");
        let refused = check("https://a.org", "", &["a.md"]).expect_err("another address");
        assert!(refused.to_string().starts_with("a.md without https://a.org"), "{refused}");
        check("https://a.org", "", &[]).expect("an address");
    }
}
