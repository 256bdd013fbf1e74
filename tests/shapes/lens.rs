//! Pixels that a user names or marks, and pixels in results, refer to the given picture, with any lens: on a scene that
//! an oracle renders with and without the lens.

use std::{fs, io::Cursor, path::Path};

use serde_json::Value;

use crate::support::{
    files::{number_at, read_json},
    program::Program,
    workspace::Workspace,
};

/// Two boxes on a table, seen through a lens and without it: depths, which box each pixel shows, and masks of the first one. Rays
/// through the lens are found by iteration, boxes by the slab test.
const RENDER: &str = "
import json, struct, sys, zlib
import numpy as np

out, coefficients = sys.argv[1], json.loads(sys.argv[2])
W, H, F, CX, CY = 640, 480, 420.0, 319.5, 239.5
k1, k2, p1, p2, k3, k4, k5, k6 = coefficients

def png(path, image):
    depth = 16 if image.dtype == np.uint16 else 8
    rows = b''.join(b'\\0' + row.astype('>u2' if depth == 16 else 'u1').tobytes() for row in image)
    chunk = lambda kind, data: struct.pack('>I', len(data)) + kind + data + struct.pack('>I', zlib.crc32(kind + data))
    head = struct.pack('>IIBBBBB', image.shape[1], image.shape[0], depth, 0, 0, 0, 0)
    with open(path, 'wb') as file:
        file.write(b'\\x89PNG\\r\\n\\x1a\\n' + chunk(b'IHDR', head) + chunk(b'IDAT', zlib.compress(rows)) + chunk(b'IEND', b''))

# The camera looks down at the table from 0.7 m; z of the world is up.
eye, aim = np.array([0.0, -0.55, 0.7]), np.array([0.0, 0.12, 0.0])
forward = (aim - eye) / np.linalg.norm(aim - eye)
right = np.cross(forward, [0.0, 0.0, 1.0]); right /= np.linalg.norm(right)
rotation = np.stack([right, np.cross(forward, right), forward], 1)
boxes = [((-0.46, 0.02, 0.0), (-0.36, 0.12, 0.14)), ((0.36, 0.05, 0.0), (0.46, 0.17, 0.09))]

def render(x, y):
    rays = np.stack([x, y, np.ones_like(x)], -1) @ rotation.T
    depth = np.where(rays[..., 2] < 0, -eye[2] / np.minimum(rays[..., 2], -1e-9), np.inf)
    owner = np.zeros(x.shape, np.uint8)
    for number, (low, high) in enumerate(boxes, 1):
        with np.errstate(divide='ignore', invalid='ignore'):
            a, b = (np.array(low) - eye) / rays, (np.array(high) - eye) / rays
        near, far = np.minimum(a, b).max(-1), np.maximum(a, b).min(-1)
        hit = (near < far) & (near > 0) & (near < depth)
        depth, owner = np.where(hit, near, depth), np.where(hit, number, owner)
    return np.where(depth < 3, depth, 0.0), owner

u, v = np.meshgrid(np.arange(W), np.arange(H))
xd, yd = (u - CX) / F, (v - CY) / F
x, y = xd.copy(), yd.copy()
for _ in range(200):
    r2 = x * x + y * y
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    x, y = (xd - 2 * p1 * x * y - p2 * (r2 + 2 * x * x)) / radial, (yd - p1 * (r2 + 2 * y * y) - 2 * p2 * x * y) / radial
for name, rays in (('raw', (x, y)), ('rectified', (xd, yd))):
    depth, owner = render(*rays)
    png(f'{out}/{name}.png', np.round(depth * 1e4).astype(np.uint16))
    png(f'{out}/mask_{name}.png', np.where(owner == 1, 255, 0).astype(np.uint8))
    png(f'{out}/owner_{name}.png', owner)
    rows, columns = np.nonzero(owner == 1)
    middle = int(np.argsort(columns)[len(columns) // 2])
    if name == 'raw':
        moved = np.hypot(F * x + CX - u, F * y + CY - v)[owner > 0].max()
        facts = {'middle': [int(np.median(columns)), int(np.median(rows))], 'moved': moved,
                 'box': [int(columns.min()), int(rows.min()), int(columns.max()), int(rows.max())]}
print(json.dumps(facts))
";

fn camera_info(coefficients: &[f64; 8]) -> String {
    format!(
        "height: 480\nwidth: 640\ndistortion_model: rational_polynomial\nD: {coefficients:?}\n\
         K: [420.0, 0.0, 319.5, 0.0, 420.0, 239.5, 0.0, 0.0, 1.0]\n"
    )
}

/// Columns, rows and values of a grey PNG of 8 or 16 bits.
fn read_png(path: &Path) -> (u32, u32, Vec<u16>) {
    let bytes = fs::read(path).expect("a file");
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().expect("a PNG");
    let (width, height, depth) = (reader.info().width, reader.info().height, reader.info().bit_depth);
    assert_eq!(reader.info().color_type, png::ColorType::Grayscale);
    let bytes = if depth == png::BitDepth::Sixteen { 2 } else { 1 };
    let mut data = vec![0; bytes * (width * height) as usize];
    reader.next_frame(&mut data).expect("pixels");
    let values = data.chunks_exact(bytes).map(|value| value.iter().fold(0, |sum, byte| sum << 8 | u16::from(*byte)));
    (width, height, values.collect())
}

/// Barrel and pincushion by Brown's model, and a rational one.
const LENSES: [[f64; 8]; 3] = [
    [-0.3, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.12, 0.05, 0.002, -0.001, 0.0, 0.0, 0.0, 0.0],
    [0.4, -0.1, 0.0005, 0.0003, 0.01, 0.6, -0.1, 0.02],
];

#[test]
#[ignore = "slow: many pictures"]
fn a_target_is_marked_and_named_in_the_picture_that_was_given() {
    for coefficients in LENSES {
        let workspace = Workspace::new();
        let render = Program::python_lines(RENDER).arg(workspace.folder()).arg(format!("{coefficients:?}"));
        let facts: Value = render.succeed().json();
        assert!(number_at(&facts, "/moved") > 8.0, "the lens moves the boxes: {facts}");
        let info = workspace.write("camera.yaml", camera_info(&coefficients));
        let plain = workspace.write("plain.yaml", camera_info(&[0.0; 8]));
        let complete = |name: &str, intrinsics: &Path, target: &str| -> Value {
            let run = Program::on("complete", workspace.path(format!("{name}.png"))).option("--intrinsics", intrinsics);
            let run = run.args(["--depth-scale", "0.0001", "--method", "hull", "--target", target]).arg("--json");
            run.option("--out", workspace.path(format!("out-{name}-{}", target.len()))).succeed().json()
        };
        let path = |name: &str| workspace.path(name).display().to_string();
        // What is right: the same object in the picture without the lens, by its own mask.
        let wanted = complete("rectified", &plain, &path("mask_rectified.png"));
        let [column, row] = [0, 1].map(|axis| number_at(&facts, &format!("/middle/{axis}")));
        for target in [path("mask_raw.png"), format!("{column},{row}"), format!("{:.1},{:.1}", column + 0.4, row - 0.4)]
        {
            let found = complete("raw", &info, &target);
            let objects = found["objects"].as_array().expect("objects");
            assert_eq!(objects.len(), 2, "no part of the target is left as an obstacle: {found}");
            let index = objects.iter().position(|object| object["role"] == "target").expect("a target");
            for (end, axis) in [0, 1].into_iter().flat_map(|end| [0, 1, 2].map(|axis| (end, axis))) {
                let bound = |report: &Value, object: usize| {
                    number_at(report, &format!("/objects/{object}/completed/bounds/{end}/{axis}"))
                };
                let (found, wanted) = (bound(&found, index), bound(&wanted, 0));
                // A pixel's nearest neighbour is up to a pixel away: 2 mm; a mask reaches down to the table, a cluster does not.
                let slack = if target.contains("mask") { 0.005 } else { 0.012 };
                assert!(
                    (found - wanted).abs() < slack,
                    "{coefficients:?}, {target}, axis {axis}: {found}, not {wanted}"
                );
            }
        }
        // Without a target, that object is chosen whose pixels of the given picture are nearest to its middle.
        let (width, height, owners) = read_png(&workspace.path("owner_raw.png"));
        let off_middle = |owner: u16| {
            let pixels: Vec<usize> = (0..owners.len()).filter(|pixel| owners[*pixel] == owner).collect();
            let mean = |value: &dyn Fn(usize) -> usize| {
                pixels.iter().map(|pixel| value(*pixel) as f64).sum::<f64>() / pixels.len() as f64
            };
            let column = mean(&|pixel| pixel % width as usize) - f64::from(width - 1) / 2.0;
            let row = mean(&|pixel| pixel / width as usize) - f64::from(height - 1) / 2.0;
            column * column + row * row
        };
        let found = complete("raw", &info, "auto");
        let target = found["objects"]
            .as_array()
            .expect("objects")
            .iter()
            .find(|object| object["role"] == "target")
            .expect("one");
        let is_left = number_at(target, "/completed/bounds/1/0") < 0.0;
        assert_eq!(is_left, off_middle(1) < off_middle(2), "{coefficients:?}: {target}");
        // Pixels outside of the picture, and those of no object, are named as what they are.
        let run = |target: &str| {
            let run = Program::on("complete", workspace.path("raw.png")).option("--intrinsics", &info);
            let run = run.args(["--depth-scale", "0.0001", "--method", "hull", "--target", target]);
            run.option("--out", workspace.path("none")).expect_code(2).stderr
        };
        for (target, words) in [
            ("640,10", "the picture has 640 x 480 pixels"),
            ("-0.6,10", "the picture has 640 x 480 pixels"),
            ("320,400", "the pixel shows the table, not an object"),
            ("1,nan", "not a valid target"),
        ] {
            let said = run(target);
            assert!(said.contains(words), "{words}: {said}");
        }
    }
}

#[test]
fn labels_and_outlines_lie_on_the_picture_that_was_given() {
    for coefficients in LENSES {
        let workspace = Workspace::new();
        let render = Program::python_lines(RENDER).arg(workspace.folder()).arg(format!("{coefficients:?}"));
        let facts: Value = render.succeed().json();
        let info = workspace.write("camera.yaml", camera_info(&coefficients));
        let out = workspace.path("scene");
        let run = Program::on("segment", workspace.path("raw.png")).option("--intrinsics", &info);
        run.args(["--depth-scale", "0.0001"]).option("--out", &out).succeed();
        let report = read_json(out.join("scene.json"));
        let table = report["table_label"].as_u64().expect("a label") as u16;
        assert_eq!(table, u16::MAX);
        let (width, height, labels) = read_png(&out.join("labels.png"));
        let (_, _, owners) = read_png(&workspace.path("owner_raw.png"));
        let (_, _, depths) = read_png(&workspace.path("raw.png"));
        assert_eq!((width, height), (640, 480));
        let objects = report["objects"].as_array().expect("objects");
        assert_eq!(objects.len(), 2);
        let mut seen = Vec::new();
        for (number, object) in (1..).zip(objects) {
            let pixels: Vec<usize> = (0..labels.len()).filter(|pixel| labels[*pixel] == number).collect();
            assert_eq!(object["pixels"].as_u64(), Some(pixels.len() as u64));
            let owner = owners[pixels[pixels.len() / 2]];
            seen.push(owner);
            // Of what is labelled nothing is another thing's; of the box only the lowest 8 mm, which belong to the table, and its
            // rim by less than a pixel are not.
            let foreign = pixels.iter().filter(|pixel| owners[**pixel] != owner).count();
            let whole = owners.iter().filter(|other| **other == owner).count();
            assert!(foreign * 200 < pixels.len(), "{coefficients:?}: {foreign} of {} px", pixels.len());
            assert!(pixels.len() * 10 > whole * 9, "{coefficients:?}: {} of {whole} px", pixels.len());
            if owner == 1 {
                let sides = [0, 1, 2, 3].map(|side| {
                    number_at(object, &format!("/pixel_box/{side}")) - number_at(&facts, &format!("/box/{side}"))
                });
                assert!(sides[..3].iter().all(|side| side.abs() <= 1.0), "{coefficients:?}: {sides:?}");
                assert!((-9.0..=1.0).contains(&sides[3]), "above the table: {sides:?}");
            }
        }
        seen.sort_unstable();
        assert_eq!(seen, [1, 2]);
        // What is no object is the table, where the picture without the lens shows it, or has no return.
        let of_table = (0..labels.len()).filter(|pixel| labels[*pixel] == table);
        assert!(of_table.clone().all(|pixel| depths[pixel] > 0), "{coefficients:?}");
        assert!(of_table.clone().filter(|pixel| owners[*pixel] == 0).count() > 200_000, "{}", of_table.count());
        assert!((0..labels.len()).all(|pixel| depths[pixel] > 0 || labels[pixel] == 0));
        // The outlines tint the same pixels: where nothing is labelled, the picture is grey.
        let mut reader = png::Decoder::new(Cursor::new(fs::read(out.join("outlines.png")).expect("a file")));
        reader.set_transformations(png::Transformations::IDENTITY);
        let mut reader = reader.read_info().expect("a PNG");
        let mut colours = vec![0; 3 * labels.len()];
        reader.next_frame(&mut colours).expect("pixels");
        for (pixel, colour) in colours.chunks_exact(3).enumerate() {
            let is_grey = colour[0] == colour[1] && colour[1] == colour[2];
            assert_eq!(is_grey, [0, table].contains(&labels[pixel]), "{coefficients:?}, pixel {pixel}: {colour:?}");
        }
    }
}

/// A box that the given picture cuts is refused, also where the lens draws the border into the undistorted picture.
#[test]
fn an_object_that_the_given_picture_cuts_is_refused_whatever_the_lens() {
    let workspace = Workspace::new();
    let coefficients = LENSES[1];
    let render = Program::python_lines(RENDER).arg(workspace.folder()).arg(format!("{coefficients:?}"));
    render.succeed();
    // Columns from the middle of the first box on, with the camera of that part.
    let (width, height, depths) = read_png(&workspace.path("raw.png"));
    let (_, _, owners) = read_png(&workspace.path("owner_raw.png"));
    let columns: Vec<u32> =
        (0..).zip(&owners).filter(|(_, owner)| **owner == 1).map(|(pixel, _)| pixel % width).collect();
    let first = (columns.iter().min().expect("a box") + columns.iter().max().expect("a box")) / 2;
    let part: Vec<u8> = (0..height)
        .flat_map(|row| (first..width).map(move |column| (row * width + column) as usize))
        .flat_map(|pixel| depths[pixel].to_le_bytes())
        .collect();
    let head = format!("{{'descr': '<u2', 'fortran_order': False, 'shape': ({height}, {}), }}\n", width - first);
    let head = [b"\x93NUMPY\x01\x00", &(head.len() as u16).to_le_bytes()[..], head.as_bytes()].concat();
    let picture = workspace.write("part.npy", [head, part].concat());
    let info = camera_info(&coefficients)
        .replace("width: 640", &format!("width: {}", width - first))
        .replace("319.5", &format!("{}", 319.5 - f64::from(first)));
    let info = workspace.write("part.yaml", info);
    let run = Program::on("segment", picture).option("--intrinsics", info).args(["--depth-scale", "0.0001"]);
    let said = run.option("--out", workspace.path("scene")).expect_code(3).stdout;
    let refused = said.lines().filter(|line| line.contains("refused: the picture's border cuts it")).count();
    assert_eq!(refused, 1, "{said}");
}
