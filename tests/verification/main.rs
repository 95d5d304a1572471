//! Does the code solve the equations? Closed forms, manufactured solutions and independent references.

mod block;
mod corners;
mod elasticity;
mod equilibria;
mod figures;
mod gradient_recovery;
mod load_path;
mod materials;
mod plain_loop;
mod quadratic_field;
mod reaction_diffusion;
mod tissue_growth;
mod transient_field;
mod turning;
