//! Does the code solve the equations? Closed forms, manufactured solutions and independent references.

mod gradient_recovery;
mod reaction_diffusion;
