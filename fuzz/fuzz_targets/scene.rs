//! Any text as a scene: it is none, or one that can be analysed.
#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use sateen::scene::Scene;

/// A folder in which there is nothing else.
static FILE: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = std::env::temp_dir().join(format!("sateen-fuzz-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    folder.join("scene.toml")
});

libfuzzer_sys::fuzz_target!(|text: &str| {
    std::fs::write(&*FILE, text).expect("there is room");
    let Ok(scene) = Scene::load(&FILE) else {
        return;
    };
    assert!(!scene.cameras.is_empty() && !scene.lights.is_empty());
    assert!(!scene.fabrics().is_empty() || scene.objects.is_empty());
});
