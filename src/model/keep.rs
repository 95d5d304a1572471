//! How state is written down so that a run can go on from it: every number by its bits, in a fixed order, without names.
//!
//! What is read back equals what was written to the last bit, NaN and −0 included. Whoever has state of its own lists its fields once
//! with [`kept!`](crate::kept!); a field that is forgotten does not compile.

use crate::numerics::locate::MaterialPoint;
use nalgebra::SVector;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// What was written down does not read back: where and why.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Damage(pub String);

/// Bytes that are still to be read.
#[derive(Debug, Clone, Copy)]
pub struct KeptBytes<'a>(&'a [u8]);

impl<'a> KeptBytes<'a> {
    /// All of `bytes`.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    /// How many are left.
    pub fn left(&self) -> usize {
        self.0.len()
    }

    /// The next `count` bytes.
    ///
    /// # Errors
    /// There are not so many.
    pub fn take(&mut self, count: usize) -> Result<&'a [u8], Damage> {
        let Some((taken, rest)) = self.0.split_at_checked(count) else {
            return Err(Damage(format!("it ends {} bytes early", count - self.0.len())));
        };
        self.0 = rest;
        Ok(taken)
    }

    /// The next bytes as a value.
    ///
    /// # Errors
    /// They are none.
    pub fn read<T: Keep>(&mut self) -> Result<T, Damage> {
        T::restore(self)
    }

    /// A number of items, each of a byte at least: never more than bytes are left, so that a wrong one asks for no memory.
    fn count(&mut self) -> Result<usize, Damage> {
        let count: u64 = self.read()?;
        match usize::try_from(count) {
            Ok(count) if count <= self.left() => Ok(count),
            _ => Err(Damage(format!("it names {count} items where {} bytes are left", self.left()))),
        }
    }
}

/// A value that can be written down and read back to the last bit.
pub trait Keep: Sized {
    /// Appends the value.
    fn keep(&self, into: &mut Vec<u8>);

    /// Reads a value.
    ///
    /// # Errors
    /// Bytes that are no such value.
    fn restore(from: &mut KeptBytes) -> Result<Self, Damage>;
}

macro_rules! kept_numbers {
    ($($number:ty),*) => { $(
        impl Keep for $number {
            fn keep(&self, into: &mut Vec<u8>) {
                into.extend_from_slice(&self.to_le_bytes());
            }

            fn restore(from: &mut KeptBytes) -> Result<Self, Damage> {
                let mut bytes = [0; size_of::<$number>()];
                bytes.copy_from_slice(from.take(size_of::<$number>())?);
                Ok(<$number>::from_le_bytes(bytes))
            }
        }
    )* };
}

kept_numbers!(u8, u16, u32, u64, i16, i64, f32, f64);

impl Keep for usize {
    fn keep(&self, into: &mut Vec<u8>) {
        (*self as u64).keep(into);
    }

    fn restore(from: &mut KeptBytes) -> Result<Self, Damage> {
        let number: u64 = from.read()?;
        usize::try_from(number).map_err(|_| Damage(format!("{number} is too large a number here")))
    }
}

impl Keep for bool {
    fn keep(&self, into: &mut Vec<u8>) {
        u8::from(*self).keep(into);
    }

    fn restore(from: &mut KeptBytes) -> Result<Self, Damage> {
        match from.read::<u8>()? {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(Damage(format!("{other} is neither yes nor no"))),
        }
    }
}

impl Keep for String {
    fn keep(&self, into: &mut Vec<u8>) {
        self.len().keep(into);
        into.extend_from_slice(self.as_bytes());
    }

    fn restore(from: &mut KeptBytes) -> Result<Self, Damage> {
        let count = from.count()?;
        let text = std::str::from_utf8(from.take(count)?);
        text.map(str::to_owned).map_err(|error| Damage(format!("a text is no UTF-8: {error}")))
    }
}

impl<T: Keep> Keep for Option<T> {
    fn keep(&self, into: &mut Vec<u8>) {
        self.is_some().keep(into);
        if let Some(value) = self {
            value.keep(into);
        }
    }

    fn restore(from: &mut KeptBytes) -> Result<Self, Damage> {
        if from.read()? { Ok(Some(from.read()?)) } else { Ok(None) }
    }
}

fn keep_all<'t, T: Keep + 't>(items: impl ExactSizeIterator<Item = &'t T>, into: &mut Vec<u8>) {
    items.len().keep(into);
    items.for_each(|item| item.keep(into));
}

impl<T: Keep> Keep for Vec<T> {
    fn keep(&self, into: &mut Vec<u8>) {
        keep_all(self.iter(), into);
    }

    fn restore(from: &mut KeptBytes) -> Result<Self, Damage> {
        let count = from.count()?;
        let mut items = Vec::with_capacity(count.min(from.left() / size_of::<T>().max(1)));
        for _ in 0..count {
            items.push(from.read()?);
        }
        Ok(items)
    }
}

macro_rules! kept_slices {
    ($($slice:ident),*) => { $(
        impl<T: Keep> Keep for $slice<[T]> {
            fn keep(&self, into: &mut Vec<u8>) {
                keep_all(self.iter(), into);
            }

            fn restore(from: &mut KeptBytes) -> Result<Self, Damage> {
                Ok(from.read::<Vec<T>>()?.into())
            }
        }
    )* };
}

kept_slices!(Box, Arc);

impl<T: Keep + Copy + Default, const N: usize> Keep for [T; N] {
    fn keep(&self, into: &mut Vec<u8>) {
        self.iter().for_each(|item| item.keep(into));
    }

    fn restore(from: &mut KeptBytes) -> Result<Self, Damage> {
        let mut items = [T::default(); N];
        for item in &mut items {
            *item = from.read()?;
        }
        Ok(items)
    }
}

impl<A: Keep, B: Keep> Keep for (A, B) {
    fn keep(&self, into: &mut Vec<u8>) {
        self.0.keep(into);
        self.1.keep(into);
    }

    fn restore(from: &mut KeptBytes) -> Result<Self, Damage> {
        Ok((from.read()?, from.read()?))
    }
}

impl<K: Keep + Ord, V: Keep> Keep for BTreeMap<K, V> {
    fn keep(&self, into: &mut Vec<u8>) {
        self.len().keep(into);
        for (key, value) in self {
            key.keep(into);
            value.keep(into);
        }
    }

    fn restore(from: &mut KeptBytes) -> Result<Self, Damage> {
        Ok(from.read::<Vec<(K, V)>>()?.into_iter().collect())
    }
}

impl<T: Keep + Ord> Keep for BTreeSet<T> {
    fn keep(&self, into: &mut Vec<u8>) {
        keep_all(self.iter(), into);
    }

    fn restore(from: &mut KeptBytes) -> Result<Self, Damage> {
        Ok(from.read::<Vec<T>>()?.into_iter().collect())
    }
}

impl<const N: usize> Keep for SVector<f64, N> {
    fn keep(&self, into: &mut Vec<u8>) {
        self.iter().for_each(|x| x.keep(into));
    }

    fn restore(from: &mut KeptBytes) -> Result<Self, Damage> {
        Ok(from.read::<[f64; N]>()?.into())
    }
}

impl Keep for MaterialPoint<2> {
    fn keep(&self, into: &mut Vec<u8>) {
        let Self { cell, weights } = self;
        cell.keep(into);
        weights.keep(into);
    }

    fn restore(from: &mut KeptBytes) -> Result<Self, Damage> {
        Ok(Self { cell: from.read()?, weights: from.read()? })
    }
}

/// Says how types are [kept](crate::prelude::Keep): structs by all their fields, wrappers by what they wrap, enums without data by the
/// place of their variants.
///
/// ```
/// use tropism::prelude::*;
/// #[derive(Debug, Clone, Copy, PartialEq, Component)]
/// struct Fatigue {
///     since: f64,
///     spells: u64,
/// }
/// #[derive(Debug, Clone, Copy, PartialEq)]
/// enum Mood {
///     Eager,
///     Weary,
/// }
/// kept! { struct Fatigue { since, spells } }
/// kept! { enum Mood { Eager, Weary } }
/// let mut bytes = Vec::new();
/// (Fatigue { since: 0.1, spells: 3 }, Mood::Weary).keep(&mut bytes);
/// let read: (Fatigue, Mood) = KeptBytes::new(&bytes).read().unwrap();
/// assert_eq!(read, (Fatigue { since: 0.1, spells: 3 }, Mood::Weary));
/// assert!(KeptBytes::new(&bytes[1..]).read::<(Fatigue, Mood)>().is_err());
/// ```
#[macro_export]
macro_rules! kept {
    (struct $name:ty { $($field:ident),* $(,)? }) => {
        impl $crate::prelude::Keep for $name {
            fn keep(&self, into: &mut ::std::vec::Vec<u8>) {
                let Self { $($field),* } = self;
                $( $crate::prelude::Keep::keep($field, into); )*
            }

            fn restore(
                from: &mut $crate::prelude::KeptBytes,
            ) -> ::core::result::Result<Self, $crate::prelude::Damage> {
                $( let $field = from.read()?; )*
                ::core::result::Result::Ok(Self { $($field),* })
            }
        }
    };
    (wrapper $name:ident) => {
        impl $crate::prelude::Keep for $name {
            fn keep(&self, into: &mut ::std::vec::Vec<u8>) {
                let Self(inner) = self;
                $crate::prelude::Keep::keep(inner, into);
            }

            fn restore(
                from: &mut $crate::prelude::KeptBytes,
            ) -> ::core::result::Result<Self, $crate::prelude::Damage> {
                ::core::result::Result::Ok(Self(from.read()?))
            }
        }
    };
    (enum $name:ident { $($variant:ident),* $(,)? }) => {
        impl $crate::prelude::Keep for $name {
            fn keep(&self, into: &mut ::std::vec::Vec<u8>) {
                let name = match self {
                    $( Self::$variant => ::core::stringify!($variant), )*
                };
                let names = [$( ::core::stringify!($variant) ),*];
                into.push(names.iter().take_while(|other| **other != name).count() as u8);
            }

            fn restore(
                from: &mut $crate::prelude::KeptBytes,
            ) -> ::core::result::Result<Self, $crate::prelude::Damage> {
                let place: u8 = from.read()?;
                let mut variants = [$( ::core::option::Option::Some(Self::$variant) ),*];
                variants.get_mut(place as usize).and_then(::core::option::Option::take).ok_or_else(|| {
                    $crate::prelude::Damage(::std::format!("{} has no variant {place}", ::core::stringify!($name)))
                })
            }
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    fn again<T: Keep>(value: &T) -> T {
        let mut bytes = Vec::new();
        value.keep(&mut bytes);
        let mut rest = KeptBytes::new(&bytes);
        let read = rest.read().unwrap();
        assert_eq!(rest.left(), 0);
        for cut in 0..bytes.len() {
            assert!(KeptBytes::new(&bytes[..cut]).read::<T>().is_err(), "cut at {cut}");
        }
        read
    }

    #[test]
    fn every_bit_of_a_number_comes_back() {
        for bits in [0x7ff8_0000_0000_0001, (-0.0f64).to_bits(), 1, f64::MAX.to_bits(), 0.1f64.to_bits()] {
            assert_eq!(again(&f64::from_bits(bits)).to_bits(), bits);
        }
        assert_eq!(again(&(u64::MAX, i64::MIN)), (u64::MAX, i64::MIN));
        let vector = SVector::from([1.0, -0.1, 1e-300]);
        assert_eq!(again(&vector), vector);
    }

    #[test]
    fn collections_come_back_and_a_cut_is_seen_at_every_byte() {
        let map = BTreeMap::from([(3u32, vec!["a".to_owned(), String::new()]), (9, Vec::new())]);
        assert_eq!(again(&map), map);
        let deep = (Some(vec![[0.5f64, 2.0]]), BTreeSet::from([7u16, 8]));
        assert_eq!(again(&deep), deep);
        assert_eq!(again(&(None::<bool>, true)), (None, true));
        let boxed: Box<[f32]> = [1.5, 2.5].into();
        assert_eq!(again(&boxed), boxed);
    }

    #[test]
    fn a_number_of_items_that_cannot_be_is_refused_before_memory_is_taken() {
        let mut bytes = Vec::new();
        (u64::MAX, 1.0f64).keep(&mut bytes);
        let refused = KeptBytes::new(&bytes).read::<Vec<f64>>().unwrap_err();
        assert_eq!(refused.to_string(), "it names 18446744073709551615 items where 8 bytes are left");
        assert!(KeptBytes::new(&[2]).read::<bool>().is_err());
        assert!(KeptBytes::new(&[1, 0, 0, 0, 0, 0, 0, 0, 0xff]).read::<String>().is_err());
    }
}
