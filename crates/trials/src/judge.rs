//! What becomes of the cases: they are diagnosed, their keys opened, answers counted and compared.

pub(crate) mod card;
pub(crate) mod compare;
pub(crate) mod corpus;
pub(crate) mod run;
pub(crate) mod said;
pub(crate) mod score;
pub(crate) mod scored;
pub(crate) mod table;
