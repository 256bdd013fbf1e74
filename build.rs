//! Tells the linker where libmujoco lies beside the build.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    // Only simulations use libmujoco.
    if std::env::var_os("CARGO_FEATURE_MAKE").is_none() {
        return;
    }
    // The program stands in target/<profile>/, tests and benches one folder deeper; both find the library by a path relative
    // to themselves, so a moved checkout keeps working. Under cargo, the build script of `sim` says where it is.
    for origin in ["$ORIGIN/../../.deps/mujoco", "$ORIGIN/../../../.deps/mujoco"] {
        println!("cargo:rustc-link-arg=-Wl,-rpath,{origin}");
    }
}
