//! Networks: the model of the tests against ONNX Runtime, and `graspmill model check`.

use std::fs;

use graspmill::{
    infer::{CompletionModel, Inputs},
    seed::Stream,
    surface::CubeField,
};

use crate::support::{
    files::{list_names, repository_path},
    program::Program,
    workspace::Workspace,
};

pub const MODEL: &str = "tests/models/thicken";
const SAMPLES: usize = 256;
const CELLS: usize = 40 * 40 * 40;

/// Samples of noise at all densities, one array of the shape (samples, 1, 40, 40, 40).
fn noise(name: &str) -> Vec<f32> {
    let mut draw = Stream::of_job(21, b"", name);
    let mut values = Vec::with_capacity(SAMPLES * CELLS);
    for sample in 0..SAMPLES {
        // Grids of whole samples are sparse: densities down to one cell in ten thousand.
        let density = 10_f64.powf(-4.0 * sample as f64 / (SAMPLES - 1) as f64);
        values.extend((0..CELLS).map(|_| f32::from(draw.unit() < density)));
    }
    values
}

fn npy_of(values: &[f32]) -> Vec<u8> {
    let head = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({SAMPLES}, 1, 40, 40, 40), }}\n");
    let mut bytes = [b"\x93NUMPY\x01\x00", &(head.len() as u16).to_le_bytes()[..], head.as_bytes()].concat();
    values.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
    bytes
}

#[test]
#[ignore = "slow: needs ONNX Runtime (in the environment of PyTorch)"]
fn networks_answer_as_in_onnx_runtime() {
    let workspace = Workspace::new();
    let (partial, free) = (noise("partial"), noise("free"));
    workspace.write("partial.npy", npy_of(&partial));
    workspace.write("free.npy", npy_of(&free));
    let script = "import sys, numpy, onnxruntime\n\
                  folder = sys.argv[2]\n\
                  session = onnxruntime.InferenceSession(sys.argv[1], providers=['CPUExecutionProvider'])\n\
                  inputs = {name: numpy.load(f'{folder}/{name}.npy') for name in ('partial', 'free')}\n\
                  found = session.run(['occupancy', 'coverage'], inputs)\n\
                  numpy.stack(found, 1).astype('<f4').tofile(f'{folder}/answers')\n";
    let run = Program::peer("torch/bin/python").option("-c", script).arg(repository_path(MODEL).join("model.onnx"));
    run.arg(workspace.folder()).succeed();
    let answers = fs::read(workspace.path("answers")).expect("answers");
    let answers: Vec<f32> = answers.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    let model = CompletionModel::open(&repository_path(MODEL)).expect("a model");
    let mut largest = 0.0_f32;
    for sample in 0..SAMPLES {
        let field =
            |values: &[f32]| CubeField::from_values(40, values[sample * CELLS..][..CELLS].to_vec()).expect("a cube");
        let (partial, free) = (field(&partial), field(&free));
        let inputs = Inputs { partial: Some(&partial), free: Some(&free), touch: None };
        let answer = model.predict(&inputs).expect("an answer");
        let coverage = answer.coverage.expect("the model has that output");
        let found = answer.occupancy.values().iter().chain(coverage.values());
        for (found, wanted) in found.zip(&answers[sample * 2 * CELLS..][..2 * CELLS]) {
            largest = largest.max((found - wanted).abs());
            assert!((found > &0.5) == (wanted > &0.5) || (wanted - 0.5).abs() < 1e-5, "{found}, not {wanted}");
        }
    }
    println!("largest difference of {SAMPLES} samples: {largest:.1e}");
    assert!(largest < 1e-4, "{largest}");
}

/// Every operator with random attributes: the library, given our reader's result for the file, answers like ONNX
/// Runtime.
#[test]
#[ignore = "slow: needs ONNX Runtime (in the environment of PyTorch)"]
fn random_networks_answer_as_in_onnx_runtime() {
    const COUNT: usize = 420;
    let workspace = Workspace::new();
    let peer = Program::peer("torch/bin/python").arg(repository_path("tests/peers/networks.py"));
    peer.arg(workspace.path("networks")).args([COUNT.to_string(), "1".to_owned()]).succeed();
    let (mut refused, mut wrong) = (Vec::new(), Vec::new());
    let names = list_names(workspace.path("networks"));
    assert_eq!(names.len(), COUNT);
    for name in names {
        match CompletionModel::open(&workspace.path("networks").join(&name)) {
            Ok(model) => {
                let check = model.check_golden().expect("samples");
                if !check.agrees() {
                    wrong.push(format!("{name}: {check:?}"));
                }
            }
            Err(error) => refused.push(format!("{name}: {error}")),
        }
    }
    println!("{COUNT} networks, {} refused", refused.len());
    // Few things of ONNX Runtime are not run, each with its reason.
    assert!(wrong.is_empty() && refused.len() < COUNT / 50, "{}\n{}", wrong.join("\n"), refused.join("\n"));
}

#[test]
fn model_check_says_what_a_model_is_and_refuses_a_changed_one() {
    let said = Program::new("model").arg("check").arg(MODEL).succeed().stdout;
    for words in [
        "thicken: input partial, free, 40 cells along each axis",
        "golden.npz: 2 samples; largest difference",
        " 0 different cells",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    let report = Program::new("model").arg("check").arg(MODEL).read_json();
    assert_eq!((report["agrees"].as_bool(), report["golden"]["samples"].as_u64()), (Some(true), Some(2)));
    let workspace = Workspace::new();
    let copy = workspace.make_folder("model");
    for name in list_names(repository_path(MODEL)) {
        fs::copy(repository_path(MODEL).join(&name), copy.join(&name)).expect("a copy");
    }
    let onnx = copy.join("model.onnx");
    let mut bytes = fs::read(&onnx).expect("bytes");
    bytes[40_000] ^= 1;
    fs::write(&onnx, bytes).expect("written");
    let said = Program::new("model").arg("check").arg(&copy).expect_code(4).stderr;
    assert!(said.contains("model.onnx") && said.contains("fetch the model again"), "{said}");
    let said = Program::new("model").arg("check").arg(workspace.folder()).expect_code(2).stderr;
    assert!(said.contains("a model folder must contain"), "{said}");
}
