//! A law of material from outside the crate: one file, one line in the roster, run from JSON.

use crate::common::{assembled, try_load};
use crate::fung::FungLaw;
use serde_json::{Value, json};
use tropism::prelude::*;
use tropism::scenario::catalogue::Catalogue;
use tropism::scenario::schema::full_schema;
use tropism::study::run::block_schemas;

fn roster() -> Roster {
    tropism::standard().with_material::<FungLaw>()
}

fn stretched(material: Value) -> Value {
    json!({
        "tissue": { "outline": { "rectangle": { "width": 300, "height": 200 } }, "mesh_size": 40 },
        "time": { "duration": 2, "step": "6 min" },
        "populations": { "axons": { "count": 2, "births": { "at": 0 } } },
        "matrix": { "material": material, "motion": { "top": { "outward": 0.4 }, "bottom": {} } }
    })
}

/// Where the vertices of a stretched tissue are in the end.
fn places(material: Value) -> Vec<[f64; 2]> {
    let mut simulation = assembled(&stretched(material), &roster());
    simulation.look_at(2.0);
    simulation.world().resource::<Configuration>().coordinates().to_vec()
}

#[test]
fn a_law_from_outside_meets_the_same_test_as_those_of_the_program() {
    for name in roster().materials().names() {
        let lame = Lame::from_young_poisson(1.0, 0.3).unwrap();
        let law = roster().materials().material(&MaterialChoice::of(name), lame).unwrap();
        assert!(law_defects(&law, lame).worst() < 1e-7, "{name}: {:?}", law_defects(&law, lame));
    }
    assert_eq!(roster().materials().names().last(), Some(&"fung"));
}

#[test]
fn a_law_from_outside_runs_from_json_with_its_keys() {
    let [neo, mild, stiff] =
        [json!("neo_hookean"), json!({ "fung": { "stiffening": 1e-6 } }), json!({ "fung": { "stiffening": 20 } })]
            .map(places);
    let apart = |a: &[[f64; 2]], b: &[[f64; 2]]| {
        a.iter().zip(b).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).fold(0.0, f64::max)
    };
    assert_eq!(places(json!("fung")), places(json!({ "fung": { "stiffening": 1 } })), "the word is the default");
    assert!(apart(&mild, &neo) > 1e-3 && apart(&mild, &neo) < 8.0, "{}", apart(&mild, &neo));
    assert!(apart(&stiff, &mild) > 1.0, "{}", apart(&stiff, &mild));
}

#[test]
fn what_is_wrong_with_a_law_is_told_with_the_laws_there_are() {
    let problems = |material: Value| -> Vec<String> {
        let errors = try_load(&stretched(material), &roster(), &[], &[]).unwrap_err();
        errors.problems.iter().map(ToString::to_string).collect()
    };
    let allowed = r#"(allowed: "st_venant_kirchhoff", "neo_hookean", "ogden", "fung", {"ogden": …}, {"fung": …})"#;
    assert_eq!(
        problems(json!("fugn")),
        [format!(r#"/matrix/material: "fugn" is not allowed here; did you mean "fung"? {allowed}"#)]
    );
    assert_eq!(
        problems(json!({ "odgen": {} })),
        [format!(r#"/matrix/material: {{"odgen":{{}}}} is not allowed here; did you mean "ogden"? {allowed}"#)]
    );
    let seen = problems(json!({ "fung": { "stiffening": -1 } }));
    assert_eq!(seen.len(), 1);
    assert!(seen[0].starts_with("/matrix/material/fung/stiffening: -1 is outside what is possible"), "{seen:?}");
    let seen = problems(json!({ "fung": { "stifening": 2 } }));
    assert_eq!(
        seen,
        ["/matrix/material/fung/stifening: unknown key; did you mean `stiffening`? (keys here: stiffening)"]
    );
    assert_eq!(
        problems(json!({ "ogden": { "exponent": 0 } })),
        ["/matrix/material/ogden/exponent: an exponent of zero has no energy; 2 is neo-Hookean"]
    );
}

#[test]
fn the_schema_and_the_list_of_keys_name_the_law_from_outside() {
    let blocks = block_schemas(&roster());
    let schema = full_schema(&blocks);
    assert!(!schema.to_string().contains("x-materials"));
    assert!(schema["$defs"]["matrix.MaterialChoice"]["oneOf"].to_string().contains(r#""const":"fung""#));
    let list = Catalogue::of(&blocks).only("matrix").unwrap();
    let keys = &list.mechanisms[0].keys;
    let exponent = keys.iter().find(|key| key.key == "material.fung.stiffening").unwrap();
    assert_eq!(exponent.description, "How fast it stiffens, b.");
    let material = keys.iter().find(|key| key.key == "material").unwrap();
    let words: Vec<&str> = material.words.iter().map(|word| word.word.as_str()).collect();
    assert_eq!(words, ["st_venant_kirchhoff", "neo_hookean", "ogden", "fung"]);
    assert!(material.words[3].description.starts_with("Tissue that stiffens exponentially"));
}

#[test]
fn the_code_of_the_chapter_on_laws_is_the_code_that_runs() {
    let (chapter, law) = (include_str!("../../docs/src/materials.md"), include_str!("fung.rs"));
    let blocks: Vec<&str> = chapter.split("```rust\n").skip(1).map(|rest| rest.split("```").next().unwrap()).collect();
    assert_eq!(blocks.len(), 2);
    assert!(blocks.iter().all(|block| law.contains(block)));
}
