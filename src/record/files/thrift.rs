//! The compact protocol of Apache Thrift, as far as the footer of a Parquet file needs it: structs of numbers, texts, lists and structs.

use crate::kept;

/// Types of fields and of entries.
#[derive(Clone, Copy)]
enum Kind {
    I32 = 5,
    I64 = 6,
    Binary = 8,
    List = 9,
    Struct = 12,
}

/// A struct on its way into bytes. Fields are added in the order of their numbers.
#[derive(Default)]
pub(super) struct Struct {
    bytes: Vec<u8>,
    last: i16,
}

kept! { struct Struct { bytes, last } }

impl Struct {
    /// A field that is a whole number of 32 bits.
    pub(super) fn i32(self, field: i16, value: i32) -> Self {
        self.add(field, Kind::I32, &varint(zigzag(value.into())))
    }

    /// A field that is a whole number of 64 bits.
    pub(super) fn i64(self, field: i16, value: i64) -> Self {
        self.add(field, Kind::I64, &varint(zigzag(value)))
    }

    /// A field that is a text.
    pub(super) fn text(self, field: i16, value: &str) -> Self {
        self.add(field, Kind::Binary, &text(value))
    }

    /// A field that is a struct.
    pub(super) fn inner(self, field: i16, value: Struct) -> Self {
        self.add(field, Kind::Struct, &value.finish())
    }

    /// A field that is a list of structs.
    pub(super) fn structs(self, field: i16, entries: impl ExactSizeIterator<Item = Struct>) -> Self {
        let head = list_head(Kind::Struct, entries.len());
        let bytes = entries.fold(head, |bytes, entry| [bytes, entry.finish()].concat());
        self.add(field, Kind::List, &bytes)
    }

    /// A field that is a list of whole numbers of 32 bits.
    pub(super) fn numbers(self, field: i16, entries: &[i32]) -> Self {
        let head = list_head(Kind::I32, entries.len());
        let bytes = entries.iter().fold(head, |bytes, entry| [bytes, varint(zigzag((*entry).into()))].concat());
        self.add(field, Kind::List, &bytes)
    }

    /// A field that is a list of one text.
    pub(super) fn one_text(self, field: i16, entry: &str) -> Self {
        self.add(field, Kind::List, &[list_head(Kind::Binary, 1), text(entry)].concat())
    }

    /// The bytes of the struct with its end.
    pub(super) fn finish(mut self) -> Vec<u8> {
        self.bytes.push(0);
        self.bytes
    }

    fn add(mut self, field: i16, kind: Kind, value: &[u8]) -> Self {
        match field - self.last {
            step @ 1..=15 => self.bytes.push((step as u8) << 4 | kind as u8),
            _ => {
                self.bytes.push(kind as u8);
                self.bytes.extend(varint(zigzag(field.into())));
            }
        }
        self.last = field;
        self.bytes.extend_from_slice(value);
        self
    }
}

/// A number of any size, seven bits a byte, the lowest first.
pub(super) fn varint(mut value: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
    bytes
}

fn zigzag(value: i64) -> u64 {
    ((value << 1) ^ (value >> 63)) as u64
}

fn text(value: &str) -> Vec<u8> {
    [varint(value.len() as u64), value.as_bytes().to_vec()].concat()
}

fn list_head(kind: Kind, count: usize) -> Vec<u8> {
    match count {
        0..=14 => vec![(count as u8) << 4 | kind as u8],
        _ => [vec![0xf0 | kind as u8], varint(count as u64)].concat(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The examples of the specification (thrift-compact-protocol.md).
    #[test]
    fn numbers_are_zigzag_varints() {
        assert_eq!(varint(50_399), [0xdf, 0x89, 0x03]);
        assert_eq!([0, -1, 1, -2, 2, i64::MAX, i64::MIN].map(zigzag), [0, 1, 2, 3, 4, u64::MAX - 1, u64::MAX]);
    }

    #[test]
    fn a_struct_has_short_heads_for_near_fields_long_ones_for_far_ones_and_an_end() {
        let bytes = Struct::default().i32(1, 1).text(4, "ab").i64(20, -1).finish();
        assert_eq!(bytes, [0x15, 2, 0x38, 2, b'a', b'b', 0x06, 40, 1, 0]);
        let list = Struct::default().numbers(1, &[0; 15]).structs(2, [Struct::default()].into_iter()).finish();
        assert_eq!(list[..3], [0x19, 0xf5, 15]);
        assert_eq!(list[18..], [0x19, 0x1c, 0, 0]);
    }
}
