//! Tells the shared sources which Bevy they are built for.

fn main() {
    println!("cargo::rustc-check-cfg=cfg(bevy_0_20)");
    println!("cargo::rustc-cfg=bevy_0_20");
}
