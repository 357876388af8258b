//! Names the public key.

use std::path::Path;

fn main() {
    println!("cargo:rerun-if-env-changed=FOOTFALL_KEY");
    let package = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
    let development = Path::new(&package).join("keys/development.pub");
    let key = std::env::var_os("FOOTFALL_KEY").map_or(development, Into::into);
    let length = std::fs::metadata(&key).map(|file| file.len());
    if !key.is_absolute() || !length.is_ok_and(|length| length == 32) {
        let shown = key.display();
        println!(
            "cargo::error=FOOTFALL_KEY is {shown}: it must be the whole path of a file of 32 bytes"
        );
    }
    println!("cargo:rerun-if-changed={}", key.display());
    println!("cargo:rustc-env=FOOTFALL_PUBLIC_KEY={}", key.display());
}
