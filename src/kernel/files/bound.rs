//! Largest size of the files of each kind.

/// Largest size of the files of a kind. A file above it is refused before it is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bound {
    /// The kind, with its article: `a job file`.
    pub kind: &'static str,
    /// Largest size [bytes].
    pub bytes: u64,
}

const KIB: u64 = 1 << 10;
const MIB: u64 = 1 << 20;

impl Bound {
    /// Job files and sets, also as stored in datasets: a hundred thousand meshes with separate settings.
    pub const JOB: Self = Self { kind: "a job file", bytes: 64 * MIB };
    /// Tables of comma-separated values that jobs name: settings of meshes, poses of cameras, arrangements.
    pub const CSV: Self = Self { kind: "a CSV table", bytes: 128 * MIB };
    /// Arrangements in the format of BOP.
    pub const BOP: Self = Self { kind: "a JSON file of BOP", bytes: 256 * MIB };
    /// About files of releases.
    pub const ABOUT: Self = Self { kind: "an about file", bytes: MIB };
    /// Tables that describe a hand.
    pub const HAND_TABLE: Self = Self { kind: "a hand's table", bytes: MIB };
    /// Descriptions of robots, hands and scenes, each of their files.
    pub const DESCRIPTION: Self = Self { kind: "an MJCF file", bytes: 16 * MIB };
    /// `package.xml` of a ROS package.
    pub const PACKAGE: Self = Self { kind: "a package.xml", bytes: MIB };
    /// Meshes, height fields and textures that descriptions name.
    pub const DESCRIPTION_DATA: Self = Self { kind: "a mesh or picture of a description", bytes: 1024 * MIB };
    /// Mesh files: about 21 million triangles of a binary STL.
    pub const MESH: Self = Self { kind: "a mesh file", bytes: 1024 * MIB };
    /// Depth pictures and organised clouds.
    pub const PICTURE: Self = Self { kind: "a depth picture", bytes: 1024 * MIB };
    /// Masks of pictures.
    pub const MASK: Self = Self { kind: "a mask", bytes: 256 * MIB };
    /// Descriptions of cameras.
    pub const CAMERA: Self = Self { kind: "a camera file", bytes: MIB };
    /// Contacts that a completion is given.
    pub const CONTACTS: Self = Self { kind: "a file of contacts", bytes: 16 * MIB };
    /// Poses to query a map at.
    pub const POSES: Self = Self { kind: "a file of poses", bytes: 256 * MIB };
    /// `model.json` of a network.
    pub const MODEL_TABLE: Self = Self { kind: "a network's model.json", bytes: MIB };
    /// Cards of networks.
    pub const MODEL_TEXT: Self = Self { kind: "a network's card", bytes: MIB };
    /// Networks: a message of protobuf has less than 2 GiB.
    pub const NETWORK: Self = Self { kind: "a network", bytes: 2047 * MIB };
    /// The other files of a network: reference output and recipes.
    pub const MODEL_DATA: Self = Self { kind: "a file of a network", bytes: 64 * MIB };
    /// `run.json` of a dataset.
    pub const RUN: Self = Self { kind: "a run.json", bytes: 64 * KIB };
    /// `manifest.json` of a dataset: a million shards.
    pub const MANIFEST: Self = Self { kind: "a manifest.json", bytes: 256 * MIB };
    /// Tables of a dataset or set next to the manifest: objects, splits, refused meshes.
    pub const DATASET_TABLE: Self = Self { kind: "a table of a dataset", bytes: 256 * MIB };
    /// A line of `rejects.jsonl`.
    pub const REJECTS_LINE: Self = Self { kind: "a line of rejects.jsonl", bytes: MIB };
    /// Notes of a run about itself.
    pub const NOTES: Self = Self { kind: "a notes.json", bytes: MIB };
    /// Documents of a release, and its list of digests: a line or more per file.
    pub const RELEASE_TEXT: Self = Self { kind: "a document of a release", bytes: 256 * MIB };
    /// Outcomes of a replay in plain MuJoCo.
    pub const REPLAY: Self = Self { kind: "an agreement.json", bytes: 64 * MIB };
    /// Records of what `submit` sent.
    pub const SUBMISSION: Self = Self { kind: "a submit.json", bytes: MIB };

    /// Covers of reports.
    pub const COVER: Self = Self { kind: "a cover of a report", bytes: 16 * MIB };

    /// Every bound.
    pub const ALL: [Self; 28] = [
        Self::JOB,
        Self::CSV,
        Self::BOP,
        Self::ABOUT,
        Self::HAND_TABLE,
        Self::DESCRIPTION,
        Self::DESCRIPTION_DATA,
        Self::PACKAGE,
        Self::MESH,
        Self::PICTURE,
        Self::MASK,
        Self::CAMERA,
        Self::CONTACTS,
        Self::POSES,
        Self::MODEL_TABLE,
        Self::MODEL_TEXT,
        Self::NETWORK,
        Self::MODEL_DATA,
        Self::RUN,
        Self::MANIFEST,
        Self::DATASET_TABLE,
        Self::REJECTS_LINE,
        Self::NOTES,
        Self::RELEASE_TEXT,
        Self::REPLAY,
        Self::SUBMISSION,
        Self::CHUNK,
        Self::COVER,
    ];
    /// Summary, ledger or chunk of a shard, before it is unpacked.
    pub const CHUNK: Self = Self { kind: "a part of a shard", bytes: 1024 * MIB };
}
