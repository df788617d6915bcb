//! Arrays whose length is a parameter, for serde, which knows only those of a length that is written down.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

pub(crate) fn serialize<T: Serialize, S: Serializer, const N: usize>(
    array: &[T; N],
    to: S,
) -> Result<S::Ok, S::Error> {
    array.as_slice().serialize(to)
}

pub(crate) fn deserialize<'de, T: Deserialize<'de>, D: Deserializer<'de>, const N: usize>(
    from: D,
) -> Result<[T; N], D::Error> {
    let members = Vec::<T>::deserialize(from)?;
    let found = members.len();
    members.try_into().map_err(|_| D::Error::custom(format!("expected {N} members, found {found}")))
}
