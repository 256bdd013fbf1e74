//! Names of things: digests and the typed ids built on them.

use std::fmt;

/// A BLAKE3 digest (32 bytes).
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Digest(pub [u8; 32]);

impl Digest {
    /// Digest of `bytes`.
    pub fn of(bytes: &[u8]) -> Self {
        Self(*blake3::hash(bytes).as_bytes())
    }

    /// Digest of several byte strings, each prefixed by its length so that no two lists collide.
    pub fn of_parts<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> Self {
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

/// What a dataset holds.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "factory", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Product {
    /// Pairs of grids: what one camera saw of an object, and the solid object.
    Completion,
    /// Which poses of a grid a robot's end effector reaches without a collision.
    Reachability,
    /// How a hand can hold an object.
    Grasps,
    /// What a camera sees around the palm and the fingertips of grasps.
    Patches,
}

impl Product {
    /// Every product.
    pub const ALL: [Self; 4] = [Self::Completion, Self::Reachability, Self::Grasps, Self::Patches];

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Completion => "completion",
            Self::Reachability => "reachability",
            Self::Grasps => "grasps",
            Self::Patches => "patches",
        }
    }

    /// The product of a name; `None` for any other text.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|product| product.name() == name)
    }
}

impl fmt::Display for Product {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

digest_id! {
    /// A subject by content: the digest of an object's prepared mesh (metres, repaired), or of the description of a robot or
    /// a hand, whatever file it came from.
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
    /// Place of a view in the job's view set.
    ViewId(u32)
}
number_id! {
    /// Place of a shard in the plan.
    ShardId(u32)
}
number_id! {
    /// Place of a work unit (a run of views of one object inside one shard) in the plan.
    UnitId(u32)
}
number_id! {
    /// Place of a sample in the plan, kept or rejected; the `log_time` of its messages.
    SampleIndex(u64)
}

/// What a sample is, wherever it stands: independent of the other objects, of shards and of order.
///
/// For a lone object the subject is the object and `instance` and `camera` are 0, so that scenes of several
/// objects and several cameras fit the same records later.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct SampleId {
    /// The object, or later the scene, by content.
    pub subject: ObjectId,
    /// Which body of the subject.
    pub instance: u32,
    /// Which view.
    pub view: ViewId,
    /// Which camera.
    pub camera: u32,
}

impl SampleId {
    /// A view of a lone object.
    pub fn of_object(subject: ObjectId, view: ViewId) -> Self {
        Self { subject, instance: 0, view, camera: 0 }
    }

    /// Fixed-length form for digests, sorting as the id sorts.
    pub fn to_bytes(&self) -> [u8; 44] {
        let mut bytes = [0; 44];
        bytes[..32].copy_from_slice(&self.subject.0.0);
        bytes[32..36].copy_from_slice(&self.instance.to_be_bytes());
        bytes[36..40].copy_from_slice(&self.view.0.to_be_bytes());
        bytes[40..].copy_from_slice(&self.camera.to_be_bytes());
        bytes
    }
}

impl fmt::Display for SampleId {
    /// `<first 16 hex digits of the subject>.<instance>.<view>.<camera>`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}.{}.{}", self.subject.0.short(), self.instance, self.view, self.camera)
    }
}
/// Ascending numbers as schedulers write arrays: `3,17-19`.
pub fn ranges(numbers: &[u32]) -> String {
    let mut runs: Vec<(u32, u32)> = Vec::new();
    for number in numbers {
        match runs.last_mut() {
            Some((_, last)) if last.checked_add(1) == Some(*number) => *last = *number,
            _ => runs.push((*number, *number)),
        }
    }
    let words = |(first, last): &(u32, u32)| if first == last { first.to_string() } else { format!("{first}-{last}") };
    runs.iter().map(words).collect::<Vec<_>>().join(",")
}
