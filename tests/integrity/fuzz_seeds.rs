//! The seeds of the fuzzer's corpus: small datasets of all products from the program, meshes and texts from here and from
//! `jobs/` and `scenes/`.

use std::{fs, path::Path};

use graspmill::{
    files::Folder,
    format::dataset::{DatasetReader, Manifest, Selection},
};

use super::targets::{ARRANGEMENTS, CAMERAS, MESHES, MODELS, PICTURES, TABLES, channels, parts};
use crate::support::{
    files::{list_names, read_text, repository_path, stem},
    jobs::make_small_datasets,
    program::Program,
    workspace::Workspace,
};

/// Writes the seeds into `fuzz/corpus`.
pub fn write() {
    let workspace = Workspace::new();
    for (name, out) in make_small_datasets(&workspace) {
        Program::on("verify", &out).succeed();
        dataset(name, &out);
    }
    for table in TABLES {
        let golden = Path::new("tests/golden/v4").join(table);
        if let Ok(bytes) = fs::read(golden) {
            table_seed("golden", table, &bytes);
        }
    }
    let set = br#"{"format_version":4,"name":"all","jobs":[{"name":"a","product":"completion"},{"name":"b","product":"grasps"}]}"#;
    table_seed("set", "set.json", set);
    texts();
    meshes();
    arrangements();
    pictures();
    cameras();
    for name in MODELS {
        let bytes = fs::read(repository_path("tests/models/thicken").join(name)).expect("a file of the small model");
        save_kind("model", &MODELS, name, name, &bytes);
    }
}

fn dataset(name: &str, out: &Path) {
    let manifest = Manifest::read(&Folder::at(out)).expect("a manifest");
    for table in TABLES {
        if let Ok(bytes) = fs::read(out.join(table)) {
            table_seed(name, table, &bytes);
        }
    }
    for (kind, file) in ["field.mcap", "shapes.mcap"].into_iter().enumerate() {
        if let Ok(bytes) = fs::read(out.join(file)) {
            save("beside", name, &[&[kind as u8], &bytes[..]].concat());
            for (index, (_, payload)) in messages(&chunks(&bytes)).into_iter().enumerate() {
                let kind = channels().count() + if kind == 0 { 0 } else { 1 + index.min(1) };
                save("records", &format!("{name}-{file}-{index}"), &[&[kind as u8], &payload[..]].concat());
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
            let topic = channels().position(|channel| channel == stored[id % stored.len()]).expect("known");
            let length = (head.len() + payload.len()) as u64;
            [&[5][..], &length.to_le_bytes(), &(topic as u16).to_le_bytes(), &head[2..], &payload].concat()
        })
        .collect();
    save("shard_content", name, &parts(attachments(&shard).each_ref().map(Vec::as_slice), &renumbered));
    let reader = DatasetReader::open(&Folder::at(out)).expect("a dataset");
    let sample = reader.iter(Selection::default()).next().expect("a sample").expect("readable");
    for channel in sample.channels() {
        let kind = channels().position(|known| known == channel).expect("known") as u8;
        let payload = sample.payload(channel).expect("stored");
        save("records", &format!("{name}-{}", channel.name()), &[&[kind], payload].concat());
    }
}

/// The content of all chunks of an MCAP file.
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

/// The attachments of a shard's ledger.
fn attachments(file: &[u8]) -> [Vec<u8>; 3] {
    let attached = records(&file[8..file.len() - 8]).into_iter().filter(|(opcode, _)| *opcode == 9);
    let data = attached.map(|(_, body)| {
        let mut at = 16;
        for _ in 0..2 {
            at += 4 + u32::from_le_bytes(body[at..at + 4].try_into().expect("4 bytes")) as usize;
        }
        body[at + 8..body.len() - 4].to_vec()
    });
    data.collect::<Vec<_>>().try_into().expect("three attachments")
}

/// Headers and payloads of messages.
fn messages(bytes: &[u8]) -> Vec<(Vec<u8>, Vec<u8>)> {
    let messages = records(bytes).into_iter().filter(|(opcode, _)| *opcode == 5);
    messages.map(|(_, body)| (body[..22].to_vec(), body[22..].to_vec())).collect()
}

/// Opcodes and bodies of records.
pub fn records(mut bytes: &[u8]) -> Vec<(u8, Vec<u8>)> {
    let mut all = Vec::new();
    while let Some((head, rest)) = bytes.split_first_chunk::<9>() {
        let length = u64::from_le_bytes(head[1..].try_into().expect("8 bytes")) as usize;
        all.push((head[0], rest[..length].to_vec()));
        bytes = &rest[length..];
    }
    all
}

fn table_seed(name: &str, table: &str, bytes: &[u8]) {
    save_kind("tables", &TABLES, table, &format!("{name}-{table}"), bytes);
}

fn texts() {
    for name in list_names("jobs") {
        let path = Path::new("jobs").join(name);
        if path.extension().is_some_and(|extension| extension == "toml") {
            let text = read_text(&path);
            // Neither comments nor other folders: see the target.
            let lines = text.lines().filter(|line| !line.starts_with('#'));
            let bare: String = lines.map(|line| line.replace("../scenes/", "").replace('/', "-") + "\n").collect();
            save("job", &stem(&path), bare.trim_start().as_bytes());
        }
    }
    let robot = "product = \"reachability\"\nseed = 3\n[robot]\nmodel = \"robot.xml\"\njoints = [\"a\", \"b\"]\ntarget = \"tip\"\nfixed = { c = 0.5 }\n\
                 [poses]\nx = { from = 0.4, to = 0.8, step = 0.2 }\ny = { from = 0.0, to = 0.2, step = 0.2 }\nz = { from = 0.6, to = 1.0, step = 0.2 }\nroll = 2\npitch = 2\nyaw = 4\n";
    save("job", "robot", robot.as_bytes());
    let table = "[[objects]]\nfolder = \".\"\ntable = \"masses.csv\"\nunit = \"mm\"\n[views]\neven = 12\n";
    save("job", "table", table.as_bytes());
    for name in list_names("scenes") {
        let path = Path::new("scenes").join(name);
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
    let number = |corner: usize| corners[corner].map(|x| x.to_string()).join(" ");
    let lines: String = (0..4).map(|corner| number(corner) + "\n").collect();
    let rows: String = faces.iter().map(|[a, b, c]| format!("3 {a} {b} {c}\n")).collect();
    let mut binary = vec![b' '; 80];
    binary.extend(4u32.to_le_bytes());
    for face in faces {
        binary.extend([0; 12]);
        binary.extend(face.iter().flat_map(|corner| corners[*corner]).flat_map(f32::to_le_bytes));
        binary.extend([0; 2]);
    }
    let facets: String = faces
        .iter()
        .map(|[a, b, c]| {
            let [a, b, c] = [a, b, c].map(|corner| number(*corner));
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
        little.extend(face.iter().flat_map(|corner| (*corner as i32).to_le_bytes()));
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
        save_kind("mesh", &MESHES, ending, &format!("{ending}-{name}"), &bytes);
    }
}

fn arrangements() {
    let turned = r#"{"3":[{"obj_id":1,"cam_R_m2c":[0,-1,0,1,0,0,0,0,1],"cam_t_m2c":[10,-20,700]}],"1":[]}"#;
    let camera = r#"{"3":{"cam_K":[600,0,320,0,600,240,0,0,1],"depth_scale":0.1,"cam_R_w2c":[1,0,0,0,-1,0,0,0,-1],"cam_t_w2c":[0,0,900]},"1":{}}"#;
    let poses = "scene,object,x,y,z,qx,qy,qz,qw\na,can-01,1.0,2.0,0.3,0,0,0,1\nb,\"box-01\",1.25,2.0,0.1,0,0,0.6,0.8\n";
    for (name, text) in ARRANGEMENTS.into_iter().zip([turned, camera, poses]) {
        save_kind("arrangement", &ARRANGEMENTS, name, name, text.as_bytes());
    }
}

/// Depths of 11 x 7 px, in every kind of file.
fn pictures() {
    let (width, height) = (11u32, 7u32);
    let depths: Vec<f32> = (0..width * height).map(|pixel| (700 + 13 * (pixel % 17)) as f32 * 0.001).collect();
    let points: Vec<[f32; 3]> = (0u32..)
        .zip(&depths)
        .map(|(pixel, depth)| {
            let (column, row) = ((pixel % width) as f32 + 0.5, (pixel / width) as f32 + 0.5);
            [(column - 5.2) / 20.0 * depth, (row - 3.9) / 21.0 * depth, *depth]
        })
        .collect();
    let floats = |values: &[f32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<_>>();
    let save = |name: &str, seed: &str, bytes: &[u8]| save_kind("picture", &PICTURES, name, seed, bytes);
    let png = |depth: png::BitDepth, data: &[u8]| {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(depth);
        encoder.write_header().and_then(|mut writer| writer.write_image_data(data)).expect("an image");
        bytes
    };
    let millimetres = depths.iter().flat_map(|depth| ((depth * 1000.0) as u16).to_be_bytes()).collect::<Vec<_>>();
    save("picture.png", "png", &png(png::BitDepth::Sixteen, &millimetres));
    save("mask.png", "mask", &png(png::BitDepth::Eight, &(0..77).map(|pixel| pixel % 3).collect::<Vec<_>>()));
    for (kind, data) in [("<f4", floats(&depths)), (">u2", millimetres)] {
        let head = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({height}, {width}), }}\n");
        let bytes = [b"\x93NUMPY\x01\x00", &(head.len() as u16).to_le_bytes()[..], head.as_bytes(), &data].concat();
        save("picture.npy", &format!("npy-{}", &kind[1..]), &bytes);
    }
    let lines: String = points.iter().map(|[x, y, z]| format!("{x} {y} {z}\n")).collect();
    let rows = floats(points.as_flattened());
    let columns = floats(&(0..3).flat_map(|axis| points.iter().map(move |point| point[axis])).collect::<Vec<_>>());
    // Literals alone.
    let packed: Vec<u8> = columns.chunks(32).flat_map(|run| [&[run.len() as u8 - 1], run].concat()).collect();
    let lengths = [packed.len() as u32, columns.len() as u32].map(u32::to_le_bytes).concat();
    for (data, bytes) in [
        ("ascii", lines.clone().into_bytes()),
        ("binary", rows.clone()),
        ("binary_compressed", [lengths, packed].concat()),
    ] {
        let head = format!(
            "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {width}\nHEIGHT {height}\nPOINTS 77\nDATA {data}\n"
        );
        save("picture.pcd", &format!("pcd-{data}"), &[head.as_bytes(), &bytes].concat());
    }
    for (format, bytes) in [("ascii", lines.into_bytes()), ("binary_little_endian", rows)] {
        let head = format!(
            "ply\nformat {format} 1.0\nobj_info num_cols {width}\nobj_info num_rows {height}\nelement vertex 77\n\
             property float x\nproperty float y\nproperty float z\nend_header\n"
        );
        save("picture.ply", &format!("ply-{format}"), &[head.as_bytes(), &bytes].concat());
    }
}

fn cameras() {
    let own = r#"{"width":640,"height":480,"fx":615.2,"fy":614.8,"cx":319.5,"cy":239.25,"pixel_centre":0,"distortion":[0.1,-0.2,0.001,0.002,0.03]}"#;
    let open3d = r#"{"class_name":"PinholeCameraParameters","extrinsic":[1],"intrinsic":{"width":640,"height":480,"intrinsic_matrix":[615.2,0,0,0,614.8,0,319.5,239.25,1]}}"#;
    let calibration = "image_width: 640\nimage_height: 480\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [615.2, 0.0, 319.5,\n         0.0, 614.8, 239.25, 0, 0, 1]\ndistortion_model: plumb_bob\ndistortion_coefficients:\n  data: [0.1, -0.2, 0.001, 0.002, 0.03]\n";
    let message = "height: 480\nwidth: 640\ndistortion_model: \"plumb_bob\"\nd:\n- 0.1\n- -0.2\n- 0.001\n- 0.002\n- 0.03\nk:\n- 615.2\n- 0.0\n- 319.5\n- 0.0\n- 614.8\n- 239.25\n- 0.0\n- 0.0\n- 1.0\n";
    for (kind, name, text) in [
        ("camera.json", "own", own),
        ("camera.json", "open3d", open3d),
        ("camera.yaml", "calibration", calibration),
        ("camera.yaml", "message", message),
    ] {
        save_kind("camera", &CAMERAS, kind, name, text.as_bytes());
    }
}

/// A seed whose first byte selects the kind of file.
fn save_kind(target: &str, kinds: &[&str], kind: &str, name: &str, bytes: &[u8]) {
    let number = kinds.iter().position(|known| *known == kind).expect("a kind") as u8;
    save(target, name, &[&[number], bytes].concat());
}

fn save(target: &str, name: &str, bytes: &[u8]) {
    let folder = repository_path("fuzz/corpus").join(target);
    fs::create_dir_all(&folder).expect("a folder");
    fs::write(folder.join(format!("seed-{name}")), bytes).expect("a seed");
}
