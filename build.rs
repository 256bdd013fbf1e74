//! Lets the program find libmujoco beside itself: in an installation, or in the checkout that it was built in.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    // Only simulations use libmujoco.
    if std::env::var_os("CARGO_FEATURE_MAKE").is_none() {
        return;
    }
    // Installed, the library is beside the folder of the program: `_bin` and `_lib` in a wheel, `bin` and `lib/graspmill` after
    // `make install`. In a checkout the program is in target/<profile>/, tests and benches are one folder deeper. All paths start
    // at the program, so a moved installation or checkout keeps working. Under cargo, the build script of `sim` provides it.
    for folder in ["../_lib", "../lib/graspmill", "../../.deps/mujoco", "../../../.deps/mujoco"] {
        println!("cargo:rustc-link-arg=-Wl,-rpath,$ORIGIN/{folder}");
    }
}
