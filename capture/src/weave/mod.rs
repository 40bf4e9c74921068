//! Weaves in a rectified close-up.
