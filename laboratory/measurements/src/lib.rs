//! Figures of the documents that [tests](../tests/main.rs) measure on other machines.
