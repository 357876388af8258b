//! Links the product with the section in which defmt interns its strings.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=../memory.x");
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "none") {
        for program in ["foot", "foot-feather"] {
            println!("cargo:rustc-link-arg-bin={program}=-Tdefmt.x");
        }
        // Names the board to the virtual one, which takes a program without a name for that of the reference board.
        println!("cargo:rustc-link-arg-bin=foot-feather=--defsym=_board_feather=1");
    }
}
