//! File formats that other programs read and write.
//!
//! A reader takes bytes that anyone may have written: it checks every count and offset against the bytes that are there before
//! it allocates, and answers a wrong file with a [`crate::BadInput`] that names the field.

pub mod capture;
pub mod merl;
pub mod rgl;
pub mod svg;

#[cfg(test)]
pub(crate) mod test_files;
