//! Figures of the documents, measured in emulators and under valgrind, and bits on other processors, in one program.

mod acceptance;
mod accuracy;
mod feather_rp2350;
mod instructions;
mod nano;
mod processors;
mod self_check;
