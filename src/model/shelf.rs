//! A shelf for what is solved before the first step, so that runs with equal inputs solve it once.
//!
//! What stands on it was made from its key alone: a text of all inputs that decide it, as `Debug` prints them (numbers in the
//! shortest form that reads back to the same bits). Taking it down gives the bits that making it again would give.

use bevy_ecs::prelude::Resource;
use std::any::{Any, TypeId};
use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

type Thing = Arc<dyn Any + Send + Sync>;
type Place = Arc<Mutex<Option<Thing>>>;

/// Meshes, load paths and cue fields by their inputs. Clones are the same shelf.
#[derive(Clone, Default, Resource)]
pub struct Shelf {
    places: Arc<Mutex<BTreeMap<(TypeId, String), Place>>>,
}

impl Shelf {
    /// What stands under a key, made first if nothing does; and whether it was made now. Others who ask for it meanwhile
    /// wait, so they must not be tasks of the thread pool that makes it.
    ///
    /// # Errors
    /// Those of `make`; nothing is put on the shelf then.
    pub fn take<T: Any + Send + Sync, E>(
        &self,
        key: &str,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<(Arc<T>, bool), E> {
        let place = {
            let mut places = self.places.lock().unwrap_or_else(PoisonError::into_inner);
            Arc::clone(places.entry((TypeId::of::<T>(), key.to_owned())).or_default())
        };
        let mut thing = place.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = thing.as_ref().and_then(|known| Arc::clone(known).downcast().ok()) {
            return Ok((known, false));
        }
        let made = Arc::new(make()?);
        *thing = Some(Arc::clone(&made) as Thing);
        Ok((made, true))
    }

    /// How many things stand on it.
    pub fn count(&self) -> usize {
        let places = self.places.lock().unwrap_or_else(PoisonError::into_inner);
        places.values().filter(|place| place.lock().unwrap_or_else(PoisonError::into_inner).is_some()).count()
    }
}

impl fmt::Debug for Shelf {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Shelf of {}", self.count())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thing_is_made_once_a_key_and_kind_and_a_failure_is_not_kept() {
        let shelf = Shelf::default();
        let of = |key: &str, value: Result<u32, String>| shelf.take(key, || value);
        assert_eq!(of("a", Err("no".into())), Err("no".to_owned()));
        assert_eq!(of("a", Ok(1)), Ok((Arc::new(1), true)));
        assert_eq!(of("a", Ok(2)), Ok((Arc::new(1), false)));
        assert_eq!(of("b", Ok(2)), Ok((Arc::new(2), true)));
        let other_kind = shelf.clone().take("a", || Ok::<_, String>(0.5f64));
        assert_eq!(other_kind, Ok((Arc::new(0.5), true)));
        assert_eq!(shelf.count(), 3);
    }
}
