//! Fabric files: the library is as published, and what is wrong with a file is said with its line.

use sateen::fabric::{Fabric, LIBRARY, nearest_name};

const GOOD: &str = r#"name = "mine"
[[thread]]
name = "warp"
direction_deg = 0
coverage = 0.5
albedo = { color = [0.1, 0.2, 0.3] }
eta = 1.4
k_d = 0.1
gamma_s_deg = 10
gamma_v_deg = 20
tangent_offsets_deg = [-20, 20, 30]
tangent_lengths = [1, 0]
"#;

fn error(text: &str) -> String {
    Fabric::from_toml(text, "mine.toml", None)
        .expect_err("it is wrong")
        .to_string()
}

#[test]
fn the_library_has_the_published_fabrics_knits_and_felt() {
    assert_eq!(LIBRARY.len(), 22);
    for entry in LIBRARY {
        let fabric = entry.load();
        assert_eq!(fabric.name, entry.name);
        assert!(!fabric.source.is_empty() && !fabric.title.is_empty());
        assert!(fabric.visible_threads().count() > 0);
    }
    let pink = crate::common::fabric("polka-dot-lining-pink");
    assert_eq!(pink.threads[0].albedo, [0.35, 0.0, 0.0875]);
    let suede = crate::common::fabric("faux-suede");
    assert_eq!(
        (suede.threads.len(), suede.visible_threads().count()),
        (2, 1)
    );
}

#[test]
fn a_file_of_ones_own_is_read() {
    let fabric = Fabric::from_toml(GOOD, "mine.toml", None).unwrap();
    assert_eq!(fabric.threads[0].albedo, [0.1, 0.2, 0.3]);
    assert!((fabric.sigma_u.to_degrees() - 20.0).abs() < 1e-12);
    assert!((fabric.gap() - 0.5).abs() < 1e-12);
}

#[test]
fn values_out_of_range_are_named_with_their_line() {
    let cases = [
        (
            "eta = 1.4",
            "eta = 0.9",
            "mine.toml:7: eta = 0.9 must be at least 1 and at most 100",
        ),
        (
            "eta = 1.4",
            "eta = nan",
            "mine.toml:7: eta = NaN must be at least 1",
        ),
        (
            "gamma_s_deg = 10",
            "gamma_s_deg = 0",
            "mine.toml:9: gamma_s_deg = 0.0 must be above 0",
        ),
        (
            "k_d = 0.1",
            "k_d = 1.5",
            "mine.toml:8: k_d = 1.5 must lie between 0 and 1",
        ),
        (
            "coverage = 0.5",
            "coverage = -1",
            "mine.toml:5: coverage = -1.0 must lie between 0 and 1",
        ),
        (
            "[-20, 20, 30]",
            "[-20, 95, 30]",
            "mine.toml:11: tangent_offsets_deg = 95.0 must lie between -90 and 90 degrees",
        ),
        (
            "[1, 0]",
            "[1, -2]",
            "mine.toml:12: tangent_lengths = -2.0 must not be negative",
        ),
        (
            "[1, 0]",
            "[0, 0]",
            "mine.toml:12: tangent_lengths: their sum 0 must be finite and above 0",
        ),
        (
            "[1, 0]",
            "[1]",
            "mine.toml:12: tangent_lengths: 3 offsets need 2 lengths (1 to 2048), there are 1",
        ),
        (
            "0.1, 0.2",
            "-0.1, 0.2",
            "mine.toml:6: albedo: color × scale = [-0.1, 0.2, 0.3] must lie between 0 and 1000",
        ),
        (
            "\"warp\"",
            "\"Warp \"",
            "mine.toml:3: name: \"Warp \" must be 1 to 64 of the characters a-z 0-9 - _",
        ),
        (
            "eta = 1.4",
            "etta = 1.4",
            "mine.toml:7: unknown field `etta`",
        ),
        ("eta = 1.4\n", "", "mine.toml:2: missing field `eta`"),
        (
            "eta = 1.4",
            "eta = \"1.4\"",
            "mine.toml:7: eta: invalid type: string \"1.4\", expected f64",
        ),
        ("eta = 1.4", "eta = = 1.4", "mine.toml:7: "),
    ];
    for (good, bad, message) in cases {
        let error = error(&GOOD.replace(good, bad));
        assert!(error.starts_with(message), "{bad}: {error}");
    }
}

#[test]
fn threads_must_fit_together() {
    let thread = &GOOD[GOOD.find("[[thread]]").unwrap()..];
    let twice = format!("{GOOD}{thread}");
    assert!(error(&twice).contains("two threads are called \"warp\""));
    let crowded = format!(
        "{GOOD}{}",
        thread
            .replace("warp", "weft")
            .replace("coverage = 0.5", "coverage = 0.6")
    );
    assert!(
        error(&crowded).starts_with("mine.toml:16: coverage: the threads' coverages sum to 1.1")
    );
    assert!(error("name = \"none\"\nthread = []").contains("a fabric has 1 to 64 threads"));
}

#[test]
fn named_albedos_are_chosen_by_variant() {
    let named = GOOD.replace(
        "albedo = { color = [0.1, 0.2, 0.3] }",
        "albedos.red = { color = [1, 0, 0] }\nalbedos.blue = { color = [0, 0, 1], scale = 0.5 }",
    );
    let read = |variant| Fabric::from_toml(&named, "mine.toml", variant);
    assert_eq!(read(Some("red")).unwrap().name, "mine-red");
    assert_eq!(read(None).unwrap().threads[0].albedo, [0.0, 0.0, 0.5]);
    assert!(
        read(Some("green"))
            .unwrap_err()
            .to_string()
            .contains("none is \"green\"; there are [\"blue\", \"red\"]")
    );
    assert!(Fabric::from_toml(GOOD, "mine.toml", Some("red")).is_err());
    // It becomes part of the name, and so of a file's.
    let climbing = named.replace("albedos.red", "albedos.\"../red\"");
    assert!(error(&climbing).contains("albedos: \"../red\" must be"));
}

#[test]
fn misspelt_names_are_recognised() {
    assert_eq!(nearest_name("dennim"), Some("denim"));
    assert_eq!(nearest_name("Velvet"), Some("velvet"));
    assert_eq!(
        nearest_name("polka-dot-lining"),
        Some("polka-dot-lining-pink")
    );
    assert_eq!(nearest_name("qqqq"), None);
}

#[test]
fn as_many_segments_as_a_thread_may_have_are_parts_that_a_table_holds() {
    let most = 2048;
    let offsets = |count: usize| -> Vec<f64> {
        let side = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        (0..=count)
            .map(|k| side(k) * (10.0 + 0.01 * k as f64))
            .collect()
    };
    let text = |count: usize| {
        let lengths = vec![1; count];
        GOOD.replace("[-20, 20, 30]", &format!("{:?}", offsets(count)))
            .replace("[1, 0]", &format!("{lengths:?}"))
    };
    let fabric = Fabric::from_toml(&text(most), "mine.toml", None).unwrap();
    // Every segment lies across all others: their ends make twice as many parts.
    let parts = fabric.threads[0].tangents::<f64>().segments().len();
    assert!((most..=4096).contains(&parts), "{parts}");
    assert!(error(&text(most + 1)).contains("(1 to 2048)"));
}

#[test]
fn text_longer_than_any_fabric_is_refused_before_it_is_read() {
    let text = format!("{GOOD}# {}", "x".repeat(sateen::fabric::MAX_TOML_BYTES));
    assert!(error(&text).contains("more than any fabric has"));
}
