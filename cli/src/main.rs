//! The command `biscale`.

fn main() {}
