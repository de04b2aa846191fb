//! bake
pub mod plan;
pub mod integrate;
pub mod settings;
pub use settings::Settings;
use crate::fabric::Fabric;
use crate::table::*;
use crate::brdf::Factors;

/// bake
pub fn bake(fabric: &Fabric, settings: &Settings) -> Table {
    let threads = fabric.visible_threads().map(|thread| {
        let tangents = thread.tangents::<f32>();
        let form = match thread.tangents::<f64>().single_tilt() {
            Some(tilt) => Form::Tilt { cos: tilt.cos() as f32, sin: tilt.sin() as f32 },
            None => {
                let integrand = integrate::Integrand::new(fabric, thread, settings);
                let axes = plan::plan(fabric, &integrand, settings);
                Form::Grid(integrand.fill(axes, settings))
            }
        };
        ThreadTable {
            name: thread.name.clone(), frame: thread.frame(), coverage: thread.coverage as f32,
            albedo: thread.albedo.map(|a| a as f32), optics: thread.optics.cast(),
            factors: Factors::new(&thread.optics.cast(), &tangents), tangents, form }
    }).collect();
    Table { threads, gap: fabric.gap() as f32, sigma_u: fabric.sigma_u as f32, reweighting: fabric.reweighting, metadata: String::new() }
}
