//! Figures of the documents, measured in emulators and under valgrind, in one program.

mod acceptance;
mod accuracy;
mod instructions;
mod nano;
mod processors;
