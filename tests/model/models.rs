//! The models that the microcylinder is compared with: physics, both precisions, and Irawan's integrals done slowly.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};

use crate::common::{fabric, hostile_directions};
use proptest::prelude::*;
use sateen::fabric::{
    Distribution, Fabric, FresnelTerm, Irawan, LIBRARY, Lambert, OrenNayar, Shadowing,
    TorranceSparrow, Yarn,
};
use sateen::math::Real;
use sateen::metrics::{Pair, protocol_pairs};
use sateen::model::{IRAWAN_PRESETS, IrawanMarschner, Model, SpineError, irawan_of};

const DISTRIBUTIONS: [Distribution; 2] = [Distribution::Beckmann, Distribution::Ggx];
const SHADOWINGS: [Shadowing; 2] = [Shadowing::VCavity, Shadowing::Smith];
const FRESNEL_TERMS: [FresnelTerm; 2] = [FresnelTerm::Dielectric, FresnelTerm::Schlick];

fn torrance_sparrows(alpha_x: f64, alpha_y: f64) -> Vec<TorranceSparrow> {
    let mut models = Vec::new();
    for distribution in DISTRIBUTIONS {
        for shadowing in SHADOWINGS {
            for fresnel in FRESNEL_TERMS {
                models.push(TorranceSparrow {
                    diffuse: [0.3, 0.2, 0.0],
                    specular: [0.7, 0.5, 1.0],
                    alpha_x,
                    alpha_y,
                    eta: 1.5,
                    distribution,
                    shadowing,
                    fresnel,
                });
            }
        }
    }
    models
}

fn presets() -> impl Iterator<Item = (&'static str, Irawan)> {
    let valid = |name: &&str| *name != "cotton-twill";
    IRAWAN_PRESETS
        .iter()
        .map(|preset| (preset.name, preset.parameters()))
        .filter(move |(name, _)| valid(name))
}

/// Every model with several parameters, by name, in one precision.
fn models<R: Real>() -> Vec<(String, Box<dyn Model<R>>)> {
    let mut models: Vec<(String, Box<dyn Model<R>>)> = Vec::new();
    let albedo = [1.0, 0.5, 0.0];
    models.push(("lambert".into(), Box::new(Lambert { albedo })));
    for sigma in [0.0, 0.2, 1.0] {
        models.push((
            format!("oren-nayar {sigma}"),
            Box::new(OrenNayar { albedo, sigma }),
        ));
    }
    for [x, y] in [[1e-3, 1e-3], [0.1, 0.5], [2.0, 0.3], [10.0, 10.0]] {
        for model in torrance_sparrows(x, y) {
            models.push((format!("{model:?}"), Box::new(model)));
        }
    }
    for (name, parameters) in presets() {
        let model = IrawanMarschner::<R>::new(&parameters).unwrap();
        models.push((name.into(), Box::new(model)));
    }
    models
}

#[test]
fn hostile_directions_give_finite_light_and_none_below_the_surface() {
    let directions = hostile_directions();
    let double = |w: [f32; 3]| w.map(f64::from);
    for ((name, single), (_, exact)) in models::<f32>().iter().zip(models::<f64>()) {
        for wi in &directions {
            for wr in &directions {
                let values = [
                    single.eval_cos(*wi, *wr).map(f64::from),
                    single.eval(*wi, *wr).map(f64::from),
                    exact.eval_cos(double(*wi), double(*wr)),
                    exact.eval(double(*wi), double(*wr)),
                ];
                for value in values.iter().flatten() {
                    assert!(
                        value.is_finite() && *value >= 0.0,
                        "{name} {wi:?} {wr:?}: {values:?}"
                    );
                }
                if !(wi[2] > 0.0 && wr[2] > 0.0) {
                    assert_eq!(values, [[0.0; 3]; 4], "{name} {wi:?} {wr:?}");
                }
            }
        }
    }
}

fn pairs(count: usize) -> Vec<Pair> {
    protocol_pairs(&fabric("denim"), count, 3)
}

#[test]
fn all_models_are_reciprocal() {
    for (name, model) in models::<f64>() {
        for Pair { wi, wr, .. } in pairs(300) {
            let (there, back) = (model.eval(wi, wr), model.eval(wr, wi));
            for channel in 0..3 {
                let difference = (there[channel] - back[channel]).abs();
                assert!(
                    difference <= 1e-9 * there[channel],
                    "{name} {wi:?} {wr:?}: {there:?} {back:?}"
                );
            }
        }
    }
}

#[test]
fn single_precision_is_close_to_double() {
    // Rounding of a half vector moves it along lobes of 0.001 by some of their width.
    for ((name, single), (_, exact)) in models::<f32>().iter().zip(models::<f64>()) {
        if name.contains("alpha_x: 0.001") {
            continue;
        }
        let mut worst = 0.0f64;
        for Pair { wi, wr, .. } in pairs(2000) {
            let rho = single.eval_cos(wi.map(|x| x as f32), wr.map(|x| x as f32));
            let truth = exact.eval_cos(
                wi.map(|x| f64::from(x as f32)),
                wr.map(|x| f64::from(x as f32)),
            );
            for channel in 0..3 {
                let error = (f64::from(rho[channel]) - truth[channel]).abs();
                worst = worst.max(error / (truth[channel] + 1e-3));
            }
        }
        assert!(worst < 2e-3, "{name}: {worst}");
    }
}

/// ∫ ρ dwi by midpoints, strata of z and azimuth.
fn reflectance(model: &dyn Model<f64>, cos_r: f64) -> f64 {
    let wr = [(1.0 - cos_r * cos_r).sqrt(), 0.0, cos_r];
    let (rows, columns) = (200, 400);
    let mut sum = 0.0;
    for index in 0..rows * columns {
        let z = ((index / columns) as f64 + 0.5) / rows as f64;
        let (sin, cos) = (TAU * ((index % columns) as f64 + 0.5) / columns as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        let rho = model.eval_cos([r * cos, r * sin, z], wr);
        sum += rho.into_iter().fold(0.0, f64::max);
    }
    sum * TAU / (rows * columns) as f64
}

#[test]
fn no_more_is_reflected_than_arrives() {
    // The strata's own error, and Walter's approximation of Λ.
    const TOLERANCE: f64 = 0.01;
    let cosines = [1.0, 0.8, 0.5, 0.2, 0.05];
    for cos in cosines {
        let albedo = [1.0; 3];
        assert!((reflectance(&Lambert { albedo }, cos) - 1.0).abs() < 1e-3);
        for k in 0..=10 {
            let sigma = FRAC_PI_2 * f64::from(k) / 10.0;
            let share = reflectance(&OrenNayar { albedo, sigma }, cos);
            // The qualitative model's own excess, as its module says.
            assert!(share < 1.016, "σ = {sigma}, cos = {cos}: {share}");
        }
        for [x, y] in [[0.15, 0.15], [0.2, 0.8], [1.0, 1.0], [3.0, 0.5]] {
            for model in torrance_sparrows(x, y) {
                let share = reflectance(&model, cos);
                assert!(share < 1.0 + TOLERANCE, "{model:?}, cos = {cos}: {share}");
            }
        }
    }
}

#[test]
fn a_smooth_mirror_of_facets_reflects_what_fresnel_says() {
    for model in torrance_sparrows(0.1, 0.1) {
        let model = TorranceSparrow {
            diffuse: [0.0; 3],
            specular: [1.0; 3],
            ..model
        };
        let share = reflectance(&model, 1.0);
        assert!((share - 0.04).abs() < 1e-3, "{model:?}: {share}");
    }
}

/// A yarn of one of the four conics: r > 0 not 1, r = 1, r = 0, r < 0.
fn yarns() -> Vec<Yarn> {
    let mut yarns = Vec::new();
    for u_max_deg in [20f64, 60.0] {
        let u_max = u_max_deg.to_radians();
        let parabola = -1.0 / (1.0 + 1.0 / u_max.tan());
        for kappa in [2.0, -0.1, 0.0, parabola, -0.95] {
            for psi_deg in [0f64, 35.0, -30.0] {
                yarns.push(Yarn {
                    direction: 0.3,
                    coverage: 0.7,
                    specular: [1.0; 3],
                    alpha: 0.02,
                    beta: 4.0,
                    delta: if kappa == 2.0 { 0.0 } else { 0.3 },
                    psi: psi_deg.to_radians(),
                    u_max,
                    kappa,
                    width: 1.0,
                    length: 2.0,
                });
            }
        }
    }
    yarns
}

/// R by the case, as published.
fn radius_of_curvature(yarn: &Yarn, u: f64) -> f64 {
    let tan_max = yarn.u_max.tan();
    let half = yarn.half_spine();
    let r = 1.0 + yarn.kappa * (1.0 + 1.0 / tan_max);
    if r.abs() < 1e-9 {
        let a = half / (2.0 * tan_max);
        return 2.0 * a * (1.0 + u.tan().powi(2)).powf(1.5);
    }
    if (r - 1.0).abs() < 1e-9 {
        return half / yarn.u_max.sin();
    }
    if r > 0.0 {
        let t_max = (r * tan_max).atan();
        let b = half / t_max.sin();
        let a = b / r;
        let t = (r * u.tan()).atan();
        ((b * t.cos()).powi(2) + (a * t.sin()).powi(2)).powf(1.5) / (a * b)
    } else {
        let t_max = -(r * tan_max).atanh();
        let b = half / t_max.sinh();
        let a = b / r;
        let t = -(r * u.tan()).atanh();
        -((b * t.cosh()).powi(2) + (a * t.sinh()).powi(2)).powf(1.5) / (a * b)
    }
}

/// f_j as published, by midpoints.
fn slow(yarn: &Yarn, wi: [f64; 3], wr: [f64; 3]) -> f64 {
    const COUNT: usize = 20_000;
    let (sin, cos) = yarn.direction.sin_cos();
    // x across, y along.
    let to_yarn = |w: [f64; 3]| [w[0] * sin - w[1] * cos, w[0] * cos + w[1] * sin, w[2]];
    let (wi, wr) = (to_yarn(wi), to_yarn(wr));
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let sum = [wi[0] + wr[0], wi[1] + wr[1], wi[2] + wr[2]];
    let length = dot(sum, sum).sqrt();
    let h = sum.map(|x| x / length);
    // I_0(4)
    let bessel = 11.301_921_952_136_33;
    let phase = yarn.alpha + (-yarn.beta * dot(wi, wr)).exp() / (TAU * bessel);
    let a = 0.5 * yarn.width;
    let attenuation = |u: f64, v: f64| {
        let n = [v.sin(), u.sin() * v.cos(), u.cos() * v.cos()];
        let (ci, cr) = (dot(n, wi).max(0.0), dot(n, wr).max(0.0));
        if ci + cr > 0.0 {
            0.25 * FRAC_1_PI * ci * cr / (ci + cr)
        } else {
            0.0
        }
    };
    let mut integral = 0.0;
    if yarn.psi == 0.0 {
        let u = (h[1] / h[2]).atan();
        if u.abs() >= yarn.u_max {
            return 0.0;
        }
        let kept = (1.0 - yarn.delta) * yarn.u_max;
        let smooth = if yarn.delta > 0.0 {
            let x = ((u.abs() - kept) / (yarn.delta * yarn.u_max)).clamp(0.0, 1.0);
            1.0 - x * x * (3.0 - 2.0 * x)
        } else {
            1.0
        };
        let r = radius_of_curvature(yarn, u.abs().min(kept));
        let across = (u.cos() * h[2] + u.sin() * h[1]).abs();
        for k in 0..COUNT {
            let v = PI * ((k as f64 + 0.5) / COUNT as f64 - 0.5);
            integral += a * (r + a * v.cos()) / (length * across) * attenuation(u, v) * smooth;
        }
        integral *= PI / COUNT as f64;
    } else {
        for k in 0..COUNT {
            let u = yarn.u_max * (2.0 * (k as f64 + 0.5) / COUNT as f64 - 1.0);
            let q = h[1] * u.sin() + h[2] * u.cos();
            let d =
                (h[1] * u.cos() - h[2] * u.sin()) / ((h[0] * h[0] + q * q).sqrt() * yarn.psi.tan());
            if d.abs() >= 1.0 {
                continue;
            }
            let mut v = (-q).atan2(h[0]) + d.acos();
            if v > PI {
                v -= TAU;
            }
            if v.abs() >= FRAC_PI_2 {
                continue;
            }
            let n = [v.sin(), u.sin() * v.cos(), u.cos() * v.cos()];
            let r = radius_of_curvature(yarn, u.abs());
            integral += a * (r + a * v.cos()) / (length * dot(n, h) * yarn.psi.sin().abs())
                * attenuation(u, v);
        }
        integral *= 2.0 * yarn.u_max / COUNT as f64;
    }
    yarn.coverage * phase * integral / (yarn.width * yarn.length)
}

#[test]
fn the_integrals_are_those_of_many_midpoints() {
    // Midpoints themselves err where a staple yarn's domain ends.
    const STAPLE: f64 = 5e-3;
    const STAPLE_MEAN: f64 = 1e-3;
    const FILAMENT: f64 = 1e-4;
    let pairs = pairs(200);
    for yarn in yarns() {
        let parameters = Irawan {
            diffuse: [0.0; 3],
            yarns: vec![yarn],
        };
        let model = IrawanMarschner::<f64>::with_normalization(&parameters, 1.0).unwrap();
        let values: Vec<[f64; 2]> = pairs
            .iter()
            .map(|pair| {
                let value = model.eval(pair.wi, pair.wr)[0];
                [value, slow(&yarn, pair.wi, pair.wr)]
            })
            .collect();
        let tolerance = if yarn.psi == 0.0 { FILAMENT } else { STAPLE };
        let mean = values.iter().map(|[_, truth]| truth).sum::<f64>() / values.len() as f64;
        assert!(mean > 0.0, "{yarn:?}");
        let errors = values.iter().map(|[value, truth]| (value - truth).abs());
        let error = errors.sum::<f64>() / values.len() as f64;
        assert!(error < STAPLE_MEAN * mean, "{yarn:?}: {error} of {mean}");
        for ([value, truth], pair) in values.iter().zip(&pairs) {
            assert!(
                (value - truth).abs() < tolerance * (truth + mean),
                "{yarn:?} {pair:?}: {value} {truth}"
            );
        }
    }
}

#[test]
fn the_specular_part_reflects_all_of_uniform_light() {
    for (name, parameters) in presets() {
        let model = IrawanMarschner::<f64>::new(&parameters).unwrap();
        assert!(model.normalization() > 0.0);
        // π times the mean over cosine-weighted pairs, of which every other protocol pair is one.
        let render: Vec<f64> = pairs(60_000)
            .iter()
            .step_by(2)
            .map(|pair| model.eval(pair.wi, pair.wr)[0])
            .collect();
        let albedo = PI * render.iter().sum::<f64>() / render.len() as f64;
        assert!((albedo - 1.0).abs() < 0.03, "{name}: {albedo}");
    }
}

#[test]
fn a_yarn_without_a_spine_is_an_error() {
    let twill = IRAWAN_PRESETS
        .iter()
        .find(|preset| preset.name == "cotton-twill");
    let error = IrawanMarschner::<f64>::new(&twill.unwrap().parameters()).unwrap_err();
    assert!(matches!(error, SpineError::TooShort { .. }), "{error}");
    assert!(error.to_string().contains("width · sin u_max"), "{error}");
    let mut cornered = irawan_of(&fabric("denim"));
    cornered.yarns[0].kappa = -1.0;
    let error = IrawanMarschner::<f64>::new(&cornered).unwrap_err();
    assert_eq!(error, SpineError::Corner(-1.0));
}

#[test]
fn strong_forward_scattering_does_not_overflow() {
    let mut parameters = irawan_of(&fabric("silk-shot"));
    parameters.yarns.truncate(1);
    for yarn in &mut parameters.yarns {
        yarn.beta = *Yarn::BETA.end();
    }
    let model = IrawanMarschner::<f32>::new(&parameters).unwrap();
    // The half vector is the normal for both; the second are opposite to within half of the lobe's width.
    let [low, lowest] = [0.1f32, 1e-3].map(|z| {
        let x = (1.0 - z * z).sqrt();
        model.eval([x, 0.0, z], [-x, 0.0, z])[0]
    });
    assert!(lowest.is_finite() && lowest > 100.0 * low, "{low} {lowest}");
}

#[test]
fn every_fabric_of_the_library_has_a_translation() {
    for entry in LIBRARY {
        let fabric = entry.load();
        let parameters = irawan_of(&fabric);
        IrawanMarschner::<f64>::new(&parameters).unwrap();
        // And one that files can have.
        let mut fabric = fabric;
        fabric.models.irawan = Some(parameters);
        let read = Fabric::from_toml(&fabric.to_toml(), "it.toml", None).unwrap();
        assert_eq!(
            read.models.irawan.unwrap().yarns.len(),
            fabric.visible_threads().count()
        );
    }
    let [denim, silk] = ["denim", "silk-shot"].map(|name| irawan_of(&fabric(name)));
    let degrees = |x: f64| x.to_degrees().round();
    assert_eq!(
        denim
            .yarns
            .iter()
            .map(|y| (degrees(y.psi), degrees(y.u_max), y.beta, y.delta))
            .collect::<Vec<_>>(),
        [(35.0, 20.0, 4.0, 0.0); 2]
    );
    assert!((denim.yarns[0].length - 7.0 / 3.0).abs() < 1e-12 && denim.yarns[1].length == 1.0);
    assert_eq!(
        (silk.yarns[0].psi, silk.yarns[0].delta, silk.yarns[0].beta),
        (0.0, 0.1, 8.0)
    );
    assert_eq!(
        silk.yarns[0].specular.map(|x| (1e6 * x).round()),
        [18e3, 180e3, 72e3]
    );
    // Two tilts and little between are a roof; a straight part in the middle is a table.
    let crepe = irawan_of(&fabric("silk-crepe-de-chine"));
    assert!(crepe.yarns[0].kappa < -0.5, "{:?}", crepe.yarns[0]);
}

const SECTIONS: &str = r#"name = "mine"
[[thread]]
name = "warp"
direction_deg = 0
coverage = 0.5
albedo = { color = [0.1, 0.2, 0.3] }
eta = 1.4
k_d = 0.1
gamma_s_deg = 10
gamma_v_deg = 20
tangent_offsets_deg = [-20, 20]
tangent_lengths = [1]
[lambert]
albedo = { color = [0.5, 0.25, 1], scale = 0.5 }
[oren_nayar]
albedo = { color = [0.5, 0.25, 1] }
sigma_deg = 30
[torrance_sparrow]
diffuse = { color = [0.5, 0.25, 1] }
specular = { color = [0.5, 0.25, 0] }
alpha_x = 0.25
alpha_y = 0.5
eta = 1.5
shadowing = "v-cavity"
[irawan]
diffuse = { color = [0.5, 0.25, 1] }
[[irawan.yarn]]
direction_deg = 0
coverage = 0.5
specular = { color = [1, 1, 1] }
alpha = 0.01
beta = 4
delta = 0
psi_deg = 35
u_max_deg = 20
kappa = -0.5
width = 1
length = 2
"#;

#[test]
fn sections_are_read_and_written_back() {
    let fabric = Fabric::from_toml(SECTIONS, "mine.toml", None).unwrap();
    let models = &fabric.models;
    assert_eq!(models.lambert.unwrap().albedo, [0.25, 0.125, 0.5]);
    assert!((models.oren_nayar.unwrap().sigma.to_degrees() - 30.0).abs() < 1e-12);
    let facets = models.torrance_sparrow.unwrap();
    assert_eq!(
        (facets.shadowing, facets.distribution, facets.fresnel),
        (
            Shadowing::VCavity,
            Distribution::Ggx,
            FresnelTerm::Dielectric
        )
    );
    let again = Fabric::from_toml(&fabric.to_toml(), "mine.toml", None)
        .unwrap()
        .models;
    assert_eq!(again.lambert, models.lambert);
    assert_eq!(again.torrance_sparrow, models.torrance_sparrow);
    let [a, b] = [&again, models].map(|models| models.irawan.clone().unwrap().yarns[0]);
    assert!(
        (a.u_max - b.u_max).abs() < 1e-12 && (a.psi - b.psi).abs() < 1e-12 && a.kappa == b.kappa
    );
    let plain = crate::common::fabric("denim");
    assert_eq!(plain.models, Default::default());
}

#[test]
fn values_out_of_range_are_named_with_their_line() {
    for (right, wrong, message) in [
        (
            "sigma_deg = 30",
            "sigma_deg = 91",
            "mine.toml:17: sigma_deg = 91.0 must lie between 0.0 and 90.0",
        ),
        (
            "alpha_y = 0.5",
            "alpha_y = 0",
            "mine.toml:22: alpha_y = 0.0 must lie between 0.001 and 10.0",
        ),
        (
            "psi_deg = 35",
            "psi_deg = 0.5",
            "mine.toml:34: psi_deg = 0.5 must be 0",
        ),
        (
            "kappa = -0.5",
            "kappa = -1",
            "mine.toml:36: kappa = -1.0 must lie",
        ),
        (
            "length = 2",
            "length = 0.3",
            "mine.toml:38: length = 0.3 must exceed width · sin u_max = 0.342",
        ),
        (
            "shadowing = \"v-cavity\"",
            "shadowing = \"none\"",
            "mine.toml:24: shadowing: unknown variant `none`",
        ),
        (
            "sigma_deg = 30",
            "sigma = 30",
            "mine.toml:17: unknown field `sigma`",
        ),
    ] {
        let text = SECTIONS.replace(right, wrong);
        let error = Fabric::from_toml(&text, "mine.toml", None)
            .unwrap_err()
            .to_string();
        assert!(error.starts_with(message), "{error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn any_yarn_gives_finite_light(
        psi_deg in prop_oneof![Just(0.0), 1.0..89f64, -89.0..-1f64], u_max_deg in 1.0..89f64, kappa in -0.999..20f64,
        delta in 0.0..0.9f64, beta in 0.0..1000f64, spare in 1e-3..10f64, seed in any::<u64>(),
    ) {
        let u_max = u_max_deg.to_radians();
        let yarn = Yarn {
            direction: 0.0, coverage: 1.0, specular: [1.0; 3], alpha: 0.01, beta, delta,
            psi: psi_deg.to_radians(), u_max, kappa, width: 1.0, length: u_max.sin() + spare,
        };
        let parameters = Irawan { diffuse: [0.0; 3], yarns: vec![yarn] };
        let model = IrawanMarschner::<f32>::with_normalization(&parameters, 1.0).unwrap();
        for pair in protocol_pairs(&fabric("denim"), 50, seed) {
            let [r, ..] = model.eval(pair.wi.map(|x| x as f32), pair.wr.map(|x| x as f32));
            prop_assert!(r.is_finite() && r >= 0.0);
        }
    }
}
