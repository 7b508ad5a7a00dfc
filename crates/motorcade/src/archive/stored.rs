//! Values as bytes that come back with the same bits.

use std::io::{self, Read};

use motorcade_geometry::Pose;
use nalgebra::{Isometry3, Point2, Quaternion, SMatrix, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Entries of a list that room is made for before they are read.
const MOST_RESERVED: usize = 1 << 16;

/// A value that is written to a file of this process and read back with the same bits.
pub(crate) trait Stored: Sized {
    /// Appends the bytes.
    fn write(&self, out: &mut Vec<u8>);
    /// Reads what [`write`](Self::write) appended.
    ///
    /// # Errors
    /// Bytes that are missing or of no such value.
    fn read(from: &mut impl Read) -> io::Result<Self>;
}

/// Values in order, as bytes that serde takes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct StoredList {
    count: usize,
    bytes: Vec<u8>,
}

impl StoredList {
    /// Of these values.
    pub(crate) fn of<T: Stored>(items: &[T]) -> Self {
        let mut bytes = Vec::new();
        items.iter().for_each(|item| item.write(&mut bytes));
        Self { count: items.len(), bytes }
    }

    /// Number of values.
    pub(crate) fn len(&self) -> usize {
        self.count
    }

    /// The values.
    ///
    /// # Errors
    /// Bytes that are missing, left over or of no such value.
    pub(crate) fn items<T: Stored>(&self) -> io::Result<Vec<T>> {
        let mut from = self.bytes.as_slice();
        let mut items = Vec::with_capacity(self.count.min(MOST_RESERVED).min(self.bytes.len()));
        for _ in 0..self.count {
            items.push(T::read(&mut from)?);
        }
        if from.is_empty() { Ok(items) } else { Err(no_such("list of this length")) }
    }
}

/// A struct by all its fields, in this order: a field that is not named does not compile.
macro_rules! stored_struct {
    ($name:ty { $($field:ident),* $(,)? }) => {
        impl Stored for $name {
            fn write(&self, out: &mut Vec<u8>) {
                let Self { $($field),* } = self;
                $(Stored::write($field, out);)*
            }
            fn read(from: &mut impl Read) -> io::Result<Self> {
                Ok(Self { $($field: Stored::read(from)?),* })
            }
        }
    };
}

/// An enumeration without data, a byte each: a variant that is not named does not compile.
macro_rules! stored_enum {
    ($name:ty { $($variant:ident = $code:literal),* $(,)? }) => {
        impl Stored for $name {
            fn write(&self, out: &mut Vec<u8>) {
                out.push(match self { $(Self::$variant => $code),* });
            }
            fn read(from: &mut impl Read) -> io::Result<Self> {
                match u8::read(from)? {
                    $($code => Ok(Self::$variant),)*
                    _ => Err(no_such(stringify!($name))),
                }
            }
        }
    };
}

pub(super) use {stored_enum, stored_struct};

/// Bytes of no value of this kind.
pub(super) fn no_such(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, format!("no {what}"))
}

macro_rules! stored_number {
    ($($number:ty),*) => {$(
        impl Stored for $number {
            fn write(&self, out: &mut Vec<u8>) {
                out.extend_from_slice(&self.to_le_bytes());
            }
            fn read(from: &mut impl Read) -> io::Result<Self> {
                let mut bytes = [0; size_of::<$number>()];
                from.read_exact(&mut bytes)?;
                Ok(Self::from_le_bytes(bytes))
            }
        }
    )*};
}

stored_number!(u8, u32, u64, i64, f32, f64);

impl Stored for usize {
    fn write(&self, out: &mut Vec<u8>) {
        (*self as u64).write(out);
    }
    fn read(from: &mut impl Read) -> io::Result<Self> {
        Self::try_from(u64::read(from)?).map_err(|_| no_such("index"))
    }
}

impl Stored for bool {
    fn write(&self, out: &mut Vec<u8>) {
        u8::from(*self).write(out);
    }
    fn read(from: &mut impl Read) -> io::Result<Self> {
        Ok(u8::read(from)? != 0)
    }
}

impl<T: Stored> Stored for Option<T> {
    fn write(&self, out: &mut Vec<u8>) {
        self.is_some().write(out);
        self.iter().for_each(|value| value.write(out));
    }
    fn read(from: &mut impl Read) -> io::Result<Self> {
        bool::read(from)?.then(|| T::read(from)).transpose()
    }
}

impl<T: Stored> Stored for Vec<T> {
    fn write(&self, out: &mut Vec<u8>) {
        self.len().write(out);
        self.iter().for_each(|value| value.write(out));
    }
    fn read(from: &mut impl Read) -> io::Result<Self> {
        let count = usize::read(from)?;
        let mut values = Self::with_capacity(count.min(MOST_RESERVED));
        for _ in 0..count {
            values.push(T::read(from)?);
        }
        Ok(values)
    }
}

impl<T: Stored + Copy + Default, const N: usize> Stored for [T; N] {
    fn write(&self, out: &mut Vec<u8>) {
        self.iter().for_each(|value| value.write(out));
    }
    fn read(from: &mut impl Read) -> io::Result<Self> {
        let mut values = [T::default(); N];
        for value in &mut values {
            *value = T::read(from)?;
        }
        Ok(values)
    }
}

impl<A: Stored, B: Stored> Stored for (A, B) {
    fn write(&self, out: &mut Vec<u8>) {
        self.0.write(out);
        self.1.write(out);
    }
    fn read(from: &mut impl Read) -> io::Result<Self> {
        Ok((A::read(from)?, B::read(from)?))
    }
}

impl<const R: usize, const C: usize> Stored for SMatrix<f64, R, C> {
    fn write(&self, out: &mut Vec<u8>) {
        self.iter().for_each(|value| value.write(out));
    }
    fn read(from: &mut impl Read) -> io::Result<Self> {
        let mut matrix = Self::zeros();
        for value in matrix.iter_mut() {
            *value = f64::read(from)?;
        }
        Ok(matrix)
    }
}

impl Stored for Point2<f64> {
    fn write(&self, out: &mut Vec<u8>) {
        self.coords.write(out);
    }
    fn read(from: &mut impl Read) -> io::Result<Self> {
        Stored::read(from).map(|coords| Self { coords })
    }
}

impl<To, From> Stored for Pose<To, From> {
    fn write(&self, out: &mut Vec<u8>) {
        let (t, q) = (self.translation(), self.rotation());
        [t.x, t.y, t.z, q.i, q.j, q.k, q.w].write(out);
    }
    fn read(from: &mut impl Read) -> io::Result<Self> {
        let [x, y, z, i, j, k, w] = Stored::read(from)?;
        // The quaternion is a unit one already; another rounding would change its bits.
        let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k));
        Ok(Self::new(Isometry3::from_parts(Translation3::from(Vector3::new(x, y, z)), rotation)))
    }
}
