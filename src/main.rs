//! The `wayhome` command.

mod cli;

fn main() {}
