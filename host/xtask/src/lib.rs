//! Tasks of the repository: tests, programs for the boards and the files that are flashed, the library for programs in C.
//!
//! | module | contents |
//! |---|---|
//! | [`mod@test`], [`quick`] | the product's tests, and a check of what differs; with [`packages`] |
//! | [`install`] | tools that this machine lacks |
//! | [`firmware`], [`hex`], [`image`], [`uf2`] | programs of the boards, and their files |
//! | [`library`], [`generic`] | the estimator for programs in C |
//! | [`links`], [`address`] | links of documents, and the project's address |
//! | [`command`] | programs that are run |

pub mod address;
pub mod command;
pub mod firmware;
pub mod generic;
pub mod hex;
pub mod image;
pub mod install;
pub mod library;
pub mod links;
pub mod packages;
pub mod quick;
pub mod test;
pub mod uf2;
