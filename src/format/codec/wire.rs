//! The parts of the protobuf wire format that our records need, written directly to the output: in tag order, without zero
//! scalars and empty bytes, with the same bytes as the generated encoder (a test compares them).

use kernel::{
    geom::{Axis, GridPlacement, Intrinsics},
    ids::SampleId,
};

const VARINT: u32 = 0;
const FIXED64: u32 = 1;
const LENGTH: u32 = 2;

fn varint(out: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

fn key(out: &mut Vec<u8>, field: u32, wire_type: u32) {
    varint(out, u64::from(field << 3 | wire_type));
}

pub(crate) fn uint32(out: &mut Vec<u8>, field: u32, value: u32) {
    if value != 0 {
        key(out, field, VARINT);
        varint(out, u64::from(value));
    }
}

pub(crate) fn uint64(out: &mut Vec<u8>, field: u32, value: u64) {
    if value != 0 {
        key(out, field, VARINT);
        varint(out, value);
    }
}

pub(crate) fn double(out: &mut Vec<u8>, field: u32, value: f64) {
    if value != 0.0 {
        key(out, field, FIXED64);
        out.extend_from_slice(&value.to_le_bytes());
    }
}

/// Key and length of a bytes field; the caller appends exactly `length` bytes.
pub(crate) fn bytes_header(out: &mut Vec<u8>, field: u32, length: usize) {
    key(out, field, LENGTH);
    varint(out, length as u64);
}

pub(crate) fn bytes(out: &mut Vec<u8>, field: u32, value: &[u8]) {
    if !value.is_empty() {
        bytes_header(out, field, value.len());
        out.extend_from_slice(value);
    }
}

/// [`bytes`] of values that are not a slice of bytes.
pub(crate) fn bytes_of(out: &mut Vec<u8>, field: u32, values: impl ExactSizeIterator<Item = u8>) {
    if values.len() > 0 {
        bytes_header(out, field, values.len());
        out.extend(values);
    }
}

/// One element of a repeated bytes or string field: written even when it is empty.
pub(crate) fn element(out: &mut Vec<u8>, field: u32, value: &[u8]) {
    bytes_header(out, field, value.len());
    out.extend_from_slice(value);
}

/// Numbers as a bytes field, little-endian.
pub(crate) fn floats(out: &mut Vec<u8>, field: u32, values: &[f32]) {
    if !values.is_empty() {
        bytes_header(out, field, 4 * values.len());
        out.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }
}

/// [`floats`] one by one.
pub(crate) fn singles(out: &mut Vec<u8>, field: u32, values: impl ExactSizeIterator<Item = f32>) {
    if values.len() > 0 {
        bytes_header(out, field, 4 * values.len());
        out.extend(values.flat_map(f32::to_le_bytes));
    }
}

/// [`floats`] three by three.
pub(crate) fn triples(out: &mut Vec<u8>, field: u32, values: impl ExactSizeIterator<Item = [f32; 3]>) {
    if values.len() > 0 {
        bytes_header(out, field, 12 * values.len());
        values.for_each(|[x, y, z]| [x, y, z].iter().for_each(|value| out.extend_from_slice(&value.to_le_bytes())));
    }
}

/// A packed `repeated uint32`.
pub(crate) fn uint32s(out: &mut Vec<u8>, field: u32, values: impl ExactSizeIterator<Item = u32> + Clone) {
    if values.len() > 0 {
        // Seven bits per byte; 0 takes one, too.
        let length = values.clone().map(|value| (38 - (value | 1).leading_zeros()) as usize / 7).sum();
        bytes_header(out, field, length);
        values.for_each(|value| varint(out, u64::from(value)));
    }
}

/// A packed `repeated double`.
pub(crate) fn doubles(out: &mut Vec<u8>, field: u32, values: &[f64]) {
    if !values.is_empty() {
        bytes_header(out, field, 8 * values.len());
        out.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }
}

/// [`doubles`] one by one.
pub(crate) fn doubles_of(out: &mut Vec<u8>, field: u32, values: impl Iterator<Item = f64> + Clone) {
    let count = values.clone().count();
    if count > 0 {
        bytes_header(out, field, 8 * count);
        out.extend(values.flat_map(f64::to_le_bytes));
    }
}

/// A nested message shorter than 128 bytes, so that its length is one byte, known afterwards.
fn short_message(out: &mut Vec<u8>, field: u32, write: impl FnOnce(&mut Vec<u8>)) {
    key(out, field, LENGTH);
    let start = out.len();
    out.push(0);
    write(out);
    let length = out.len() - start - 1;
    debug_assert!(length < 128);
    out[start] = length as u8;
}

pub(crate) fn sample(out: &mut Vec<u8>, field: u32, sample: &SampleId) {
    short_message(out, field, |out| {
        bytes(out, 1, &sample.subject.0.0);
        uint32(out, 2, sample.instance);
        uint32(out, 3, sample.item.0);
        uint32(out, 4, sample.camera);
    });
}

pub(crate) fn grid(out: &mut Vec<u8>, field: u32, grid: &GridPlacement) {
    short_message(out, field, |out| {
        uint32(out, 1, grid.resolution);
        double(out, 2, grid.centre.x);
        double(out, 3, grid.centre.y);
        double(out, 4, grid.centre.z);
        double(out, 5, grid.cell_size);
    });
}

pub(crate) fn camera(out: &mut Vec<u8>, field: u32, camera: &Intrinsics) {
    short_message(out, field, |out| {
        uint32(out, 1, camera.width);
        uint32(out, 2, camera.height);
        double(out, 3, camera.fx);
        double(out, 4, camera.fy);
        double(out, 5, camera.cx);
        double(out, 6, camera.cy);
        double(out, 7, camera.near);
    });
}

pub(crate) fn axis(out: &mut Vec<u8>, field: u32, axis: &Axis, unit: &str) {
    short_message(out, field, |out| {
        bytes(out, 1, axis.name.as_bytes());
        bytes(out, 2, unit.as_bytes());
        double(out, 3, axis.first);
        double(out, 4, axis.step);
        uint32(out, 5, axis.count as u32);
        uint32(out, 6, u32::from(axis.periodic));
    });
}

/// [`floats`] with every NaN written as the same bits: IEEE 754 does not define which NaN an operation returns.
pub(crate) fn floats_one_nan(out: &mut Vec<u8>, field: u32, values: &[f32]) {
    if !values.is_empty() {
        bytes_header(out, field, 4 * values.len());
        out.extend(values.iter().flat_map(|value| if value.is_nan() { f32::NAN } else { *value }.to_le_bytes()));
    }
}
