//! What the commands share.

pub mod bounces;
pub mod content_hash;
pub mod cost;
pub mod exit;
pub mod figure;
pub mod file_kind;
pub mod filter_summary;
pub mod flags;
pub mod flip;
pub mod interrupt;
pub mod lowrank_cache;
pub mod options;
pub mod output;
pub mod page;
pub mod pairs;
pub mod paper;
pub mod progress;
pub mod wrap_sidecar;
