//! The mathematics against closed forms and independent references.

mod block;
mod elasticity;
mod equilibria;
mod load_path;
mod turning;
