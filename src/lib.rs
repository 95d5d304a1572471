//! How axons find their way.

pub mod numerics;
pub mod record;
