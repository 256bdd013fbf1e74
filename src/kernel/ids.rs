//! Names of things: digests and the typed ids built on them.

use std::{
    fmt,
    io::{self, Read},
};

/// A BLAKE3 digest (32 bytes).
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Digest(pub [u8; 32]);

impl Digest {
    /// Digest of `bytes`.
    pub fn hash(bytes: &[u8]) -> Self {
        Self(*blake3::hash(bytes).as_bytes())
    }

    /// Digest and size of the bytes of a reader, one piece in memory at a time.
    ///
    /// # Errors
    /// An error of the reader.
    pub fn hash_reader(mut reader: impl Read) -> io::Result<(Self, u64)> {
        let (mut hasher, mut buffer, mut bytes) = (blake3::Hasher::new(), vec![0; 256 << 10], 0);
        loop {
            let read = match reader.read(&mut buffer) {
                Ok(0) => return Ok((Self(*hasher.finalize().as_bytes()), bytes)),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                read => read?,
            };
            hasher.update(&buffer[..read]);
            bytes += read as u64;
        }
    }

    /// Digest of several byte strings, each prefixed by its length so that no two lists collide.
    pub fn hash_parts<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> Self {
        let mut hasher = blake3::Hasher::new();
        for part in parts {
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part);
        }
        Self(*hasher.finalize().as_bytes())
    }

    /// All 64 hexadecimal digits.
    pub fn hex(&self) -> String {
        self.0.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// The first 16 hexadecimal digits, for people and file names.
    pub fn short(&self) -> String {
        self.hex()[..16].to_owned()
    }

    /// Reads 64 hexadecimal digits, lower-case; `None` for anything else, so that a digest has one spelling.
    pub fn from_hex(text: &str) -> Option<Self> {
        if text.len() != 64 || !text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f')) {
            return None;
        }
        let mut bytes = [0; 32];
        for (byte, pair) in bytes.iter_mut().zip(text.as_bytes().chunks_exact(2)) {
            *byte = u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok()?;
        }
        Some(Self(bytes))
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.hex())
    }
}

impl fmt::Debug for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.short())
    }
}

impl serde::Serialize for Digest {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.hex())
    }
}

impl<'de> serde::Deserialize<'de> for Digest {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        Self::from_hex(&text)
            .ok_or_else(|| serde::de::Error::custom(format!("'{text}' is no digest of 64 hexadecimal digits")))
    }
}

macro_rules! digest_id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
        #[serde(transparent)]
        pub struct $name(pub Digest);

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }

        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, concat!(stringify!($name), "({:?})"), self.0)
            }
        }
    };
}

digest_id! {
    /// A subject by content: the digest of an object's prepared mesh (metres, repaired), or of the description of a
    /// robot or a hand, independent of its file.
    ObjectId
}
digest_id! {
    /// A resolved job without paths, threads, shards or clock.
    JobDigest
}

macro_rules! number_id {
    ($(#[$doc:meta])* $name:ident($type:ty)) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
        pub struct $name(pub $type);

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }
    };
}

number_id! {
    /// Number of an item of a subject: a view, a position, a search run or a grasp, by product.
    ItemId(u32)
}
number_id! {
    /// Index of a shard in the plan.
    ShardId(u32)
}
number_id! {
    /// Index of a work unit (consecutive items of one subject inside one shard) in the plan.
    UnitId(u32)
}
number_id! {
    /// Index of a sample in the plan, kept or rejected; the `log_time` of its messages.
    SampleIndex(u64)
}

/// Identity of a sample: independent of the other subjects, of shards and of order.
///
/// The subject of a lone object's sample is the object, its instance and camera are 0. The subject of a scene's sample is
/// the settled scene; instance 0 is the scene as a whole, 1 and up are its bodies.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct SampleId {
    /// The object, robot or scene, by content.
    pub subject: ObjectId,
    /// Number of the item.
    pub item: ItemId,
    /// Body of the subject.
    pub instance: u32,
    /// Number of the camera.
    pub camera: u32,
}

impl SampleId {
    /// Sample of a lone object or robot.
    pub fn of_object(subject: ObjectId, item: ItemId) -> Self {
        Self { subject, item, instance: 0, camera: 0 }
    }

    /// Fixed-length form for digests and random streams: subject, instance, item, camera, big-endian.
    pub fn to_bytes(&self) -> [u8; 44] {
        let mut bytes = [0; 44];
        bytes[..32].copy_from_slice(&self.subject.0.0);
        bytes[32..36].copy_from_slice(&self.instance.to_be_bytes());
        bytes[36..40].copy_from_slice(&self.item.0.to_be_bytes());
        bytes[40..].copy_from_slice(&self.camera.to_be_bytes());
        bytes
    }
}

impl fmt::Display for SampleId {
    /// `<first 16 hex digits of the subject>.<item>.<instance>.<camera>`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}.{}.{}", self.subject.0.short(), self.item, self.instance, self.camera)
    }
}
