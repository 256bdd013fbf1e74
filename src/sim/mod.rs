//! MuJoCo: the only room that names it.
