//! The kernels of Raystone as they stand in this folder, embedded in the program. A user copies one from here,
//! edits it, and gives the folder to `--kernels`.
#![warn(missing_docs)]

include!(concat!(env!("OUT_DIR"), "/embedded.rs"));
