//! Which mathematics the program takes from the C library: none that numbers of class `exact` depend on.
//!
//! C libraries round the last bits of `sin`, `exp` or `hypot` each in its own way. `sqrt`, `floor`, `fmod` and the like are
//! exact by definition, and are instructions or part of the program.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::PathBuf,
};

use object::{Object, ObjectSection, ObjectSymbol, RelocationTarget, read::archive::ArchiveFile};

/// Functions of the C library's mathematics that are not exact by definition. Each has forms for `float` and `long double`.
const INEXACT: [&str; 32] = [
    "acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "cbrt", "cos", "cosh", "erf", "erfc", "exp", "exp10",
    "exp2", "expm1", "hypot", "j0", "lgamma", "log", "log10", "log1p", "log2", "pow", "sin", "sincos", "sinh", "tan",
    "tanh", "tgamma", "y0", "jn",
];

/// Parts of the names of functions that may call them, each with the reason.
const CALLERS: [(&str, &str); 16] = [
    ("tract_", "networks, class `inferred`"),
    ("ndarray", "networks, class `inferred`"),
    ("half", "numbers of 16 bits of networks, class `inferred`"),
    ("rustfft", "an operator of networks, class `inferred`"),
    ("num_complex", "an operator of networks, class `inferred`"),
    ("rand_distr", "random operators of networks, class `inferred`"),
    ("num_traits", "operators of networks, class `inferred`: what our crates call is compiled into them"),
    ("_ZN3std", "functions of the standard library that others call: our crates name none, as the other test shows"),
    ("_ZN4core", "functions passed as values and closures of networks: our crates name none, as the other test shows"),
    ("$LT$core..", "closures of networks: our crates name none, as the other test shows"),
    ("indicatif", "bars of progress"),
    ("minijinja", "templates of pages"),
    ("parquet", "sizes of filters and digits of decimals, neither of which is used"),
    ("7TriMesh22compute_pseudo_normals", "pseudo-normals are not computed"),
    ("parry3d_f645query20nonlinear_shape_cast", "no motion is cast"),
    ("glamx6eigen3", "axes of inertia are not computed"),
];

fn is_inexact(symbol: &str) -> bool {
    let base = symbol.trim_end_matches("_r");
    [base, base.trim_end_matches('f'), base.trim_end_matches('l')].iter().any(|name| INEXACT.contains(name))
}

/// Functions that refer to each of the inexact ones that the program takes from the C library.
///
/// Such a function is called through its slot in the table of offsets, whose distance from the next instruction is the last
/// four bytes of the instruction that refers to it; in code of C through a stub that jumps there.
fn callers(program: &object::File) -> BTreeMap<String, BTreeSet<String>> {
    let names: BTreeMap<usize, String> = program
        .dynamic_symbols()
        .map(|symbol| (symbol.index().0, symbol.name().unwrap_or_default().to_owned()))
        .collect();
    let mut targets: BTreeMap<u64, String> = BTreeMap::new();
    for (slot, relocation) in program.dynamic_relocations().into_iter().flatten() {
        if let RelocationTarget::Symbol(symbol) = relocation.target() {
            targets.extend(names.get(&symbol.0).filter(|name| is_inexact(name)).map(|name| (slot, name.clone())));
        }
    }
    let mut functions: Vec<(u64, String)> = program
        .symbols()
        .filter(|symbol| symbol.is_definition() && symbol.kind() == object::SymbolKind::Text)
        .map(|symbol| (symbol.address(), symbol.name().unwrap_or_default().to_owned()))
        .collect();
    functions.sort();
    assert!(functions.len() > 10_000, "the program has no symbols: {}", functions.len());
    // Stubs first: what calls them refers to the stub's own address.
    for section in program.sections().filter(|section| section.name().is_ok_and(|name| name.starts_with(".plt"))) {
        for (at, name) in references(&section, &targets) {
            // The stub begins at the last multiple of sixteen, or of eight, before its jump.
            targets.extend([(at & !15, name.clone()), (at & !7, name)]);
        }
    }
    let mut callers: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for section in program.sections().filter(|section| section.name() == Ok(".text")) {
        for (at, name) in references(&section, &targets) {
            let function = functions.partition_point(|(start, _)| *start <= at);
            let caller = functions.get(function.wrapping_sub(1)).map_or("?", |(_, caller)| caller.as_str());
            callers.entry(name).or_default().insert(caller.to_owned());
        }
    }
    callers
}

/// Where instructions of a section refer to one of the targets: a call or jump, or a load of the address, through a slot or
/// to a stub.
fn references(section: &object::Section, targets: &BTreeMap<u64, String>) -> Vec<(u64, String)> {
    let code = section.data().expect("code");
    let (Some((&low, _)), Some((&high, _))) = (targets.first_key_value(), targets.last_key_value()) else {
        return Vec::new();
    };
    let mut found = Vec::new();
    for (offset, bytes) in code.windows(4).enumerate().skip(2) {
        let distance = i32::from_le_bytes(bytes.try_into().expect("four bytes"));
        let next = section.address() + offset as u64 + 4;
        let target = next.wrapping_add_signed(i64::from(distance));
        if !(low..=high).contains(&target) || !targets.contains_key(&target) {
            continue;
        }
        // Relative to the instruction: mod 00, rm 101. A call or a jump to a stub: E8, E9.
        let is_reference = code[offset - 1] & 0xc7 == 0x05 || [0xe8, 0xe9].contains(&code[offset - 1]);
        if is_reference {
            found.push((section.address() + offset as u64, targets[&target].clone()));
        }
    }
    found
}

#[test]
fn the_program_takes_inexact_mathematics_of_c_for_no_exact_number() {
    let bytes = fs::read(env!("CARGO_BIN_EXE_graspmill")).expect("the program");
    let program = object::File::parse(&*bytes).expect("an ELF file");
    let names = program.dynamic_symbols().filter(|symbol| symbol.is_undefined());
    let imported: BTreeSet<String> =
        names.filter_map(|symbol| symbol.name().ok().map(str::to_owned)).filter(|name| is_inexact(name)).collect();
    let callers = callers(&program);
    let called: BTreeSet<String> = callers.keys().cloned().collect();
    assert_eq!(imported, called, "every import has a caller that is found");
    let mut wrong = Vec::new();
    for (symbol, callers) in &callers {
        for caller in callers {
            let is_allowed = CALLERS.iter().any(|(part, _)| caller.contains(part));
            if caller.contains("graspmill") || !is_allowed {
                wrong.push(format!("{symbol}: {caller}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Names of the crates of the house, as their libraries are called.
fn crates() -> Vec<String> {
    let folders = fs::read_dir("src").expect("the crates").map(|entry| entry.expect("an entry").path());
    let manifests = folders.filter(|folder| folder.join("Cargo.toml").exists());
    manifests.map(|folder| format!("graspmill_{}", folder.file_name().expect("a name").to_string_lossy())).collect()
}

/// The newest library of a crate in the folder of this test.
fn library(name: &str) -> PathBuf {
    let beside = std::env::current_exe().expect("this test").parent().expect("a folder").to_owned();
    let is_library = |path: &PathBuf| {
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        file.starts_with(&format!("lib{name}-")) && file.ends_with(".rlib")
    };
    let files = fs::read_dir(beside).expect("what cargo built").map(|entry| entry.expect("an entry").path());
    let newest = files.filter(is_library).max_by_key(|path| fs::metadata(path).and_then(|facts| facts.modified()).ok());
    newest.unwrap_or_else(|| panic!("no library of {name} in the folder of the test"))
}

/// Includes our crates' instances of generic code from other crates, such as nalgebra.
#[test]
fn our_crates_name_no_inexact_mathematics_of_c() {
    let crates = crates();
    assert!(crates.len() >= 14, "{crates:?}");
    let mut wrong = BTreeSet::new();
    for name in crates {
        let bytes = fs::read(library(&name)).expect("a library");
        let mut parts = 0;
        for member in ArchiveFile::parse(&*bytes).expect("an archive").members() {
            let member = member.expect("a part");
            let Ok(part) = object::File::parse(member.data(&*bytes).expect("its bytes")) else { continue };
            parts += 1;
            let undefined = part.symbols().filter(|symbol| symbol.is_undefined());
            let inexact = undefined
                .filter_map(|symbol| symbol.name().ok().map(str::to_owned))
                .filter(|symbol| is_inexact(symbol));
            wrong.extend(inexact.map(|symbol| format!("{name}: {symbol}")));
        }
        assert!(parts > 0, "{name} has no code");
    }
    assert!(wrong.is_empty(), "use libm: {wrong:?}");
}
