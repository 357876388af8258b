//! Numbers of a message in plain CDR, found by walking through all of it.

use super::path::Step;
use super::{Count, Definition, Kind, MOST_STEPS, Number, Path};
use crate::input::bag::cdr::{ENCODING, LONGEST_PADDING, Order, content};

/// Place of a number in a message that is not compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) struct Place {
    /// First byte, from the beginning of the message.
    at: usize,
    number: Number,
    order: Order,
}

impl Place {
    /// Writes a value, rounded and limited to the range of the number; `None` if the message is too short.
    pub(in super::super) fn write(self, value: f64, message: &mut [u8]) -> Option<()> {
        let rounded = value.round();
        let bits = match self.number {
            Number::Bool => u64::from(rounded != 0.0),
            Number::U8 => u64::from(rounded as u8),
            Number::U16 => u64::from(rounded as u16),
            Number::U32 => u64::from(rounded as u32),
            Number::U64 => rounded as u64,
            Number::I8 => u64::from((rounded as i8).cast_unsigned()),
            Number::I16 => u64::from((rounded as i16).cast_unsigned()),
            Number::I32 => u64::from((rounded as i32).cast_unsigned()),
            Number::I64 => (rounded as i64).cast_unsigned(),
            Number::F32 => u64::from((value as f32).to_bits()),
            Number::F64 => value.to_bits(),
        };
        let size = self.number.size();
        let mut bytes = bits.to_le_bytes();
        if self.order == Order::Big {
            bytes[..size].reverse();
        }
        let stored = message.get_mut(self.at..self.at + size)?;
        stored.copy_from_slice(&bytes[..size]);
        Some(())
    }
}

impl Definition {
    /// Numbers of a message at these paths; the error is half a sentence.
    pub(in super::super) fn values(
        &self,
        payload: &[u8],
        paths: &[&Path],
    ) -> Result<Vec<f64>, String> {
        let (found, _) = self.found(payload, paths, None)?;
        Ok(found.into_iter().map(|(_, value)| value).collect())
    }

    /// Places of the numbers of a message at these paths; the error is half a sentence.
    pub(in super::super) fn places(
        &self,
        payload: &[u8],
        paths: &[&Path],
    ) -> Result<Vec<Place>, String> {
        let (found, _) = self.found(payload, paths, None)?;
        Ok(found.into_iter().map(|(place, _)| place).collect())
    }

    /// Numbers of a message at these paths with their places, and the text at another, which is empty without a path;
    /// the error is half a sentence.
    pub(in super::super) fn found(
        &self,
        payload: &[u8],
        paths: &[&Path],
        text: Option<&Path>,
    ) -> Result<(Vec<(Place, f64)>, String), String> {
        let message = content(payload)?;
        let ways = paths.iter().copied().chain(text).map(|path| &path.0[..]);
        let wanted: Vec<(usize, &[Step])> = ways.enumerate().collect();
        let walk = |unit| {
            let mut walk = Walk {
                definition: self,
                order: message.order,
                content: &message.bytes,
                at: 0,
                steps: 0,
                unit,
                found: vec![None; paths.len()],
                text: String::new(),
            };
            walk.record(self.message, &wanted)?;
            if walk.content.len() - walk.at > LONGEST_PADDING {
                return Err(format!(
                    "{} bytes are more than its type has, {}",
                    walk.content.len(),
                    walk.at
                ));
            }
            Ok(walk)
        };
        let mut fields = self.records.iter().flatten();
        let walk = if fields.any(|field| field.kind == Kind::WideText) {
            let fitting = UNITS.into_iter().map(walk).find(Result::is_ok);
            fitting.unwrap_or_else(|| {
                Err("its wstrings have neither 1, 2 nor 4 bytes for each unit of length".to_owned())
            })?
        } else {
            walk(1)?
        };
        let found = walk.found.into_iter().map(|value| {
            value.ok_or_else(|| "it has fewer elements than the index says".to_owned())
        });
        Ok((found.collect::<Result<_, _>>()?, walk.text))
    }
}

/// Bytes for each unit of the length of a `wstring`. Implementations of DDS differ in the size of a character, and in
/// whether the length counts characters or bytes, which no field of the message says: the right one is that with which
/// the message is as long as its type.
const UNITS: [usize; 3] = [4, 2, 1];

struct Walk<'a> {
    definition: &'a Definition,
    order: Order,
    content: &'a [u8],
    at: usize,
    steps: usize,
    /// One of [`UNITS`].
    unit: usize,
    found: Vec<Option<(Place, f64)>>,
    text: String,
}

impl Walk<'_> {
    /// Walks through a record; `wanted` has the slots of numbers in it, and the rest of the ways to them.
    fn record(&mut self, record: usize, wanted: &[(usize, &[Step])]) -> Result<(), String> {
        let fields = &self.definition.records[record];
        self.steps += fields.len();
        if self.steps > MOST_STEPS {
            return Err(format!("it has more than {MOST_STEPS} fields"));
        }
        if fields.is_empty() {
            // An empty record has a byte, because IDL has none that are empty.
            return self.skip(1, 1);
        }
        for (index, field) in fields.iter().enumerate() {
            let of_field: Vec<_> = wanted
                .iter()
                .filter_map(|(slot, steps)| {
                    let (step, rest) = steps.split_first()?;
                    (step.field == index).then_some((*slot, step.element, rest))
                })
                .collect();
            let elements = match field.count {
                Count::One => 1,
                Count::Fixed(elements) => elements,
                Count::Sequence => self.number(Number::U32)? as u32,
            };
            match field.kind {
                Kind::Number(number) if of_field.is_empty() => {
                    self.skip(number.size(), elements as usize)?;
                }
                Kind::Number(number) => {
                    for element in 0..elements {
                        let value = self.number(number)?;
                        let place = Place {
                            at: ENCODING + self.at - number.size(),
                            number,
                            order: self.order,
                        };
                        for (slot, _, _) in of_field.iter().filter(|(_, at, _)| *at == element) {
                            self.found[*slot] = Some((place, value));
                        }
                    }
                }
                Kind::Text => {
                    for element in 0..elements {
                        let length = self.number(Number::U32)? as usize;
                        self.skip(1, length)?;
                        if of_field.iter().any(|(_, at, _)| *at == element) {
                            let text = &self.content[self.at - length..self.at];
                            let text = text.strip_suffix(&[0]).unwrap_or(text);
                            self.text = String::from_utf8_lossy(text).into_owned();
                        }
                    }
                }
                Kind::WideText => {
                    for _ in 0..elements {
                        let length = self.number(Number::U32)? as usize;
                        self.skip(1, length.checked_mul(self.unit).ok_or_else(too_short)?)?;
                    }
                }
                Kind::Record(record) => {
                    for element in 0..elements {
                        let within: Vec<_> = of_field
                            .iter()
                            .filter(|(_, at, _)| *at == element)
                            .map(|(slot, _, rest)| (*slot, *rest))
                            .collect();
                        let before = self.at;
                        self.record(record, &within)?;
                        if self.at == before {
                            break;
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// Advances over `count` values of `size` bytes.
    fn skip(&mut self, size: usize, count: usize) -> Result<(), String> {
        if count > 0 {
            self.at = self.at.next_multiple_of(size);
        }
        let end = size.checked_mul(count).and_then(|bytes| self.at.checked_add(bytes));
        let end = end.filter(|end| *end <= self.content.len()).ok_or_else(too_short)?;
        self.at = end;
        Ok(())
    }

    fn number(&mut self, number: Number) -> Result<f64, String> {
        let size = number.size();
        self.skip(size, 1)?;
        let stored = &self.content[self.at - size..self.at];
        let mut bytes = [0; 8];
        bytes[..size].copy_from_slice(stored);
        if self.order == Order::Big {
            bytes[..size].reverse();
        }
        let bits = u64::from_le_bytes(bytes);
        Ok(match number {
            Number::Bool | Number::U8 | Number::U16 | Number::U32 | Number::U64 => bits as f64,
            Number::I8 => f64::from(bits as i8),
            Number::I16 => f64::from(bits as i16),
            Number::I32 => f64::from(bits as i32),
            Number::I64 => bits.cast_signed() as f64,
            Number::F32 => f64::from(f32::from_bits(bits as u32)),
            Number::F64 => f64::from_bits(bits),
        })
    }
}

fn too_short() -> String {
    "it has fewer bytes than its type".to_owned()
}
