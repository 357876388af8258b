//! Hash and signature of a program: SHA-256 (FIPS 180-4) and Ed25519 (RFC 8032).

use sha2::{Digest, Sha256};

use crate::image::{HEADER, Header, Refusal, SIGNED};

/// Public key of the builds, 32 bytes: the file that `FOOTFALL_KEY` named when the bootloader was built, otherwise the
/// development key, whose private half is public.
pub static KEY: &[u8; 32] = include_bytes!(env!("FOOTFALL_PUBLIC_KEY"));

/// SHA-256 in progress.
#[derive(Clone, Debug, Default)]
pub struct Hash(Sha256);

impl Hash {
    /// Begins a hash.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds bytes.
    pub fn update(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// Returns the hash of all bytes.
    #[must_use]
    pub fn finish(self) -> [u8; 32] {
        self.0.finalize().into()
    }
}

/// Checks the signature of a header with a public key.
///
/// # Errors
/// The signature is not that of the key.
pub fn signature(bytes: &[u8; HEADER], key: &[u8; 32]) -> Result<(), Refusal> {
    let header = Header::decode(bytes)?;
    let Ok(key) = salty::PublicKey::try_from(key) else {
        return Err(Refusal::WrongSignature);
    };
    let signature = salty::Signature::from(&header.signature);
    let signed = bytes.get(..SIGNED).unwrap_or(&[]);
    key.verify(signed, &signature).map_err(|_| Refusal::WrongSignature)
}
