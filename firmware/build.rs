//! Links the product with the section in which defmt interns its strings.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=header.x");
    println!("cargo:rerun-if-changed=../memory.x");
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "none") {
        for program in ["foot", "foot-feather", "bring-up", "bring-up-feather"] {
            println!("cargo:rustc-link-arg-bin={program}=-Tdefmt.x");
            // Behind the bootloader: see memory.x.
            println!("cargo:rustc-link-arg-bin={program}=--defsym=_program=1");
            println!("cargo:rustc-link-arg-bin={program}=-Tfirmware/header.x");
        }
        // Names the board to the virtual one, which takes a program without a name for that of the reference board.
        for program in ["foot-feather", "bring-up-feather"] {
            println!("cargo:rustc-link-arg-bin={program}=--defsym=_board_feather=1");
        }
    }
}
