//! The seeds of the fuzzer's corpus: small datasets of all products from the program, meshes and texts from here and from
//! `jobs/` and `scenes/`.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use graspmill::{
    dataset::{DatasetReader, Manifest, Selection},
    record::Channel,
};

use crate::{
    products,
    targets::{MESHES, TABLES, parts},
};

const CORPUS: &str = "fuzz/corpus";

/// Writes them anew into `fuzz/corpus`.
pub fn write() {
    let program = env!("CARGO_BIN_EXE_graspmill");
    let place = tempfile::tempdir().expect("a folder");
    let root = std::env::current_dir().expect("a folder");
    for (name, job) in products::jobs(&root, place.path()) {
        let (file, out) = (place.path().join(format!("{name}.toml")), place.path().join(name));
        fs::write(&file, job).expect("a job");
        let mut command = Command::new(program);
        command.arg("run").arg(&file).arg("--out").arg(&out).args(["--progress", "none"]);
        assert!(command.status().expect("graspmill starts").success(), "{name}");
        let mut command = Command::new(program);
        assert!(command.args(["verify"]).arg(&out).status().expect("graspmill starts").success(), "{name}");
        dataset(name, &out);
    }
    for table in TABLES {
        let golden = Path::new("tests/golden/v1").join(table);
        if let Ok(bytes) = fs::read(golden) {
            table_seed("golden", table, &bytes);
        }
    }
    let set = br#"{"format_version":1,"name":"all","jobs":[{"name":"a","product":"completion"},{"name":"b","product":"grasps"}]}"#;
    table_seed("set", "set.json", set);
    texts();
    meshes();
}

fn dataset(name: &str, out: &Path) {
    let manifest = Manifest::read(out).expect("a manifest");
    for table in TABLES {
        if let Ok(bytes) = fs::read(out.join(table)) {
            table_seed(name, table, &bytes);
        }
    }
    save("index", name, &fs::read(out.join("index.parquet")).expect("an index"));
    for (kind, file) in ["field.mcap", "shapes.mcap"].into_iter().enumerate() {
        if let Ok(bytes) = fs::read(out.join(file)) {
            save("beside", name, &[&[kind as u8], &bytes[..]].concat());
            for (place, (_, payload)) in messages(&chunks(&bytes)).into_iter().enumerate() {
                let kind = Channel::ALL.len() + if kind == 0 { 0 } else { 1 + place.min(1) };
                save("records", &format!("{name}-{file}-{place}"), &[&[kind as u8], &payload[..]].concat());
            }
        }
    }
    let shard = fs::read(manifest.shard_path(out, 0)).expect("a shard");
    save("shard", name, &shard);
    // Channel k of the target is topic k of all, of a shard the k-th that it has.
    let stored = manifest.channels();
    let renumbered: Vec<u8> = (messages(&chunks(&shard)).into_iter())
        .take(2 * stored.len())
        .flat_map(|(head, payload)| {
            let id = u16::from_le_bytes([head[0], head[1]]) as usize;
            let place = Channel::ALL.iter().position(|channel| *channel == stored[id % stored.len()]).expect("known");
            let length = (head.len() + payload.len()) as u64;
            [&[5][..], &length.to_le_bytes(), &(place as u16).to_le_bytes(), &head[2..], &payload].concat()
        })
        .collect();
    save("shard_content", name, &parts(&attachment(&shard), &renumbered));
    let reader = DatasetReader::open(out).expect("a dataset");
    let sample = reader.iter(Selection::default()).next().expect("a sample").expect("readable");
    for channel in sample.channels() {
        let kind = Channel::ALL.iter().position(|known| *known == channel).expect("known") as u8;
        let payload = sample.payload(channel).expect("stored");
        save("records", &format!("{name}-{}", channel.name()), &[&[kind], payload].concat());
    }
}

/// What all chunks of an MCAP file hold.
fn chunks(file: &[u8]) -> Vec<u8> {
    let mut all = Vec::new();
    for (opcode, body) in records(&file[8..file.len() - 8]) {
        if opcode == 6 {
            let size = u64::from_le_bytes(body[16..24].try_into().expect("8 bytes")) as usize;
            let word = u32::from_le_bytes(body[28..32].try_into().expect("4 bytes")) as usize;
            all.extend(zstd::bulk::decompress(&body[32 + word + 8..], size).expect("zstd"));
        }
    }
    all
}

fn attachment(file: &[u8]) -> Vec<u8> {
    let body = records(&file[8..file.len() - 8]).into_iter().find(|(opcode, _)| *opcode == 9).expect("a ledger").1;
    let mut at = 16;
    for _ in 0..2 {
        at += 4 + u32::from_le_bytes(body[at..at + 4].try_into().expect("4 bytes")) as usize;
    }
    body[at + 8..body.len() - 4].to_vec()
}

/// Headers and payloads of messages.
fn messages(bytes: &[u8]) -> Vec<(Vec<u8>, Vec<u8>)> {
    let messages = records(bytes).into_iter().filter(|(opcode, _)| *opcode == 5);
    messages.map(|(_, body)| (body[..22].to_vec(), body[22..].to_vec())).collect()
}

fn records(mut bytes: &[u8]) -> Vec<(u8, Vec<u8>)> {
    let mut all = Vec::new();
    while let Some((head, rest)) = bytes.split_first_chunk::<9>() {
        let length = u64::from_le_bytes(head[1..].try_into().expect("8 bytes")) as usize;
        all.push((head[0], rest[..length].to_vec()));
        bytes = &rest[length..];
    }
    all
}

fn table_seed(name: &str, table: &str, bytes: &[u8]) {
    let place = TABLES.iter().position(|known| *known == table).expect("a table") as u8;
    save("tables", &format!("{name}-{table}"), &[&[place], bytes].concat());
}

fn texts() {
    for entry in fs::read_dir("jobs").expect("jobs") {
        let path = entry.expect("a job").path();
        if path.extension().is_some_and(|extension| extension == "toml") {
            let text = fs::read_to_string(&path).expect("text");
            // Neither comments nor other folders: see the target.
            let lines = text.lines().filter(|line| !line.starts_with('#'));
            let bare: String = lines.map(|line| line.replace("../scenes/", "").replace('/', "-") + "\n").collect();
            save("job", &stem(&path), bare.trim_start().as_bytes());
        }
    }
    let robot = "product = \"reachability\"\nseed = 3\n[robot]\nscene = \"robot.xml\"\njoints = [\"a\", \"b\"]\ntarget = \"tip\"\nfixed = { c = 0.5 }\n\
                 [poses]\nx = { from = 0.4, to = 0.8, step = 0.2 }\ny = { from = 0.0, to = 0.2, step = 0.2 }\nz = { from = 0.6, to = 1.0, step = 0.2 }\nroll = 2\npitch = 2\nyaw = 4\n";
    save("job", "robot", robot.as_bytes());
    let table = "[[objects]]\nfolder = \".\"\ntable = \"masses.csv\"\nunit = \"mm\"\n[views]\neven = 12\n";
    save("job", "table", table.as_bytes());
    for entry in fs::read_dir("scenes").expect("scenes") {
        let path = entry.expect("a scene").path();
        let target = if path.extension().is_some_and(|extension| extension == "toml") { "hand" } else { "description" };
        let bytes = fs::read(&path).expect("bytes");
        save(target, &stem(&path), &bytes[..bytes.len().min(8000)]);
    }
    let names = b"<mujoco model='x'><compiler meshdir='m' texturedir='t' strippath='true'/><!-- c --><include file='a.xml'/><asset><mesh file=\"b.stl\"/><hfield file='h.png'/><texture fileright='r.png'/></asset></mujoco>";
    save("description", "names", names);
    save("binvox", "two", b"#binvox 1\ndim 2 2 2\ntranslate 0 -1 2.5\nscale 0.1\ndata\n\x00\x03\x01\x05");
    save("binvox", "one", b"#binvox 1\ndim 1 1 1\ntranslate 0 0 0\nscale 1\ndata\n\x01\x01");
}

fn meshes() {
    let corners = [[0.0f32, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]];
    let faces = [[0usize, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    let number = |place: usize| corners[place].map(|x| x.to_string()).join(" ");
    let lines: String = (0..4).map(|corner| number(corner) + "\n").collect();
    let rows: String = faces.iter().map(|[a, b, c]| format!("3 {a} {b} {c}\n")).collect();
    let mut binary = vec![b' '; 80];
    binary.extend(4u32.to_le_bytes());
    for face in faces {
        binary.extend([0; 12]);
        binary.extend(face.iter().flat_map(|place| corners[*place]).flat_map(f32::to_le_bytes));
        binary.extend([0; 2]);
    }
    let facets: String = faces
        .iter()
        .map(|[a, b, c]| {
            let [a, b, c] = [a, b, c].map(|place| number(*place));
            format!("facet normal 0 0 0\nouter loop\nvertex {a}\nvertex {b}\nvertex {c}\nendloop\nendfacet\n")
        })
        .collect();
    let obj: String = (corners.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")))
        .chain(faces.iter().map(|[a, b, c]| format!("f {}/1/1 {}//2 {}\n", a + 1, b + 1, *c as i64 - 4)))
        .collect();
    let head = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n";
    let mut little = format!("ply\nformat binary_little_endian 1.0\ncomment c\n{head}").into_bytes();
    little.extend(corners.iter().flatten().flat_map(|x| x.to_le_bytes()));
    for face in faces {
        little.push(3);
        little.extend(face.iter().flat_map(|place| (*place as i32).to_le_bytes()));
    }
    let square = "OFF\n8 6 12\n0 0 0\n.1 0 0\n.1 .1 0\n0 .1 0\n0 0 .1\n.1 0 .1\n.1 .1 .1\n0 .1 .1\n4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n";
    let files: [(&str, &str, Vec<u8>); 8] = [
        ("stl", "binary", binary),
        ("stl", "text", format!("solid x\n{facets}endsolid x\n").into_bytes()),
        ("obj", "negative", obj.into_bytes()),
        ("obj", "polygon", b"v 0 0 0\nv .1 0 0\nv .1 .1 0\nv 0 .1 0\nv .05 .05 .1\nf 4 3 2 1\nf 1 2 5\nf 2 3 5\nf 3 4 \\\n5\nf 4 1 5\n".to_vec()),
        ("ply", "text", format!("ply\nformat ascii 1.0\n{head}{lines}{rows}").into_bytes()),
        ("ply", "little", little),
        ("off", "text", format!("OFF\n4 4 6\n{lines}{rows}").into_bytes()),
        ("off", "square", square.into()),
    ];
    for (ending, name, bytes) in files {
        let place = MESHES.iter().position(|known| *known == ending).expect("a format") as u8;
        save("mesh", &format!("{ending}-{name}"), &[&[place], &bytes[..]].concat());
    }
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn save(target: &str, name: &str, bytes: &[u8]) {
    let folder = PathBuf::from(CORPUS).join(target);
    fs::create_dir_all(&folder).expect("a folder");
    fs::write(folder.join(format!("seed-{name}")), bytes).expect("a seed");
}
