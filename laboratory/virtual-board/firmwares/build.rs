//! Shows the linker the memory of the chip, which lies in the root of the repository.

fn main() {
    println!("cargo:rustc-link-search=../../..");
    println!("cargo:rerun-if-changed=../../../memory.x");
}
