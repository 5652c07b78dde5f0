//! Integration tests, one module a file.

mod arm;
mod believed;
mod data;
mod floor;
mod isolability;
mod joint;
mod late;
mod locate;
mod made;
mod map;
mod pushes;
mod reversals;
mod rigid;
