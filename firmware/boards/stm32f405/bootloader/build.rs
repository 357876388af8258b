//! Places the bootloader at the start of the flash.

fn main() {
    println!("cargo:rerun-if-changed=../../../../memory.x");
    println!("cargo:rustc-link-arg-bin=bootloader=--defsym=_bootloader=1");
}
