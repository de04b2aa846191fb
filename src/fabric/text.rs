//! [`Fabric`] to TOML text.

use std::fmt::Write;

use super::{Fabric, Thread};

/// The text that [`Fabric::from_toml`] reads the fabric from, with the albedo variant that was chosen as the only one.
pub(super) fn to_toml(fabric: &Fabric) -> String {
    let mut text = String::new();
    write_fabric(&mut text, fabric).expect("writing to a string");
    text
}

fn write_fabric(text: &mut String, fabric: &Fabric) -> std::fmt::Result {
    let quoted = |text: &str| toml::Value::from(text).to_string();
    writeln!(text, "name = {}", quoted(&fabric.name))?;
    writeln!(text, "title = {}", quoted(&fabric.title))?;
    writeln!(text, "source = {}", quoted(&fabric.source))?;
    let reweighting = toml::Value::try_from(fabric.reweighting).expect("a name");
    writeln!(text, "reweighting = {reweighting}")?;
    let width = fabric.sigma_u.to_degrees();
    writeln!(text, "correlation_width_deg = {width:?}")?;
    if fabric.rho_scale < 1.0 {
        writeln!(text, "rho_scale = {:?}", fabric.rho_scale)?;
    }
    fabric
        .threads
        .iter()
        .try_for_each(|thread| write_thread(text, thread))?;
    text.push_str(&fabric.models.to_toml());
    Ok(())
}

fn write_thread(text: &mut String, thread: &Thread) -> std::fmt::Result {
    let offsets: Vec<f64> = thread
        .tangent_offsets
        .iter()
        .map(|offset| offset.to_degrees().clamp(-90.0, 90.0))
        .collect();
    writeln!(text, "\n[[thread]]")?;
    writeln!(text, "name = \"{}\"", thread.name)?;
    if thread.is_straight() {
        writeln!(
            text,
            "direction_deg = {:?}",
            thread.direction().to_degrees()
        )?;
    } else {
        let directions: Vec<f64> = thread.directions.iter().map(|x| x.to_degrees()).collect();
        writeln!(text, "direction_deg = {directions:?}")?;
    }
    writeln!(text, "coverage = {:?}", thread.coverage)?;
    writeln!(text, "albedo = {{ color = {:?} }}", thread.albedo)?;
    writeln!(text, "eta = {:?}", thread.optics.eta)?;
    writeln!(text, "k_d = {:?}", thread.optics.k_d)?;
    let [gamma_s, gamma_v] = [thread.optics.gamma_s, thread.optics.gamma_v].map(f64::to_degrees);
    writeln!(text, "gamma_s_deg = {gamma_s:?}")?;
    writeln!(text, "gamma_v_deg = {gamma_v:?}")?;
    writeln!(text, "tangent_offsets_deg = {offsets:?}")?;
    writeln!(text, "tangent_lengths = {:?}", thread.tangent_lengths)
}
